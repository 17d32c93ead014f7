"""Attainment: a point of a min-max form re-evaluated, with what the first-order conditions and a dual bound prove."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from optsat.arrays import Array
from optsat.certificates.dual_bound import dual_bound
from optsat.certificates.first_order import FirstOrder, first_order
from optsat.convex_rows import convex_rows
from optsat.forms import MinMaxForm, Point
from optsat.solution import Proof, Solution, Termination

# relative to the size of a bound, at least 1
FEASIBLE = 1e-8
# of the KKT residual
STATIONARY = 1e-6
# of the gap between the factor and its dual bound, relative to the factor (at least 1)
GLOBAL = 1e-7
# slack, relative to the size of the bound, below which a row is listed as active
_ACTIVE = 1e-6


@dataclass(frozen=True)
class Attainment:
    """Answer of goal attainment and of minimax, every number re-evaluated at x.

    x (n,); objectives (k,) : F(x)
    factor : attainment factor, the least t with F_i - goal_i <= weight_i t; < 0 over-achieved, 0 met, > 0 missed.
    Of minimax: the largest objective
    active : indices of the objectives that determine the factor; active_constraints : names of what else holds x
    multipliers, multipliers_below (k,) >= 0 : of F_i - goal_i <= w_i t, and of the row from below where there is one;
    sum of |w_i| (multipliers_i + multipliers_below_i) = 1
    constraint_multipliers, linear_multipliers (A rows, then Aeq rows), bound_multipliers : positive where an upper
    bound presses, negative where a lower one does
    violated : names of what is not satisfied, with how much is missing
    conflicting : where no feasible point was found, names of the constraints that stand against each other
    """

    x: Array
    objectives: Array
    factor: float
    active: tuple[int, ...]
    active_constraints: tuple[str, ...]
    multipliers: Array
    multipliers_below: Array
    constraint_multipliers: Array
    linear_multipliers: Array
    bound_multipliers: Array
    violated: Mapping[str, float]
    dual: Array = field(repr=False)
    conflicting: tuple[str, ...] = ()

    def message(self) -> str:
        """Return the result in one sentence."""
        if self.violated:
            worst = ", ".join(f"{name} by {amount:.3g}" for name, amount in self.violated.items())
            conflict = f" These stand against each other: {', '.join(self.conflicting)}." if self.conflicting else ""
            return f"No point was found that satisfies all constraints; the nearest one violates {worst}.{conflict}"
        return f"Attainment factor {self.factor:.9g}, determined by the objectives {list(self.active)}."


class MinMaxProblem(Protocol):
    """A problem that is a min-max form with names for its rows."""

    @property
    def form(self) -> MinMaxForm:
        """The min-max form."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all entries of the form's `dual`, as a user knows them."""
        ...

    def lower(self) -> MinMaxForm:
        """Return the min-max form."""
        ...

    def interpret(self, point: Point, solver: str) -> Solution[Attainment]:
        """Return the attainment at the point."""
        ...


def attained(form: MinMaxForm, names: Sequence[str], point: Point, solver: str) -> Solution[Attainment]:
    """Return the attainment re-evaluated at the point, with what is proven there.

    names : of all entries of the form's `dual`
    """
    x = np.clip(np.where(np.isfinite(point.x), point.x, form.start), form.lower, form.upper)
    objectives = form.objectives.values(x)
    stats = {"solver": solver, "iterations": point.iterations, **point.stats}
    if not (np.all(np.isfinite(objectives)) and np.all(np.isfinite(form.constraints.values(x)))):
        answer = _answer(form, names, x, objectives, None)
        return Solution(answer, Termination.NUMERICAL_ERROR, Proof.NOTHING, {"kkt": np.inf}, None, stats)
    state = first_order(form, x, point.dual)
    residuals = _residuals(form, state)
    proof = Proof.NOTHING
    if state.violation <= FEASIBLE:
        proof = Proof.STATIONARY if state.residual <= STATIONARY else Proof.FEASIBLE
        convex = convex_rows(form)
        if convex is not None:
            factor = form.factor(objectives)
            residuals["gap"] = factor - dual_bound(form, convex, state, x)
            if residuals["gap"] <= GLOBAL * max(1.0, abs(factor)):
                proof = Proof.GLOBAL
    return Solution(
        answer=_answer(form, names, x, objectives, state),
        termination=point.termination,
        proof=proof,
        residuals=residuals,
        stats=stats,
    )


def _answer(
    form: MinMaxForm, names: Sequence[str], x: Array, objectives: Array, state: FirstOrder | None
) -> Attainment:
    counts = (len(form.weight), form.constraints.size, len(form.A), len(x))
    dual = np.zeros(sum(counts)) if state is None else state.dual
    rows, constraints, linear, bound = np.split(dual, np.cumsum(counts)[:-1])
    at_most, at_least = (np.zeros(len(objectives)) for _ in range(2))
    np.add.at(at_most, form.objective[form.sign > 0], rows[form.sign > 0])
    np.add.at(at_least, form.objective[form.sign < 0], rows[form.sign < 0])
    active: list[int] = []
    held: list[str] = []
    violated: dict[str, float] = {}
    if state is not None:
        slack, place = state.rows.slack / state.rows.scale, state.rows.place
        soft = state.rows.weight > 0
        pressing = np.abs(slack) <= _ACTIVE
        active = sorted(set(form.objective[place[soft & pressing]].tolist()))
        held = list(dict.fromkeys(names[i] for i in sorted({int(i) for i in place[~soft & pressing]})))
        for i in np.argsort(slack):
            if slack[i] < -FEASIBLE:
                violated.setdefault(names[int(place[i])], float(-state.rows.slack[i]))
    return Attainment(
        x=x,
        objectives=objectives,
        factor=form.factor(objectives),
        active=tuple(active),
        active_constraints=tuple(held),
        multipliers=at_most,
        multipliers_below=at_least,
        constraint_multipliers=constraints,
        linear_multipliers=linear,
        bound_multipliers=bound,
        violated=violated,
        dual=dual,
    )


def _residuals(form: MinMaxForm, state: FirstOrder) -> dict[str, float]:
    hard = (state.rows.place < len(form.weight)) & (state.rows.weight == 0)
    return {
        "kkt": state.residual,
        "stationarity": state.stationarity,
        "complementarity": state.complementarity,
        "violation": state.violation,
        "hard_goal_violation": float(np.max(-state.rows.slack[hard], initial=0.0)),
        "solver_weight_sum": state.weight_sum,
    }
