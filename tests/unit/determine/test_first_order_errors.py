"""First-order covariance against Monte Carlo, statistical bounds against SciPy's chi-square and drawn noise."""

import numpy as np
import pytest
from scipy import stats

import optsat
from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.davenport import davenport_matrix, dominant_quaternion

R_N = np.array([(1.0, 0, 0), (0.6, 0.8, 0), (0, 0.28, 0.96)])
SIGMA = np.array([1e-3, 3e-3, 2e-3])


def noisy(rng: np.random.Generator, count: int) -> Array:
    """Return directions (count, 3, 3) with Gaussian noise of SIGMA in each tangent axis."""
    noise = rng.standard_normal((count, 3, 3)) * SIGMA[:, None]
    noise -= np.sum(noise * R_N, axis=-1, keepdims=True) * R_N
    b_B = R_N + noise
    return np.asarray(b_B / np.linalg.norm(b_B, axis=-1, keepdims=True))


@pytest.mark.parametrize("weights", [np.ones(3), 1 / SIGMA**2, np.array([1.0, 5.0, 0.2])], ids=["equal", "best", "odd"])
def test_covariance_against_drawn_noise(weights: Array) -> None:
    b_B = noisy(np.random.default_rng(0), 20_000)
    q_BN = dominant_quaternion(
        davenport_matrix(b_B, np.broadcast_to(R_N, b_B.shape), np.broadcast_to(weights, (20_000, 3)))
    )
    # the truth is the identity: the error is q_true (x) q^-1, its vector part half the rotation in B
    error = -2 * q_BN[:, :3] * np.sign(q_BN[:, 3:])
    measured = error.T @ error / len(error)
    stated = optsat.wahba(R_N, R_N, weights).answer.covariance_B(SIGMA)
    scale = np.sqrt(np.diag(stated))
    np.testing.assert_allclose(measured / np.outer(scale, scale), stated / np.outer(scale, scale), atol=0.04)


def test_covariance_at_the_best_weights_is_the_inverse_information() -> None:
    stated = optsat.wahba(R_N, R_N, 1 / SIGMA**2).answer.covariance_B(SIGMA)
    information = sum((np.eye(3) - np.outer(b, b)) / s**2 for b, s in zip(R_N, SIGMA, strict=True))
    np.testing.assert_allclose(stated, np.linalg.inv(information), rtol=1e-12, atol=1e-20)
    np.testing.assert_array_equal(stated, stated.T)
    for other in (np.ones(3), np.array([1.0, 5.0, 0.2])):
        worse = optsat.wahba(R_N, R_N, other).answer.covariance_B(SIGMA)
        assert np.linalg.eigvalsh(worse - stated)[0] >= -1e-18


def test_certified_attitude_takes_its_bounds_as_deviations() -> None:
    attitude = optsat.certify_attitude(R_N, R_N, 2 * SIGMA)
    np.testing.assert_allclose(attitude.covariance_B(), attitude.covariance_B(SIGMA), rtol=1e-15)
    np.testing.assert_allclose(attitude.covariance_B(0.002), attitude.covariance_B(np.full(3, 0.002)), rtol=1e-15)


@pytest.mark.parametrize("probability", [0.5, 0.9, 0.9973, 1 - 1e-9])
@pytest.mark.parametrize("m", [1, 2, 7])
def test_statistical_bound_is_the_chi_square_quantile(probability: float, m: int) -> None:
    sigma = np.linspace(0.001, 0.01, m)
    quantile = stats.chi2.isf((1 - probability) / m, 2)
    np.testing.assert_allclose(optsat.statistical_angle_bound(sigma, probability), sigma * np.sqrt(quantile), rtol=1e-9)


def test_statistical_bounds_hold_together_as_often_as_stated() -> None:
    bound = optsat.statistical_angle_bound(SIGMA, 0.9)
    b_B = noisy(np.random.default_rng(1), 20_000)
    off = 2 * np.arcsin(np.linalg.norm(b_B - R_N, axis=-1) / 2)
    together = np.mean(np.all(off <= bound, axis=1))
    # independent errors: (1 - 0.1 / 3)^3 = 0.9033; the union bound promises 0.9
    assert together == pytest.approx((1 - 0.1 / 3) ** 3, abs=0.008)


def test_certificates_with_statistical_bounds_fail_no_more_often_than_stated() -> None:
    bound = optsat.statistical_angle_bound(SIGMA[:2], 0.8)
    b_B = noisy(np.random.default_rng(2), 5000)[:, :2]
    batch = optsat.certify_attitude_batch(b_B, np.broadcast_to(R_N[:2], b_B.shape), bound)
    held = quaternion.error_angle(batch.q_BN, quaternion.identity()) <= np.nan_to_num(batch.bound_rad, nan=0.0)
    assert held.mean() >= 0.8
