"""Certified attitude from two vectors as straight-line code: the closed form of the smallest ball that holds the truth.

With theta_b, theta_r the angles between the two directions in B and in N, weights w and v = t w, h_i = 1 - cos(eps_i),
Theorem 1 of the robust Wahba specification gives for every t > 0
    sin^2(bound / 2) <= [h1 / t + h2 - mismatch / (P + 1 + t)] (P + M) / (4 sin theta_b sin theta_r),
    P, M = sqrt(1 + 2 t cos(theta_b -+ theta_r) + t^2), mismatch = 4 sin^2((theta_b - theta_r) / 2).
Its least value lies between t = 1 and t = sin(eps_1 / 2) / sin(eps_2 / 2). The sign of the slope is bisected there in
the logarithm of t, by geometric means, so that no exponential is needed; a step too few would only loosen the bound.
"""

import math
from dataclasses import dataclass

from optsat.attitude import dcm, quaternion
from optsat.attitude.backend import Value, atan2, cross, dot, reciprocal, scale, sqrt, stack
from optsat.attitude.edges import unchecked
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION, unit_quaternion
from optsat.symbolic.generated_function import GeneratedFunction, generate

LENGTH_TOLERANCE = 0.05
"""Deviation of a vector's length from one that flight code counts, as a sign of a sensor gone wrong."""

_BISECTIONS = 20
# what rounding of this computation may cost, in roundings: added to each bound [rad], and to sin^2(bound / 2) over the
# sines of the angles between the vectors
_MARGIN = 8.0
_MARGIN_OF_SQUARE = 16.0
# mismatch beyond the bounds [rad] that is granted to rounding of the data, as everywhere in optsat; in roundings where
# those are coarser
_GRANTED_RAD = 1e-12
_GRANTED = 16.0
# sine of the angle between two vectors that counts as zero, in roundings
_COLLINEAR = 4096.0
_quaternion_from_dcm = unchecked(dcm.to_quaternion)
_canonical = unchecked(quaternion.canonical)


def certified_two_vector(tiny: float = 1e-300, rounding: float = 2.0**-52) -> GeneratedFunction:
    """Return `certified_two_vector`: attitude from two bounded direction errors, and the angle its error never exceeds.

    q_BN : w >= 0; where the vectors are collinear, the smallest rotation that fits the better pair
    bound_rad : every attitude within the bounds is within this angle of q_BN; pi where the status is not 0
    weights : of the two pairs, sum 1
    status : 0 ok; 1 unbounded: the vectors are collinear or the bounds too wide; 2 inconsistent: no attitude fits

    Vectors are scaled to length one first. Rounding of the computation is covered; that of data which are less exact
    than the arithmetic must be covered by angle_bound_rad, the sum of the bounds of a direction in B and in N.

    tiny : least divisor of the arithmetic it runs in
    rounding : spacing of its numbers at 1

    Source: robust Wahba specification, sections 6 and 8.
    """
    import casadi as ca

    b_B, r_N, bound = ca.SX.sym("b_B", 2, 3), ca.SX.sym("r_N", 2, 3), ca.SX.sym("angle_bound_rad", 2)
    b, r = _pair_of(b_B, tiny), _pair_of(r_N, tiny)
    sin_difference = b.sine * r.cosine - b.cosine * r.sine
    cos_difference = b.cosine * r.cosine + b.sine * r.sine
    excess = atan2(ca.fabs(sin_difference), cos_difference) - bound[0] - bound[1]
    granted = max(_GRANTED_RAD, _GRANTED * rounding)
    inconsistent = excess > granted
    slack = _MARGIN * rounding + ca.if_else(excess > 0, granted, 0)
    half_sine = [ca.sin(0.5 * ca.fmin(bound[k] + slack, math.pi)) for k in range(2)]
    search = _Search(
        h1=2 * half_sine[0] ** 2,
        h2=2 * half_sine[1] ** 2,
        mismatch=ca.if_else(
            cos_difference > 0,
            2 * sin_difference**2 / (1 + ca.fmax(cos_difference, 0)),
            2 * (1 - cos_difference),
        ),
        cos_difference=cos_difference,
        cos_sum=b.cosine * r.cosine - b.sine * r.sine,
        tiny=tiny,
    )
    t = search.best(half_sine[0] / half_sine[1], rounding)
    steepness = (reciprocal(ca.fmax(b.sine, tiny)), reciprocal(ca.fmax(r.sine, tiny)))
    outward = 1 + _MARGIN_OF_SQUARE * rounding * (steepness[0] + steepness[1])
    square = ca.fmax(search.value(t), 0) * (0.25 * steepness[0] * outward) * steepness[1]
    collinear = ca.fmin(b.sine, r.sine) <= _COLLINEAR * rounding
    free = ca.logic_or(collinear, ca.logic_not(square < 1))
    angle = 2 * atan2(sqrt(ca.fmin(square, 1)), sqrt(1 - ca.fmin(square, 1)))
    share = reciprocal(search.P(t))
    closed = _quaternion_from_dcm(_rotation(b, r, (1 + t * cos_difference) * share, t * sin_difference * share))
    better_B, better_N = (ca.if_else(bound[0] <= bound[1], pair.first, pair.second) for pair in (b, r))
    q = ca.if_else(collinear, _smallest_rotation(better_B, better_N, tiny, rounding), closed)
    return generate(
        "certified_two_vector",
        inputs=[
            (Port("b_B", (2, 3), "-", direction=LENGTH_TOLERANCE), b_B),
            (Port("r_N", (2, 3), "-", direction=LENGTH_TOLERANCE), r_N),
            (Port("angle_bound_rad", (2,), "rad", lower=0.0, upper=math.pi), bound),
        ],
        outputs=[
            (QUATERNION, q),
            (
                Port("bound_rad", (), "rad", lower=0.0, upper=3.2, safe=math.pi),
                ca.if_else(ca.logic_or(free, inconsistent), math.pi, angle),
            ),
            (Port("weights", (2,), "-", lower=0.0, upper=1.0, safe=0.5), scale(reciprocal(1 + t), stack((1, t)))),
            (Port("status", (), "-", lower=0.0, upper=2.0, safe=1.0), ca.if_else(inconsistent, 2, free)),
        ],
    )


@dataclass(frozen=True)
class _Pair:
    """Two unit vectors of one frame, their unit normal, and the angle between them."""

    first: Value
    second: Value
    normal: Value
    cosine: Value
    sine: Value


def _pair_of(rows: Value, tiny: float) -> _Pair:
    import casadi as ca

    def unit(vector: Value) -> Value:
        length = sqrt(dot(vector, vector))
        # of vectors so short that their squares vanish no direction is left
        return scale((length > tiny) * reciprocal(ca.fmax(length, tiny)), vector)

    first, second = unit(rows[0, :].T), unit(rows[1, :].T)
    normal = cross(first, second)
    sine = sqrt(dot(normal, normal))
    return _Pair(first, second, scale(reciprocal(ca.fmax(sine, tiny)), normal), dot(first, second), sine)


@dataclass(frozen=True)
class _Search:
    """What the bound is made of, as functions of the weight ratio t = v / w."""

    h1: Value
    h2: Value
    mismatch: Value
    cos_difference: Value
    cos_sum: Value
    tiny: float

    def P(self, t: Value) -> Value:
        """Return the larger eigenvalue of K over w, never zero."""
        return self._length(t, self.cos_difference)

    def value(self, t: Value) -> Value:
        """Return 4 sin theta_b sin theta_r sin^2(bound / 2)."""
        P = self.P(t)
        return (self.h1 / t + self.h2 - self.mismatch / (P + 1 + t)) * (P + self._length(t, self.cos_sum))

    def slope(self, t: Value) -> Value:
        """Return the derivative of `value`."""
        P, M = self.P(t), self._length(t, self.cos_sum)
        dP, dM = (self.cos_difference + t) / P, (self.cos_sum + t) / M
        pull, part = self.h1 / t, 1 / (P + 1 + t)
        drawn = self.mismatch * part
        first = (drawn * part * (dP + 1) - pull / t) * (P + M)
        return first + (pull + self.h2 - drawn) * (dP + dM)

    def best(self, end: Value, rounding: float) -> Value:
        """Return the t of the least value between 1 and `end`."""
        import casadi as ca

        # a lighter vector would drown in the rounding that the bound allows for
        limit = rounding**-0.5
        end = ca.fmin(ca.fmax(end, 1 / limit), limit)
        low, high = ca.fmin(end, 1), ca.fmax(end, 1)
        for _ in range(_BISECTIONS):
            middle = sqrt(low * high)
            rises = self.slope(middle) > 0
            low, high = ca.if_else(rises, low, middle), ca.if_else(rises, middle, high)
        return sqrt(low * high)

    def _length(self, t: Value, cosine: Value) -> Value:
        import casadi as ca

        return ca.fmax(sqrt(ca.fmax(1 + t * (2 * cosine + t), 0)), self.tiny)


def _rotation(b: _Pair, r: _Pair, cosine: Value, sine: Value) -> Value:
    """Return A, which takes the normals into each other and r_1 to b_1 turned by an angle within their plane."""
    in_plane_B, in_plane_N = cross(b.normal, b.first), cross(r.normal, r.first)
    along = scale(cosine, b.first) + scale(sine, in_plane_B)
    across = scale(cosine, in_plane_B) - scale(sine, b.first)
    return b.normal @ r.normal.T + along @ r.first.T + across @ in_plane_N.T


def _smallest_rotation(b: Value, r: Value, tiny: float, rounding: float) -> Value:
    """Return q with A(q) r = b of the least angle; of a half turn any."""
    import casadi as ca

    scalar = 1 + dot(b, r)
    opposite = scalar <= _MARGIN * rounding
    # an axis across r, taken from the coordinate axis that is not along it
    across = ca.if_else(ca.fabs(r[0]) < 0.8, stack((0, -r[2], r[1])), stack((r[2], 0, -r[0])))
    vector = ca.if_else(opposite, across, cross(b, r))
    q = unit_quaternion(stack((vector[0], vector[1], vector[2], ca.if_else(opposite, 0, scalar))), tiny)
    return _canonical(q)
