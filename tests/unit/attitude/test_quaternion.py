"""Quaternion algebra against worked numbers, SciPy and closed forms."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.errors import InputError


def some(count: int, seed: int = 1) -> Array:
    return quaternion.from_scipy(Rotation.random(count, rng=np.random.default_rng(seed)))


def test_composition_has_the_minus_sign() -> None:
    p = [0, 0, np.sin(0.1), np.cos(0.1)]
    q = [np.sin(0.2), 0, 0, np.cos(0.2)]
    c1, s1, c2, s2 = np.cos(0.1), np.sin(0.1), np.cos(0.2), np.sin(0.2)
    np.testing.assert_allclose(quaternion.compose(p, q), [c1 * s2, -s1 * s2, s1 * c2, c1 * c2], atol=1e-16)


def test_composition_is_scipy_in_reverse_order() -> None:
    p, q = some(200, 1), some(200, 2)
    expected = quaternion.from_scipy(quaternion.to_scipy(q) * quaternion.to_scipy(p))
    np.testing.assert_allclose(quaternion.canonical(quaternion.compose(p, q)), expected, atol=1e-15)


def test_transform_is_the_matrix() -> None:
    q, r = some(200), np.random.default_rng(3).normal(size=(200, 3))
    expected = np.einsum("nij,nj->ni", dcm.from_quaternion(q), r)
    np.testing.assert_allclose(quaternion.transform(q, r), expected, atol=1e-14)


def test_scipy_round_trip_and_its_meaning() -> None:
    q, r = some(50), np.random.default_rng(3).normal(size=(50, 3))
    np.testing.assert_allclose(quaternion.from_scipy(quaternion.to_scipy(q)), q, atol=1e-15)
    b_B = quaternion.transform(q, r)
    np.testing.assert_allclose(quaternion.to_scipy(q).apply(b_B), r, atol=1e-14)


@pytest.mark.parametrize(
    ("q", "expected"),
    [
        ([0.6, 0, 0, -0.8], [-0.6, 0, 0, 0.8]),
        ([-1, 0, 0, 0], [1, 0, 0, 0]),
        ([0, -0.6, 0.8, 0], [0, 0.6, -0.8, 0]),
        ([0, 0, -1, 0], [0, 0, 1, 0]),
        ([0, 0, -1, -0.0], [0, 0, 1, 0]),
        ([0.6, 0, 0, 0.8], [0.6, 0, 0, 0.8]),
    ],
)
def test_canonical_sign(q: list[float], expected: list[float]) -> None:
    result = quaternion.canonical(q)
    assert result.tolist() == expected
    assert not np.any(np.signbit(result) & (result == 0))
    symbol = ca.SX.sym("q", 4)
    assert ca.Function("f", [symbol], [quaternion.canonical(symbol)])(q).full().ravel().tolist() == expected


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-140, 1e-12, 1e-8, 1e-3, 1.0, 3.0, np.pi])
def test_error_angle_keeps_its_digits(angle: float) -> None:
    axis = np.array([2, -1, 2]) / 3
    turned = np.append(np.sin(angle / 2) * axis, np.cos(angle / 2))
    assert quaternion.error_angle(turned, quaternion.identity()) == pytest.approx(angle, rel=1e-14, abs=1e-300)
    assert quaternion.error_angle(-turned, quaternion.identity()) == pytest.approx(angle, rel=1e-14, abs=1e-300)


def test_kinematics_is_the_derivative_of_the_matrix() -> None:
    q, omega = some(1)[0], np.array([0.3, -0.2, 0.5])
    h = 1e-6
    q_dot = quaternion.derivative(q, omega)
    difference = (quaternion.propagate(q, omega, h) - quaternion.propagate(q, omega, -h)) / (2 * h)
    np.testing.assert_allclose(q_dot, difference, atol=1e-10)
    A = dcm.from_quaternion(q)
    A_dot = (
        dcm.from_quaternion(quaternion.propagate(q, omega, h)) - dcm.from_quaternion(quaternion.propagate(q, omega, -h))
    ) / (2 * h)
    cross = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    np.testing.assert_allclose(A_dot, -cross @ A, atol=1e-9)


def test_propagation_is_the_matrix_exponential() -> None:
    from scipy.linalg import expm

    q, omega, dt = some(1)[0], np.array([0.3, -0.2, 0.5]), 7.0
    cross = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    after = dcm.from_quaternion(quaternion.propagate(q, omega, dt))
    np.testing.assert_allclose(after, expm(-cross * dt) @ dcm.from_quaternion(q), atol=1e-13)


@pytest.mark.parametrize("angle", [0.0, 1e-200, 1e-9, 0.0999999, 0.1, 0.1000001, 1.0, 3.2, 6.2, 7.0])
def test_exponential_is_smooth_across_its_series(angle: float) -> None:
    axis = np.array([2, -1, 2]) / 3
    expected = np.append(np.sin(angle / 2) * axis, np.cos(angle / 2))
    np.testing.assert_allclose(quaternion.exponential(angle * axis), expected, rtol=3e-16, atol=1e-15)


def test_scalar_first() -> None:
    q = some(5)
    assert np.array_equal(quaternion.to_scalar_first(q)[:, 0], q[:, 3])
    assert np.array_equal(quaternion.from_scalar_first(quaternion.to_scalar_first(q)), q)
    assert np.all(quaternion.from_scalar_first(-quaternion.to_scalar_first(q))[:, 3] >= 0)


def test_continuous_signs_restore_a_smooth_turn() -> None:
    angle = np.linspace(0, 8 * np.pi, 400)
    smooth = np.stack((np.sin(angle / 2), 0 * angle, 0 * angle, np.cos(angle / 2)), axis=-1)
    broken = quaternion.canonical(smooth)
    assert np.abs(np.diff(broken, axis=0)).max() > 1
    np.testing.assert_array_equal(quaternion.continuous_signs(broken), smooth)
    assert quaternion.continuous_signs(np.zeros((0, 4))).shape == (0, 4)
    with pytest.raises(InputError, match=r"`q_BN` must be a time series of shape \(m, 4\)"):
        quaternion.continuous_signs([0, 0, 0, 1])


def test_bad_numbers_are_refused_by_name_and_row() -> None:
    good = some(3)
    bad = good.copy()
    bad[1] *= 1 + 2e-6
    with pytest.raises(InputError, match=r"`q` must hold unit quaternions .* row 1 norm was 1"):
        quaternion.compose(good, bad)
    with pytest.raises(InputError, match="norm was 0"):
        quaternion.inverse([0, 0, 0, 0])
    with pytest.raises(InputError, match=r"`q_BN` must be finite .*row 2"):
        quaternion.canonical(np.vstack((good[:2], [np.nan, 0, 0, 1])))
    with pytest.raises(InputError, match=r"`r_N` must have shape \(..., 3\)"):
        quaternion.transform(good, [1, 2])
    with pytest.raises(InputError, match=r"`q_BN` must have shape .* `\.T`"):
        quaternion.inverse(good[:2].T)
    with pytest.raises(InputError, match=r"compose: the sample axes do not fit together: `p` \(3,\), `q` \(2,\)"):
        quaternion.compose(good, good[:2])


def test_rounding_is_repaired_but_unit_quaternions_keep_their_bits() -> None:
    q = some(100)
    assert np.array_equal(quaternion.inverse(quaternion.inverse(q)), q)
    off = quaternion.inverse(q * (1 + 5e-7))
    np.testing.assert_allclose(np.linalg.norm(off, axis=-1), 1, atol=3e-16)
