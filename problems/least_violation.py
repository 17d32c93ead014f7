"""Least violation: the point that comes nearest to satisfying all constraints, and which of them conflict there."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.certificates.dual_bound import dual_bound
from optsat.certificates.first_order import FirstOrder, first_order
from optsat.convex_rows import convex_rows
from optsat.forms import MinMaxForm, Point
from optsat.problems.attainment import FEASIBLE, Attainment, MinMaxProblem
from optsat.smooth_map import CallableMap, SmoothMap, SymbolicMap, no_values
from optsat.solution import Proof, Solution

# multipliers above this share of the largest name a constraint as part of the conflict
_SHARE = 1e-6


@dataclass(frozen=True)
class LeastViolation:
    """Minimise the largest violation of a problem's constraints, each relative to the size of its bound (at least 1).

    Bounds on x are kept. The answer is that of the problem itself: INFEASIBLE when it is convex and the dual bound of
    the least violation is positive, NOTHING when the violation is merely stationary.
    """

    problem: MinMaxProblem
    form: MinMaxForm = field(init=False, repr=False)
    places: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        form, places = _relaxed(self.problem.form)
        object.__setattr__(self, "form", form)
        object.__setattr__(self, "places", places)

    @property
    def vacuous(self) -> bool:
        """Whether the problem has no constraint but bounds, which are never violated."""
        return len(self.form.weight) == 0

    def lower(self) -> MinMaxForm:
        """Return the min-max form of the violations."""
        return self.form

    def interpret(self, point: Point, solver: str) -> Solution[Attainment]:
        """Return the problem's own answer at the point, with the conflict named where it is infeasible."""
        there = replace(point, dual=np.zeros(0))
        found = self.problem.interpret(there, solver)
        x = found.answer.x
        violations = self.form.objectives.values(x)
        if found.proof is not Proof.NOTHING or not np.all(np.isfinite(violations)):
            return found
        state = first_order(self.form, x, point.dual)
        proof, residuals = Proof.NOTHING, {**found.residuals, "violation_kkt": state.residual}
        convex = convex_rows(self.form)
        if convex is not None:
            residuals["least_violation"] = dual_bound(self.form, convex, state, x)
            if residuals["least_violation"] > FEASIBLE:
                proof = Proof.INFEASIBLE
        answer = replace(found.answer, conflicting=self._conflicting(state))
        return replace(found, answer=answer, proof=proof, residuals=residuals)

    def _conflicting(self, state: FirstOrder) -> tuple[str, ...]:
        pressing = state.multipliers > _SHARE * np.max(state.multipliers, initial=0.0)
        names = self.problem.names
        own = len(self.form.weight)
        first_bound = len(names) - len(self.form.lower)
        found = {
            int(self.places[place]) if place < own else first_bound + int(place) - own
            for place in state.rows.place[pressing]
        }
        return tuple(names[i] for i in sorted(found))


def _relaxed(form: MinMaxForm) -> tuple[MinMaxForm, Any]:
    """Return the form of the violations, and for each of its rows the place in the problem's own order."""
    hard = np.flatnonzero(form.weight == 0)
    m, k = len(form.weight), form.objectives.size
    objective = [form.objective[hard]]
    sign, level, places = [form.sign[hard]], [form.level[hard]], [hard]
    for offset, first, lower, upper in (
        (k, m, form.constraint_lower, form.constraint_upper),
        (k + form.constraints.size, m + form.constraints.size, form.linear_lower, form.linear_upper),
    ):
        for bound, side in ((upper, 1.0), (lower, -1.0)):
            given = np.flatnonzero(np.isfinite(bound))
            objective.append(offset + given)
            sign.append(np.full(len(given), side))
            level.append(side * bound[given])
            places.append(first + given)
    levels = np.concatenate(level)
    nothing = np.zeros(0)
    relaxed = MinMaxForm(
        objectives=_together(form),
        objective=np.concatenate(objective),
        sign=np.concatenate(sign),
        level=levels,
        weight=np.maximum(1.0, np.abs(levels)),
        constraints=no_values(form.objectives, form.lower, form.upper),
        constraint_lower=nothing,
        constraint_upper=nothing,
        A=np.zeros((0, len(form.lower))),
        linear_lower=nothing,
        linear_upper=nothing,
        lower=form.lower,
        upper=form.upper,
        start=form.start,
    )
    return relaxed, np.concatenate(places)


def _together(form: MinMaxForm) -> SmoothMap:
    """Return objectives, constraints and linear rows as one map."""
    objectives, constraints, A = form.objectives, form.constraints, form.A
    if isinstance(objectives, SymbolicMap) and isinstance(constraints, SymbolicMap):
        import casadi as ca

        scalar = objectives.function.is_a("SXFunction") and constraints.function.is_a("SXFunction")
        kind: Any = ca.SX if scalar else ca.MX
        x, p = kind.sym("x", len(form.lower)), kind.sym("p", len(objectives.p) + len(constraints.p))
        first, second = p[: len(objectives.p)], p[len(objectives.p) :]
        values = ca.vertcat(objectives.function(x, first), constraints.function(x, second), ca.mtimes(ca.DM(A), x))
        return SymbolicMap(
            ca.Function("violations", [x, p], [ca.densify(values)]), np.concatenate((objectives.p, constraints.p))
        )
    return CallableMap(
        lambda x: np.concatenate((objectives.values(x), constraints.values(x), A @ x)),
        objectives.size + constraints.size + len(A),
        form.lower,
        form.upper,
    )
