"""Two-eigenvalue bound: every admissible attitude lies in a ball about q, for any weights, rounding allowed for.

Theorem 1 of the robust Wahba specification (section 6): with f(g) = a + 2 h.g - g^T C g the weighted sum of the
constraints
about q, f >= 0 for every admissible attitude [g; 1] (x) q, hence |g|^2 <= s1 / -s2 with s1 >= a + |h|^2 / mu and
s2 <= mu - lambda_min(C) for every mu > 0.
"""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.davenport import (
    centred_blocks,
    davenport_matrix,
    dominant_quaternion,
    rotation_matrix,
    turn,
)
from optsat.attitude.status import AttitudeStatus

ROUNDOFF = 2.3e-16


@dataclass(frozen=True)
class WeightedSum:
    """Weighted sum of constraints about q as f(g) = a + 2 h.g - g^T C g; leading axes are poses.

    rounding : bound of the relative rounding error of a, h and C; scale : size of the terms that were summed into a
    """

    q_BN: Array
    a: Array
    h: Array
    C: Array
    rounding: Array
    scale: Array


def weighted_sum(
    b_B: Array, r_N: Array, versine: Array, weights: Array, q_BN: Array, cuts: AdmissibleSet | None = None
) -> WeightedSum:
    """Return the weighted sum about q_BN (..., 4) of cones b_B, r_N (..., m, 3), versine = 1 - cos(eps) (..., m).

    weights : (..., m), or (m + k,) when `cuts` holds k half-space cuts (one pose only).
    """
    m = b_B.shape[-2]
    y_B = r_N @ np.swapaxes(rotation_matrix(q_BN), -1, -2)
    gap = b_B - y_B
    value = versine - 0.5 * np.sum(gap * gap, axis=-1)
    linear, block = centred_blocks(b_B, y_B, 1.0 - versine)
    w = weights[..., :m]
    a = np.sum(w * value, axis=-1)
    h = (w[..., None, :] @ linear)[..., 0, :]
    C = -(w[..., None, :] @ block.reshape(*block.shape[:-2], 9)).reshape(*h.shape, 3)
    scale = np.sum(w * np.sqrt(2 * versine), axis=-1)
    magnitude = np.sum(w, axis=-1)
    if cuts is not None and len(cuts.cut_level):
        y_cut = cuts.cut_N @ rotation_matrix(q_BN).T
        cut_linear, cut_block = centred_blocks(cuts.cut_B, y_cut, cuts.cut_level)
        v = weights[m:]
        a = a + v @ (np.sum(cuts.cut_B * y_cut, axis=-1) - cuts.cut_level)
        h = h + v @ cut_linear
        C = C - np.sum(v[:, None, None] * cut_block, axis=0)
        # a cut has no form free of cancellation: its whole size enters the rounding of a
        size = v @ cuts.magnitude[m:]
        scale, magnitude = scale + size, magnitude + size
    rounding = (weights.shape[-1] + 10) * ROUNDOFF * np.maximum(1.0, magnitude)
    return WeightedSum(q_BN, a, h, C, rounding, scale)


@dataclass(frozen=True)
class Ball:
    """Ball of attitudes about q_BN that holds the admissible set; leading axes are poses.

    bound_rad : (...) guaranteed angle [rad], pi when unbounded
    s1, s2 : (...) the two eigenvalue bounds, rounding included
    empty : (...) True where s1 < 0 and s2 < 0 prove that no attitude is admissible
    """

    q_BN: Array
    bound_rad: Array
    s1: Array
    s2: Array
    empty: Array

    @property
    def status(self) -> AttitudeStatus:
        """Status of a single pose."""
        if bool(self.empty):
            return AttitudeStatus.INCONSISTENT
        return AttitudeStatus.OK if float(self.s2) < 0 else AttitudeStatus.UNBOUNDED


def ball_of(total: WeightedSum) -> Ball:
    """Return the ball that a weighted sum proves, outward rounded."""
    c = np.linalg.eigvalsh(total.C)[..., 0]
    u = total.rounding
    eta = np.linalg.norm(total.h, axis=-1) + 2 * u
    positive = np.maximum(c, np.finfo(float).tiny)
    mu = np.minimum(positive / 2, eta * np.sqrt(positive / np.maximum(total.a, u * u)))
    s1 = total.a + eta * eta / mu + u * (np.abs(total.a) + total.scale + u)
    s2 = np.where(c > 0, mu - c + u, np.maximum(u - c, 0.0))
    bounded = s2 < 0
    ratio = np.where(bounded, np.maximum(s1, 0.0) / np.where(bounded, -s2, 1.0), np.inf)
    angle = np.where(bounded, 2 * np.arctan(np.sqrt(ratio)), np.pi)
    return Ball(total.q_BN, np.asarray(angle), np.asarray(s1), np.asarray(s2), np.asarray(bounded & (s1 < 0)))


def recentre(total: WeightedSum) -> Array:
    """Return the attitude at which the weighted sum is largest, one Newton step from its present centre."""
    bounded = np.linalg.eigvalsh(total.C)[..., 0] > total.rounding
    if bounded.ndim == 0:
        return turn(total.q_BN, np.asarray(np.linalg.solve(total.C, total.h), np.float64)) if bounded else total.q_BN
    safe = np.where(bounded[..., None, None], total.C, np.eye(3))
    step = np.linalg.solve(safe, total.h[..., None])[..., 0]
    return turn(total.q_BN, np.where(bounded[..., None], step, 0.0))


def centred_sum(admissible: AdmissibleSet, weights: Array) -> WeightedSum:
    """Return the weighted sum about the attitude where the weights (count,), sum 1, prove the smallest ball.

    The Davenport attitude of the weights, finished by a Newton step on the vectors where its rounding shows.
    """
    q_BN = dominant_quaternion(davenport_matrix(admissible.left_B, admissible.right_N, weights))
    total = sum_about(admissible, weights, q_BN)
    negligible = 1e-10 * np.sqrt(max(float(total.a), 0.0) * max(float(np.trace(total.C)), 0.0))
    if float(np.linalg.norm(total.h)) > negligible:
        total = sum_about(admissible, weights, recentre(total))
    return total


def enclose(admissible: AdmissibleSet, weights: Array) -> Ball:
    """Return the smallest ball that the given weights (count,) >= 0, any scale, prove.

    Source: robust Wahba specification, Theorem 1 with its rounding-safe evaluation.
    """
    return ball_of(centred_sum(admissible, weights / weights.sum()))


def sum_about(admissible: AdmissibleSet, weights: Array, q_BN: Array) -> WeightedSum:
    """Return the weighted sum of an admissible set's constraints about q_BN (4,)."""
    return weighted_sum(admissible.b_B, admissible.r_N, admissible.cone_versine, weights, q_BN, admissible)


def ellipsoid(total: WeightedSum, ball: Ball) -> Array:
    """Return E (3, 3) with g^T E g <= 1 for every admissible attitude [g; 1] (x) q_BN, infinite-free only when bounded.

    From g^T (C - mu I) g <= s1 with the mu of the ball: E = (C - (s2 + lambda_min(C)) I) / s1.
    """
    c = float(np.linalg.eigvalsh(total.C)[0])
    shift = float(ball.s2) + c
    return np.asarray((total.C - shift * np.eye(3)) / max(float(ball.s1), np.finfo(float).tiny))
