"""Minimax: the point whose largest objective is least."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from numpy.typing import ArrayLike

from optsat.errors import explain_unknown_fields
from optsat.forms import MinMaxForm, Point
from optsat.problems.goal_attainment import Attainment, GoalAttainment
from optsat.solution import Solution


@explain_unknown_fields
@dataclass(frozen=True)
class Minimax:
    """Minimise max_i F_i(x), or |F_i(x)| for the objectives `absolute`, subject to the constraints.

    Goal attainment with goals 0 and weights 1. The arguments are those of `optsat.minimax`, which explains them.

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    """

    x: Any
    objectives: Any
    absolute: bool | Sequence[int] = ()
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
    attainment: GoalAttainment = field(init=False, repr=False)

    def __post_init__(self) -> None:
        given = {each.name: getattr(self, each.name) for each in fields(self) if each.init}
        object.__setattr__(self, "attainment", GoalAttainment(goals=0.0, weights=1.0, **given))

    @property
    def form(self) -> MinMaxForm:
        """The min-max form."""
        return self.attainment.form

    def lower(self) -> MinMaxForm:
        """Return the min-max form."""
        return self.attainment.form

    def interpret(self, point: Point, solver: str) -> Solution[Attainment]:
        """Return the largest objective re-evaluated at the point, with what is proven there."""
        return self.attainment.interpret(point, solver)
