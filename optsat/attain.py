"""Attain: goals and worst cases of several objectives, by the first engine whose answer stands re-evaluation."""

import warnings
from collections.abc import Sequence
from typing import Any, Unpack

from numpy.typing import ArrayLike

from optsat.attain_runs import Engine, best_attainment
from optsat.errors import explain_unknown_options
from optsat.problems.attainment import Attainment
from optsat.problems.goal_attainment import GoalAttainment
from optsat.problems.minimax import Minimax
from optsat.problems.multi_objective import MultiObjective, RegionOptions
from optsat.solution import Solution

Start = ArrayLike | Solution[Attainment] | None


@explain_unknown_options
def goal_attain(
    x: Any,
    objectives: Any,
    goals: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    absolute: bool | Sequence[int] = (),
    exact: Sequence[int] = (),
    start: Start = None,
    starts: int = 1,
    seed: int = 0,
    engine: Engine = "auto",
    **region: Unpack[RegionOptions],
) -> Solution[Attainment]:
    """Return the x whose objectives attain their goals best: minimise t subject to F_i(x) - goal_i <= w_i t.

    x : the unknowns, a CasADi column of symbols (SX or MX); or, where objectives are functions, the start (n,)
    objectives : CasADi expression (k,) or a sequence of them; a CasADi Function, a GeneratedFunction or a Python
    callable of x, or of (x, p) when `parameter_values` are given
    goals (k,); weights (k,), 1 when None : w > 0 may be missed by w t; w = 0 is a constraint, F <= goal; w < 0 asks
    for at least the goal, goal - F <= |w| t. Weights |goal| make t a relative miss.
    absolute : indices (or True, all) whose deviation counts in both directions, |F_i - goal_i| <= |w_i| t
    exact : indices that must equal their goals, F_i = goal_i, whatever their weights
    lb, ub (n,) or scalar; A x <= b; Aeq x = beq; constraints : as objectives, constraints_lb <= g(x) <=
    constraints_ub, g(x) <= 0 when neither is given
    parameters, parameter_values : CasADi symbols that expressions may use, and their numbers
    start : (n,), moved into the bounds, or an earlier solution of the same problem (warm start); with symbols and no
    start the middle of the bounds, 0 where there is none
    starts, seed : number of starts, the others from a Sobol sequence over the bounds; the best answer is returned
    engine : "auto" tries the engines of the table in turn until one's answer passes re-evaluation; or a name, a solver,
    or a sequence of them, tried in its order;
    "compiled_minmax" compiles the problem first (a second or two once, then microseconds) and falls back on "auto"

    Returns a Solution: `answer.x`, `.objectives`, `.factor` (t re-evaluated), `.active`, `.multipliers`; `proof` is
    GLOBAL, STATIONARY, FEASIBLE, NOTHING or INFEASIBLE; `residuals["kkt"]` recomputed; `stats["runs"]` which engine
    ran and how it was judged.

    MATLAB's fgoalattain(fun, x0, goal, weight, A, b, Aeq, beq, lb, ub, nonlcon): fun -> objectives, x0 -> x or start,
    goal -> goals, weight -> weights, EqualityGoalCount -> absolute (indices instead of a count), nonlcon's c ->
    constraints, its ceq -> rows with constraints_lb = constraints_ub = 0, attainfactor -> answer.factor, lambda ->
    answer's multipliers, exitflag -> proof and termination.

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    Source: Gembicki & Haimes (1975).
    """
    problem = GoalAttainment(
        x, objectives, goals, weights, absolute=absolute, exact=exact, start=point_of(start), **region
    )
    return _best(problem, start, starts, seed, engine)


@explain_unknown_options
def minimax(
    x: Any,
    objectives: Any,
    *,
    absolute: bool | Sequence[int] = (),
    start: Start = None,
    starts: int = 1,
    seed: int = 0,
    engine: Engine = "auto",
    **region: Unpack[RegionOptions],
) -> Solution[Attainment]:
    """Return the x whose largest objective is least: minimise max_i F_i(x).

    absolute : indices (or True, all) whose absolute values |F_i(x)| count
    `answer.factor` is the largest objective. All other arguments and the result are those of `goal_attain`.

    MATLAB's fminimax(fun, x0, A, b, Aeq, beq, lb, ub, nonlcon): fun -> objectives, x0 -> x or start, maxfval ->
    answer.factor, AbsoluteMaxObjectiveCount -> absolute (indices instead of a count), nonlcon, lambda and exitflag as
    for `goal_attain`.

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    """
    problem = Minimax(x, objectives, absolute=absolute, start=point_of(start), **region)
    return _best(problem, start, starts, seed, engine)


def point_of(start: Start) -> ArrayLike | None:
    """Return the point that a start or an earlier solution stands for."""
    return start.answer.x if isinstance(start, Solution) else start


def _best(problem: MultiObjective, start: Start, starts: int, seed: int, engine: Engine) -> Solution[Attainment]:
    best = best_attainment(problem, start, starts, seed, engine)
    if best.answer.violated:
        # the caller of the verb, beyond this function, the verb and its check of options
        warnings.warn(best.answer.message(), stacklevel=4)
    return best
