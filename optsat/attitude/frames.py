"""Frames: elementary rotations, and the orbital frame O (LVLH): z to nadir, y along the negative orbit normal."""

import numpy as np

from optsat.attitude.backend import (
    Value,
    components,
    cos,
    cross,
    dot,
    is_symbolic,
    matrix,
    norm,
    reciprocal,
    scale,
    sin,
    stack,
)
from optsat.attitude.edges import ANGLE, POSITION, VELOCITY, checked
from optsat.errors import InputError

_PARALLEL = 1e-12


@checked(angle=ANGLE)
def rotation_x(angle: Value) -> Value:
    """Return R1 (..., 3, 3): components in axes turned by `angle` [rad] about x."""
    c, s = cos(angle), sin(angle)
    one, zero = 1 + 0 * c, 0 * c
    return matrix(((one, zero, zero), (zero, c, s), (zero, -s, c)))


@checked(angle=ANGLE)
def rotation_y(angle: Value) -> Value:
    """Return R2 (..., 3, 3): components in axes turned by `angle` [rad] about y."""
    c, s = cos(angle), sin(angle)
    one, zero = 1 + 0 * c, 0 * c
    return matrix(((c, zero, -s), (zero, one, zero), (s, zero, c)))


@checked(angle=ANGLE)
def rotation_z(angle: Value) -> Value:
    """Return R3 (..., 3, 3): components in axes turned by `angle` [rad] about z."""
    c, s = cos(angle), sin(angle)
    one, zero = 1 + 0 * c, 0 * c
    return matrix(((c, s, zero), (-s, c, zero), (zero, zero, one)))


@checked(r_N=POSITION, v_N=VELOCITY)
def orbital_dcm(r_N: Value, v_N: Value) -> Value:
    """Return dcm_ON (..., 3, 3) from position [m] and velocity [m/s].

    Raises
    ------
    InputError : position and velocity are parallel, so there is no orbit plane.
    """
    normal = _orbit_normal(r_N, v_N)
    z = scale(-reciprocal(norm(r_N)), r_N)
    y = scale(-reciprocal(norm(normal)), normal)
    return matrix((components(cross(y, z)), components(y), components(z)))


@checked(r_N=POSITION, v_N=VELOCITY)
def orbital_rate(r_N: Value, v_N: Value) -> Value:
    """Return omega_ON_O = (0, -|r x v| / r^2, 0) (..., 3) [rad/s], exact for two-body motion."""
    rate = norm(_orbit_normal(r_N, v_N)) / dot(r_N, r_N)
    return stack((0 * rate, -rate, 0 * rate))


def _orbit_normal(r_N: Value, v_N: Value) -> Value:
    normal = cross(r_N, v_N)
    if not is_symbolic(normal):
        flat = norm(normal) <= _PARALLEL * norm(r_N) * norm(v_N)
        if np.any(flat):
            row = f" in row {int(np.argmax(flat))}" if np.ndim(flat) else ""
            raise InputError(f"`r_N` and `v_N` are parallel{row}: an orbit plane needs a velocity across the position.")
    return normal
