"""Rotation vector phi_BN = a e: axis times angle [rad]; results have a <= pi."""

from optsat.attitude.backend import Value, atan2, components, dot, scale, sqrt, stack, where
from optsat.attitude.edges import ANGLES, QUATERNION, checked, unchecked
from optsat.attitude.quaternion import canonical, exponential

_SMALL_SQUARED_SINE = 1e-4


@checked(phi_BN=ANGLES)
def to_quaternion(phi_BN: Value) -> Value:
    """Return q_BN (..., 4), canonical sign, of any rotation vector, also beyond pi."""
    return unchecked(canonical)(unchecked(exponential)(phi_BN))


@checked(q_BN=QUATERNION)
def from_quaternion(q_BN: Value) -> Value:
    """Return phi_BN (..., 3) [rad], |phi| <= pi; by a series where the angle is small, so it is smooth at zero."""
    x, y, z, w = components(unchecked(canonical)(q_BN))
    v = stack((x, y, z))
    square = dot(v, v)
    small = square < _SMALL_SQUARED_SINE
    sine = sqrt(where(small, 1.0, square))
    # atan(t) / t with t = |v| / w, where w is near one
    t2 = square / where(small, w * w, 1.0)
    series = (1 - t2 / 3 + t2**2 / 5 - t2**3 / 7 + t2**4 / 9) / where(small, w, 1.0)
    return scale(2 * where(small, series, atan2(sine, w) / sine), v)
