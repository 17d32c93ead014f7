"""Pareto sweep: the front of two or three objectives, point by point, each from where the last one stood."""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, Literal, Unpack, get_args

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array
from optsat.attain_runs import Engine, best_attainment
from optsat.errors import InputError, NotProvenError, explain_unknown_options, nearest_name
from optsat.problems.attainment import Attainment
from optsat.problems.minimax import Minimax
from optsat.problems.multi_objective import RegionOptions
from optsat.problems.pareto_front import ParetoFront, ParetoPoint, Verdict, judged
from optsat.problems.scalarisation import Scalarisation, along, bounded, weighted_sum
from optsat.solution import Proof, Solution

Method = Literal["weights", "epsilon_constraint", "normal_boundary"]

# weight, in shares of the ranges, of objectives that only decide between equals, so that no point is weakly optimal;
# smaller ones drown in the accuracy of the solvers
_TIE = 1e-4
# of the size of an objective: a smaller range means that it does not conflict with the others
_NO_RANGE = 1e-9
_FEASIBLE = (Proof.FEASIBLE, Proof.STATIONARY, Proof.GLOBAL)
_POINTS = {2: 21, 3: 9}


@explain_unknown_options
def pareto_sweep(
    x: Any,
    objectives: Any,
    *,
    method: Method = "normal_boundary",
    points: int | None = None,
    start: ArrayLike | None = None,
    starts: int = 1,
    seed: int = 0,
    engine: Engine = "auto",
    **region: Unpack[RegionOptions],
) -> ParetoFront:
    """Return the Pareto front of two or three objectives that are all to be small.

    method : "weights" minimises weighted sums, quick, blind to parts where the front is not convex;
    "epsilon_constraint" minimises the first objective under bounds on the others, even in these;
    "normal_boundary" goes from evenly spread places between the anchors towards the front, even along it
    points : along each edge of the front, anchors included; 21 for two objectives, 9 for three, when None. Of three
    objectives the sweep has points (points + 1) / 2 points, of "epsilon_constraint" points squared
    start : (n,) of the anchors; starts, seed : number of starts of every point, the others from a Sobol sequence over
    the bounds, the same in every run
    x, engine, lb, ub, A, b, Aeq, beq, constraints, ..., parameter_values : as of `goal_attain`

    Returns a `ParetoFront`: `points`, each with `x`, `objectives` and the `solution` of its own problem, whose `proof`
    is GLOBAL where all is convex; `anchors`; `left_out` with the dominated and infeasible ones; `plot()`.

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    NotProvenError : no feasible point was found for an anchor.
    Source: Das & Dennis (1998); Miettinen (1999), chapter 3.
    """
    if method not in get_args(Method):
        raise InputError(f"`method` {method!r} is unknown.{nearest_name(str(method), list(get_args(Method)))}")
    problem = Minimax(x, objectives, start=start, **region)
    count = problem.form.objectives.size
    if count not in _POINTS:
        raise InputError(f"`objectives` must be two or three for a sweep, got {count}.")
    if points is None:
        points = _POINTS[count]
    if isinstance(points, bool) or not isinstance(points, int) or points < 2:
        raise InputError(f"`points` must be a whole number >= 2, got {points!r}.")
    sweep = _Sweep(problem, starts, seed, engine)
    anchors, ideal, ranges = sweep.anchors()
    nadir = np.max([each.objectives for each in anchors], axis=0)
    found = list(anchors)
    last = anchors[0]
    for setting, scalarised in _subproblems(problem, method, points, anchors, ideal, ranges):
        point = sweep.point(scalarised, setting, last)
        found.append(point)
        last = point if point.verdict is Verdict.KEPT else last
    kept, left_out = _sorted_out(found, ranges)
    return ParetoFront(kept, anchors, left_out, ideal, nadir, method)


class _Sweep:
    """How every point of one sweep is solved."""

    def __init__(self, problem: Minimax, starts: int, seed: int, engine: Engine) -> None:
        self.problem = problem
        self.starts, self.seed, self.engine = starts, seed, engine

    def solved(self, subproblem: Scalarisation, warm: Solution[Attainment] | None = None) -> Solution[Attainment]:
        return best_attainment(subproblem, warm, self.starts, self.seed, self.engine)

    def point(self, subproblem: Callable[[Array], Scalarisation], setting: Array, last: ParetoPoint) -> ParetoPoint:
        """Return the point of a subproblem, started where the last one stood."""
        return self._read(self.solved(subproblem(last.x), last.solution), setting, None)

    def anchors(self) -> tuple[tuple[ParetoPoint, ...], Array, Array]:
        """Return the anchors, the ideal point and the ranges (k,) > 0 of the objectives.

        Each objective is minimised alone, then with a touch of the others, which decides between equals.
        """
        form = self.problem.form
        alone = []
        for i, weights in enumerate(np.eye(form.objectives.size)):
            found = self.solved(weighted_sum(self.problem, weights, form.start))
            if found.proof not in _FEASIBLE:
                raise NotProvenError(
                    f"Objective {i} has no anchor, so there is no front to sweep. {found.answer.message()}", found
                )
            alone.append(found.answer.x)
        # the start tells the size of an objective that is least at all of these points
        ranges = _ranges(np.array([form.objectives.values(x) for x in (form.start, *alone)]))
        anchors = []
        for i in range(len(alone)):
            # the next objective before the one after it, so that objectives which can all be least along an edge of the
            # front get anchors at different ends
            order = (np.arange(len(ranges)) - i) % len(ranges)
            weights = np.where(order == 0, 1.0, _TIE * 0.1 ** (order - 1) * ranges[i] / ranges)
            tried = [self.solved(weighted_sum(self.problem, weights, x)) for x in (form.start, *alone)]
            found = min(tried, key=lambda each: each.answer.factor if each.proof in _FEASIBLE else np.inf)
            anchors.append(self._read(found, weights, i))
            if found.proof not in (Proof.STATIONARY, Proof.GLOBAL):
                warnings.warn(
                    f"The anchor of objective {i} is not known to be stationary ({found.termination.value}); the front "
                    "may go on beyond it. Is the objective bounded below?",
                    stacklevel=4,
                )
        F = np.array([each.objectives for each in anchors])
        return tuple(anchors), np.min(F, axis=0), _ranges(F)

    def _read(self, solution: Solution[Attainment], setting: Array, anchor: int | None) -> ParetoPoint:
        verdict = Verdict.KEPT if solution.proof in _FEASIBLE else Verdict.INFEASIBLE
        x = solution.answer.x
        return ParetoPoint(x, self.problem.form.objectives.values(x), setting, solution, verdict, anchor)


def _ranges(F: Array) -> Array:
    """Return the range of each objective over points (m, k), 1 where it has none."""
    ranges = np.max(F, axis=0) - np.min(F, axis=0)
    return np.where(ranges > _NO_RANGE * np.maximum(1.0, np.max(np.abs(F), axis=0)), ranges, 1.0)


def _subproblems(
    problem: Minimax, method: Method, points: int, anchors: tuple[ParetoPoint, ...], ideal: Array, ranges: Array
) -> Iterator[tuple[Array, Callable[[Array], Scalarisation]]]:
    """Yield each setting with what makes its problem from a start, neighbours after each other; no anchors."""
    count = len(ranges)
    F = np.array([each.objectives for each in anchors])
    if method == "epsilon_constraint":
        weights = np.append(1.0, _TIE * ranges[0] / ranges[1:])
        for share in _grid(points, count - 1):
            upper = np.append(np.inf, ideal[1:] + share * ranges[1:])
            yield upper, partial(bounded, problem, weights, upper)
        return
    direction = np.mean(F - ideal, axis=0)
    direction = np.where(direction > 0, direction, ranges)
    for share in _simplex(points, count):
        if np.max(share) == 1.0:
            continue
        if method == "weights":
            weights = np.maximum(share, _TIE) / ranges
            yield weights, partial(weighted_sum, problem, weights)
        else:
            yield share @ F, partial(along, problem, share @ F, direction)


def _simplex(points: int, count: int) -> Array:
    """Return shares (m, count) >= 0 of sum 1, `points` along each edge, every other line backwards."""
    last = points - 1
    if count == 2:
        first = np.linspace(1.0, 0.0, points)
        return np.column_stack((first, 1.0 - first))
    lines = [[(last - i, j, i - j) for j in range(i + 1)] for i in range(points)]
    return np.array([each for i, line in enumerate(lines) for each in (line[::-1] if i % 2 else line)]) / last


def _grid(points: int, count: int) -> Array:
    """Return places (m, count) in the unit cube from 1 down to 0, every other line backwards."""
    line = np.linspace(1.0, 0.0, points)
    if count == 1:
        return line[:, None]
    return np.array([(a, b) for i, a in enumerate(line) for b in (line[::-1] if i % 2 else line)])


def _sorted_out(found: list[ParetoPoint], ranges: Array) -> tuple[tuple[ParetoPoint, ...], tuple[ParetoPoint, ...]]:
    feasible = np.array([each.verdict is Verdict.KEPT for each in found])
    verdicts = judged(np.array([each.objectives for each in found]), feasible, ranges)
    told = [replace(each, verdict=verdict) for each, verdict in zip(found, verdicts, strict=True)]
    kept = [each for each in told if each.verdict is Verdict.KEPT]
    kept.sort(key=lambda each: tuple(each.objectives))
    return tuple(kept), tuple(each for each in told if each.verdict is not Verdict.KEPT)
