"""The simulated orbit: true motion against independent integration, errors inside their bounds, faults where asked."""

import dataclasses
import time
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from optsat.attitude import dcm, euler321, frames, quaternion
from optsat.determine import certify_attitude_batch
from optsat.errors import InputError
from optsat.models.epoch import Epoch
from optsat.models.rigid_body import RigidBody
from optsat.records.record import Record
from optsat.simulation.orbit_scenario import OrbitScenario
from optsat.simulation.sensor_fault import SensorFault
from optsat.simulation.true_motion import true_motion

DEG = np.pi / 180
MU, R = 398600.4418e9, 7178137.0


def simulate(seed: int = 1, **changes: Any) -> Record:
    return OrbitScenario(**{"duration": 120.0, **changes}).simulate(np.random.default_rng(seed))


def sensor_error(record: Record, name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    channel = record.channel(name)
    assert record.q_BN_true is not None
    true_B = quaternion.transform(record.q_BN_true, np.nan_to_num(channel.r_N, nan=1.0))
    return np.asarray(2 * np.arcsin(np.linalg.norm(channel.b_B - true_B, axis=1) / 2))


def test_truth_agrees_with_another_integrator() -> None:
    scenario = OrbitScenario(rate="inertial", yaw_pitch_roll=(0.3, 0.2, -0.1))
    q_BN, omega = scenario.truth()
    J, n, i = np.diag([80.0, 80.0, 4.0]), np.sqrt(MU / R**3), 75 * DEG

    def rates(t: float, y: Any) -> Any:
        up_N = np.array([np.cos(n * t), np.cos(i) * np.sin(n * t), np.sin(i) * np.sin(n * t)])
        up_B = Rotation.from_quat(y[:4]).inv().apply(up_N)
        torque = 3 * n**2 * np.cross(up_B, J @ up_B)
        w = y[4:]
        half = 0.5 * np.array([*(y[3] * w - np.cross(w, y[:3])), -w @ y[:3]])
        return np.concatenate((half, np.linalg.solve(J, torque - np.cross(w, J @ w))))

    y = solve_ivp(rates, (0, 1200), np.concatenate((q_BN[0], omega[0])), method="DOP853", rtol=1e-12, atol=1e-14).y
    end = y[:4, -1] / np.linalg.norm(y[:4, -1])
    assert quaternion.error_angle(end, q_BN[-1]) < 1e-8
    np.testing.assert_allclose(y[4:, -1], omega[-1], atol=1e-11)


@pytest.mark.parametrize("dt", [1.0, 60.0])
def test_integration_error_is_far_below_the_bar(dt: float) -> None:
    scenario = OrbitScenario(dt=dt)
    q_BN, omega = scenario.truth()
    finer, _ = true_motion(RigidBody(scenario.inertia_B), scenario.orbit(), q_BN[0], omega[0], dt, len(q_BN), 0.25)
    assert np.max(quaternion.error_angle(q_BN, finer)) < 1e-10


def test_the_aligned_satellite_stays_aligned() -> None:
    scenario = OrbitScenario(yaw_pitch_roll=(0.0, 0.0, 0.0))
    q_BN, omega = scenario.truth()
    r_N, v_N = scenario.orbit().motion().batch(scenario.times())
    dcm_ON = frames.orbital_dcm(r_N, v_N)
    np.testing.assert_allclose(dcm.from_quaternion(q_BN), dcm_ON, atol=1e-9)
    np.testing.assert_allclose(omega, np.tile([0, -np.sqrt(MU / R**3), 0], (1201, 1)), atol=1e-12)


def test_the_start_is_the_papers() -> None:
    scenario = OrbitScenario()
    q_BN, omega = scenario.truth()
    r_N, v_N = scenario.orbit().motion()(0.0)
    q_BO = quaternion.compose(q_BN[0], quaternion.inverse(dcm.to_quaternion(frames.orbital_dcm(r_N, v_N))))
    np.testing.assert_allclose(euler321.from_quaternion(q_BO), [5 * DEG, 0, 0], atol=1e-12)
    assert np.linalg.norm(omega[0]) == pytest.approx(np.sqrt(MU / R**3), rel=1e-12)
    np.testing.assert_allclose(OrbitScenario(rate="inertial").truth()[1][0], 0, atol=0)


@pytest.mark.parametrize("noise", ["cap", "angle", "boundary"])
def test_errors_keep_their_bounds_and_reach_for_them(noise: Any) -> None:
    record = simulate(noise=noise, duration=600.0)
    for name, bound in (("sun", 0.005 * DEG), ("magnetometer", 0.5 * DEG)):
        error = sensor_error(record, name)
        assert error.max() <= bound + 1e-12
        assert error.max() > 0.97 * bound
        mean = {"cap": 2 / 3, "angle": 1 / 2, "boundary": 1.0}[noise]
        assert error.mean() / bound == pytest.approx(mean, abs=0.04)


def test_record_of_the_papers_run() -> None:
    record = OrbitScenario().simulate(np.random.default_rng(0))
    np.testing.assert_array_equal(record.t, np.arange(1201.0))
    assert [channel.name for channel in record.channels] == ["sun", "magnetometer"]
    assert record.epoch == "2021-03-20T12:00:00Z"
    assert record.omega_BN_B is None
    assert all(channel.valid.all() for channel in record.channels)
    angle = np.degrees(np.arccos(np.sum(record.channels[0].r_N * record.channels[1].r_N, axis=1)))
    # the specification gives the angle between field and Sun over this run as 95 to 163 deg
    assert (angle.min(), angle.max()) == (pytest.approx(95, abs=1), pytest.approx(163, abs=1))


def test_epoch_is_written_as_utc() -> None:
    assert simulate(epoch=Epoch.from_julian_date(2459475.5), duration=0.0).epoch == "2021-09-18T00:00:00Z"


def test_same_seed_same_errors_whatever_gyro_and_faults() -> None:
    plain, other, same = simulate(3), simulate(4), simulate(3)
    rich = simulate(3, gyro_bound_rad_s=1e-4, faults=(SensorFault("magnetometer", 50, 60, "offset", 0.1),))
    assert np.array_equal(plain.channels[0].b_B, same.channels[0].b_B)
    assert not np.array_equal(plain.channels[0].b_B, other.channels[0].b_B)
    assert np.array_equal(plain.channels[0].b_B, rich.channels[0].b_B)
    assert np.array_equal(plain.channels[1].b_B[:50], rich.channels[1].b_B[:50])


def test_gyro_error_is_the_bound_in_one_direction_or_random_inside() -> None:
    bound = 0.002 * DEG
    _, omega = OrbitScenario(duration=120.0).truth()
    for law in ("constant", "random"):
        record = simulate(gyro_bound_rad_s=bound, gyro_error=law)
        assert record.omega_BN_B is not None
        error = record.omega_BN_B - omega
        size = np.linalg.norm(error, axis=1)
        assert size.max() <= bound * (1 + 1e-9)
        if law == "constant":
            np.testing.assert_allclose(error, np.tile(error[0], (121, 1)), atol=1e-15)
            np.testing.assert_allclose(size, bound, rtol=1e-9)
        else:
            assert size.std() > 0.05 * bound
        np.testing.assert_array_equal(record.gyro_bound_rad_s, np.full(121, bound))


def test_eclipse_blinds_the_sun_sensor_only_when_asked() -> None:
    # 2021-09-18 00:00: most of the run lies in shadow
    night: dict[str, Any] = {"epoch": Epoch.from_julian_date(2459475.5), "duration": 1200.0}
    seeing, blind = simulate(**night), simulate(**night, eclipse=True)
    dark = OrbitScenario(**night).in_shadow()
    assert 0 < dark.sum() < len(dark)
    assert seeing.channel("sun").valid.all()
    np.testing.assert_array_equal(blind.channel("sun").valid, ~dark)
    assert blind.channel("magnetometer").valid.all()


def test_offset_turns_by_its_angle_in_its_window_alone() -> None:
    record = simulate(faults=(SensorFault("magnetometer", 40.0, 60.0, "offset", 5 * DEG),))
    error = sensor_error(record, "magnetometer")
    inside = (record.t >= 40) & (record.t < 60)
    assert np.all(error[~inside] <= 0.5 * DEG + 1e-12)
    assert np.all(np.abs(error[inside] - 5 * DEG) < 0.6 * DEG)


def test_dead_and_frozen() -> None:
    faults = (SensorFault("sun", 40.0, 60.0, "dead"), SensorFault("magnetometer", 40.0, 60.0, "frozen"))
    record, sound = simulate(faults=faults), simulate()
    inside = (record.t >= 40) & (record.t < 60)
    np.testing.assert_array_equal(record.channel("sun").valid, ~inside)
    held = record.channel("magnetometer").b_B[inside]
    np.testing.assert_array_equal(held, np.tile(sound.channel("magnetometer").b_B[39], (20, 1)))
    np.testing.assert_array_equal(record.channel("magnetometer").r_N, sound.channel("magnetometer").r_N)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"altitude": -1.0}, "`altitude`"),
        ({"rate": "lvhl"}, "Did you mean `lvlh`"),
        ({"noise": "gauss"}, "`noise` is 'gauss'"),
        ({"gyro_error": "bias"}, "`gyro_error`"),
        ({"dt": 0.0}, "`dt`"),
        ({"dt": 1e-9}, "`duration`"),
        ({"sun_bound_rad": 4.0}, "`sun_bound_rad`"),
        ({"gyro_bound_rad_s": -1.0}, "`gyro_bound_rad_s`"),
        ({"inertia_B": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 9.0))}, "`inertia_B`"),
        ({"faults": (SensorFault("magnetmeter", 0, 1, "dead"),)}, "Did you mean `magnetometer`"),
    ],
)
def test_refusals_name_the_parameter(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        OrbitScenario(**changes)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("sun", 0, 1, "ofset"), "Did you mean `offset`"),
        (("sun", 0, 0, "dead"), "`stop_s`"),
        (("sun", 0, 1, "offset"), "`angle_rad`"),
    ],
)
def test_refused_faults(arguments: tuple[Any, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        SensorFault(*arguments)


def test_a_generator_is_needed() -> None:
    with pytest.raises(InputError, match=r"`rng` must be a numpy.random.Generator"):
        OrbitScenario(duration=2.0).simulate(7)  # type: ignore[arg-type]


def test_twenty_minutes_take_less_than_a_second() -> None:
    scenario = dataclasses.replace(OrbitScenario(), gyro_bound_rad_s=1e-5)
    start = time.process_time()
    scenario.simulate(np.random.default_rng(0))
    assert time.process_time() - start < 1.0


@pytest.mark.parametrize(
    ("julian_date", "rms_deg", "rms_bound_deg"),
    [(2459294.0, 0.4991, 0.8807), (2459385.0, 0.2801, 0.4843), (2459475.5, 0.4428, 0.7816)],
)
def test_errors_and_bounds_are_those_of_the_specification(
    julian_date: float, rms_deg: float, rms_bound_deg: float
) -> None:
    record = OrbitScenario(epoch=Epoch.from_julian_date(julian_date)).simulate(np.random.default_rng(0))
    b_B, r_N, bound = (
        np.stack([getattr(channel, name) for channel in record.channels], axis=1)
        for name in ("b_B", "r_N", "angle_bound_rad")
    )
    attitude = certify_attitude_batch(b_B, r_N, bound)
    assert record.q_BN_true is not None
    error = quaternion.error_angle(attitude.q_BN, record.q_BN_true)
    assert np.all(error <= attitude.bound_rad)
    # another seed than the specification's, so the errors agree to the spread of 1201 draws
    assert np.degrees(np.sqrt(np.mean(error**2))) == pytest.approx(rms_deg, rel=0.05)
    assert np.degrees(np.sqrt(np.mean(attitude.bound_rad**2))) == pytest.approx(rms_bound_deg, rel=0.02)
