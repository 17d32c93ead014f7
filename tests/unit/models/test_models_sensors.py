"""Sensors: no draw exceeds its bound, every law is what it says, measurements are the truth with the drawn error."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.errors import InputError
from optsat.models import draws
from optsat.models.gyro import Gyro
from optsat.models.sensors import BoxSensor, ConeSensor, MisalignedSensor, VectorSensor

SENSORS: list[VectorSensor] = [
    ConeSensor(math.radians(0.005)),
    ConeSensor(math.radians(0.5)),
    ConeSensor(3.0),
    BoxSensor([0.01, 0.02, 0.0]),
    BoxSensor([0.5, 0.5, 0.5]),
    MisalignedSensor(0.01, 0.02),
    MisalignedSensor(0.9, 1.5),
    MisalignedSensor(0.0, 0.0),
]
LAWS = {ConeSensor: ("cap", "angle", "boundary"), BoxSensor: ("uniform", "boundary")}


def angle_between(a: Array, b: Array) -> Array:
    return np.asarray(2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))


def truth(count: int, seed: int = 0) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(count, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    r_N = rng.normal(size=(count, 3))
    r_N /= np.linalg.norm(r_N, axis=-1, keepdims=True)
    return q, r_N, np.asarray(quaternion.transform(q, r_N))


@pytest.mark.parametrize("sensor", SENSORS, ids=repr)
def test_no_draw_exceeds_the_bound(sensor: VectorSensor) -> None:
    q, r_N, y = truth(3000)
    measurement = sensor.measurement()
    for law in LAWS.get(type(sensor), ("uniform", "boundary")):
        error = sensor.draw(np.random.default_rng(1), 3000, law)  # type: ignore[call-arg]
        b_B = measurement.batch(q, 5e-5 * r_N, error)
        np.testing.assert_allclose(np.linalg.norm(b_B, axis=-1), 1, atol=1e-15)
        assert angle_between(b_B, y).max() <= sensor.angle_bound + 2e-15


@pytest.mark.parametrize("half_angle", [1e-9, 0.01, 1.0, 3.1])
def test_cone_measurement_lies_at_the_drawn_angle(half_angle: float) -> None:
    q, r_N, y = truth(500)
    error = ConeSensor(half_angle).draw(np.random.default_rng(2), 500)
    b_B = ConeSensor(half_angle).measurement().batch(q, r_N, error)
    np.testing.assert_allclose(angle_between(b_B, y), error[:, 0], atol=1e-15 + 1e-15 * half_angle)


@pytest.mark.parametrize("axis", [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 1, 0], [1e-9, 0, -1]])
def test_cone_measurement_has_no_bad_direction(axis: list[float]) -> None:
    y = np.array(axis) / np.linalg.norm(axis)
    measurement = ConeSensor(0.1).measurement()
    azimuth = np.linspace(-np.pi, np.pi, 9)[:-1]
    b_B = measurement.batch(quaternion.identity(), y, np.stack((np.full(8, 0.1), azimuth), axis=-1))
    np.testing.assert_allclose(angle_between(b_B, y), 0.1, atol=1e-15)
    # eight equal azimuths: their mean lies on the axis
    np.testing.assert_allclose(b_B.mean(axis=0), math.cos(0.1) * y, atol=1e-15)


def test_cap_law_is_uniform_in_area_and_angle_law_in_angle() -> None:
    rng, eps = np.random.default_rng(3), 0.7
    cap = draws.cone_angles(rng, 5000, eps, "cap")
    assert kstest((1 - np.cos(cap)) / (1 - math.cos(eps)), "uniform").pvalue > 1e-3
    assert kstest(draws.cone_angles(rng, 5000, eps, "angle") / eps, "uniform").pvalue > 1e-3
    assert kstest(cap / eps, "uniform").pvalue < 1e-6
    assert np.all(draws.cone_angles(rng, 10, eps, "boundary") == eps)
    azimuth = ConeSensor(eps).draw(rng, 5000)[:, 1]
    assert kstest(azimuth / (2 * np.pi) + 0.5, "uniform").pvalue > 1e-3


def test_ball_law_is_uniform_in_volume() -> None:
    rng = np.random.default_rng(4)
    inside = draws.ball(rng, 5000, 2.0, "uniform")
    assert kstest((np.linalg.norm(inside, axis=-1) / 2) ** 3, "uniform").pvalue > 1e-3
    np.testing.assert_allclose(np.linalg.norm(draws.ball(rng, 100, 2.0, "boundary"), axis=-1), 2, rtol=1e-15)


def test_box_measurement_adds_before_scaling() -> None:
    q, r_N, y = truth(100)
    sensor = BoxSensor([0.1, 0.2, 0.3])
    error = sensor.draw(np.random.default_rng(5), 100, "boundary")
    np.testing.assert_array_equal(np.abs(error), np.broadcast_to([0.1, 0.2, 0.3], (100, 3)))
    expected = (y + error) / np.linalg.norm(y + error, axis=-1, keepdims=True)
    np.testing.assert_allclose(sensor.measurement().batch(q, r_N, error), expected, atol=1e-15)


def test_misalignment_turns_before_the_bias() -> None:
    q, r_N, y = truth(1)
    error = np.array([0.01, -0.02, 0.03, 0.0, 0.0, 0.2])
    turned = quaternion.transform([0, 0, math.sin(0.1), math.cos(0.1)], y[0])
    expected = turned + error[:3]
    b_B = MisalignedSensor(0.1, 0.3).measurement()(q[0], r_N[0], error)
    np.testing.assert_allclose(b_B, expected / np.linalg.norm(expected), atol=1e-15)


def test_measurement_jacobians_against_differences() -> None:
    q, r_N, _ = (array[0] for array in truth(1))
    for sensor in SENSORS[1:6]:
        measurement = sensor.measurement()
        error = sensor.draw(np.random.default_rng(6), 1)[0]
        exact = measurement.jacobian("b_B", "error")(q, r_N, error)
        h = 1e-6
        differences = [
            (measurement(q, r_N, error + h * e) - measurement(q, r_N, error - h * e)) / (2 * h)
            for e in np.eye(len(error))
        ]
        np.testing.assert_allclose(exact, np.stack(differences, axis=1), atol=1e-8)


@settings(max_examples=30)
@given(st.floats(0, 0.2), st.integers(0, 2**32), st.sampled_from(["uniform", "boundary"]), st.booleans())
def test_gyro_error_stays_in_its_ball(bound: float, seed: int, law: draws.BallLaw, constant: bool) -> None:
    gyro = Gyro(bound)
    error = gyro.draw(np.random.default_rng(seed), 20, law, constant)
    assert error.shape == (20, 3)
    assert np.linalg.norm(error, axis=-1).max() <= bound * (1 + 1e-15)
    assert np.all(error == error[0]) or not constant


def test_gyro_adds_its_error() -> None:
    assert Gyro(0.1).measurement()([1, 2, 3], [0.1, 0, -0.1]).tolist() == [1.1, 2, 2.9]


def test_the_same_generator_state_gives_the_same_draws() -> None:
    sensor = ConeSensor(0.1)
    one, other = (sensor.draw(np.random.default_rng(9), 5) for _ in range(2))
    np.testing.assert_array_equal(one, other)


def test_refusals() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match=r"`half_angle` must be >= 0 and < 3.14159 \[rad\], got 180"):
        ConeSensor(180.0)
    with pytest.raises(InputError, match="`half_width` must be >= 0 with a corner shorter than 1"):
        BoxSensor([0.6, 0.6, 0.6])
    with pytest.raises(InputError, match="`bias_bound` must be >= 0 and < 1"):
        MisalignedSensor(1.0, 0.0)
    with pytest.raises(InputError, match=r"`rate_bound` must be >= 0 \[rad/s\]"):
        Gyro(-1.0)
    with pytest.raises(InputError, match=r"`rng` must be a numpy\.random\.Generator, got int"):
        draws.ball(3, 1, 1.0, "uniform")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="`law` must be one of 'cap', 'angle', 'boundary', got 'gauss'"):
        ConeSensor(0.1).draw(rng, 1, "gauss")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="`count` must be a whole number >= 0, got -1"):
        ConeSensor(0.1).draw(rng, -1)
