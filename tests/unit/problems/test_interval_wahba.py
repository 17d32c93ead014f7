"""Interval Wahba: the degeneracy theorem by independent routes, the options of the problem, inputs to be refused."""

import inspect

import numpy as np
import pytest
from interval_draws import boxes, general_pairs, perturbed, unit

import optsat
from optsat.attitude import quaternion
from optsat.attitude.status import AttitudeStatus
from optsat.errors import InfeasibleBoxError, InputError, UnknownOptionError
from optsat.forms import Point
from optsat.problems.component_box import ComponentBox
from optsat.problems.interval_pairs import IntervalPairs
from optsat.problems.interval_wahba import IntervalWahba, interval_wahba_forms
from optsat.solution import Proof, Termination
from optsat.solvers.slsqp import Slsqp


@pytest.mark.parametrize(
    "options",
    [{}, {"absolute": False}, {"goal_weights": (3.0, 0.5)}, {"shared": True}, {"goal_norm": 1.0}],
    ids=["absolute", "signed", "weighted", "shared", "one-norm"],
)
def test_unit_middles_give_the_q_method_and_a_proof(options: dict[str, object]) -> None:
    rng = np.random.default_rng(10)
    for _ in range(3):
        b, r = perturbed(rng)
        solution = optsat.solve(IntervalWahba(*boxes(b, r), **options))  # type: ignore[arg-type]
        q = optsat.wahba(b, r, norm_policy="silent").answer
        assert np.degrees(quaternion.error_angle(solution.answer.q_BN, q.q_BN)) < 1e-5
        assert solution.answer.mid_loss == pytest.approx(q.loss, abs=1e-12)
        assert abs(solution.residuals["gap"]) < 1e-12
        assert solution.require(Proof.GLOBAL).answer.status is AttitudeStatus.OK


def test_the_theorem_holds_for_more_pairs_and_weights_too() -> None:
    b, r = general_pairs(np.random.default_rng(11), 3)
    solution = optsat.solve(IntervalWahba(*boxes(b, r), weights=[1.0, 2.0, 5.0]))
    q = optsat.wahba(b, r, [1.0, 2.0, 5.0]).answer
    assert np.degrees(quaternion.error_angle(solution.answer.q_BN, q.q_BN)) < 1e-5


def test_a_solver_without_derivatives_of_ours_agrees() -> None:
    b, r = perturbed(np.random.default_rng(12))
    problem = IntervalWahba(*boxes(b, r))
    solution = optsat.solve(problem, Slsqp())
    q = optsat.wahba(b, r, norm_policy="silent").answer
    assert np.degrees(quaternion.error_angle(solution.answer.q_BN, q.q_BN)) < 1e-3
    assert solution.answer.factor >= solution.answer.lower_bound - 1e-15


def test_no_sampled_feasible_point_lies_below_the_theorem() -> None:
    # the route without any optimiser: random unit directions inside their boxes and random attitudes
    rng = np.random.default_rng(13)
    b, r = boxes(*perturbed(rng))
    pairs = IntervalPairs(b, r)
    count = 20_000
    alpha, beta = rng.uniform(-1, 1, (2, count, 2, 3))
    q = unit(pairs.triad() + 0.3 * rng.standard_normal((count, 4)))
    db, dr = pairs.directions(alpha, beta)
    alpha, beta = (unit(db) - pairs.b_mid) / pairs.b_radius, (unit(dr) - pairs.r_mid) / pairs.r_radius
    inside = np.all(np.abs(alpha) <= 1, axis=(1, 2)) & np.all(np.abs(beta) <= 1, axis=(1, 2))
    parts = pairs.losses(q[inside], alpha[inside], beta[inside])
    least = 1 - np.linalg.eigvalsh(pairs.mid_matrix())[-1]
    assert inside.sum() > 1000
    assert np.all(np.maximum(parts.mid, parts.change) >= least - 1e-15)
    assert np.min(np.maximum(parts.mid, parts.change)) < least + 0.05


def test_a_start_elsewhere_ends_in_the_same_attitude() -> None:
    rng = np.random.default_rng(14)
    b, r = perturbed(rng)
    form = interval_wahba_forms(*boxes(b, r))["absolute"]
    start = np.concatenate((unit(form.form.start[:4] + 0.3 * rng.standard_normal(4)), rng.uniform(-1, 1, 12)))
    problem = IntervalWahba(*boxes(b, r))

    solution = optsat.solve(problem, start=Point(start, np.zeros(0), Termination.CONVERGED))
    q = optsat.wahba(b, r, norm_policy="silent").answer
    assert np.degrees(quaternion.error_angle(solution.answer.q_BN, q.q_BN)) < 1e-5


def test_middles_that_are_not_unit_vectors_do_not_degenerate() -> None:
    b, r = perturbed(np.random.default_rng(15))
    raw = ComponentBox.from_half_width(b, 0.3 * np.abs(b)), ComponentBox.from_half_width(r, 0.3 * np.abs(r))
    solution = optsat.solve(IntervalWahba(*raw, absolute=False))
    q = optsat.wahba(b, r, norm_policy="silent").answer
    assert solution.proof in (Proof.STATIONARY, Proof.FEASIBLE)
    assert np.degrees(quaternion.error_angle(solution.answer.q_BN, q.q_BN)) > 0.1
    np.testing.assert_allclose(np.linalg.norm(solution.answer.b_B, axis=1), 1, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(solution.answer.r_N, axis=1), 1, atol=1e-8)


def test_the_search_range_is_about_triad_and_keeps_the_answer_inside() -> None:
    b, r = perturbed(np.random.default_rng(16))
    problem = IntervalWahba(*boxes(b, r), search_fraction=0.1)
    solution = optsat.solve(problem)
    seed = problem.pairs.triad()
    q = solution.answer.q_BN * np.sign(solution.answer.q_BN @ seed)
    assert np.all(np.abs(q - seed) <= 0.1 * np.abs(seed) + 1e-9)
    assert solution.answer.factor > solution.answer.lower_bound + 1e-6
    assert solution.proof is not Proof.GLOBAL


def test_parallel_middles_are_said_to_leave_a_rotation_free() -> None:
    b, r = np.tile([[1.0, 0.0, 0.0]], (2, 1)), np.tile([[0.0, 0.6, 0.8]], (2, 1))
    solution = optsat.solve(IntervalWahba(*boxes(b, r, 0.1)))
    assert solution.answer.status is AttitudeStatus.UNBOUNDED
    assert solution.answer.mid_loss == pytest.approx(0, abs=1e-9)


def test_the_three_forms_are_ordinary_problems_with_one_answer() -> None:
    b, r = perturbed(np.random.default_rng(17))
    forms = interval_wahba_forms(*boxes(b, r))
    q = optsat.wahba(b, r, norm_policy="silent").answer
    assert list(forms) == ["absolute", "signed", "two_norm"]
    for name, form in forms.items():
        x = optsat.solve(form).require(Proof.STATIONARY).answer.x[:4]
        error = np.degrees(quaternion.error_angle(x / np.linalg.norm(x), q.q_BN))
        assert error < (0.1 if name == "two_norm" else 1e-5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"goal_weights": (1.0, -1.0)}, "`goal_weights` must be >= 0"),
        ({"goal_weights": (0.0, 0.0)}, "not all zero"),
        ({"goal_weights": (1.0,)}, "`goal_weights` must have shape"),
        ({"goal_weights": (0.0, 1.0), "absolute": False}, "`goal_weights` must both be positive"),
        ({"goal_norm": 0.5}, "`goal_norm` must be a number p >= 1"),
        ({"goal_norm": float("nan")}, "`goal_norm` must be a number p >= 1"),
        ({"goal_norm": 2.0, "absolute": False}, "signed needs infinity"),
        ({"search_fraction": -0.1}, "`search_fraction` must be a number >= 0 or None"),
        ({"search_fraction": True}, "`search_fraction` must be a number >= 0 or None"),
    ],
)
def test_bad_options_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        IntervalWahba(*boxes(*perturbed(np.random.default_rng(18))), **options)  # type: ignore[arg-type]


def test_a_misspelt_option_is_named() -> None:
    with pytest.raises(UnknownOptionError, match="Did you mean `absolute`"):
        IntervalWahba(*boxes(*perturbed(np.random.default_rng(18))), absolut=True)  # type: ignore[call-arg]


def test_the_papers_box_that_misses_the_sphere_is_refused_by_its_row() -> None:
    with pytest.raises(InfeasibleBoxError, match="Box 1 lies inside the unit sphere"):
        ComponentBox.from_relative(np.array([[1.0, 0.0, 0.0], [0.4, 0.4, 0.4]]), 0.2, mode="paper")


def test_the_problem_cannot_be_told_the_truth() -> None:
    names = set(inspect.signature(IntervalWahba).parameters)
    assert not any(word in name for name in names for word in ("true", "truth", "exact", "start"))


def test_data_that_agree_to_arcminutes_and_known_references_are_solved_to_a_proof_too() -> None:
    rng = np.random.default_rng(19)
    r = unit(rng.standard_normal((2, 3)))
    b = unit(r + 1e-3 * rng.standard_normal((2, 3)))
    boxes_of_arcminutes = ComponentBox.from_half_width(b, 1e-3), ComponentBox.from_half_width(r, 0.0)
    solution = optsat.solve(IntervalWahba(*boxes_of_arcminutes))
    q = optsat.wahba(b, r).answer
    assert np.degrees(quaternion.error_angle(solution.require(Proof.GLOBAL).answer.q_BN, q.q_BN)) < 1e-4
    np.testing.assert_array_equal(solution.answer.r_N, r)
