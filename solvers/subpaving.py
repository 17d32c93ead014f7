"""Branch and prune: cells of the proven ball that no constraint excludes, twice, and the ball around what is left."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude.gibbs_chart import GibbsChart, fibonacci_directions, smallest_ball
from optsat.attitude.subpaving import CORNERS, chart_point, farthest_level, remaining_cells
from optsat.forms import CoverForm, Point, required
from optsat.solution import Termination


@dataclass(frozen=True)
class SubpavingSolver:
    """Two rounds of pruning. levels : halvings of each round. Source: robust Wahba specification section 7.1."""

    levels: tuple[int, int] = (5, 5)
    name: str = "subpaving"

    def accepts(self, form: object) -> bool:
        """Return whether the form is a cover of a proven ball."""
        return isinstance(form, CoverForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the centre (`x`, quaternion) and in `stats` the second ball and the bound."""
        form = required(form, CoverForm, self.name)
        chart = GibbsChart.about(form.admissible, form.q_BN, form.scale)
        centres, half = remaining_cells(chart, self.levels[0])
        second, second_scale = None, 0.0
        if len(centres):
            middle = _centre(chart, centres, half)
            second = chart.attitude(middle)
            level = farthest_level(chart, centres, half, chart_point(chart, second))
            second_scale = float(chart.scale * np.sqrt(level) * (1 + 1e-10))
            chart = GibbsChart.about(form.admissible, second, second_scale)
            centres, half = remaining_cells(chart, self.levels[1])
        if not len(centres):
            return Point(x=form.q_BN, dual=np.zeros(0), termination=Termination.STALLED)
        q_BN = chart.attitude(_centre(chart, centres, half))
        level = farthest_level(chart, centres, half, chart_point(chart, q_BN))
        return Point(
            x=q_BN,
            dual=np.zeros(0),
            termination=Termination.CONVERGED,
            iterations=sum(self.levels),
            stats={
                "levels": self.levels,
                "second_BN": second,
                "second_scale": second_scale,
                "bound_rad": float(2 * np.arctan(chart.scale * np.sqrt(level))),
                "cells": len(centres),
            },
        )


def _centre(chart: GibbsChart, centres: Array, half: float) -> Array:
    corners = (centres[:, None, :] + half * CORNERS).reshape(-1, 3)
    if len(corners) > 4000:
        # only outer corners shape the ball: keep the extreme one along each of many directions
        corners = corners[np.unique(np.argmax(fibonacci_directions(512) @ corners.T, axis=1))]
    return smallest_ball(corners, chart.scale)
