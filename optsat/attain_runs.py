"""Engine runs: the engines of one problem in turn, from many starts, each answer judged by re-evaluation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array
from optsat.errors import InputError, nearest_name
from optsat.forms import MinMaxForm, Point
from optsat.multistart import sobol_starts
from optsat.solution import Proof, Solution, Termination
from optsat.solve import Solver, solve

if TYPE_CHECKING:
    from optsat.problems.attainment import Attainment, MinMaxProblem
    from optsat.problems.least_violation import LeastViolation

# a name, a solver, or several to be tried in this order
Engine = str | Solver | Sequence[str | Solver]

# KKT residual of an answer that is taken without trying the next engine
_ACCURATE = 1e-8
# factors closer than this, relative to their size (at least 1), count as equal
_SAME = 1e-9
_FEASIBLE = (Proof.FEASIBLE, Proof.STATIONARY, Proof.GLOBAL)


@dataclass(frozen=True)
class EngineRun:
    """One run of one engine, judged by re-evaluation.

    start : number of the start; one past the last where the best answer was taken up again, or a feasible point sought
    kkt, violation : recomputed residuals; seconds : wall time of the run
    verdict : why the answer was taken, or why the next engine was tried
    """

    engine: str
    start: int
    proof: Proof
    termination: Termination
    factor: float
    kkt: float
    violation: float
    iterations: int
    seconds: float
    verdict: str


class _Search:
    """The runs of one call, in order, with the engines that may take part."""

    def __init__(self, problem: "MinMaxProblem", engine: "Engine") -> None:
        self.problem = problem
        self.form = problem.lower()
        self.engine = engine
        self.engines = _engines(self.form, engine)
        self.found: list[Solution[Attainment]] = []
        self.runs: list[EngineRun] = []

    def run(self, engines: "list[Solver]", number: int, x: Array, dual: Array) -> None:
        """Run the engines from one start, up to the first whose answer stands."""
        for each in engines:
            if _settled(self.once(self.problem, each, number, Point(x, dual, Termination.CONVERGED))):
                break

    def once(
        self, problem: "MinMaxProblem | LeastViolation", engine: "Solver", number: int, start: Point
    ) -> "Solution[Attainment]":
        """Run one engine and keep its answer and how it was judged."""
        began = perf_counter()
        solution = solve(problem, engine, start)
        self.runs.append(_judged(solution, engine.name, number, perf_counter() - began))
        self.found.append(solution)
        return solution

    def least_violation(self, number: int) -> None:
        """Look for a feasible point, and go on from it; or for a proof that there is none."""
        from optsat.problems.least_violation import LeastViolation

        relaxed = LeastViolation(self.problem)
        if relaxed.vacuous:
            return
        for each in _engines(relaxed.lower(), "auto"):
            solution = self.once(relaxed, each, number, Point(self.form.start, np.zeros(0), Termination.CONVERGED))
            if solution.proof in _FEASIBLE:
                self.run(self.engines, number, solution.answer.x, np.zeros(0))
                return
            if solution.proof is Proof.INFEASIBLE or solution.residuals.get("violation_kkt", np.inf) <= _ACCURATE:
                return


def best_attainment(
    problem: "MinMaxProblem",
    start: "ArrayLike | Solution[Attainment] | None",
    starts: int,
    seed: int,
    engine: "Engine",
) -> "Solution[Attainment]":
    """Return the best answer of the engines from all starts, with how each run was judged in `stats["runs"]`.

    Raises
    ------
    InputError : `starts` or `engine` cannot be used.
    """
    search = _Search(problem, engine)
    form, engines, found = search.form, search.engines, search.found
    # one engine of each method takes its turn at the further starts, since each falls into other local optima
    methods = list({type(each): each for each in reversed(engines)}.values())[::-1]
    points = sobol_starts(form.start, form.lower, form.upper, starts, seed)
    search.run(engines, 0, points[0], start.answer.dual if isinstance(start, Solution) else np.zeros(0))
    for number, x in enumerate(points[1:], 1):
        if any(each.proof in (Proof.GLOBAL, Proof.INFEASIBLE) for each in found):
            break
        if _defined(form, x):
            search.run([methods[number % len(methods)]], number, x, np.zeros(0))
    best = _chosen(found)
    if best.proof is Proof.NOTHING:
        search.least_violation(len(points))
        best = _chosen(found)
    elif starts > 1 and not _settled(best):
        search.run(engines, len(points), best.answer.x, np.zeros(0))
        best = _chosen(found)
    return replace(best, stats={**best.stats, "runs": tuple(search.runs)})


def _defined(form: MinMaxForm, x: Array) -> bool:
    return bool(np.all(np.isfinite(form.objectives.values(x))) and np.all(np.isfinite(form.constraints.values(x))))


def _engines(form: object, engine: "Engine") -> "list[Solver]":
    from optsat.solvers import SOLVERS

    if isinstance(engine, Sequence) and not isinstance(engine, str):
        chosen = [each for part in engine for each in _engines(form, part)]
        if not chosen:
            raise InputError("`engine` is empty; give a name, a solver, or several of them in the order to try.")
        return list({each.name: each for each in chosen}.values())
    if not isinstance(engine, str):
        return [engine]
    always = [each for each in SOLVERS if not getattr(each, "by_name_only", False) and each.accepts(form)]
    if engine == "auto":
        return always
    named = [each for each in SOLVERS if each.name == engine and each.accepts(form)]
    if not named:
        known = [*(each.name for each in SOLVERS if each.accepts(form)), "auto"]
        raise InputError(f"`engine` {engine!r} cannot solve this problem or is unknown.{nearest_name(engine, known)}")
    # what is there for speed alone leaves the rest to the others
    return named if named[0] in always else [*named, *always]


def _judged(solution: "Solution[Attainment]", engine: str, start: int, seconds: float) -> EngineRun:
    kkt, violation = (solution.residuals.get(name, float("inf")) for name in ("kkt", "violation"))
    if _settled(solution):
        verdict = f"taken: {solution.proof.value}"
    elif solution.proof in (Proof.FEASIBLE, Proof.STATIONARY):
        verdict = f"not accurate: KKT residual {kkt:.2g}"
    elif solution.answer.violated:
        verdict = "infeasible: " + ", ".join(f"{name} by {by:.2g}" for name, by in solution.answer.violated.items())
    else:
        verdict = "a function is not finite at its answer"
    return EngineRun(
        engine=engine,
        start=start,
        proof=solution.proof,
        termination=solution.termination,
        factor=solution.answer.factor,
        kkt=kkt,
        violation=violation,
        iterations=int(solution.stats["iterations"]),
        seconds=seconds,
        verdict=verdict,
    )


def _settled(solution: "Solution[Attainment]") -> bool:
    if solution.proof is Proof.STATIONARY:
        return solution.residuals["kkt"] <= _ACCURATE
    return solution.proof in (Proof.GLOBAL, Proof.INFEASIBLE)


def _chosen(found: "list[Solution[Attainment]]") -> "Solution[Attainment]":
    """Return the feasible solution of least factor, of equal ones the best proven; else the least infeasible."""
    strength = [Proof.NOTHING, Proof.FEASIBLE, Proof.STATIONARY, Proof.INFEASIBLE, Proof.GLOBAL]
    feasible = [each for each in found if each.proof in _FEASIBLE]
    if not feasible:
        proven = [each for each in found if each.proof is Proof.INFEASIBLE]
        named = [each for each in found if each.answer.conflicting]
        return min(proven or named or found, key=lambda each: each.residuals.get("violation", float("inf")))
    least = min(each.answer.factor for each in feasible)
    equal = [each for each in feasible if each.answer.factor <= least + _SAME * max(1.0, abs(least))]
    return max(equal, key=lambda each: (strength.index(each.proof), -each.residuals["kkt"]))
