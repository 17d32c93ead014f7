"""Relative attitude from a gyro: against exact integration, with a growth bound that is never below the error."""

import numpy as np
import pytest
from flown_record import attitude, flight, rate

from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.estimators.relative_attitude import RelativeAttitude, prefix_products
from optsat.records.record import Record


def errors(record: Record, q_BN: Array) -> tuple[Array, Array]:
    """Return error and bound (n,) [rad] of the rotation between all pairs of epochs."""
    relative = RelativeAttitude.of(record)
    found, bounds = [], []
    for j in range(len(record)):
        for k in range(j + 1, len(record)):
            turn, growth = relative.rotation(j, k)
            truth = dcm.from_quaternion(q_BN[k]) @ dcm.from_quaternion(q_BN[j]).T
            found.append(quaternion.error_angle(dcm.to_quaternion(turn), dcm.to_quaternion(truth)))
            bounds.append(growth)
    return np.array(found), np.array(bounds)


@pytest.mark.parametrize("dt", [0.1, 0.5, 2.0])
def test_integration_error_is_within_its_allowance(dt: float) -> None:
    record = flight(count=25, dt=dt, gyro_bound=0.0)
    assert record.q_BN_true is not None
    found, bounds = errors(record, record.q_BN_true)
    assert np.all(found <= bounds + 1e-13)
    # the allowance follows the error at third order; it is not merely large
    assert bounds.max() <= 0.02 * dt**2


@pytest.mark.parametrize("axis", [*np.eye(3), (0.6, 0.0, -0.8)])
def test_worst_case_bias_is_within_the_growth(axis: Array) -> None:
    bias = 2e-4 * np.asarray(axis)
    record = flight(count=25, dt=0.5, bias=bias, gyro_bound=2e-4)
    assert record.q_BN_true is not None
    found, bounds = errors(record, record.q_BN_true)
    assert np.all(found <= bounds)


def test_growth_is_reached_by_a_bias_along_the_turn() -> None:
    t = np.arange(40.0)
    omega, bias = np.array([0.0, 0.0, 0.05]), np.array([0.0, 0.0, 1e-4])
    record = Record(t, omega_BN_B=np.tile(omega + bias, (40, 1)), gyro_bound_rad_s=np.full(40, 1e-4))
    found, bounds = errors(record, quaternion.exponential(omega * t[:, None]))
    np.testing.assert_allclose(found, bounds, rtol=1e-9)


def test_a_constant_rate_is_exact() -> None:
    t = np.arange(100.0)
    omega = np.array([0.3, -0.2, 0.5])
    record = Record(t, omega_BN_B=np.tile(omega, (100, 1)), gyro_bound_rad_s=np.zeros(100))
    relative = RelativeAttitude.of(record)
    exact = quaternion.exponential(omega * t[:, None])
    assert np.all(quaternion.error_angle(relative.q_BkB0, exact) <= 1e-13)
    assert np.all(relative.growth_rad <= 1e-14)


def test_a_gap_ends_the_segment() -> None:
    record = flight(count=10)
    assert record.omega_BN_B is not None
    omega = np.array(record.omega_BN_B)
    omega[4] = np.nan
    relative = RelativeAttitude.of(flight(count=10, omega_BN_B=omega))
    assert relative.connected(0, 3)
    assert relative.connected(5, 9)
    assert not relative.connected(3, 4)
    assert not relative.connected(3, 5)
    assert not relative.connected(4, 5)
    # steps beside the gap are bounded as they would be at the ends of a record
    whole = RelativeAttitude.of(record)
    growth, unbroken = np.diff(relative.growth_rad), np.diff(whole.growth_rad)
    known = [0, 1, 2, 5, 6, 7, 8]
    assert np.all(growth[known] <= 1.1 * unbroken[known])


def test_integration_error_beside_gaps_is_within_its_allowance() -> None:
    record = flight(count=24, dt=2.0, gyro_bound=0.0)
    assert record.omega_BN_B is not None
    assert record.q_BN_true is not None
    omega = np.array(record.omega_BN_B)
    omega[[5, 8, 12]] = np.nan
    relative = RelativeAttitude.of(flight(count=24, dt=2.0, gyro_bound=0.0, omega_BN_B=omega))
    pairs = [(j, k) for j in range(24) for k in range(j + 1, 24) if relative.connected(j, k)]
    assert len(pairs) == 10 + 1 + 3 + 55
    for j, k in pairs:
        turn, growth = relative.rotation(j, k)
        truth = dcm.from_quaternion(record.q_BN_true[k]) @ dcm.from_quaternion(record.q_BN_true[j]).T
        assert quaternion.error_angle(dcm.to_quaternion(turn), dcm.to_quaternion(truth)) <= growth + 1e-13


def test_short_records() -> None:
    for count in (1, 2):
        t = np.arange(float(count))
        record = Record(t, omega_BN_B=rate(t), gyro_bound_rad_s=np.full(count, 1e-3))
        relative = RelativeAttitude.of(record)
        assert relative.q_BkB0.shape == (count, 4)
        assert relative.growth_rad[0] == 0.0


def test_the_flight_itself_satisfies_its_equation() -> None:
    """A central difference of the true attitude gives back the rate: the reference of these tests is no circle."""
    t = np.array([4.999, 5.0, 5.001])
    q = attitude(np.concatenate(([0.0], t)))[1:]
    step = quaternion.compose(q[2], quaternion.inverse(q[0]))
    np.testing.assert_allclose(2 * step[:3] / 0.002, rate(np.array(5.0)), atol=1e-8)


def test_prefix_products() -> None:
    rng = np.random.default_rng(1)
    steps = rng.standard_normal((37, 4))
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    one_by_one = [steps[0]]
    for step in steps[1:]:
        one_by_one.append(quaternion.compose(step, one_by_one[-1]))
    np.testing.assert_allclose(prefix_products(steps), one_by_one, atol=1e-13)
