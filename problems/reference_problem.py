"""Reference problem: a min-max problem of the literature with its start and best known value, to judge solvers by."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import ArrayLike

from optsat.problems.goal_attainment import GoalAttainment
from optsat.problems.minimax import Minimax


@dataclass(frozen=True)
class ReferenceProblem:
    """One problem: objectives as CasADi expressions of x, its usual start and its least factor.

    published : as printed in the source, NaN where it prints none; optimum : re-solved from many starts
    doubt : where the two differ, what was found out about it; empty where the printed figure reproduces
    options : further arguments of Minimax, or of GoalAttainment where they name goals
    convex : all rows are convex, so that a global proof exists
    """

    name: str
    objectives: Callable[[Any], Sequence[Any]] = field(repr=False)
    start: tuple[float, ...]
    published: float
    optimum: float
    source: str
    options: dict[str, Any] = field(default_factory=dict, repr=False)
    convex: bool = False
    doubt: str = ""

    def problem(self, start: ArrayLike | None = None) -> Minimax | GoalAttainment:
        """Return the problem on SX symbols, from its usual start or another (n,)."""
        import casadi as ca

        x = ca.SX.sym("x", len(self.start))
        kind = GoalAttainment if "goals" in self.options else Minimax
        return kind(x, list(self.objectives(x)), start=self.start if start is None else start, **self.options)
