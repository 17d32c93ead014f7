"""Sensors of fault diagnosis: what they read, and whether their noise has the covariance that they claim."""

import numpy as np
import pytest
from scipy.stats import chi2

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.errors import InputError
from optsat.models.accelerometer import Accelerometer, Axes, Sensed
from optsat.models.additive_sensors import PositionReceiver, PressureSensor, RateGyro, SkewedGyro
from optsat.models.draws import rotations
from optsat.models.gaussian_errors import covariance
from optsat.models.star_tracker import StarTracker

COUNT = 20_000
FULL = np.array([[4.0, 1.0, -0.5], [1.0, 2.0, 0.3], [-0.5, 0.3, 1.0]])


def assert_covariance(draws: Array, P: Array) -> None:
    """Mean and covariance of the draws, whitened, within what chance allows once in 1e6."""
    white = np.linalg.solve(np.linalg.cholesky(P), draws.reshape(len(draws), -1).T)
    n, size = white.shape
    assert size * float(white.mean(axis=1) @ white.mean(axis=1)) < chi2.isf(1e-6, n)
    assert chi2.ppf(1e-6, n * size) < float(np.sum(white**2)) < chi2.isf(1e-6, n * size)
    correlation = (white @ white.T / size)[np.triu_indices(n, 1)]
    assert np.all(np.abs(correlation) < 6 / np.sqrt(size))


@pytest.mark.parametrize("sensor", [RateGyro(FULL), PositionReceiver(FULL), Accelerometer(FULL), StarTracker()])
def test_noise_has_the_covariance(sensor: RateGyro | PositionReceiver | Accelerometer | StarTracker) -> None:
    assert_covariance(sensor.draw(np.random.default_rng(1), COUNT), np.asarray(sensor.R))


def test_noise_of_single_numbers() -> None:
    rng = np.random.default_rng(2)
    assert_covariance(SkewedGyro(sigma=0.02).draw(rng, COUNT), np.array([[4e-4]]))
    assert_covariance(PressureSensor().draw(rng, COUNT), 0.25 * np.eye(3))


def test_the_bias_walks() -> None:
    gyro, t = RateGyro(bias=(0.1, 0.2, 0.3), bias_walk=0.5), np.array([0.0, 0.5, 2.0, 4.0])
    rng = np.random.default_rng(3)
    paths = np.stack([gyro.draw_bias(rng, t) for _ in range(4000)])
    np.testing.assert_array_equal(paths[:, 0], np.tile([0.1, 0.2, 0.3], (4000, 1)))
    steps = np.diff(paths, axis=1).reshape(4000, 9)
    assert_covariance(steps, 0.25 * np.diag(np.repeat(np.diff(t), 3)))
    np.testing.assert_array_equal(RateGyro(bias=(1, 2, 3)).draw_bias(rng, t), np.tile([1.0, 2.0, 3.0], (4, 1)))


def test_total_acceleration_and_specific_force() -> None:
    q = rotations(np.random.default_rng(4), 1)[0]
    acceleration, gravity, noise = np.array([1.0, 2, 3]), np.array([0.5, 0.5, 4]), np.array([0.1, 0, 0])
    readings = {
        (sensed, axes): Accelerometer(sensed=sensed, axes=axes).measurement()(q, acceleration, gravity, noise) - noise
        for sensed in Sensed
        for axes in Axes
    }
    np.testing.assert_allclose(readings[Sensed.TOTAL, Axes.INERTIAL], acceleration)
    np.testing.assert_allclose(readings[Sensed.SPECIFIC_FORCE, Axes.INERTIAL], acceleration - gravity)
    np.testing.assert_allclose(readings[Sensed.TOTAL, Axes.BODY], quaternion.transform(q, acceleration))
    np.testing.assert_allclose(
        readings[Sensed.SPECIFIC_FORCE, Axes.BODY], quaternion.transform(q, acceleration - gravity), atol=1e-15
    )


def test_additive_readings() -> None:
    x, n = np.array([1.0, 2, 3]), np.array([0.5, 0.25, 0])
    assert RateGyro().measurement()(x, n, n).tolist() == [2.0, 2.5, 3.0]
    assert PositionReceiver().measurement()(x, n).tolist() == [1.5, 2.25, 3.0]
    assert PressureSensor().measurement()(x, n).tolist() == [1.5, 2.25, 3.0]
    assert float(SkewedGyro((0, 3, 4)).measurement()(x, 0.5)) == pytest.approx(0.6 * 2 + 0.8 * 3 + 0.5)


def test_star_tracker_without_noise_is_the_attitude() -> None:
    q = rotations(np.random.default_rng(5), 10)
    np.testing.assert_allclose(StarTracker().measurement().batch(q, np.zeros((10, 4))), q, atol=1e-16)
    # either sign of the truth gives w >= 0
    np.testing.assert_allclose(StarTracker().measurement().batch(-q, np.zeros((10, 4))), q, atol=1e-16)


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (np.eye(2), r"must have shape \(3, 3\)"),
        (np.diag([1.0, 1.0, 0.0]), "positive definite .*least eigenvalue is 0"),
        (np.diag([1.0, -2.0, 1.0]), "least eigenvalue is -2"),
        ([[1, 0.1, 0], [0.2, 1, 0], [0, 0, 1]], r"symmetric .*entry \(0, 1\) is 0.1, entry \(1, 0\) is 0.2"),
        (np.full((3, 3), np.nan), "must be finite"),
    ],
)
def test_covariances_are_checked(value: Array, says: str) -> None:
    with pytest.raises(InputError, match=says):
        RateGyro(value)


def test_covariances_are_symmetric_to_the_bit_and_fixed() -> None:
    P = covariance("P", [[1.0, 0.1], [0.1 + 1e-12, 1.0]], 2, "-")
    assert P[0, 1] == P[1, 0]
    assert not P.flags.writeable


def test_single_numbers_are_checked() -> None:
    with pytest.raises(InputError, match="`sigma` must be > 0"):
        PressureSensor(0.0)
    with pytest.raises(InputError, match="`axis_B` is the zero vector"):
        SkewedGyro((0, 0, 0))
    with pytest.raises(InputError, match="`bias_walk` must be >= 0"):
        RateGyro(bias_walk=-1.0)
    assert SkewedGyro((0, 0, 2)).axis_B == (0, 0, 1)
