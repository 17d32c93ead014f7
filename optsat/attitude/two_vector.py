"""Two vectors in closed form: the Wahba attitude, and the weights that give the smallest guaranteed bound.

All functions take (..., 2, 3) unit vectors and work on whole arrays at once.
"""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array, cross_rows

_GOLDEN = (np.sqrt(5.0) - 1) / 2
_STEPS = 24
# a weight ratio of the square root of rounding: a lighter vector would drown in the rounding that a proof allows for,
# and the bound at this ratio is within 1e-7 of its limit
_LOG_RATIO_LIMIT = 17.0


def pair_angle(unit: Array) -> Array:
    """Return the angle (...) [rad] between the two unit rows of (..., 2, 3), accurate from 0 to pi."""
    total = np.linalg.norm(unit[..., 0, :] + unit[..., 1, :], axis=-1)
    difference = np.linalg.norm(unit[..., 0, :] - unit[..., 1, :], axis=-1)
    return np.asarray(2 * np.arctan2(difference, total))


def wahba_dcm(b_B: Array, r_N: Array, weights: Array) -> Array:
    """Return the rotation A (..., 3, 3) that minimises the weighted Wahba loss of two non-collinear pairs.

    A = b3 r3^T + (w/p) [b1 r1^T + (b1 x b3)(r1 x r3)^T] + (v/p) [b2 r2^T + (b2 x b3)(r2 x r3)^T],
    p = sqrt(w^2 + v^2 + 2 w v cos(theta_b - theta_r)).

    weights : (..., 2), sum 1. Collinear pairs give NaN: the caller decides before.
    Source: robust attitude paper, two-vector form; Markley (2002), fast attitude from two vectors.
    """
    b3 = cross_rows(b_B[..., 0, :], b_B[..., 1, :])
    r3 = cross_rows(r_N[..., 0, :], r_N[..., 1, :])
    with np.errstate(invalid="ignore", divide="ignore"):
        b3 = b3 / np.linalg.norm(b3, axis=-1, keepdims=True)
        r3 = r3 / np.linalg.norm(r3, axis=-1, keepdims=True)
        w, v = weights[..., 0], weights[..., 1]
        p = np.sqrt(w * w + v * v + 2 * w * v * np.cos(pair_angle(b_B) - pair_angle(r_N)))
        A = b3[..., :, None] * r3[..., None, :]
        for k, share in ((0, w / p), (1, v / p)):
            b, r = b_B[..., k, :], r_N[..., k, :]
            plane = (
                b[..., :, None] * r[..., None, :] + cross_rows(b, b3)[..., :, None] * cross_rows(r, r3)[..., None, :]
            )
            A = A + share[..., None, None] * plane
    return np.asarray(A)


@dataclass(frozen=True)
class BoundOfWeights:
    """Guaranteed bound of two pairs as a function of the log weight ratio x = log(w / v); arrays of poses (...).

    rho(x) = [h1/v + h2/w - 4 sin^2((theta_b - theta_r)/2) / (p + 1)] (p + m) / (4 sin theta_b sin theta_r),
    p, m = sqrt(w^2 + v^2 + 2 w v cos(theta_b -+ theta_r)), h = 1 - cos(eps); no cancellation down to arcseconds.
    Source: Theorem 1 for two vectors, robust Wahba specification section 6.
    """

    versine: tuple[Array, Array]
    cosine_difference: Array
    cosine_sum: Array
    mismatch: Array
    scale: Array

    @staticmethod
    def of(theta_b: Array, theta_r: Array, angle_bound_rad: Array) -> "BoundOfWeights":
        """Return the function for pair angles (...) and bounds (..., 2) [rad]."""
        half = np.sin(angle_bound_rad / 2)
        with np.errstate(divide="ignore"):
            scale = 1 / (4 * np.sin(theta_b) * np.sin(theta_r))
        return BoundOfWeights(
            (2 * half[..., 0] ** 2, 2 * half[..., 1] ** 2),
            2 * np.cos(theta_b - theta_r),
            2 * np.cos(theta_b + theta_r),
            4 * np.sin((theta_b - theta_r) / 2) ** 2,
            scale,
        )

    def __call__(self, x: Array) -> Array:
        """Return rho = sin^2(bound / 2) (...); >= 1 means unbounded, < 0 inconsistent."""
        tail = np.exp(-x)
        w = 1 / (1 + tail)
        v = tail * w
        squares, product = w * w + v * v, w * v
        p = np.sqrt(squares + product * self.cosine_difference)
        m = np.sqrt(np.maximum(squares + product * self.cosine_sum, 0.0))
        # 1/v and 1/w from their own exponential: nothing is 0/0 at either end
        pull = self.versine[0] * (1 + 1 / tail) + self.versine[1] * (1 + tail)
        return np.asarray((pull - self.mismatch / (p + 1)) * (p + m) * self.scale)


def best_weights(b_B: Array, r_N: Array, angle_bound_rad: Array) -> Array:
    """Return the weights (..., 2), sum 1, that minimise the guaranteed bound of two pairs.

    Golden section on x = log(w / v) in the exact bracket between 0 and log(sin(eps_2 / 2) / sin(eps_1 / 2)).
    angle_bound_rad : (..., 2)
    """
    half = np.sin(angle_bound_rad / 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        end = np.nan_to_num(np.log(half[..., 1]) - np.log(half[..., 0]), nan=0.0)
    end = np.clip(end, -_LOG_RATIO_LIMIT, _LOG_RATIO_LIMIT)
    rho = BoundOfWeights.of(pair_angle(b_B), pair_angle(r_N), angle_bound_rad)
    low, high = np.minimum(end, 0.0), np.maximum(end, 0.0)
    width = high - low
    x1, x2 = high - _GOLDEN * width, low + _GOLDEN * width
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        f1, f2 = rho(x1), rho(x2)
        for _ in range(_STEPS):
            left = f1 <= f2
            low, width = np.where(left, low, x1), width * _GOLDEN
            probe = low + np.where(left, 1 - _GOLDEN, _GOLDEN) * width
            value = rho(probe)
            x1, x2 = np.where(left, probe, x2), np.where(left, x1, probe)
            f1, f2 = np.where(left, value, f2), np.where(left, f1, value)
    x = np.where(f1 <= f2, x1, x2)
    return np.stack((1 / (1 + np.exp(-x)), 1 / (1 + np.exp(x))), axis=-1)


def collinear(b_B: Array, r_N: Array, tolerance: float = 1e-12) -> Array:
    """Return whether either pair of directions (..., 2, 3) spans no plane: sine of its angle <= tolerance."""
    return np.asarray(
        (np.linalg.norm(cross_rows(b_B[..., 0, :], b_B[..., 1, :]), axis=-1) <= tolerance)
        | (np.linalg.norm(cross_rows(r_N[..., 0, :], r_N[..., 1, :]), axis=-1) <= tolerance)
    )
