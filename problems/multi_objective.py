"""Multi-objective: unknowns, objectives and a feasible region, shared by every problem that weighs objectives."""

from abc import ABC, abstractmethod
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.attitude.backend import is_symbolic
from optsat.errors import InputError
from optsat.forms import MinMaxForm, Point
from optsat.problems.attainment import Attainment, attained
from optsat.problems.feasible_region import bounds, linear_rows, named_rows
from optsat.problems.user_function import Unknowns, count_of, parameter_values, smooth_map
from optsat.smooth_map import no_values
from optsat.solution import Solution


class RegionOptions(TypedDict, total=False):
    """The feasible region and the parameters, as every public verb takes them by name."""

    lb: ArrayLike | None
    ub: ArrayLike | None
    A: ArrayLike | None
    b: ArrayLike | None
    Aeq: ArrayLike | None
    beq: ArrayLike | None
    constraints: Any
    constraints_lb: ArrayLike | None
    constraints_ub: ArrayLike | None
    parameters: Any
    parameter_values: ArrayLike | None


@dataclass(frozen=True)
class GoalRows:
    """Which rows sign F - level <= weight t a problem sets."""

    objective: Any
    sign: Array
    level: Array
    weight: Array


@dataclass(frozen=True)
class MultiObjective(ABC):
    """What all problems with several objectives hold; `optsat.goal_attain` explains the arguments.

    form : the min-max form; names : of all entries of its `dual`, as a user knows them
    """

    x: Any
    objectives: Any
    _: KW_ONLY
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
        rows = self._rows(objectives.size)
        form = MinMaxForm(
            objectives=objectives,
            objective=rows.objective,
            sign=rows.sign,
            level=rows.level,
            weight=rows.weight,
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

    @abstractmethod
    def _rows(self, count: int) -> GoalRows:
        """Return the rows of `count` objectives."""

    def lower(self) -> MinMaxForm:
        """Return the min-max form."""
        return self.form

    def interpret(self, point: Point, solver: str) -> Solution[Attainment]:
        """Return the attainment re-evaluated at the point, with what the first-order conditions prove there."""
        return attained(self.form, self.names, point, solver)
