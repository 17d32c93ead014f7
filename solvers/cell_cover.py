"""Adaptive cells: a small semidefinite programme each; the worst is halved until the bound meets samples."""

import heapq
from dataclasses import dataclass, field

import numpy as np

from optsat.arrays import Array
from optsat.attitude.gibbs_chart import (
    GibbsChart,
    ball_levels,
    ball_matrices,
    boundary_points,
    fibonacci_directions,
    interior_point,
    slab_matrices,
    smallest_ball,
)
from optsat.forms import ConeKind, ConicForm, CoverForm, Point, required, symmetric_vector
from optsat.solution import Termination
from optsat.solvers.clarabel import Clarabel


@dataclass(frozen=True)
class CellCoverSolver:
    """Branch and bound over cells of the pivot ball.

    cells : most programmes that are solved; gap : stop when bound / sampled radius is below 1 + gap
    rays : directions along which the admissible set is sampled for centre and stopping rule
    Source: robust Wahba specification section 7.1, made adaptive.
    """

    cells: int = 64
    gap: float = 0.02
    rays: int = 512
    conic: Clarabel = field(default_factory=lambda: Clarabel(tolerance=1e-8, prescaled=True))
    name: str = "cell_cover"

    def accepts(self, form: object) -> bool:
        """Return whether the form is a cover of a proven ball."""
        return isinstance(form, CoverForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the centre (`x`, chart point) and the cells: `stats` low, high, multipliers, tau, sampled."""
        form = required(form, CoverForm, self.name)
        chart = GibbsChart.about(form.admissible, form.q_BN, form.scale)
        centre, sampled = sampled_ball(chart, self.rays)
        target = max(sampled, 1e-6)
        root = (np.full(3, -1.0), np.full(3, 1.0))
        tau, multipliers = self._bound(chart, centre, target, *root)
        # worst first; the counter breaks ties so that the order is the same on every machine
        queue = [(-tau, 0, root, multipliers)]
        solved = 1
        while -queue[0][0] > target * (1 + self.gap) ** 2 and solved + 2 <= self.cells:
            _, _, (low, high), _ = heapq.heappop(queue)
            axis = int(np.argmax(high - low))
            middle = (low[axis] + high[axis]) / 2
            for half in (0, 1):
                cell = (low.copy(), high.copy())
                cell[1 - half][axis] = middle
                tau, multipliers = self._bound(chart, centre, target, *cell)
                heapq.heappush(queue, (-tau, solved, cell, multipliers))
                solved += 1
        leaves = sorted(queue, key=lambda leaf: leaf[1])
        return Point(
            x=centre,
            dual=np.stack([leaf[3] for leaf in leaves]),
            termination=Termination.CONVERGED if solved + 2 <= self.cells else Termination.MAX_ITERATIONS,
            iterations=solved,
            stats={
                "low": np.stack([leaf[2][0] for leaf in leaves]),
                "high": np.stack([leaf[2][1] for leaf in leaves]),
                "tau": -queue[0][0],
                "sampled_tau": sampled,
            },
        )

    def _bound(self, chart: GibbsChart, centre: Array, target: float, low: Array, high: Array) -> tuple[float, Array]:
        """Minimise tau >= target over y >= 0 with tau D - N - sum y_j Q_j >= 0."""
        N, D = ball_matrices(centre, chart.scale)
        Q = np.concatenate((chart.matrices(), slab_matrices(low, high)))
        count = len(Q)
        A = np.zeros((count + 11, count + 1))
        A[0, 0] = -1.0
        A[1 : count + 1, 1:] = -np.eye(count)
        A[count + 1 :, 0] = -symmetric_vector(D)
        A[count + 1 :, 1:] = symmetric_vector(Q).T
        b = np.concatenate(([-target], np.zeros(count), -symmetric_vector(N)))
        q = np.zeros(count + 1)
        q[0] = 1.0
        cones: tuple[tuple[ConeKind, int], ...] = (("nonnegative", count + 1), ("psd_triangle", 4))
        point = self.conic.run(ConicForm(q, A, b, cones))
        corners = np.array(
            [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
        )
        farthest = float(np.max(ball_levels(corners, centre, chart.scale)))
        if np.all(np.isfinite(point.x)) and point.x[0] < farthest:
            return float(max(point.x[0], target)), np.maximum(point.x[1:], 0.0)
        # the programme failed: each slab by itself proves its farther face, exactly so at these multipliers
        half = (high - low) / 2
        fallback = np.zeros(count)
        fallback[-4:-1] = 1 + np.abs((low + high) / 2 - centre) / half
        return farthest, fallback * (1 + chart.scale**2 * (farthest + float(centre @ centre)))


def sampled_ball(chart: GibbsChart, rays: int) -> tuple[Array, float]:
    """Return a centre (chart point) and the largest level of sampled boundary points.

    The pivot and 0 when none was found.
    """
    inside = interior_point(chart)
    if inside is None:
        return np.zeros(3), 0.0
    points = boundary_points(chart, inside, fibonacci_directions(rays))
    points = points[np.linalg.norm(points, axis=1) <= 1.0 + 1e-6]
    if len(points) < 4:
        return np.zeros(3), 0.0
    centre = smallest_ball(points, chart.scale)
    return centre, float(np.max(ball_levels(points, centre, chart.scale)))
