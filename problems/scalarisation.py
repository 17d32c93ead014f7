"""Scalarisation: one problem out of several objectives, whose solution is one point of their Pareto front."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.forms import MinMaxForm, Point
from optsat.problems.attainment import Attainment, attained
from optsat.problems.feasible_region import named_rows
from optsat.problems.multi_objective import MultiObjective
from optsat.smooth_map import CallableMap, SmoothMap, SymbolicMap
from optsat.solution import Solution


@dataclass(frozen=True)
class Scalarisation:
    """A min-max form over the objectives of another problem; `x` and the constraints stay what they are there.

    form, names : as of every min-max problem; the objectives of its answers are those of the form
    """

    form: MinMaxForm
    names: tuple[str, ...]

    def lower(self) -> MinMaxForm:
        """Return the min-max form."""
        return self.form

    def interpret(self, point: Point, solver: str) -> Solution[Attainment]:
        """Return the attainment re-evaluated at the point, with what is proven there."""
        return attained(self.form, self.names, point, solver)


def weighted_sum(problem: MultiObjective, weights: Array, start: Array) -> Scalarisation:
    """Return: minimise weights . F(x). With all weights > 0 its optimum is Pareto optimal.

    weights (k,) >= 0; start (n,). Source: Geoffrion (1968).
    """
    return _over(problem, _with_sum(problem.form, weights), [0], [0.0], [1.0], start)


def bounded(problem: MultiObjective, weights: Array, upper: Array, start: Array) -> Scalarisation:
    """Return: minimise weights . F(x) subject to F_i(x) <= upper_i where that is finite: the epsilon constraint.

    weights (k,) > 0, small but for the objective that is minimised; upper (k,); start (n,)
    Source: Haimes, Lasdon & Wismer (1971); Mavrotas (2009) for the small weights.
    """
    given = np.flatnonzero(np.isfinite(upper))
    rows = [0, *(1 + given).tolist()]
    levels, widths = [0.0, *upper[given].tolist()], [1.0, *[0.0] * len(given)]
    return _over(problem, _with_sum(problem.form, weights), rows, levels, widths, start)


def along(problem: MultiObjective, place: Array, direction: Array, start: Array) -> Scalarisation:
    """Return: minimise t subject to F(x) <= place + t direction: normal-boundary intersection.

    place (k,) : on the plane through the anchors; direction (k,) > 0 : against the way to go; start (n,)
    Das and Dennis demand equality. With <= convex objectives stay a convex problem, every answer is at least weakly
    Pareto optimal, and where all rows press it is theirs.

    Source: Das & Dennis (1998); Pascoletti & Serafini (1984).
    """
    count = problem.form.objectives.size
    return _over(problem, problem.form.objectives, range(count), place.tolist(), direction.tolist(), start)


def _over(
    problem: MultiObjective,
    objectives: SmoothMap,
    rows: Sequence[int],
    levels: Sequence[float],
    widths: Sequence[float],
    start: Array,
) -> Scalarisation:
    base = problem.form
    form = replace(
        base,
        objectives=objectives,
        objective=np.array(rows, dtype=np.intp),
        sign=np.ones(len(rows)),
        level=np.array(levels),
        weight=np.array(widths),
        start=np.clip(start, base.lower, base.upper),
    )
    own = named_rows(form, 0)[: len(rows)]
    return Scalarisation(form, (*own, *problem.names[len(base.weight) :]))


def _with_sum(form: MinMaxForm, weights: Array) -> SmoothMap:
    """Return weights . F, then F itself."""
    objectives, lower, upper = form.objectives, form.lower, form.upper
    if isinstance(objectives, SymbolicMap):
        return SymbolicMap(_sum_function(objectives.function), np.concatenate((objectives.p, weights)))

    def values(x: Array) -> Array:
        F = objectives.values(x)
        return np.append(weights @ F, F)

    return CallableMap(values, 1 + objectives.size, lower, upper)


# weights are parameters of one Function, so that its derivatives and solvers serve the whole front
@lru_cache(maxsize=64)
def _sum_function(function: Any) -> Any:
    import casadi as ca

    kind: Any = ca.SX if function.is_a("SXFunction") else ca.MX
    x, p = kind.sym("x", function.size1_in(0)), kind.sym("p", function.size1_in(1))
    weights = kind.sym("weights", function.size1_out(0))
    F = function(x, p)
    return ca.Function("with_sum", [x, ca.vertcat(p, weights)], [ca.densify(ca.vertcat(ca.dot(weights, F), F))])
