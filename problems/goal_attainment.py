"""Goal attainment: the point whose objectives miss their goals least, in units of their weights."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import finite_array
from optsat.errors import InputError, explain_unknown_fields
from optsat.problems.multi_objective import GoalRows, MultiObjective


@explain_unknown_fields
@dataclass(frozen=True)
class GoalAttainment(MultiObjective):
    """Minimise t over x and t subject to F_i(x) - goal_i <= w_i t and the constraints.

    The arguments are those of `optsat.goal_attain`, which explains them.

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    """

    goals: ArrayLike
    weights: ArrayLike | None = None
    _: KW_ONLY
    absolute: bool | Sequence[int] = ()
    exact: Sequence[int] = ()

    def _rows(self, count: int) -> GoalRows:
        return goal_rows(self.goals, self.weights, self.absolute, self.exact, count)


def goal_rows(
    goals: ArrayLike, weights: ArrayLike | None, absolute: bool | Sequence[int], exact: Sequence[int], k: int
) -> GoalRows:
    """Return the rows of goals and weights as a user gives them.

    Raises
    ------
    InputError : wrong lengths, not finite, an index out of range, or no weight other than 0.
    """
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
    return GoalRows(objective, sign, sign * goal[objective], np.abs(weight)[objective])


def _indices(name: str, value: Any, k: int) -> set[int]:
    result = set()
    for item in value:
        if isinstance(item, bool | float) or not 0 <= int(item) < k:
            raise InputError(f"`{name}` must hold indices of objectives in 0..{k - 1}, got {item!r}.")
        result.add(int(item))
    return result
