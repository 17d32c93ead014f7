"""Subpaving: cells of a Gibbs chart that no constraint excludes; they hold the admissible set and show its shape.

A cell is dropped only when some constraint is negative on all of it: f(centre) + h |grad f|_1 + h^2 sum |G| < -rounding.
The procedure has no choice in it, so running it again is the check.
"""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.gibbs_chart import GibbsChart, ball_levels
from optsat.certificates.attitude_bound import ball_of, sum_about
from optsat.certificates.certificate import Verdict

_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
_CELL_LIMIT = 60_000


def remaining_cells(chart: GibbsChart, levels: int, pad: float = 1.0 + 1e-9) -> tuple[Array, float]:
    """Return centres (k, 3) and half width of the cells of [-pad, pad]^3 that no constraint excludes.

    Stops halving before more than 60,000 cells would be kept; fewer levels are coarser, never wrong.
    """
    centres, half = np.zeros((1, 3)), pad
    curve = np.abs(chart.G).sum(axis=(1, 2))
    for _ in range(levels):
        if 8 * len(centres) > 8 * _CELL_LIMIT:
            break
        half /= 2
        centres = (centres[:, None, :] + half * _CORNERS).reshape(-1, 3)
        inside = np.linalg.norm(np.maximum(np.abs(centres) - half, 0.0), axis=1) <= pad
        centres = centres[inside]
        slopes = 2 * np.abs(chart.h + np.einsum("nij,kj->kni", chart.G, centres)).sum(axis=-1)
        highest = chart.values(centres) + half * slopes + half**2 * curve
        centres = centres[np.all(highest >= -2 * chart.rounding, axis=1)]
    return centres, half


def farthest_level(chart: GibbsChart, centres: Array, half: float, centre: Array) -> float:
    """Return the largest ball level over all corners of the cells, seen from chart point `centre`."""
    worst = 0.0
    for corner in _CORNERS:
        worst = max(worst, float(np.max(ball_levels(centres + half * corner, centre, chart.scale), initial=0.0)))
    return worst * (1 + 1e-12)


@dataclass(frozen=True)
class Subpaving:
    """Two rounds of pruning: the pivot ball of Theorem 1, then the ball around what the first round left.

    pivot_BN, pivot_weights, scale : first ball; levels : halvings of each round
    second_BN (4,), second_scale : second ball, None for one round; centre_BN (4,) : centre of the bound; bound_rad [rad]
    """

    pivot_BN: Array
    pivot_weights: Array
    scale: float
    levels: tuple[int, int]
    second_BN: Array | None
    second_scale: float
    centre_BN: Array
    bound_rad: float

    def cells(self, admissible: AdmissibleSet) -> tuple[GibbsChart, Array, float]:
        """Return the last chart, the remaining cells' centres (k, 3) and their half width."""
        chart = GibbsChart.about(admissible, self.pivot_BN, self.scale)
        centres, half = remaining_cells(chart, self.levels[0])
        if self.second_BN is None:
            return chart, centres, half
        second = GibbsChart.about(admissible, self.second_BN, self.second_scale)
        return second, *remaining_cells(second, self.levels[1])

    def check(self, admissible: AdmissibleSet) -> Verdict:
        """Run both rounds again and compare."""
        pivot = ball_of(sum_about(admissible, self.pivot_weights / self.pivot_weights.sum(), self.pivot_BN))
        if float(pivot.bound_rad) > 2 * np.arctan(self.scale) * (1 + 1e-12):
            return Verdict(False, "the pivot ball does not hold the admissible set")
        chart = GibbsChart.about(admissible, self.pivot_BN, self.scale)
        centres, half = remaining_cells(chart, self.levels[0])
        if self.second_BN is not None:
            level = farthest_level(chart, centres, half, chart_point(chart, self.second_BN))
            if chart.scale * np.sqrt(level) > self.second_scale * (1 + 1e-9):
                return Verdict(False, "the second ball does not hold what the first round left")
            chart = GibbsChart.about(admissible, self.second_BN, self.second_scale)
            centres, half = remaining_cells(chart, self.levels[1])
        level = farthest_level(chart, centres, half, chart_point(chart, self.centre_BN))
        proven = 2 * np.arctan(chart.scale * np.sqrt(level))
        if proven > self.bound_rad * (1 + 1e-10):
            return Verdict(False, f"recomputed bound {proven:.12g} rad exceeds the claimed {self.bound_rad:.12g} rad")
        return Verdict(True, f"{len(centres)} cells remain")


def chart_point(chart: GibbsChart, q_BN: Array) -> Array:
    """Return the chart point (3,) of an attitude."""
    v, s = chart.q_BN[:3], chart.q_BN[3]
    error = q_BN[3] * -v + s * q_BN[:3] - np.cross(q_BN[:3], -v)
    scalar = q_BN[3] * s + q_BN[:3] @ v
    return np.asarray(error / (scalar * chart.scale))
