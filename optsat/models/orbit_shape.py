"""Orbit shape: what a position and a velocity say about the orbit before anything is integrated."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import finite_array
from optsat.errors import InputError
from optsat.models.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER


@dataclass(frozen=True)
class OrbitShape:
    """flight_path_angle above the local horizontal and inclination [rad], eccentricity [-], perigee_radius [m]."""

    flight_path_angle: float
    eccentricity: float
    inclination: float
    perigee_radius: float


def orbit_shape(r_N: ArrayLike, v_N: ArrayLike, gravitational_parameter: float = GRAVITATIONAL_PARAMETER) -> OrbitShape:
    """Return the shape of the two-body orbit through r_N (3,) [m] with velocity v_N (3,) [m/s].

    Raises
    ------
    InputError : not finite, or r_N or v_N is zero.
    """
    r, v = finite_array("r_N", r_N, (3,), "m"), finite_array("v_N", v_N, (3,), "m/s")
    distance, speed = float(np.linalg.norm(r)), float(np.linalg.norm(v))
    for name, length in (("r_N", distance), ("v_N", speed)):
        if length == 0.0:
            raise InputError(f"`{name}` is the zero vector, so that there is no orbit.")
    momentum = np.cross(r, v)
    eccentricity_vector = np.cross(v, momentum) / gravitational_parameter - r / distance
    e = float(np.linalg.norm(eccentricity_vector))
    size = float(np.linalg.norm(momentum))
    return OrbitShape(
        flight_path_angle=math.asin(max(-1.0, min(1.0, float(r @ v) / (distance * speed)))),
        eccentricity=e,
        inclination=math.acos(momentum[2] / size) if size else 0.0,
        perigee_radius=size**2 / (gravitational_parameter * (1 + e)),
    )


def check_orbit(r_N: ArrayLike, v_N: ArrayLike, gravitational_parameter: float = GRAVITATIONAL_PARAMETER) -> OrbitShape:
    """Return the shape of an orbit that stays above the ground.

    Raises
    ------
    InputError : as for `orbit_shape`, or the orbit leads into the Earth; a lost sign in v_N is the usual cause.
    """
    shape = orbit_shape(r_N, v_N, gravitational_parameter)
    if shape.perigee_radius <= EQUATORIAL_RADIUS:
        depth_km = (EQUATORIAL_RADIUS - shape.perigee_radius) / 1e3
        raise InputError(
            f"`v_N` leads into the Earth: flight-path angle {math.degrees(shape.flight_path_angle):.2f} deg, "
            f"eccentricity {shape.eccentricity:.3g}, perigee {depth_km:.0f} km below the ground. Check the signs and "
            "units of `r_N` [m] and `v_N` [m/s]."
        )
    return shape
