"""Pareto front: points of which none is better in one objective without being worse in another, each with its proof."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from optsat.arrays import Array, Mask
from optsat.solution import Proof, Solution, Termination

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from optsat.problems.attainment import Attainment

# in shares of the objectives' ranges: what is better by less counts as equal, worse by more as worse
_BETTER, _WORSE = 1e-6, 1e-9


class Verdict(Enum):
    """What became of a point of the sweep."""

    KEPT = "on the front"
    DOMINATED = "another point is better"
    REPEATED = "the same objectives as another point"
    INFEASIBLE = "no feasible point was found"


@dataclass(frozen=True)
class ParetoPoint:
    """One point of a sweep.

    x (n,); objectives (k,) : F(x)
    setting (k,) : the weights; the bounds of the objectives (inf: none); or the place on the plane of the anchors
    solution : of the one problem that gave it, with its proof, residuals and engine runs
    anchor : index of the objective that is least here, None elsewhere
    """

    x: Array
    objectives: Array
    setting: Array
    solution: "Solution[Attainment]"
    verdict: Verdict
    anchor: int | None = None

    @property
    def proof(self) -> Proof:
        """What is proven of the problem that gave the point."""
        return self.solution.proof

    @property
    def termination(self) -> Termination:
        """Why its solver stopped."""
        return self.solution.termination


@dataclass(frozen=True)
class ParetoFront:
    """What `pareto_sweep` returns.

    points : the front in the order of the first objective, then of the others
    anchors : for each objective the point where it is least, on the front or not
    left_out : dominated, repeated and infeasible points
    ideal, nadir (k,) : least and largest value of each objective among the anchors
    """

    points: tuple[ParetoPoint, ...]
    anchors: tuple[ParetoPoint, ...]
    left_out: tuple[ParetoPoint, ...]
    ideal: Array
    nadir: Array
    method: str

    @property
    def x(self) -> Array:
        """Unknowns of the front's points (m, n)."""
        return np.array([point.x for point in self.points])

    @property
    def objectives(self) -> Array:
        """Objectives of the front's points (m, k)."""
        return np.array([point.objectives for point in self.points])

    def plot(self, axes: "Axes | None" = None, names: Sequence[str] = ()) -> "Axes":
        """Return Matplotlib axes with the front, its anchors and the points left out; new ones when None.

        axes : of a three-dimensional projection for three objectives; names : of the objectives

        Raises
        ------
        InputError : axes or names that do not fit the number of objectives.
        """
        from optsat.problems.front_figure import draw_front

        return draw_front(self, axes, names)


def judged(objectives: Array, feasible: Mask, ranges: Array) -> list[Verdict]:
    """Return what becomes of each point (m, k); of equal ones the first is kept.

    ranges (k,) : sizes of the objectives, > 0
    """
    F = objectives / ranges
    verdicts = [Verdict.KEPT if each else Verdict.INFEASIBLE for each in feasible]
    for i in np.flatnonzero(feasible):
        for j in np.flatnonzero(feasible):
            difference = F[j] - F[i]
            if j < i and verdicts[j] is not Verdict.REPEATED and np.all(np.abs(difference) <= _BETTER):
                verdicts[i] = Verdict.REPEATED
                break
            if np.all(difference <= _WORSE) and np.any(difference < -_BETTER):
                verdicts[i] = Verdict.DOMINATED
                break
    return verdicts
