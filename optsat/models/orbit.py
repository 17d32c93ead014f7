"""Orbit: two-body motion in closed form, and its acceleration."""

import math
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude import frames
from optsat.attitude.backend import Value, norm
from optsat.models.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

_NEWTON_STEPS = 8


@dataclass(frozen=True)
class KeplerOrbit:
    """Elliptic two-body orbit by its elements at t = 0.

    semi_major_axis [m]; eccentricity in [0, 0.97]; inclination, raan, argument_of_perigee, mean_anomaly [rad];
    gravitational_parameter [m^3/s^2]

    Raises
    ------
    InputError : an element is not finite or outside its range.
    """

    semi_major_axis: float
    eccentricity: float
    inclination: float
    raan: float = 0.0
    argument_of_perigee: float = 0.0
    mean_anomaly: float = 0.0
    gravitational_parameter: float = GRAVITATIONAL_PARAMETER

    def __post_init__(self) -> None:
        check_scalar("semi_major_axis", self.semi_major_axis, "m", low=0.0, low_open=True)
        check_scalar("eccentricity", self.eccentricity, "-", low=0.0, high=0.97)
        check_scalar("inclination", self.inclination, "rad", low=0.0, high=math.pi)
        for name in ("raan", "argument_of_perigee", "mean_anomaly"):
            check_scalar(name, getattr(self, name), "rad")
        check_scalar("gravitational_parameter", self.gravitational_parameter, "m^3/s^2", low=0.0, low_open=True)

    @property
    def mean_motion(self) -> float:
        """Mean motion n [rad/s]."""
        return math.sqrt(self.gravitational_parameter / self.semi_major_axis) / self.semi_major_axis

    @property
    def period(self) -> float:
        """Period [s]."""
        return 2 * math.pi / self.mean_motion

    def motion(self) -> GeneratedFunction:
        """Return position and velocity (r_N [m], v_N [m/s]) as a function of t [s], by fixed Newton steps."""
        import casadi as ca

        t = ca.SX.sym("t")
        e = self.eccentricity
        E = _eccentric_anomaly(self.mean_anomaly + self.mean_motion * t, e)
        minor = math.sqrt(1 - e * e)
        speed = self.mean_motion * self.semi_major_axis / (1 - e * ca.cos(E))
        in_plane = self.semi_major_axis * ca.vertcat(ca.cos(E) - e, minor * ca.sin(E))
        velocity = speed * ca.vertcat(-ca.sin(E), minor * ca.cos(E))
        return _motion("kepler_orbit", t, self._plane() @ in_plane, self._plane() @ velocity)

    def _plane(self) -> Array:
        return plane_axes(self.inclination, self.raan, self.argument_of_perigee)


@dataclass(frozen=True)
class CircularOrbit:
    """Circular orbit about a spherical Earth.

    altitude above the equatorial radius [m]; inclination, raan, argument_of_latitude at t = 0 [rad]

    Raises
    ------
    InputError : a parameter is not finite or outside its range.
    """

    altitude: float
    inclination: float
    raan: float = 0.0
    argument_of_latitude: float = 0.0

    def __post_init__(self) -> None:
        check_scalar("altitude", self.altitude, "m", low=0.0)
        check_scalar("inclination", self.inclination, "rad", low=0.0, high=math.pi)
        for name in ("raan", "argument_of_latitude"):
            check_scalar(name, getattr(self, name), "rad")

    @property
    def radius(self) -> float:
        """Distance from the Earth's centre [m]."""
        return EQUATORIAL_RADIUS + self.altitude

    @property
    def mean_motion(self) -> float:
        """Orbital rate n [rad/s]."""
        return math.sqrt(GRAVITATIONAL_PARAMETER / self.radius) / self.radius

    @property
    def period(self) -> float:
        """Period [s]."""
        return 2 * math.pi / self.mean_motion

    def motion(self) -> GeneratedFunction:
        """Return position and velocity (r_N [m], v_N [m/s]) as a function of t [s]."""
        import casadi as ca

        t = ca.SX.sym("t")
        u = self.argument_of_latitude + self.mean_motion * t
        plane = plane_axes(self.inclination, self.raan, 0.0)
        r_N = self.radius * (plane @ ca.vertcat(ca.cos(u), ca.sin(u)))
        v_N = self.radius * self.mean_motion * (plane @ ca.vertcat(-ca.sin(u), ca.cos(u)))
        return _motion("circular_orbit", t, r_N, v_N)


def two_body_derivative(gravitational_parameter: float = GRAVITATIONAL_PARAMETER) -> GeneratedFunction:
    """Return the rates (r_dot_N, v_dot_N) of two-body motion: v_dot = -mu r / |r|^3."""
    import casadi as ca

    check_scalar("gravitational_parameter", gravitational_parameter, "m^3/s^2", low=0.0, low_open=True)
    r_N, v_N = ca.SX.sym("r_N", 3), ca.SX.sym("v_N", 3)
    return generate(
        "two_body",
        inputs=[(Port("r_N", (3,), "m"), r_N), (Port("v_N", (3,), "m/s"), v_N)],
        outputs=[
            (Port("r_dot_N", (3,), "m/s"), v_N),
            (Port("v_dot_N", (3,), "m/s^2"), -gravitational_parameter * r_N / norm(r_N) ** 3),
        ],
    )


def plane_axes(inclination: float, raan: float, argument: float) -> Array:
    """Return two axes of the orbit plane in N as columns (3, 2): `argument` past the node, and a quarter turn on."""
    dcm_PN = frames.rotation_z(argument) @ frames.rotation_x(inclination) @ frames.rotation_z(raan)
    return np.asarray(dcm_PN[:2].T)


def _eccentric_anomaly(M: Value, e: float) -> Value:
    import casadi as ca

    M = M - 2 * math.pi * ca.floor((M + math.pi) / (2 * math.pi))
    # starts beyond the root, on the side where Newton's steps do not overshoot; eight reach rounding up to e = 0.97
    E = M + ca.if_else(M < 0, -e, e)
    for _ in range(_NEWTON_STEPS):
        E = E - (E - e * ca.sin(E) - M) / (1 - e * ca.cos(E))
    return E


def _motion(name: str, t: Value, r_N: Value, v_N: Value) -> GeneratedFunction:
    return generate(
        name,
        inputs=[(Port("t", (), "s"), t)],
        outputs=[(Port("r_N", (3,), "m"), r_N), (Port("v_N", (3,), "m/s"), v_N)],
    )
