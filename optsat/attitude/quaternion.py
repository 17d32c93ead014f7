"""Quaternion algebra: q_BN = [x, y, z, w], scalar last, b_B = A(q_BN) r_N, A(p (x) q) = A(p) A(q).

Every function takes NumPy arrays (..., 4) or CasADi columns. Group operations keep the sign that the algebra gives, so
they are smooth; `canonical` applies the rule of results (w >= 0), as do all conversions into a quaternion.
"""

from typing import TYPE_CHECKING

import numpy as np

from optsat.arrays import Array
from optsat.attitude.backend import (
    Value,
    absolute,
    atan2,
    components,
    cos,
    cross,
    dot,
    is_symbolic,
    join,
    norm,
    scale,
    sin,
    sqrt,
    stack,
    where,
)
from optsat.attitude.edges import ANGLES, QUATERNION, RATE, TIME, VECTOR, checked, unchecked
from optsat.errors import InputError

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_SMALL_SQUARED_ANGLE = 1e-2


def identity() -> Array:
    """Return the quaternion of no rotation (4,)."""
    return np.array([0.0, 0.0, 0.0, 1.0])


@checked(p=QUATERNION, q=QUATERNION)
def compose(p: Value, q: Value) -> Value:
    """Return p (x) q = [s_p v_q + s_q v_p - v_p x v_q; s_p s_q - v_p . v_q], so q_CN = compose(q_CB, q_BN)."""
    return _product(p, q)


@checked(q_BN=QUATERNION)
def inverse(q_BN: Value) -> Value:
    """Return q_NB = [-v; s]."""
    x, y, z, w = components(q_BN)
    return stack((-x, -y, -z, w))


@checked(q_BN=QUATERNION, r_N=VECTOR)
def transform(q_BN: Value, r_N: Value) -> Value:
    """Return b_B = A(q_BN) r_N (..., 3): the same vector in B components."""
    x, y, z, w = components(q_BN)
    v = stack((x, y, z))
    twice = 2 * cross(v, r_N)
    return r_N - scale(w, twice) + cross(v, twice)


@checked(q_BN=QUATERNION)
def canonical(q_BN: Value) -> Value:
    """Return the one of q and -q with w >= 0 and, if w = 0, the first non-zero of the vector part positive."""
    x, y, z, w = components(q_BN)
    leading = where(w != 0, w, where(x != 0, x, where(y != 0, y, z)))
    signed = scale(where(leading < 0, -1.0, 1.0), q_BN)
    return signed + 0.0  # no negative zeros in results


@checked(q_BN=QUATERNION, q_ref_BN=QUATERNION)
def error_angle(q_BN: Value, q_ref_BN: Value) -> Value:
    """Return the angle [rad] in [0, pi] between two attitudes, 2 atan2(|e_v|, |e_s|): accurate for tiny errors."""
    x, y, z, w = components(_product(q_BN, inverse(q_ref_BN)))
    return 2 * atan2(norm(stack((x, y, z))), absolute(w))


@checked(q_BN=QUATERNION, omega_BN_B=RATE)
def derivative(q_BN: Value, omega_BN_B: Value) -> Value:
    """Return q_dot = 1/2 [omega; 0] (x) q [1/s]."""
    o1, o2, o3 = components(0.5 * omega_BN_B)
    return _product(stack((o1, o2, o3, 0 * o1)), q_BN)


@checked(rotation_vector=ANGLES)
def exponential(rotation_vector: Value) -> Value:
    """Return [sin(a/2) e; cos(a/2)] of the rotation vector a e [rad]; smooth everywhere, so w < 0 for pi < a < 3 pi."""
    square = dot(rotation_vector, rotation_vector)
    small = square < _SMALL_SQUARED_ANGLE
    half = 0.5 * sqrt(where(small, 1.0, square))
    series = 0.5 - square / 48 + square**2 / 3840 - square**3 / 645120
    factor = where(small, series, 0.5 * sin(half) / half)
    cosine = 1 - square / 8 + square**2 / 384 - square**3 / 46080 + square**4 / 10321920
    return join(scale(factor, rotation_vector), stack((where(small, cosine, cos(half)),)))


@checked(q_BN=QUATERNION, omega_BN_B=RATE, dt=TIME)
def propagate(q_BN: Value, omega_BN_B: Value, dt: Value) -> Value:
    """Return q_BN after `dt` [s] at a rate constant in B: exp(omega dt) (x) q, exact."""
    return _product(exponential(scale(dt, omega_BN_B)), q_BN)


@checked(q_BN=QUATERNION)
def to_scalar_first(q_BN: Value) -> Value:
    """Return [w, x, y, z]."""
    x, y, z, w = components(q_BN)
    return stack((w, x, y, z))


@checked(wxyz=QUATERNION)
def from_scalar_first(wxyz: Value) -> Value:
    """Return [x, y, z, w], in the canonical sign."""
    w, x, y, z = components(wxyz)
    return unchecked(canonical)(stack((x, y, z, w)))


@checked(q_BN=QUATERNION)
def to_scipy(q_BN: Value) -> "Rotation":
    """Return `Rotation.from_quat(q_BN)`: its matrix is A(q_BN)^T, its `apply` maps B components to N components."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(q_BN)


def from_scipy(rotation: "Rotation") -> Array:
    """Return q_BN (..., 4) of a Rotation whose `apply` maps B components to N components; the inverse of `to_scipy`."""
    return np.asarray(canonical(rotation.as_quat()))


@checked(q_BN=QUATERNION)
def continuous_signs(q_BN: Value) -> Array:
    """Return a time series (m, 4) with successive quaternions on the same side; the first keeps its sign.

    Raises
    ------
    InputError : not (m, 4), or as for every quaternion argument.
    """
    if is_symbolic(q_BN) or q_BN.ndim != 2:
        raise InputError(f"`q_BN` must be a time series of shape (m, 4) [-], got {q_BN.shape}.")
    turns = np.where(np.sum(q_BN[1:] * q_BN[:-1], axis=-1) < 0, -1.0, 1.0)
    signs = np.concatenate((np.ones(min(len(q_BN), 1)), np.cumprod(turns)))
    return np.asarray(q_BN * signs[:, None])


def _product(p: Value, q: Value) -> Value:
    p1, p2, p3, p4 = components(p)
    q1, q2, q3, q4 = components(q)
    return stack(
        (
            p4 * q1 + q4 * p1 - (p2 * q3 - p3 * q2),
            p4 * q2 + q4 * p2 - (p3 * q1 - p1 * q3),
            p4 * q3 + q4 * p3 - (p1 * q2 - p2 * q1),
            p4 * q4 - (p1 * q1 + p2 * q2 + p3 * q3),
        )
    )
