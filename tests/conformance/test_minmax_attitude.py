"""Min-max attitude from interval data: a thousand problems solved, answers as IPOPT's, losses as written down."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from kernel_source_harness import compiled
from minmax_family import Found, found

from optsat.arrays import Array
from optsat.attitude.davenport import rotation_matrix, turn
from optsat.campaign.claim import Verdict
from optsat.estimators.minmax_attitude import interval_losses, minmax_attitude
from optsat.kernels.status import Status
from optsat.studies import kernels_minmax_timing as study
from optsat.studies.kernels_minmax_timing import ERROR, VECTORS, by_slsqp, draw_problems, ipopt, kernel_arguments

N = 3 + VECTORS


def sample(problem: Array) -> Array:
    return np.concatenate([np.ravel(each) for each in kernel_arguments(problem)])


def losses(answer: Found, problem: Array) -> Array:
    """By the attitude itself: |b + t radius - A([g; 1]) y|^2 / 2."""
    b_B, radius_B, y_B = problem
    A = rotation_matrix(turn(np.array([0.0, 0.0, 0.0, 1.0]), answer.x[:3]))
    return np.asarray(0.5 * np.sum((b_B + answer.x[3:, None] * radius_B - y_B @ A.T) ** 2, axis=1))


def test_a_thousand_problems(tmp_path: Path) -> None:
    call = compiled(minmax_attitude(), tmp_path)
    for k, problem in enumerate(draw_problems(np.random.default_rng(12), 1000)):
        answer = found(N, call(sample(problem)))
        assert answer.status == Status.OK, k
        assert answer.gamma == pytest.approx(np.max(losses(answer, problem)) / ERROR**2, rel=1e-12, abs=1e-12)
        assert np.sum(answer.multipliers) * ERROR**2 == pytest.approx(1.0, abs=1e-7)
        assert np.all(np.abs(answer.x[3:]) <= 1.0)


def test_answers_of_ipopt_and_slsqp(tmp_path: Path) -> None:
    call, by_ipopt = compiled(minmax_attitude(), tmp_path), ipopt()
    for k, problem in enumerate(draw_problems(np.random.default_rng(13), 40)):
        answer = found(N, call(sample(problem)))
        assert answer.gamma == pytest.approx(by_ipopt(problem), abs=1e-8)
        if k < 3:
            assert answer.gamma == pytest.approx(by_slsqp(problem), abs=2e-7)


def test_gauss_newton_and_other_counts(tmp_path: Path) -> None:
    exact = compiled(minmax_attitude(), tmp_path)
    approximate = compiled(minmax_attitude(gauss_newton=True), tmp_path, "clang")
    for problem in draw_problems(np.random.default_rng(14), 100):
        a, b = found(N, exact(sample(problem))), found(N, approximate(sample(problem)))
        assert a.status == b.status == Status.OK
        assert a.gamma == pytest.approx(b.gamma, abs=1e-8)
    assert minmax_attitude(2).inputs[1].shape == (2, 3)


def test_float_form(tmp_path: Path) -> None:
    double = compiled(minmax_attitude(), tmp_path)
    single = compiled(minmax_attitude(), tmp_path, real=np.float32)
    for problem in draw_problems(np.random.default_rng(15), 200):
        a, b = found(N, double(sample(problem))), found(N, single(sample(problem)))
        assert b.status == Status.OK
        assert b.gamma == pytest.approx(a.gamma, abs=3e-4)


def test_losses_about_the_start_are_those_of_the_rotation() -> None:
    x = ca.SX.sym("x", N)
    arrays = [ca.SX.sym(name, VECTORS, 3) for name in ("b", "radius", "y")]
    function = ca.Function("losses", [x, *arrays], [interval_losses(x, *arrays)])
    rng = np.random.default_rng(16)
    for problem in draw_problems(rng, 20):
        at = rng.uniform(-1.0, 1.0, N)
        given = Found(0, at, 0.0, at, at, 0.0, 0.0)
        np.testing.assert_allclose(function(at, *problem).full()[:, 0], losses(given, problem), rtol=1e-13, atol=1e-15)


def test_a_problem_not_solved_or_another_answer_fails_the_study() -> None:
    row = {
        "slsqp_over_batch": 1200.0, "ipopt_over_batch": 200.0, "not_converged": 0, "above_ipopt": 0.0,
        "below_ipopt": 1e-9, "slsqp_above_ipopt": 0.0, "largest_residual": 1e-9, "most_iterations": 9.0,
        "largest_turn": 0.1, "median_iterations": 7.0,
    }  # fmt: skip

    def failed(**changed: float) -> set[str]:
        judged = study.claims(study.metrics([row, row | changed]))
        return {claim.id for claim in judged if claim.verdict is Verdict.FAILS}

    assert failed() == set()
    assert failed(not_converged=1) == {"converged"}
    assert failed(above_ipopt=2e-8) == failed(below_ipopt=2e-8) == {"answers"}
    assert failed(slsqp_over_batch=700.0) == {"against-slsqp"}
    assert failed(ipopt_over_batch=90.0) == {"against-ipopt"}
