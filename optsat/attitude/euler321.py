"""Euler angles 3-2-1: (yaw, pitch, roll) [rad], dcm_BN = R1(roll) R2(pitch) R3(yaw)."""

import math

from optsat.attitude.backend import Value, absolute, atan2, components, cos, sin, sqrt, stack, where
from optsat.attitude.edges import ANGLES, QUATERNION, checked, unchecked
from optsat.attitude.quaternion import canonical

_LOCKED = 1e-12


@checked(yaw_pitch_roll=ANGLES)
def to_quaternion(yaw_pitch_roll: Value) -> Value:
    """Return q_BN (..., 4), canonical sign."""
    yaw, pitch, roll = components(yaw_pitch_roll)
    c3, c2, c1 = cos(yaw / 2), cos(pitch / 2), cos(roll / 2)
    s3, s2, s1 = sin(yaw / 2), sin(pitch / 2), sin(roll / 2)
    q = stack(
        (
            s1 * c2 * c3 - c1 * s2 * s3,
            c1 * s2 * c3 + s1 * c2 * s3,
            c1 * c2 * s3 - s1 * s2 * c3,
            c1 * c2 * c3 + s1 * s2 * s3,
        )
    )
    return unchecked(canonical)(q)


@checked(q_BN=QUATERNION)
def from_quaternion(q_BN: Value) -> Value:
    """Return (yaw, pitch, roll) (..., 3) [rad]: yaw and roll in (-pi, pi], pitch in [-pi/2, pi/2].

    At gimbal lock (pitch = +-pi/2) only yaw -+ roll is defined: roll is 0 and yaw carries it all.
    Source: half sums and differences of the angles, after Bernardes & Viollet, PLoS ONE 17 (2022); full accuracy
    everywhere, where the usual arcsine of a matrix entry loses half of the digits near the lock.
    """
    x, y, z, w = components(q_BN)
    plus, minus = sqrt((w + y) ** 2 + (x - z) ** 2), sqrt((w - y) ** 2 + (x + z) ** 2)
    pitch = 2 * atan2(plus, minus) - math.pi / 2
    half_sum, half_difference = atan2(x + z, w - y), atan2(x - z, w + y)
    up, down = minus <= _LOCKED, plus <= _LOCKED
    half_sum, half_difference = where(up, -half_difference, half_sum), where(down, -half_sum, half_difference)
    return stack((_wrapped(half_sum - half_difference), pitch, _wrapped(half_sum + half_difference)))


def _wrapped(angle: Value) -> Value:
    """Return an angle of magnitude up to 2 pi in (-pi, pi]; exactly -pi becomes pi."""
    beyond = where(absolute(angle) > math.pi, where(angle > 0, 2 * math.pi, -2 * math.pi), 0.0)
    inside = angle - beyond
    return where(inside <= -math.pi, inside + 2 * math.pi, inside)
