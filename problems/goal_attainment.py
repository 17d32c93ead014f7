"""Goal attainment: the point whose objectives miss their goals least, in units of their weights."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.attitude.backend import is_symbolic
from optsat.certificates.dual_bound import dual_bound
from optsat.certificates.first_order import FirstOrder, first_order
from optsat.convex_rows import convex_rows
from optsat.errors import InputError, explain_unknown_fields
from optsat.forms import MinMaxForm, Point
from optsat.problems.feasible_region import bounds, linear_rows, named_rows
from optsat.problems.user_function import Unknowns, count_of, parameter_values, smooth_map
from optsat.smooth_map import no_values
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


@explain_unknown_fields
@dataclass(frozen=True)
class GoalAttainment:
    """Minimise t over x and t subject to F_i(x) - goal_i <= w_i t and the constraints.

    The arguments are those of `optsat.goal_attain`, which explains them.

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    """

    x: Any
    objectives: Any
    goals: ArrayLike
    weights: ArrayLike | None = None
    absolute: bool | Sequence[int] = ()
    exact: Sequence[int] = ()
    lb: ArrayLike | None = None
    ub: ArrayLike | None = None
    A: ArrayLike | None = None
    b: ArrayLike | None = None
    Aeq: ArrayLike | None = None
    beq: ArrayLike | None = None
    constraints: Any = None
    constraints_lb: ArrayLike | None = None
    constraints_ub: ArrayLike | None = None
    parameters: Any = None
    parameter_values: ArrayLike | None = None
    start: ArrayLike | None = None
    form: MinMaxForm = field(init=False, repr=False)
    names: tuple[str, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        unknowns = self._unknowns()
        linear = linear_rows(self.A, self.b, self.Aeq, self.beq, unknowns.n)
        objectives = smooth_map("objectives", self.objectives, unknowns)
        if objectives.size == 0:
            raise InputError("`objectives` is empty; at least one is needed.")
        constraints = no_values(objectives, unknowns.lower, unknowns.upper)
        if self.constraints is not None:
            constraints = smooth_map("constraints", self.constraints, unknowns)
        low, high = self.constraints_lb, self.constraints_ub
        if self.constraints is None and (low is not None or high is not None):
            raise InputError("`constraints_lb` and `constraints_ub` need `constraints`.")
        if low is None and high is None:
            high = 0.0
        constraint_bounds = bounds(("constraints_lb", "constraints_ub"), low, high, constraints.size)
        rows = _goal_rows(self.goals, self.weights, self.absolute, self.exact, objectives.size)
        form = MinMaxForm(
            objectives=objectives,
            objective=rows[0],
            sign=rows[1],
            level=rows[2],
            weight=rows[3],
            constraints=constraints,
            constraint_lower=constraint_bounds[0],
            constraint_upper=constraint_bounds[1],
            A=linear.A,
            linear_lower=linear.lower,
            linear_upper=linear.upper,
            lower=unknowns.lower,
            upper=unknowns.upper,
            start=unknowns.start,
        )
        object.__setattr__(self, "form", form)
        object.__setattr__(self, "names", tuple(named_rows(form, linear.inequalities)))

    def _unknowns(self) -> Unknowns:
        n = count_of(self.x)
        symbolic = is_symbolic(self.x)
        if self.parameters is not None and not symbolic:
            raise InputError("`parameters` are symbols of expressions; with functions give `parameter_values` alone.")
        lower, upper = bounds(("lb", "ub"), self.lb, self.ub, n)
        if self.start is not None:
            # one unknown may start from a plain number
            start = finite_array("start", np.reshape(self.start, -1) if np.ndim(self.start) == 0 else self.start, (n,))
        elif symbolic:
            between = np.isfinite(lower) & np.isfinite(upper)
            start = np.where(between, np.where(between, lower, 0.0) / 2 + np.where(between, upper, 0.0) / 2, 0.0)
        else:
            start = finite_array("x", self.x, (n,))
        return Unknowns(
            n=n,
            symbol=self.x if symbolic else None,
            parameters=self.parameters,
            p=parameter_values(self.parameters, self.parameter_values),
            start=np.clip(start, lower, upper),
            lower=lower,
            upper=upper,
        )

    @property
    def attainment(self) -> "GoalAttainment":
        """The problem itself, as of every min-max problem."""
        return self

    def lower(self) -> MinMaxForm:
        """Return the min-max form."""
        return self.form

    def interpret(self, point: Point, solver: str) -> Solution[Attainment]:
        """Return the attainment re-evaluated at the point, with what the first-order conditions prove there."""
        form = self.form
        x = np.clip(np.where(np.isfinite(point.x), point.x, form.start), form.lower, form.upper)
        objectives = form.objectives.values(x)
        stats = {"solver": solver, "iterations": point.iterations, **point.stats}
        if not (np.all(np.isfinite(objectives)) and np.all(np.isfinite(form.constraints.values(x)))):
            answer = self._answer(x, objectives, None)
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
            answer=self._answer(x, objectives, state),
            termination=point.termination,
            proof=proof,
            residuals=residuals,
            stats=stats,
        )

    def _answer(self, x: Array, objectives: Array, state: FirstOrder | None) -> Attainment:
        form = self.form
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
            held = sorted({self.names[i] for i in place[~soft & pressing]}, key=self.names.index)
            for i in np.argsort(slack):
                if slack[i] < -FEASIBLE:
                    violated.setdefault(self.names[place[i]], float(-state.rows.slack[i]))
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


def _goal_rows(
    goals: ArrayLike, weights: ArrayLike | None, absolute: bool | Sequence[int], exact: Sequence[int], k: int
) -> tuple[Any, Array, Array, Array]:
    """Return objective, sign, level and weight of the rows."""
    goal = finite_array("goals", goals)
    if goal.shape == ():
        goal = np.full(k, float(goal))
    if goal.shape != (k,):
        raise InputError(f"`goals` must hold one goal per objective: shape ({k},), got {goal.shape}.")
    weight = np.ones(k) if weights is None else finite_array("weights", weights)
    if weight.shape == ():
        weight = np.full(k, float(weight))
    if weight.shape != (k,):
        raise InputError(f"`weights` must hold one weight per objective: shape ({k},), got {weight.shape}.")
    two_sided = set(range(k)) if absolute is True else _indices("absolute", absolute or (), k)
    equal = _indices("exact", exact, k)
    weight = np.where([i in equal for i in range(k)], 0.0, weight)
    if not np.any(weight):
        raise InputError(
            "`weights` are all zero, so every goal is a hard constraint and nothing is left to minimise; "
            "give at least one objective that is not `exact` a weight other than 0."
        )
    rows = [
        (i, sign)
        for i in range(k)
        for sign in (1.0, -1.0)
        if i in two_sided | equal or sign == (-1.0 if weight[i] < 0 else 1.0)
    ]
    objective = np.array([i for i, _ in rows], dtype=np.intp)
    sign = np.array([side for _, side in rows])
    return objective, sign, sign * goal[objective], np.abs(weight)[objective]


def _indices(name: str, value: Any, k: int) -> set[int]:
    result = set()
    for item in value:
        if isinstance(item, bool | float) or not 0 <= int(item) < k:
            raise InputError(f"`{name}` must hold indices of objectives in 0..{k - 1}, got {item!r}.")
        result.add(int(item))
    return result
