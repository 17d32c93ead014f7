"""Modified Rodrigues parameters: sigma_BN = e tan(a / 4) = v / (1 + s); results lie in the unit ball."""

from optsat.attitude.backend import Value, components, cross, dot, reciprocal, scale, stack, where
from optsat.attitude.edges import NON_ZERO, QUATERNION, RATE, VECTOR, checked, unchecked
from optsat.attitude.quaternion import canonical as canonical_quaternion
from optsat.attitude.quaternion import compose as compose_quaternions


@checked(q_BN=QUATERNION)
def from_quaternion(q_BN: Value) -> Value:
    """Return sigma_BN (..., 3), |sigma| <= 1."""
    x, y, z, w = components(unchecked(canonical_quaternion)(q_BN))
    return scale(reciprocal(1 + w), stack((x, y, z)))


@checked(sigma_BN=VECTOR)
def to_quaternion(sigma_BN: Value) -> Value:
    """Return q_BN (..., 4), canonical sign; a set and its shadow give the same."""
    s1, s2, s3 = components(sigma_BN)
    square = dot(sigma_BN, sigma_BN)
    q = scale(reciprocal(1 + square), stack((2 * s1, 2 * s2, 2 * s3, 1 - square)))
    return unchecked(canonical_quaternion)(q)


@checked(sigma_BN=NON_ZERO)
def shadow(sigma_BN: Value) -> Value:
    """Return the other set of the same attitude, -sigma / |sigma|^2.

    Raises
    ------
    InputError : sigma is zero, whose shadow lies at infinity.
    """
    return scale(-1 / dot(sigma_BN, sigma_BN), sigma_BN)


@checked(sigma_BN=VECTOR)
def canonical(sigma_BN: Value) -> Value:
    """Return the set with |sigma| <= 1: the shadow where |sigma| > 1."""
    square = dot(sigma_BN, sigma_BN)
    outside = square > 1
    return scale(where(outside, -1 / where(outside, square, 1.0), 1.0), sigma_BN)


@checked(p=VECTOR, q=VECTOR)
def compose(p: Value, q: Value) -> Value:
    """Return sigma_CN = compose(sigma_CB, sigma_BN), |sigma| <= 1; by quaternions, so it has no singular pair."""
    return from_quaternion(compose_quaternions(to_quaternion(p), to_quaternion(q)))


@checked(sigma_BN=VECTOR)
def inverse(sigma_BN: Value) -> Value:
    """Return sigma_NB = -sigma_BN."""
    return -sigma_BN


@checked(sigma_BN=VECTOR, omega_BN_B=RATE)
def derivative(sigma_BN: Value, omega_BN_B: Value) -> Value:
    """Return sigma_dot = 1/4 [(1 - s.s) omega + 2 s x omega + 2 s (s.omega)] [1/s].

    Source: Schaub & Junkins, Analytical Mechanics of Space Systems, eq. (3.160).
    """
    turning = scale(1 - dot(sigma_BN, sigma_BN), omega_BN_B)
    leaning = cross(sigma_BN, omega_BN_B) + scale(dot(sigma_BN, omega_BN_B), sigma_BN)
    return 0.25 * (turning + 2 * leaning)
