"""Robust minimax: the largest objective made least when some quantities may be anywhere in a box."""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.attain import Start, point_of
from optsat.attain_runs import Engine, best_attainment
from optsat.attitude.backend import is_symbolic
from optsat.certificates.box_maximum import BoxMaximum, largest_over_box
from optsat.errors import InputError, explain_unknown_options
from optsat.problems.attainment import FEASIBLE, Attainment
from optsat.problems.feasible_region import bounds
from optsat.problems.minimax import Minimax
from optsat.problems.uncertain_rows import UncertainRow, uncertain_rows
from optsat.problems.user_function import count_of, parameter_values
from optsat.solution import Proof, Solution

_MOST_BOXES = 2000
_MOST_ROUNDS = 30
# of a box whose corners are few enough to start from
_FEW = 4


@dataclass(frozen=True)
class WorstCase:
    """Answer of `robust_minimax`.

    x (n,); worst : largest objective found over the box at x; bound : that it surely does not exceed anywhere in it
    u (k, m) : where each objective was found to be largest; objectives (k,) : its value there
    constraint_bound : that no constraint exceeds anywhere in the box, -inf where there are none
    exact : for each objective, then each constraint, whether its worst corners are proven, so that bound = worst
    attainment : of the finite problem over the cases that were looked at, with active set and multipliers
    """

    x: Array
    worst: float
    bound: float
    u: Array
    objectives: Array
    constraint_bound: float
    exact: tuple[bool, ...]
    attainment: Attainment


@explain_unknown_options
def robust_minimax(
    x: Any,
    objectives: Any,
    uncertain: Any,
    uncertain_lb: ArrayLike,
    uncertain_ub: ArrayLike,
    *,
    constraints: Any = None,
    lb: ArrayLike | None = None,
    ub: ArrayLike | None = None,
    A: ArrayLike | None = None,
    b: ArrayLike | None = None,
    Aeq: ArrayLike | None = None,
    beq: ArrayLike | None = None,
    parameters: Any = None,
    parameter_values: ArrayLike | None = None,
    start: Start = None,
    starts: int = 1,
    seed: int = 0,
    engine: Engine = "auto",
    tolerance: float = 1e-6,
) -> Solution[WorstCase]:
    """Return the x whose largest objective over a box of uncertain quantities is least: min_x max_i max_u F_i(x, u).

    x, uncertain : CasADi columns of symbols; objectives, constraints : expressions of both, constraints <= 0 for all u
    uncertain_lb, uncertain_ub (m,) or scalar : the box, finite
    tolerance : of the inner maximum, relative to the factor (at least 1)
    The other arguments are those of `goal_attain`.

    Where the box's worst corners are proven (the function is convex in u, or rises or falls throughout) they stand in
    for the box, exactly. Elsewhere cases are added until branch and bound on intervals finds none worse by more than
    the tolerance. `answer.bound` is then proven by that search, rounding included, whatever the optimiser did; at
    proven corners it is the value as evaluated there.

    Returns a Solution: `answer.worst`, `answer.bound`, `answer.u`; `proof` is GLOBAL where the finite problem is proven
    and the bound is within the tolerance of it, STATIONARY or FEASIBLE by the finite problem where only the inner
    maximum is settled, NOTHING where it is not or a constraint may be violated.

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    Source: Blankenship & Falk (1976), with bounds instead of local inner maxima.
    """
    robust = _Robust(
        x, objectives, uncertain, (uncertain_lb, uncertain_ub), constraints, (lb, ub), parameters, parameter_values
    )
    if not 0 < tolerance < np.inf:
        raise InputError(f"`tolerance` must be > 0, got {tolerance!r}.")
    given: Any = {"lb": lb, "ub": ub, "A": A, "b": b, "Aeq": Aeq, "beq": beq}

    def settled_over_cases(at: ArrayLike | None) -> tuple[Solution[Attainment], list[BoxMaximum]]:
        finite = best_attainment(robust.finite(given, at), None, starts, seed, engine)
        return finite, robust.worst(finite.answer.x, tolerance * max(1.0, abs(finite.answer.factor)))

    finite, worst = settled_over_cases(point_of(start))
    rounds = 1
    while robust.add(worst, finite, tolerance) and rounds < _MOST_ROUNDS:
        finite, worst = settled_over_cases(finite.answer.x)
        rounds += 1
    solution = robust.told(finite, worst, tolerance, rounds)
    if solution.proof in (Proof.NOTHING, Proof.INFEASIBLE):
        warnings.warn(robust.complaint(solution, tolerance), stacklevel=3)
    return solution


class _Robust:
    """The rows with the cases looked at so far."""

    def __init__(
        self,
        x: Any,
        objectives: Any,
        u: Any,
        box: tuple[ArrayLike, ArrayLike],
        constraints: Any,
        limits: tuple[ArrayLike | None, ArrayLike | None],
        parameters: Any,
        values: ArrayLike | None,
    ) -> None:
        import casadi as ca

        for name, symbol in (("x", x), ("uncertain", u)):
            if not is_symbolic(symbol):
                raise InputError(f"`{name}` must be a column of CasADi symbols, got {symbol!r}.")
        n, m = count_of(x), count_of(u)
        self.p = parameter_values(parameters, values)
        self.lower, self.upper = (
            np.array(np.broadcast_to(finite_array(name, np.asarray(value)), (m,)))
            if np.ndim(value) == 0
            else finite_array(name, np.asarray(value), (m,))
            for name, value in zip(("uncertain_lb", "uncertain_ub"), box, strict=True)
        )
        bounds(("uncertain_lb", "uncertain_ub"), self.lower, self.upper, m)
        self.x, self.u, self.symbol_p = (
            ca.SX.sym(name, size) for name, size in (("x", n), ("u", m), ("p", len(self.p)))
        )
        boxes = [bounds(("lb", "ub"), *limits, n), (self.lower, self.upper), (self.p, self.p)]
        self.rows: list[UncertainRow] = []
        for kind, expressions in (("objective", objectives), ("constraint", constraints)):
            if expressions is None:
                self.count = len(self.rows)
                continue
            column = self._in_scalars(f"{kind}s", expressions, [x, u, parameters])
            self.rows += uncertain_rows(column, self.x, self.u, self.symbol_p, boxes, (kind, "uncertain"))
            if kind == "objective":
                self.count = len(self.rows)
        if self.count == 0:
            raise InputError("`objectives` is empty; at least one is needed.")
        self.cases = [list(self._first(row)) for row in self.rows]

    def _in_scalars(self, name: str, expressions: Any, symbols: list[Any]) -> Any:
        import casadi as ca

        kind = type(symbols[0])
        known = [kind.sym("p", 0) if symbol is None else symbol for symbol in symbols]
        try:
            column = kind(
                ca.vertcat(*map(ca.vec, expressions)) if isinstance(expressions, list | tuple) else expressions
            )
            function = ca.Function(name, known, [ca.vec(column)])
            return ca.densify(function.expand()(self.x, self.u, self.symbol_p))
        except (NotImplementedError, RuntimeError, TypeError) as error:
            reason = str(error).strip().splitlines()[-1]
            raise InputError(
                f"`{name}` must be CasADi expressions of `x`, `uncertain` and `parameters` alone, of one kind and of "
                f"scalar operations: {reason}"
            ) from None

    def _first(self, row: UncertainRow) -> Array:
        if row.corners is not None:
            return row.corners
        middle = 0.5 * (self.lower + self.upper)
        ends = np.array([middle, self.lower, self.upper])
        return ends if len(middle) <= _FEW else ends[:1]

    def finite(self, region: Any, start: ArrayLike | None) -> Minimax:
        """Return the problem over the cases."""
        import casadi as ca

        total = sum(map(len, self.cases))
        cases = ca.SX.sym("cases", len(self.lower), total)
        column, place = [], 0
        for row, own in zip(self.rows, self.cases, strict=True):
            column.append([row.function(self.x, cases[:, place + k], self.symbol_p) for k in range(len(own))])
            place += len(own)
        numbers = np.concatenate((self.p, *(case for own in self.cases for case in own)))
        objectives, constraints = ([each for part in parts for each in part] for parts in self._split(column))
        return Minimax(
            self.x,
            objectives,
            constraints=constraints or None,
            parameters=ca.vertcat(self.symbol_p, ca.vec(cases)),
            parameter_values=numbers,
            start=start,
            **region,
        )

    def _split(self, rows: list[Any]) -> tuple[list[Any], list[Any]]:
        return rows[: self.count], rows[self.count :]

    def worst(self, x: Array, tolerance: float) -> list[BoxMaximum]:
        """Return the maximum of each row over the box at x."""
        found = []
        for row in self.rows:
            if row.corners is None:
                found.append(largest_over_box(row.row, x, self.p, self.lower, self.upper, 0.5 * tolerance, _MOST_BOXES))
                continue
            values = [float(row.function(x, corner, self.p)) for corner in row.corners]
            best = int(np.argmax(values))
            found.append(BoxMaximum(row.corners[best], values[best], values[best], 0))
        return found

    def add(self, worst: list[BoxMaximum], finite: Solution[Attainment], tolerance: float) -> bool:
        """Add the cases that are worse than all others so far; return whether there were any."""
        factor = finite.answer.factor
        added = False
        for i, (row, each) in enumerate(zip(self.rows, worst, strict=True)):
            level = factor if i < self.count else FEASIBLE
            if row.corners is None and each.value > level + 0.5 * tolerance * max(1.0, abs(factor)):
                self.cases[i].append(each.u)
                added = True
        return added

    def told(
        self, finite: Solution[Attainment], worst: list[BoxMaximum], tolerance: float, rounds: int
    ) -> Solution[WorstCase]:
        objectives, constraints = self._split(worst)
        answer = WorstCase(
            x=finite.answer.x,
            worst=max(each.value for each in objectives),
            bound=max(each.bound for each in objectives),
            u=np.array([each.u for each in objectives]),
            objectives=np.array([each.value for each in objectives]),
            constraint_bound=max((each.bound for each in constraints), default=-np.inf),
            exact=tuple(row.corners is not None for row in self.rows),
            attainment=finite.answer,
        )
        allowed = tolerance * max(1.0, abs(answer.worst))
        excess = answer.bound - finite.answer.factor
        settled = excess <= allowed and answer.constraint_bound <= (FEASIBLE if all(answer.exact) else allowed)
        proof = finite.proof
        if proof is not Proof.INFEASIBLE and not settled:
            proof = Proof.NOTHING
        stats = {**finite.stats, "rounds": rounds, "boxes": sum(each.boxes for each in worst)}
        stats["cases"] = sum(map(len, self.cases))
        residuals = {**finite.residuals, "inner_gap": answer.bound - answer.worst, "excess": excess}
        return Solution(answer, finite.termination, proof, residuals, None, stats)

    def complaint(self, solution: Solution[WorstCase], tolerance: float) -> str:
        answer = solution.answer
        if answer.attainment.violated:
            return answer.attainment.message()
        return (
            f"The worst case over the box is between {answer.worst:.9g} and {answer.bound:.9g} at the answer, wider "
            f"than the tolerance {tolerance:g}; constraints may reach {answer.constraint_bound:.3g}. Narrow the box, "
            "raise `tolerance`, or write the functions with fewer repeated quantities."
        )
