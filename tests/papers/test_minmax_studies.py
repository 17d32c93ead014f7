"""The studies of the min-max engines, cut down: every engine answers as it should, and a wrong one is found out."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.attain_runs import best_attainment
from optsat.campaign.claim import Verdict
from optsat.campaign.interleaved import InterleavedTimes
from optsat.campaign.runner import run_study
from optsat.kernels.toolchain import CompilerMissingError, find_compiler
from optsat.problems.attainment import Attainment
from optsat.problems.minimax import Minimax
from optsat.solution import Proof, Solution
from optsat.solve import solve
from optsat.solvers.ipopt import Ipopt
from optsat.studies import compare_solvers, goal_attainment_timing, minmax_honesty
from optsat.studies._solver_suite import tasks


@pytest.fixture
def compiler() -> None:
    try:
        find_compiler()
    except CompilerMissingError as reason:
        pytest.skip(str(reason))


def test_no_engine_is_dishonest_on_a_few_draws() -> None:
    result = run_study(minmax_honesty.study, 6, 0, workers=1)
    assert result.passed
    assert result.metrics["honesty_ipopt"] == 1.0
    assert result.metrics["stationary_ipopt"] == 1.0


def line() -> tuple[Minimax, Solution[Attainment]]:
    """min max(x, 1 - 2 x): 1/3 at x = 1/3."""
    x = ca.SX.sym("x")
    problem = Minimax(x, [x, 1 - 2 * x], start=3.0)
    return problem, solve(problem, Ipopt())


def test_a_dishonest_answer_is_found_out() -> None:
    problem, found = line()
    optimum = 1 / 3
    honest = minmax_honesty.honest
    assert found.proof is Proof.GLOBAL
    assert honest(problem.form, found, optimum)
    answer = found.answer
    wrong = {
        "worse than the optimum": (found, optimum - 1e-3),
        "better than any point": (found, optimum + 1e-3),
        "a factor that its point has not": (
            replace(found, answer=replace(answer, factor=answer.factor + 1e-9)),
            optimum,
        ),
        "multipliers out of balance": (
            replace(found, answer=replace(answer, multipliers=1.1 * answer.multipliers)),
            optimum,
        ),
        "feasible but outside": (
            replace(found, proof=Proof.FEASIBLE, residuals={**found.residuals, "violation": 1e-7}),
            optimum,
        ),
        "no answer where there is one": (replace(found, proof=Proof.INFEASIBLE), optimum),
    }
    assert not [name for name, (solution, least) in wrong.items() if honest(problem.form, solution, least)]
    assert honest(problem.form, replace(found, proof=Proof.NOTHING), optimum - 1)


def test_the_suite_holds_the_interval_forms() -> None:
    named = {task.name: task for task in tasks()}
    assert len(named) == len(tasks()) >= 35
    for form in ("absolute", "signed"):
        task = named[f"interval Wahba, {form}"]
        found = best_attainment(task.pose(None), None, 4, 0, "ipopt")
        assert found.answer.factor == pytest.approx(task.optimum, abs=task.tolerance)


def test_engines_are_compared_on_one_problem(compiler: None, tmp_path: Path) -> None:
    rows = []
    for start in (0, 3):
        row = compare_solvers.run({"problem": "CB2", "start": start}, np.random.default_rng(0))
        rows.append({"case": start, **row})
    figures = compare_solvers.metrics(rows)
    for name in compare_solvers.ENGINES:
        taken = name != "conic_minmax"
        assert figures[f"solved_{name}"] == float(taken)
        assert rows[1][f"takes_{name}"] == (taken and name != "auto_8")
    assert min(rows[0][f"time_ratio_{name}"] for name in compare_solvers.SINGLE) == 1.0
    verdicts = {claim.id: claim.verdict for claim in compare_solvers.claims(figures)}
    bars = ("usual-starts", "multistart", "honesty", "weight-sum", "hard-goals", "take-auto")
    assert {verdicts[bar] for bar in bars} == {Verdict.HOLDS}
    # the problem has an exponential, so that no conic engine was there to be recommended
    assert verdicts["take-conic"] is Verdict.FAILS
    compare_solvers.figure(rows, tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").read_bytes().startswith(b"<?xml")


def test_cases_go_through_all_problems_first() -> None:
    suite = tasks()
    cases = compare_solvers.cases(len(suite) + 1)
    assert [case["problem"] for case in cases[:-1]] == [task.name for task in suite]
    assert cases[-1] == {"problem": suite[0].name, "start": 1}


def test_the_performance_profile() -> None:
    ratios = np.array([1.0, 2.0, 5.0, np.inf])
    np.testing.assert_array_equal(compare_solvers.profile(ratios, np.array([0.5, 1.0, 4.0, 1e9])), (0, 0.25, 0.5, 0.75))


def test_goal_attainment_answers_as_slsqp(compiler: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def once(alternatives: Mapping[str, Callable[[], object]], rounds: int = 1, least_s: float = 0.0) -> Any:
        for function in alternatives.values():
            function()
        return InterleavedTimes({name: np.ones(1) for name in alternatives})

    monkeypatch.setattr(goal_attainment_timing, "time_interleaved", once)
    monkeypatch.setattr(goal_attainment_timing, "INSTANCES", 4)
    figures = goal_attainment_timing.metrics([goal_attainment_timing.run({}, np.random.default_rng(0))])
    assert all(value == 0 for name, value in figures.items() if name.startswith(("unproven", "worse")))
    verdicts = {claim.id: claim.verdict for claim in goal_attainment_timing.claims(figures)}
    assert verdicts.pop("answers") is Verdict.HOLDS
    # with this clock all ratios are one, or the size of the batch
    assert set(verdicts.values()) == {Verdict.FAILS}
