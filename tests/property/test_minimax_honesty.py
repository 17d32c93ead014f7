"""Honesty of min-max proofs: over random problems no engine calls an answer optimal that is not.

OPTSAT_HONESTY_INSTANCES sets the number of problems of each kind; the campaign of the specification is 500 and 500.
"""

import os
from dataclasses import replace

import numpy as np
import pytest

from optsat.certificates.dual_bound import dual_bound
from optsat.certificates.first_order import first_order
from optsat.convex_rows import convex_rows
from optsat.forms import Point
from optsat.multistart import sobol_starts
from optsat.problems.reference_draws import Drawn, convex_problem, nonconvex_problem
from optsat.solution import Proof, Termination
from optsat.solve import solve
from optsat.solvers import SOLVERS

INSTANCES = int(os.environ.get("OPTSAT_HONESTY_INSTANCES", "25"))
# what is compiled for each problem takes part in the study `compare-solvers`
LISTED = [each for each in SOLVERS if not getattr(each, "by_name_only", False)]
ENGINES = [each for each in LISTED if each.accepts(convex_problem(np.random.default_rng(0)).problem.form)]


def convex_draws() -> list[Drawn]:
    return [convex_problem(np.random.default_rng((1, k))) for k in range(INSTANCES)]


def allowance(factor: float) -> float:
    return 1e-6 * max(1.0, abs(factor))


def test_convex_problems_are_proven_and_no_proof_is_wrong() -> None:
    proven = 0
    for drawn in convex_draws():
        assert convex_rows(drawn.problem.form) is not None
        for engine in LISTED:
            if not engine.accepts(drawn.problem.form):
                continue
            found = solve(drawn.problem, engine)
            if found.proof in (Proof.FEASIBLE, Proof.STATIONARY, Proof.GLOBAL):
                assert found.answer.factor >= drawn.optimum - allowance(drawn.optimum), engine.name
            if found.proof is Proof.GLOBAL:
                assert found.answer.factor <= drawn.optimum + allowance(drawn.optimum), engine.name
                proven += engine.name == "ipopt"
    # the others have flat optima without bounds: along a direction in which nothing grows no bound can be had
    assert proven >= 0.8 * INSTANCES


def test_nonconvex_problems_are_not_called_proven() -> None:
    """A proof may only stand where no start and no sample does better: some draws are convex after all."""
    stationary = 0
    for k in range(INSTANCES):
        problem = nonconvex_problem(np.random.default_rng((2, k))).problem
        form = problem.form
        found = [solve(problem, engine) for engine in ENGINES]
        claimed = [each.answer.factor for each in found if each.proof is Proof.GLOBAL]
        stationary += any(each.proof is Proof.STATIONARY for each in found)
        assert not claimed or convex_rows(form) is not None
        if claimed:
            points = sobol_starts(form.start, form.lower, form.upper, 128, 0)
            least = min(form.factor(form.objectives.values(x)) for x in points)
            assert max(claimed) <= least + allowance(least)
    assert stationary >= 0.8 * INSTANCES


@pytest.mark.parametrize("seed", range(3))
def test_the_dual_bound_holds_for_any_point_and_any_multipliers(seed: int) -> None:
    """However wrong point and multipliers are, the bound never exceeds the optimum: no solver is trusted."""
    rng = np.random.default_rng((3, seed))
    finite = 0
    for _ in range(INSTANCES):
        drawn = convex_problem(rng)
        form = drawn.problem.form
        convex = convex_rows(form)
        assert convex is not None
        x = np.minimum(drawn.x + rng.standard_normal(len(drawn.x)) * 10 ** rng.uniform(-9, 0.5), form.upper)
        state = first_order(form, x, np.zeros(0))
        for multipliers in (state.multipliers, rng.uniform(0, 1, len(state.multipliers))):
            given = replace(state, multipliers=multipliers, dual=state.rows.dual(multipliers, len(state.dual)))
            bound = dual_bound(form, convex, given, x)
            assert bound <= drawn.optimum + 1e-9 * max(1.0, abs(drawn.optimum), float(np.abs(state.rows.slack).max()))
            finite += np.isfinite(bound)
    assert finite >= INSTANCES / 4


def test_an_answer_moved_off_the_optimum_loses_its_proof() -> None:
    """By how much the factor is worse the gap must show."""
    for drawn in convex_draws():
        form = drawn.problem.form
        for size in (1e-5, 1e-3, 1e-1):
            x = np.minimum(drawn.x + size * np.ones(len(drawn.x)), form.upper)
            if len(form.A) and np.any(form.A @ x > form.linear_upper):
                continue
            moved = drawn.problem.interpret(Point(x, np.zeros(0), Termination.CONVERGED), "by hand")
            excess = moved.answer.factor - drawn.optimum
            assert moved.residuals["gap"] >= excess - 1e-9 * max(1.0, abs(drawn.optimum))
            if excess > allowance(drawn.optimum):
                assert moved.proof is not Proof.GLOBAL
