"""Subpaving certificate: two rounds of pruning, checked by running them again."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.gibbs_chart import GibbsChart
from optsat.attitude.subpaving import chart_point, farthest_level, remaining_cells
from optsat.certificates.attitude_bound import ball_of, sum_about
from optsat.certificates.certificate import Verdict


@dataclass(frozen=True)
class Subpaving:
    """Two rounds of pruning: the pivot ball of Theorem 1, then the ball around what the first round left.

    pivot_BN, pivot_weights, scale : first ball; levels : halvings of each round
    second_BN (4,), second_scale : second ball, None for one round; centre_BN (4,) : centre of the bound; bound_rad
    [rad]
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
