"""Worst-case Wahba: worked numbers, the inner maximum by other routes, certificates, what the tool is not for."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.box_corners import BoxCorners
from optsat.attitude.davenport import rotation_matrix, turn
from optsat.attitude.status import AttitudeStatus
from optsat.certificates.worst_case_certificate import WorstCaseCertificate
from optsat.errors import CertificateFormatError, InfeasibleBoxError, InputError, UnknownOptionError
from optsat.forms import Point
from optsat.models.draws import rotations
from optsat.problems.component_box import ComponentBox
from optsat.problems.worst_case_wahba import WorstCaseWahba
from optsat.solution import Proof, Termination

B_B = np.array([[1.0, 0, 0], [0.28, 0.96, 0]])
R_N = np.array([[0, 0.6, 0.8], [0.936, 0, 0.352]])
RADIUS = np.array([[0.05, 0.1, 0.02], [0.08, 0.03, 0.1]])
MANY = ComponentBox.from_half_width(np.tile([[1.0, 0, 0]], (600, 1)), 0.1)


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def draw(rng: np.random.Generator, size: float, reference: float, count: int) -> tuple[ComponentBox, ComponentBox]:
    """Return boxes with radii up to size and size * reference, the truth inside most of them."""
    r = unit(rng.standard_normal((count, 3)))
    A = rotation_matrix(rotations(rng, 1)[0])
    b_half, r_half = size * rng.uniform(0, 1, (count, 3)), reference * size * rng.uniform(0, 1, (count, 3))
    b_mid = unit(r @ A.T + b_half * rng.uniform(-1, 1, (count, 3)))
    r_mid = unit(r + r_half * rng.uniform(-1, 1, (count, 3)))
    return ComponentBox.from_half_width(b_mid, b_half), ComponentBox.from_half_width(r_mid, r_half)


def test_worked_number_of_the_specification() -> None:
    solution = optsat.worst_case_wahba(ComponentBox.from_half_width(B_B, RADIUS), R_N)
    answer = solution.require(Proof.GLOBAL).answer
    assert answer.worst_case_loss == pytest.approx(0.0076217165, abs=1e-10)
    assert answer.q_method_loss == pytest.approx(0.0076275426, abs=1e-10)
    np.testing.assert_allclose(
        answer.q_BN * np.sign(answer.q_BN[3]), [-0.663583, -0.593549, -0.384318, 0.244248], atol=2e-6
    )


def test_the_corner_maximum_is_the_closed_form_for_body_boxes() -> None:
    rng = np.random.default_rng(1)
    corners = BoxCorners(B_B, RADIUS, R_N, np.zeros((2, 3)), np.array([0.3, 0.7]))
    for q in rotations(rng, 20):
        error = B_B - R_N @ rotation_matrix(q).T
        closed = 0.5 * np.sum((np.abs(error) + RADIUS) ** 2, axis=1)
        assert corners.worst_case_loss(q) == pytest.approx(float([0.3, 0.7] @ closed), rel=1e-14)


def test_the_corner_maximum_is_above_every_sample_and_below_the_triangle_bound() -> None:
    rng = np.random.default_rng(2)
    r_radius = RADIUS[::-1]
    corners = BoxCorners(B_B, RADIUS, R_N, r_radius, np.array([0.5, 0.5]))
    for q in rotations(rng, 5):
        A = rotation_matrix(q)
        alpha, beta = rng.uniform(-1, 1, (2, 4000, 2, 3))
        gap = B_B + alpha * RADIUS - (R_N + beta * r_radius) @ A.T
        sampled = np.max(0.5 * np.sum(gap**2, axis=-1), axis=0).mean()
        upper = 0.5 * np.sum((np.abs(B_B - R_N @ A.T) + RADIUS + r_radius @ np.abs(A).T) ** 2, axis=1).mean()
        assert sampled <= corners.worst_case_loss(q) <= upper + 1e-15
        assert sampled > 0.8 * corners.worst_case_loss(q)


def test_quadratics_are_the_losses_of_turned_attitudes() -> None:
    rng = np.random.default_rng(3)
    corners = BoxCorners(B_B, RADIUS, R_N, RADIUS, np.array([0.5, 0.5]))
    q, g = rotations(rng, 1)[0], rng.standard_normal(3)
    a, h, C = corners.quadratics(q)
    value = (a + 2 * h @ g + np.einsum("i,vij,j->v", g, C, g)) / (1 + g @ g)
    np.testing.assert_allclose(value, corners.losses(turn(q, g)), atol=1e-13)


@pytest.mark.parametrize(("size", "reference"), [(0.2, 0.0), (1e-3, 0.0), (1e-5, 0.0), (0.05, 1.0), (1e-5, 1.0)])
def test_random_boxes_are_solved_to_a_proof_that_samples_cannot_break(size: float, reference: float) -> None:
    rng = np.random.default_rng(4)
    for count in (2, 3, 5):
        b, r = draw(rng, size, reference, count)
        solution = optsat.worst_case_wahba(b, r)
        answer, corners = solution.require(Proof.GLOBAL).answer, solution.answer.certificate.corners
        assert answer.rank_ratio < 1e-6
        assert solution.residuals["gap"] <= 1e-8 * answer.worst_case_loss
        assert answer.worst_case_loss <= answer.q_method_loss
        assert answer.certificate.error_bound < 1e-3 * size
        near = [turn(answer.q_BN, 3 * size * g) for g in rng.standard_normal((100, 3))]
        for q in [*near, *rotations(rng, 50)]:
            assert corners.worst_case_loss(q) >= answer.lower_bound
            if corners.worst_case_loss(q) <= answer.worst_case_loss:
                assert quaternion.error_angle(q, answer.q_BN) <= answer.certificate.error_bound


def test_where_the_programme_leaves_a_gap_the_label_says_so_and_the_bound_still_holds() -> None:
    rng = np.random.default_rng(5)
    proofs = set()
    for _ in range(12):
        b, r = draw(rng, 0.5, 1.0, 2)
        solution = optsat.worst_case_wahba(b, r)
        answer = solution.answer
        proofs.add(solution.proof)
        corners = answer.certificate.corners
        assert answer.lower_bound <= answer.worst_case_loss <= answer.q_method_loss
        assert all(corners.worst_case_loss(q) >= answer.lower_bound for q in rotations(rng, 300))
        assert answer.certificate.verify()
        if solution.proof is not Proof.GLOBAL:
            assert solution.residuals["gap"] > 1e-6 * answer.worst_case_loss
            assert answer.rank_ratio > 1e-6
            step = [turn(answer.q_BN, 1e-4 * g) for g in rng.standard_normal((100, 3))]
            assert all(corners.worst_case_loss(q) >= answer.worst_case_loss - 1e-9 for q in step)
    assert {Proof.GLOBAL, Proof.STATIONARY} <= proofs


def test_reference_boxes_of_no_width_are_exact_references() -> None:
    boxes = ComponentBox.from_half_width(B_B, RADIUS)
    exact = optsat.worst_case_wahba(boxes, R_N).answer
    boxed = optsat.worst_case_wahba(boxes, ComponentBox.from_half_width(R_N, 0.0)).answer
    np.testing.assert_allclose(exact.q_BN, boxed.q_BN, atol=1e-12)


def test_boxes_of_no_width_give_wahbas_attitude() -> None:
    rng = np.random.default_rng(6)
    b, r = unit(rng.standard_normal((4, 3))), unit(rng.standard_normal((4, 3)))
    answer = optsat.worst_case_wahba(ComponentBox.from_half_width(b, 0.0), r, [1, 2, 3, 4]).answer
    plain = optsat.wahba(b, r, [1, 2, 3, 4]).answer
    assert quaternion.error_angle(answer.q_BN, plain.q_BN) < 1e-7
    assert answer.worst_case_loss == pytest.approx(plain.loss, rel=1e-12)


def test_consistent_exact_data_cost_nothing() -> None:
    A = rotation_matrix(rotations(np.random.default_rng(7), 1)[0])
    solution = optsat.worst_case_wahba(ComponentBox.from_half_width(R_N @ A.T, 0.0), R_N)
    assert solution.answer.worst_case_loss < 1e-28
    np.testing.assert_allclose(solution.answer.dcm_BN, A, atol=1e-12)


def test_a_half_turn_and_a_common_rotation_change_nothing_but_the_attitude() -> None:
    boxes = ComponentBox.from_half_width(B_B, RADIUS)
    plain = optsat.worst_case_wahba(boxes, R_N).answer
    for axis in np.eye(3):
        half_turn = 2 * np.outer(axis, axis) - np.eye(3)
        turned = optsat.worst_case_wahba(boxes, R_N @ plain.dcm_BN.T @ half_turn).answer
        np.testing.assert_allclose(turned.dcm_BN, half_turn, atol=1e-6)
        assert turned.worst_case_loss == pytest.approx(plain.worst_case_loss, rel=1e-10)


def test_order_of_pairs_and_weights_of_zero() -> None:
    b, r = draw(np.random.default_rng(8), 0.1, 0.0, 3)
    mid, half, ref = b.midpoint, b.radius, r.midpoint
    first = optsat.worst_case_wahba(b, ref, [1.0, 0.0, 2.0]).answer
    swapped = optsat.worst_case_wahba(ComponentBox.from_half_width(mid[::-1], half[::-1]), ref[::-1], [2, 0, 1]).answer
    dropped = optsat.worst_case_wahba(ComponentBox.from_half_width(mid[::2], half[::2]), ref[::2], [1, 2]).answer
    assert quaternion.error_angle(first.q_BN, swapped.q_BN) < 1e-5
    assert quaternion.error_angle(first.q_BN, dropped.q_BN) < 1e-5


@pytest.mark.parametrize("count", [1, 3])
def test_parallel_directions_are_said_to_leave_a_rotation_free(count: int) -> None:
    boxes = ComponentBox.from_half_width(np.tile([[1.0, 0, 0]], (count, 1)), 0.1)
    answer = optsat.worst_case_wahba(boxes, np.tile([[0, 0.6, 0.8]], (count, 1))).answer
    assert answer.status is AttitudeStatus.UNBOUNDED
    assert answer.certificate.error_bound == np.pi


def test_a_solver_that_fails_leaves_a_valid_answer_and_no_proof() -> None:
    problem = WorstCaseWahba(ComponentBox.from_half_width(B_B, RADIUS), R_N)
    for dual in (np.zeros(0), np.full(26, np.nan), np.zeros(26)):
        failed = problem.interpret(Point(np.full(11, np.nan), dual, Termination.NUMERICAL_ERROR), "none")
        assert failed.proof is Proof.FEASIBLE
        assert failed.certificate
        assert failed.certificate.verify()
        assert failed.answer.worst_case_loss <= failed.answer.q_method_loss
        assert failed.answer.lower_bound < 0.0076217165


def test_it_is_a_worst_case_and_not_an_accuracy() -> None:
    rng = np.random.default_rng(9)
    gain, worse = [], []
    for _ in range(60):
        q = rotations(rng, 1)[0]
        r = unit(rng.standard_normal((2, 3)))
        half = 0.1 * rng.uniform(0, 1, (2, 3))
        b = unit(r @ rotation_matrix(q).T + half * rng.uniform(-1, 1, (2, 3)))
        answer = optsat.worst_case_wahba(ComponentBox.from_half_width(b, half), r).answer
        plain = optsat.wahba(b, r).answer
        gain.append(answer.worst_case_loss / answer.q_method_loss)
        worse.append(quaternion.error_angle(answer.q_BN, q) - quaternion.error_angle(plain.q_BN, q))
    assert np.mean(gain) < 0.99
    assert np.mean(worse) > -1e-3


def certificate() -> WorstCaseCertificate:
    return optsat.worst_case_wahba(ComponentBox.from_half_width(B_B, RADIUS), R_N).answer.certificate


def test_the_certificate_is_read_back_and_accepted() -> None:
    original = certificate()
    copy = WorstCaseCertificate.from_json(original.to_json())
    assert copy.verify()
    assert copy.margin() == original.margin() == 0.0
    assert copy.claim == original.claim
    assert "within" in copy.claim


def test_damaged_certificates_are_rejected() -> None:
    good = certificate()
    corners, shares = good.corners, good.shares
    wider = replace(corners, b_radius=corners.b_radius * 1.1)
    light = np.where(corners.pair == 0, shares * 1.01, shares)
    for damaged, reason in (
        (replace(good, gap=good.gap * (1 - 1e-6)), "recomputed gap"),
        (replace(good, distance_rad=good.distance_rad * 0.99), "recomputed distance"),
        (replace(good, q_BN=turn(good.q_BN, np.array([1e-4, 0, 0]))), "recomputed gap"),
        (replace(good, corners=wider), "recomputed gap"),
        (replace(good, shares=light), "exceed its weight"),
        (replace(good, shares=-shares), "must be >= 0"),
        (replace(good, shares=shares[:-1]), "corners but"),
        (replace(good, q_BN=2 * good.q_BN), "not a unit quaternion"),
        (replace(good, gap=float("nan")), "not finite"),
    ):
        verdict = damaged.verify()
        assert not verdict
        assert reason in verdict.reason


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "other"}, "`format` must be"),
        ({"weights": []}, "`weights` is empty"),
        ({"b_mid": [[1.0, 0.0]]}, "`b_mid` must"),
        ({"shares": [1.0]}, "`shares` must be finite numbers of shape"),
        ({"gap": "small"}, "`gap` must hold numbers"),
    ],
)
def test_damaged_files_name_the_field(change: dict[str, object], message: str) -> None:
    content = {**json.loads(certificate().to_json()), **change}
    with pytest.raises(CertificateFormatError, match=message):
        WorstCaseCertificate.from_json(json.dumps(content))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"b_B": B_B}, "`b_B` must be a ComponentBox, got ndarray"),
        ({"r_N": R_N[:1]}, "same number of boxes"),
        ({"b_B": ComponentBox(np.zeros((0, 3)), np.zeros((0, 3))), "r_N": np.zeros((0, 3))}, "`b_B` holds no boxes"),
        ({"r_N": R_N * np.nan}, "`r_N` must be finite"),
        ({"r_N": R_N.T}, "`r_N` must have shape"),
        ({"r_N": np.zeros((2, 3))}, "`r_N` row 0 is the zero vector"),
        ({"r_N": R_N + 1j}, "`r_N` must be real"),
        ({"b_B": MANY, "r_N": MANY}, "have 38400 corners in 600 pairs, more than the programme can hold"),
        ({"weights": [1.0, -1.0]}, "`weights` must be >= 0"),
        ({"weights": [0.0, 0.0]}, "`weights` are all zero"),
        ({"weights": [1.0]}, "`weights` must hold one weight per vector pair"),
        ({"r_N": 2 * R_N, "norm_policy": "error"}, "`r_N` must hold unit vectors"),
    ],
)
def test_bad_input_is_refused(arguments: dict[str, object], message: str) -> None:
    given: dict[str, object] = {"b_B": ComponentBox.from_half_width(B_B, RADIUS), "r_N": R_N, **arguments}
    with pytest.raises(InputError, match=message):
        optsat.worst_case_wahba(**given)  # type: ignore[arg-type]


def test_bad_boxes_are_refused() -> None:
    with pytest.raises(InputError, match="`half_width` must be >= 0"):
        ComponentBox.from_half_width(B_B, -0.1)
    with pytest.raises(InputError, match="`low` must not exceed `high`"):
        ComponentBox(B_B + 0.1, B_B)
    with pytest.raises(InfeasibleBoxError, match="Box 1 lies outside"):
        ComponentBox.from_half_width(B_B * [[1.0], [2.0]], 0.1)
    with pytest.raises(UnknownOptionError, match="Did you mean `weights`"):
        optsat.worst_case_wahba(ComponentBox.from_half_width(B_B, RADIUS), R_N, weigths=[1, 1])  # type: ignore[call-arg]


def test_all_corners_are_there_once() -> None:
    corners = BoxCorners(B_B, RADIUS, R_N, np.zeros((2, 3)), np.array([0.5, 0.5]))
    signs = np.array(list(itertools.product((1.0, -1.0), repeat=3)))
    np.testing.assert_array_equal(corners.b_B[:8], B_B[0] + signs * RADIUS[0])
    assert corners.first.tolist() == [0, 8]
    assert len(corners.pair) == 16
