"""Cell cover: a tighter bound than Theorem 1 from one multiplier proof a cell of the pivot ball.

The pivot ball |g| <= 1 of a Gibbs chart holds the admissible set (Theorem 1). Its bounding cube is cut into cells.
On a cell,
multipliers y >= 0 of the constraints, of the three slabs (g_a - l_a)(u_a - g_a) >= 0 and of 1 - |g|^2 >= 0 prove
|angle to the centre| <= theta for every admissible attitude in it when tau D - N - sum_j y_j Q_j is positive
semidefinite.
"""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.gibbs_chart import ROUNDOFF, GibbsChart, ball_matrices, slab_matrices
from optsat.certificates.attitude_bound import ball_of, sum_about
from optsat.certificates.certificate import Verdict


def proof_slack(
    chart: GibbsChart, centre: Array, tau: float | Array, low: Array, high: Array, multipliers: Array
) -> Array:
    """Return the slack (...) of the cells' proofs: smallest eigenvalue less its rounding error, >= 0 when proven.

    low, high : (..., 3); multipliers : (..., n + 4) of the constraints, the slabs and the unit ball; tau : scalar or
    (...)
    """
    N, D = ball_matrices(centre, chart.scale)
    constraints = chart.matrices()
    n = len(constraints)
    y, z = multipliers[..., :n], multipliers[..., n:]
    slabs = slab_matrices(low, high)
    level = np.asarray(tau)[..., None, None]
    proof = level * D - N - np.einsum("...n,nij->...ij", y, constraints) - np.einsum("...k,...kij->...ij", z, slabs)
    terms = np.asarray(np.abs(tau)) * np.abs(D).max() + np.abs(N).max() + y @ np.ones(n) + z.sum(axis=-1)
    rounding = (n + 60) * ROUNDOFF * terms + y @ chart.rounding
    return np.asarray(np.linalg.eigvalsh(proof)[..., 0] - 4 * rounding)


@dataclass(frozen=True)
class CellCover:
    """Cells, multipliers and the level that they prove.

    pivot_BN (4,), pivot_weights (count,), scale : the ball that the cells cover, and tan(theta / 2) of its radius
    centre (3,) : chart point of the bound's centre; tau : proven level, tan^2(bound / 2) = scale^2 tau
    low, high : (k, 3) cells of the cube [-1, 1]^3; multipliers : (k, count + 4)
    """

    pivot_BN: Array
    pivot_weights: Array
    scale: float
    centre: Array
    tau: float
    low: Array
    high: Array
    multipliers: Array

    @property
    def bound_rad(self) -> float:
        """Proven angle from the centre [rad]."""
        return float(2 * np.arctan(self.scale * np.sqrt(self.tau)))

    def check(self, admissible: AdmissibleSet) -> Verdict:
        """Recompute the whole proof from the data."""
        chart = GibbsChart.about(admissible, self.pivot_BN, self.scale)
        if not (
            np.all(self.pivot_weights >= 0) and np.all(self.multipliers >= 0) and np.all(np.isfinite(self.multipliers))
        ):
            return Verdict(False, "a multiplier is negative or not finite")
        pivot = ball_of(sum_about(admissible, self.pivot_weights / self.pivot_weights.sum(), self.pivot_BN))
        if float(pivot.bound_rad) > 2 * np.arctan(self.scale) * (1 + 1e-12):
            return Verdict(False, "the pivot ball does not hold the admissible set")
        if not _tiles_cube(self.low, self.high):
            return Verdict(False, "the cells do not tile the cube around the pivot ball")
        slack = proof_slack(chart, self.centre, self.tau, self.low, self.high, self.multipliers)
        if not np.all(slack >= 0):
            return Verdict(False, f"cell {int(np.argmin(slack))} is not proven (slack {float(slack.min()):.3g})")
        return Verdict(True, f"{len(self.low)} cells proven")

    def margin(self, admissible: AdmissibleSet) -> float:
        """Smallest slack of the cells' proofs."""
        chart = GibbsChart.about(admissible, self.pivot_BN, self.scale)
        return float(proof_slack(chart, self.centre, self.tau, self.low, self.high, self.multipliers).min())


def _tiles_cube(low: Array, high: Array) -> bool:
    """Return whether boxes with dyadic corners are disjoint and fill [-1, 1]^3: exact in floating point."""
    size = high - low
    if not (np.all(size > 0) and np.all(low >= -1) and np.all(high <= 1)):
        return False
    overlap = np.minimum(high[:, None], high[None, :]) - np.maximum(low[:, None], low[None, :])
    common = np.all(overlap > 0, axis=-1)
    np.fill_diagonal(common, False)
    return not common.any() and float(np.prod(size, axis=-1).sum()) == 8.0
