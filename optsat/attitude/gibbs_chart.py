"""Gibbs chart: attitudes [s g; 1] (x) q about a pivot q, with the radius of interest scaled to |g| = 1.

In this chart every constraint is a quadratic f(g) = a + 2 h.g + g^T G g and every number is of order one, whatever
the size of the errors. A ball about the attitude at g = c is {g : N(g) <= tau D(g)} with tan^2(theta / 2) = s^2 tau,
N(g) = |g - c|^2 + s^2 (|g|^2 |c|^2 - (g.c)^2), D(g) = (1 + s^2 g.c)^2. The chart is gnomonic: a ball below pi is
convex in it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from optsat.arrays import Array, cross_rows
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.davenport import turn

ROUNDOFF = 2.3e-16


@dataclass(frozen=True)
class GibbsChart:
    """Constraints about a pivot, each divided by its own size.

    admissible : the set; q_BN : (4,) pivot; scale : s = tan(theta / 2) of |g| = 1
    a (n,), h (n, 3), G (n, 3, 3) : scaled coefficients; size (n,) : what they were divided by
    """

    admissible: AdmissibleSet
    q_BN: Array
    scale: float
    a: Array
    h: Array
    G: Array
    size: Array

    @staticmethod
    def about(admissible: AdmissibleSet, q_BN: Array, scale: float) -> "GibbsChart":
        """Return the chart of an admissible set about q_BN."""
        return GibbsChart.of(admissible, q_BN, scale, admissible.centred(q_BN))

    @staticmethod
    def of(
        admissible: AdmissibleSet, q_BN: Array, scale: float, quadratics: tuple[Array, Array, Array]
    ) -> "GibbsChart":
        """Return the chart about q_BN from the constraints a + 2 h.g + g^T G g that `admissible.centred` gave there."""
        a, h, G = quadratics[0], scale * quadratics[1], scale**2 * quadratics[2]
        size = np.maximum(np.maximum(np.abs(a), np.abs(h).max(axis=1)), np.abs(G).max(axis=(1, 2)))
        size = np.maximum(size, np.finfo(float).tiny)
        return GibbsChart(admissible, q_BN, scale, a / size, h / size[:, None], G / size[:, None, None], size)

    @cached_property
    def rounding(self) -> Array:
        """Bound (n,) of the rounding error of every scaled constraint anywhere on |g| <= 2."""
        known, m = self.admissible, self.admissible.cone_count
        linear = np.linalg.norm(self.h[:m], axis=1) * self.size[:m]
        # a of a cone is a difference of squares of size eps^2, its h carries the rounding of y; a of a cut has its full
        # size
        cones = np.sqrt(2 * known.cone_versine) + linear + self.scale + ROUNDOFF
        terms = np.concatenate((cones, known.magnitude[m:]))
        return np.asarray(40 * ROUNDOFF * (terms / self.size + 1))

    def attitude(self, g: Array) -> Array:
        """Return the unit quaternions (..., 4) of chart points g (..., 3)."""
        return turn(np.broadcast_to(self.q_BN, (*g.shape[:-1], 4)), self.scale * g)

    def values(self, g: Array) -> Array:
        """Return all scaled constraints (..., n) at chart points g (..., 3)."""
        curved = np.einsum("...i,nij,...j->...n", g, self.G, g)
        return np.asarray(self.a + 2 * g @ self.h.T + curved)

    def matrices(self) -> Array:
        """Return the constraints as symmetric matrices (n, 4, 4) in (1, g)."""
        Q = np.empty((len(self.a), 4, 4))
        Q[:, 0, 0] = self.a
        Q[:, 0, 1:] = Q[:, 1:, 0] = self.h
        Q[:, 1:, 1:] = self.G
        return Q


def ball_matrices(centre: Array, scale: float) -> tuple[Array, Array]:
    """Return N and D (4, 4) in (1, g) for balls about the attitude at chart point `centre` (3,)."""
    c2 = float(centre @ centre)
    N = np.empty((4, 4))
    N[0, 0] = c2
    N[0, 1:] = N[1:, 0] = -centre
    N[1:, 1:] = np.eye(3) + scale**2 * (c2 * np.eye(3) - np.outer(centre, centre))
    d = np.concatenate(([1.0], scale**2 * centre))
    return N, np.outer(d, d)


def slab_matrices(low: Array, high: Array) -> Array:
    """Return the three slabs of cells (..., 3) and the unit ball as matrices (..., 4, 4, 4) in (1, g)."""
    Q = np.zeros((*low.shape[:-1], 4, 4, 4))
    for axis in range(3):
        Q[..., axis, 0, 0] = -low[..., axis] * high[..., axis]
        Q[..., axis, 0, axis + 1] = Q[..., axis, axis + 1, 0] = (low[..., axis] + high[..., axis]) / 2
        Q[..., axis, axis + 1, axis + 1] = -1.0
    Q[..., 3, :, :] = np.diag((1.0, -1.0, -1.0, -1.0))
    return Q


def ball_levels(g: Array, centre: Array, scale: float) -> Array:
    """Return tau (...) of chart points g (..., 3): tan^2(theta / 2) / s^2 of their angle theta from `centre`.

    Inf beyond pi.
    """
    gap = g - centre
    N = np.sum(gap * gap, axis=-1) + scale**2 * np.sum(cross_rows(g, centre) ** 2, axis=-1)
    root = 1 + scale**2 * (g @ centre)
    return np.where(root > 0, N / np.maximum(root, 1e-300) ** 2, np.inf)


def smallest_ball(g: Array, scale: float, iterations: int = 1000, tolerance: float = 1e-6) -> Array:
    """Return the chart point (3,) that minimises the largest angle to points g (k, 3).

    The smallest cap on the sphere of quaternions is cut by the smallest Euclidean ball around them; its dual weights
    are found by pairwise Frank-Wolfe steps, from the nearest support point to the farthest point, until the squared
    radius is known to the relative tolerance. Coordinates are taken about the pivot and divided by `scale`, so small
    sets lose no digits.
    """
    square = np.sum(g * g, axis=1)
    n = np.sqrt(1 + scale**2 * square)
    points = np.column_stack((g / n[:, None], -scale * square / (n * (n + 1))))
    weights = np.zeros(len(points))
    weights[int(np.argmax(square))] = 1.0
    for _ in range(iterations):
        support = np.flatnonzero(weights)
        centre = weights[support] @ points[support]
        distance = np.sum((points - centre) ** 2, axis=1)
        far, near = int(np.argmax(distance)), int(support[np.argmin(distance[support])])
        if distance[far] <= (1 + tolerance) * float(weights[support] @ distance[support]):
            break
        step = (distance[far] - distance[near]) / (2 * float(np.sum((points[far] - points[near]) ** 2)))
        step = min(step, weights[near])
        weights[near] = 0.0 if step == weights[near] else weights[near] - step
        weights[far] += step
    centre = weights @ points
    return np.asarray(centre[:3] / (1 + scale * centre[3]))


def fibonacci_directions(count: int) -> Array:
    """Return `count` unit vectors (count, 3) spread evenly over the sphere, the same on every machine."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    azimuth = np.pi * (1 + np.sqrt(5.0)) * k
    radius = np.sqrt(1 - z * z)
    return np.stack((radius * np.cos(azimuth), radius * np.sin(azimuth), z), axis=1)


def interior_point(chart: GibbsChart, steps: int = 60) -> Array | None:
    """Return a chart point where every constraint is positive, None where none was found.

    Newton steps on the soft minimum of the scaled constraints, sharpened step by step.
    """
    g = np.zeros(3)
    best, best_value = g, -np.inf
    sharpness = 4.0
    for _ in range(steps):
        values = chart.values(g)
        lowest = float(values.min())
        if lowest > best_value:
            best, best_value = g, lowest
        share = np.exp(-sharpness * (values - lowest))
        share /= share.sum()
        slopes = 2 * (chart.h + chart.G @ g)
        gradient = share @ slopes
        spread = np.einsum("n,ni,nj->ij", share, slopes, slopes) - np.outer(gradient, gradient)
        hessian = sharpness * spread - 2 * np.einsum("n,nij->ij", share, chart.G)
        lowest_curvature = float(np.linalg.eigvalsh(hessian)[0])
        hessian = hessian + max(1e-3 - lowest_curvature, 0.0) * np.eye(3)
        step = np.linalg.solve(hessian, gradient)
        g = g + step * min(1.0, 0.3 / max(float(np.linalg.norm(step)), 1e-12))
        sharpness = min(sharpness * 1.15, 400.0)
    return best if best_value > 1e-9 else None


def boundary_points(chart: GibbsChart, start: Array, directions: Array) -> Array:
    """Return where rays from an interior point (3,) along directions (k, 3) first leave the admissible set (k, 3)."""
    value = chart.values(start)
    slope = 2 * directions @ (chart.h + chart.G @ start).T
    curve = np.einsum("ki,nij,kj->kn", directions, chart.G, directions)
    # smallest positive root of value + slope t + curve t^2, value > 0, in the form without cancellation
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(slope * slope - 4 * curve * value)
        t = 2 * value / (-slope + root)
        other = (-slope + root) / (2 * curve)
    t = np.where(np.isfinite(t) & (t > 0), t, np.where(np.isfinite(other) & (other > 0), other, np.inf))
    return np.asarray(start + np.minimum(t.min(axis=1), 4.0)[:, None] * directions)
