"""Minimax: the point whose largest objective is least."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

from optsat.errors import explain_unknown_fields
from optsat.problems.goal_attainment import goal_rows
from optsat.problems.multi_objective import GoalRows, MultiObjective


@explain_unknown_fields
@dataclass(frozen=True)
class Minimax(MultiObjective):
    """Minimise max_i F_i(x), or |F_i(x)| for the objectives `absolute`, subject to the constraints.

    Goal attainment with goals 0 and weights 1. The arguments are those of `optsat.minimax`, which explains them.

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    """

    _: KW_ONLY
    absolute: bool | Sequence[int] = ()

    def _rows(self, count: int) -> GoalRows:
        return goal_rows(0.0, 1.0, self.absolute, (), count)
