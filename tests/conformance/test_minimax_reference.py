"""Every engine on every min-max problem of the literature: right, or honest about not being so."""

import math

import numpy as np
import pytest

from optsat.attain import goal_attain, minimax
from optsat.attain_runs import EngineRun
from optsat.forms import MinMaxForm
from optsat.problems.attainment import Attainment
from optsat.problems.goal_attainment import GoalAttainment
from optsat.problems.minimax import Minimax
from optsat.problems.reference_fitting import FITTING
from optsat.problems.reference_minimax import MINIMAX
from optsat.problems.reference_problem import ReferenceProblem
from optsat.solution import Proof, Solution
from optsat.solve import Solver, solve
from optsat.solvers import SOLVERS

REFERENCE = (*MINIMAX, *FITTING)
FORMS = [reference.problem().form for reference in REFERENCE]
# what is compiled for each problem takes part in the study `compare-solvers`
ENGINES = [
    solver
    for solver in SOLVERS
    if not getattr(solver, "by_name_only", False) and any(solver.accepts(form) for form in FORMS)
]
# the share of the problems it accepts that each engine solves alone from the usual start
SHARE = 0.85


def reached(problem: ReferenceProblem, factor: float) -> bool:
    return factor <= problem.optimum + tolerance(problem)


def tolerance(problem: ReferenceProblem) -> float:
    return 1e-6 * abs(problem.optimum) if problem.optimum else 1e-7


def check_honest(reference: ReferenceProblem, problem: Minimax | GoalAttainment, found: Solution[Attainment]) -> None:
    """A feasible point cannot beat the optimum, a proven one is the optimum, and the multipliers sum to 1."""
    form, answer = problem.form, found.answer
    if found.proof in (Proof.NOTHING, Proof.UNDECIDED):
        return
    assert answer.factor == form.factor(form.objectives.values(answer.x))
    assert answer.factor >= reference.optimum - tolerance(reference)
    assert np.all(answer.x >= form.lower)
    assert np.all(answer.x <= form.upper)
    if found.proof in (Proof.STATIONARY, Proof.GLOBAL):
        assert weight_sum(form, answer) == pytest.approx(1, abs=1e-6)
    if found.proof is Proof.GLOBAL:
        assert reference.convex
        assert reached(reference, answer.factor)


def weight_sum(form: MinMaxForm, answer: Attainment) -> float:
    weights = np.zeros(form.objectives.size)
    weights[form.objective] = form.weight
    return float(weights @ (answer.multipliers + answer.multipliers_below))


@pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)
def test_engine_from_the_usual_starts(engine: Solver) -> None:
    accepted, missed = 0, []
    for reference in REFERENCE:
        problem = reference.problem()
        if not engine.accepts(problem.form):
            continue
        accepted += 1
        found = solve(problem, engine)
        check_honest(reference, problem, found)
        if not (found.proof in (Proof.STATIONARY, Proof.GLOBAL) and reached(reference, found.answer.factor)):
            missed.append(reference.name)
    assert len(missed) <= (1 - SHARE) * accepted, missed


def test_only_the_conic_engine_is_choosy() -> None:
    choosy = {engine.name for engine in ENGINES if not all(engine.accepts(form) for form in FORMS)}
    assert choosy == {"conic_minmax"}


def attained(reference: ReferenceProblem, starts: int) -> Solution[Attainment]:
    problem = reference.problem()
    options = {"start": reference.start, "starts": starts, **reference.options}
    if isinstance(problem, GoalAttainment):
        return goal_attain(problem.x, problem.objectives, **options)
    return minimax(problem.x, problem.objectives, **options)


def test_the_table_from_the_usual_starts() -> None:
    missed = [each.name for each in REFERENCE if not reached(each, attained(each, 1).answer.factor)]
    assert len(missed) <= (1 - SHARE) * len(REFERENCE), missed


@pytest.mark.parametrize("reference", REFERENCE, ids=lambda reference: reference.name)
def test_the_table_from_many_starts(reference: ReferenceProblem) -> None:
    found = attained(reference, 8)
    check_honest(reference, reference.problem(), found)
    assert reached(reference, found.answer.factor)
    assert found.proof is Proof.GLOBAL if reference.convex else found.proof is Proof.STATIONARY
    runs = found.stats["runs"]
    assert all(isinstance(run, EngineRun) and run.verdict for run in runs)
    assert min(run.factor for run in runs if run.violation <= 1e-8) == pytest.approx(found.answer.factor, abs=1e-8)


@pytest.mark.parametrize("reference", REFERENCE, ids=lambda reference: reference.name)
def test_published_optimum_reproduces_or_is_doubted(reference: ReferenceProblem) -> None:
    if math.isnan(reference.published):
        pytest.skip("no optimum is printed")
    digits = len(f"{reference.published!r}".partition("e")[0].replace("-", "").replace(".", "").lstrip("0"))
    size = math.floor(math.log10(abs(reference.published))) if reference.published else 0
    reproduces = abs(reference.optimum - reference.published) <= 2 * 10.0 ** (size - digits + 1)
    assert reproduces == (not reference.doubt)


def test_names_are_unique() -> None:
    assert len({each.name for each in REFERENCE}) == len(REFERENCE)
