"""Worked numbers of the robust Wahba specification, section 16, and the reproduction of the paper's equation (9)."""

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.attitude.davenport import davenport_matrix, dominant_quaternion, pair_matrices
from optsat.attitude.two_vector import BoundOfWeights, best_weights, pair_angle, wahba_dcm

R9 = np.array([(-0.54, -0.326, 0.775), (-0.673, 0.000133, 0.74)])
B9 = np.array([(-0.776, -0.46, 0.43), (-0.927, 0.01, 0.374)])

B2 = np.array([(1, 0, 0), (0.28, 0.96, 0)])
R2 = np.array([(0, 0.6, 0.8), (0.936, 0, 0.352)])
EPS2 = np.array([0.02, 0.05])

B3 = np.vstack([B2, (0, 0, 1)])
R3 = np.vstack([R2, (0.28, 0.768, -0.576)])
EPS3 = np.array([0.02, 0.05, 0.08])

HALF = np.array([0.5, 0.5])


def unit(rows: Array) -> Array:
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def test_item_1_matrix_of_a_quaternion() -> None:
    expected = [[2 / 15, 14 / 15, -1 / 3], [-2 / 3, 1 / 3, 2 / 3], [11 / 15, 2 / 15, 2 / 3]]
    np.testing.assert_allclose(dcm.from_quaternion(np.array([1, 2, 3, 4]) / np.sqrt(30)), expected, atol=1e-15)


@pytest.mark.parametrize(
    ("b_B", "r_N", "eigenvalues", "q_BN"),
    [
        (B9, R9, (0.99657533, 0.90865114), (-0.07072628, 0.21221665, 0.01255887, 0.97457897)),
        (unit(B9), unit(R9), (0.99732066, 0.90933068), (-0.07073959, 0.21220963, 0.01253971, 0.97457978)),
    ],
    ids=["raw", "normalised"],
)
def test_item_2_equation_9(b_B: Array, r_N: Array, eigenvalues: tuple[float, float], q_BN: Array) -> None:
    K = davenport_matrix(b_B, r_N, HALF)
    first, second = eigenvalues
    np.testing.assert_allclose(np.linalg.eigvalsh(K), (-first, -second, second, first), atol=6e-9)
    np.testing.assert_allclose(quaternion.canonical(dominant_quaternion(K)), q_BN, atol=6e-9)


def test_equation_9_as_printed_is_scalar_first_with_the_sign_turned() -> None:
    printed = np.array([-0.9746, 0.0707, -0.2122, -0.0125])
    q_BN = optsat.wahba(B9, R9).answer.q_BN
    read = quaternion.from_scalar_first(printed / np.linalg.norm(printed))
    assert np.degrees(quaternion.error_angle(q_BN, read)) <= 0.02
    as_it_stands = printed / np.linalg.norm(printed)
    assert np.degrees(quaternion.error_angle(q_BN, as_it_stands)) > 90


def test_equation_9_data_contradict_themselves() -> None:
    separation = np.degrees([float(pair_angle(unit(R9))), float(pair_angle(unit(B9)))])
    np.testing.assert_allclose(separation, (20.39, 28.78), atol=5e-3)
    each = np.degrees(np.arccos(np.sum(unit(B9) * (unit(R9) @ optsat.wahba(B9, R9).answer.dcm_BN.T), axis=1)))
    np.testing.assert_allclose(each, 4.19, atol=6e-3)


def test_item_3_closed_form() -> None:
    theta_b, theta_r = pair_angle(B2), pair_angle(R2)
    assert float(theta_b) == pytest.approx(1.2870022176, abs=6e-11)
    assert float(theta_r) == pytest.approx(1.2853351449, abs=6e-11)
    assert np.log(np.sin(0.025) / np.sin(0.01)) == pytest.approx(0.9162032298, abs=6e-11)
    weights = best_weights(B2, R2, EPS2)
    # the minimum is flat: its place is known to half the digits of its value
    assert np.log(weights[0] / weights[1]) == pytest.approx(0.42548545, abs=2e-5)
    assert weights[0] == pytest.approx(0.60479512, abs=5e-6)
    rho = BoundOfWeights.of(theta_b, theta_r, EPS2)(np.log(weights[0] / weights[1]))
    assert float(rho) == pytest.approx(9.388062626e-4, abs=6e-14)


def test_item_3_eigenvalues_at_the_best_weights() -> None:
    weights = np.array([0.60479512, 1 - 0.60479512])
    K = davenport_matrix(B2, R2, weights)
    large, small = 0.9999996679, 0.3454172751
    np.testing.assert_allclose(np.linalg.eigvalsh(K), (-large, -small, small, large), atol=2e-9)
    S = K - weights @ np.cos(EPS2) * np.eye(4)
    s = np.linalg.eigvalsh(S)[::-1]
    np.testing.assert_allclose(s, (6.145260497e-4, -0.6539678667, -1.344802417, -1.999384810), atol=2e-9)
    assert s[0] / (s[0] - s[1]) == pytest.approx(9.388062626e-4, abs=6e-13)


def test_item_3_certified_attitude() -> None:
    attitude = optsat.certify_attitude(B2, R2, EPS2)
    assert attitude.bound_rad == pytest.approx(0.06128948345, abs=6e-12)
    np.testing.assert_allclose(
        attitude.q_BN, (-0.6633877527, -0.5937671156, -0.3843981676, 0.2441215899), rtol=0, atol=1e-8
    )
    expected = [
        [-0.0006426777, 0.6001158813, 0.7999128177],
        [0.9754754486, -0.1756905235, 0.1325914366],
        [0.2201073285, 0.7803805283, -0.5852853962],
    ]
    np.testing.assert_allclose(attitude.dcm_BN, expected, rtol=0, atol=2e-8)
    np.testing.assert_allclose(wahba_dcm(B2, R2, attitude.weights), expected, rtol=0, atol=2e-8)


def test_item_3_q_method_at_equal_weights() -> None:
    eigenvalues = np.linalg.eigvalsh(davenport_matrix(B2, R2, HALF))
    large, small = 0.99999965261, 0.28080009755
    np.testing.assert_allclose(eigenvalues, (-large, -small, small, large), atol=6e-12)
    assert optsat.wahba(B2, R2).answer.loss == pytest.approx(3.473914e-7, abs=6e-14)


@pytest.mark.parametrize(
    ("weights", "bound_rad"),
    [
        (np.ones(3), 0.06608979608),
        (1 / EPS3, 0.06364266305),
        (1 / (1 - np.cos(EPS3)), 0.07050564747),
    ],
    ids=["equal", "one over bound", "one over versine"],
)
def test_item_4_theorem_1_at_fixed_weights(weights: Array, bound_rad: float) -> None:
    attitude = optsat.certify_attitude(B3, R3, EPS3, weights=weights)
    assert attitude.bound_rad == pytest.approx(bound_rad, abs=6e-12)
    s = np.linalg.eigvalsh(davenport_matrix(B3, R3, weights / weights.sum()))
    plain = (s[3] - weights @ np.cos(EPS3) / weights.sum()) / (s[3] - s[2])
    assert 2 * np.arcsin(np.sqrt(plain)) == pytest.approx(bound_rad, abs=6e-12)


def test_item_4_optimal_weights() -> None:
    attitude = optsat.certify_attitude(B3, R3, EPS3)
    assert attitude.bound_rad == pytest.approx(0.06050301683, abs=2e-10)
    np.testing.assert_allclose(attitude.weights, (0.567227, 0.373079, 0.059695), atol=2e-5)
    np.testing.assert_allclose(attitude.q_BN, (-0.664821, -0.592112, -0.386734, 0.240527), atol=2e-6)


def test_item_5_support_of_a_box() -> None:
    box = optsat.ComponentBox([(0.5, 0.1, 0.6)], [(0.7, 0.4, 0.9)])
    np.testing.assert_allclose([box.support(0, e) for e in np.eye(3)], (0.7, 0.4, 0.8602325267), atol=6e-11)
    np.testing.assert_allclose([box.support(0, -e) for e in np.eye(3)], (-0.5, -0.1, -0.6), atol=6e-11)
    np.testing.assert_allclose(box.midpoint_directions()[0], (0.6045512662, 0.2518963609, 0.7556890828), atol=6e-11)
    assert box.cone_angles()[0] == pytest.approx(0.2328296657, abs=6e-11)


def test_item_5_ring_needs_the_rule_for_a_direction_without_free_part() -> None:
    ring = optsat.ComponentBox([(-0.5, -0.5, 0.9)], [(0.5, 0.5, 0.95)])
    assert ring.support(0, (0, 0, 1)) == pytest.approx(0.95, abs=1e-15)
    assert ring.support(0, (0, 0, -1)) == pytest.approx(-0.9, abs=1e-15)


def test_item_7_composition() -> None:
    p = np.array([0, 0, np.sin(0.1), np.cos(0.1)])
    q = np.array([np.sin(0.2), 0, 0, np.cos(0.2)])
    vector = (np.cos(0.1) * np.sin(0.2), -np.sin(0.1) * np.sin(0.2), np.sin(0.1) * np.cos(0.2))
    np.testing.assert_allclose(quaternion.compose(p, q), (*vector, np.cos(0.1) * np.cos(0.2)), atol=1e-16)


def test_quadratic_form_of_a_pair_is_its_scalar_product() -> None:
    rng = np.random.default_rng(9)
    u, w, q = rng.standard_normal((3, 50, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    K = pair_matrices(u[:, :3], w[:, :3])
    form = np.einsum("ni,nij,nj->n", q, K, q)
    product = np.sum(u[:, :3] * np.einsum("nij,nj->ni", dcm.from_quaternion(q), w[:, :3]), axis=1)
    np.testing.assert_allclose(form, product, atol=1e-13)
    np.testing.assert_allclose(np.trace(K, axis1=1, axis2=2), 0, atol=1e-14)
