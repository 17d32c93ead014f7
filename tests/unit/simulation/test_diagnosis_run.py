"""Simulated runs: the truth against SciPy, the noises against their covariance, faults and losses where they belong."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import chi2

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.errors import InputError
from optsat.models.accelerometer import Accelerometer, Axes, Sensed
from optsat.models.additive_sensors import PressureSensor, RateGyro, SkewedGyro
from optsat.models.attitude_motion import attitude_step
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.gravity import EARTH_J2, gravity
from optsat.models.parts import Part
from optsat.models.schedule import Schedule
from optsat.models.spacecraft import SEED_GRAVITATIONAL_PARAMETER as MU
from optsat.models.spacecraft import Spacecraft
from optsat.simulation.diagnosis_run import DiagnosisRuns, simulate, simulate_many
from optsat.simulation.diagnosis_scenario import (
    AttitudeTruth,
    DiagnosisScenario,
    OrbitTruth,
    Sampling,
    scenario_s0,
    scenario_s1,
    scenario_s2,
)

K = SensorFaultKind
EVERYTHING = Spacecraft(
    gyro=RateGyro(bias=(0.01, 0.02, 0.03), bias_walk=0.001), skewed_gyro=SkewedGyro(), pressure=PressureSensor()
)


def busy(**changes: object) -> DiagnosisScenario:
    """Every sensor, most kinds of faults, jitter, gaps and losses in six seconds."""
    faults = (
        Fault(Part.THRUSTER_X, ThrusterFaultKind.LOCKED, 1, 2, (7.0,)),
        Fault(Part.GYRO_X, K.NOISE, 1, 3, (0.5,)),
        Fault(Part.GYRO_X, K.BIAS, 2, 4, (0.2,)),
        Fault(Part.SKEWED_GYRO, K.FREEZE, 1, 3),
        Fault(Part.STAR, K.DRIFT, 1, 4, (0.01, 0.0, 0.02)),
        Fault(Part.GPS, K.DEAD_NOISY, 3, 4, (5.0,)),
        Fault(Part.PRESSURE_Y, K.SCALE, 0, 4, (3.0,)),
    )
    values: dict[str, object] = {
        "spacecraft": EVERYTHING,
        "duration": 6.0,
        "faults": faults,
        "sampling": {"star": Sampling(every=5), "gps": Sampling(dropout=0.3)},
        "time_jitter_s": 0.03,
        "gaps_s": ((2.0, 2.4), (5.0, 5.1)),
        "command_torque_B": Schedule((0.0, 1.0), ((0, 0, 5), (1, 2, 0)), period_s=2.0),
    }
    return DiagnosisScenario(**{**values, **changes})  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def s0() -> DiagnosisRuns:
    return simulate_many(scenario_s0(), range(40))


def test_runs_together_are_each_the_same_alone() -> None:
    for scenario in (busy(), busy(orbit=OrbitTruth.NINE_STATE, attitude=AttitudeTruth.EULER), scenario_s1()):
        runs = simulate_many(scenario, (5, 6, 7))
        assert len(runs) == 3
        for seed, run in zip((5, 6, 7), runs, strict=True):
            alone = simulate(scenario, seed)
            assert run.telemetry.equals(alone.telemetry)
            for name in ("t", "q_BN", "omega_BN_B", "r_N", "v_N", "acceleration_N", "torque_B", "gyro_bias", "faulty"):
                np.testing.assert_array_equal(getattr(run.truth, name), getattr(alone.truth, name), err_msg=name)
    assert not runs[0].telemetry.equals(runs[1].telemetry)
    with pytest.raises(IndexError):
        runs[3]


def test_a_generator_is_a_seed_and_goes_on() -> None:
    rng, scenario = np.random.default_rng(5), busy()
    first, second = simulate(scenario, rng), simulate(scenario, rng)
    assert first.telemetry.equals(simulate(scenario, 5).telemetry)
    assert not first.telemetry.equals(second.telemetry)


def test_noise_depends_neither_on_faults_nor_on_other_sensors() -> None:
    healthy = simulate(busy(faults=()), 3).telemetry
    dead = tuple(Fault(part, K.DEAD, 1, 2) for part in EVERYTHING.parts if not part.is_thruster)
    failing = simulate(busy(faults=dead), 3)
    outside = ~failing.truth.failed(Part.GPS)
    assert 0 < outside.sum() < len(outside)
    for name in healthy.sensors:
        mine, its = getattr(failing.telemetry, name), getattr(healthy, name)
        np.testing.assert_array_equal(mine[outside], its[outside], err_msg=name)
        assert np.all((mine[~outside] == 0) | np.isnan(mine[~outside]))
    fewer = simulate(busy(faults=(), spacecraft=replace(EVERYTHING, star=None), sampling={}), 3).telemetry
    np.testing.assert_array_equal(fewer.gyro_omega_BN_B, healthy.gyro_omega_BN_B)
    assert fewer.star_q_BN is None


@pytest.mark.parametrize("scenario", [scenario_s1(), scenario_s2(tumbling=False)])
def test_true_motion_against_an_adaptive_integrator(scenario: DiagnosisScenario) -> None:
    disturbance = np.array([0.1, -0.2, 0.3])
    truth = simulate(replace(scenario, rate_variance=0.0, disturbance_torque_B=tuple(disturbance)), 1).truth
    J = np.asarray(scenario.spacecraft.inertia_B)
    fault = scenario.faults[0]
    faulty_torque = 12.0 if fault.kind is ThrusterFaultKind.OPEN else 2.0

    def rates(t: float, x: Array, torque_z: float) -> Array:
        q, w = x[:4], x[4:7]
        vector, scalar = 0.5 * (q[3] * w - np.cross(w, q[:3])), -0.5 * w @ q[:3]
        spin = np.linalg.solve(J, np.array([0, 0, torque_z]) + disturbance - np.cross(w, J @ w))
        pull = -MU * x[7:10] / np.linalg.norm(x[7:10]) ** 3
        return np.asarray(np.concatenate((vector, [scalar], spin, x[10:], pull)), dtype=np.float64)

    x = np.concatenate((scenario.q_BN, scenario.omega_BN_B, scenario.r_N, scenario.v_N))
    for start, stop, torque_z in (
        (0.0, fault.start_s, 5.0),
        (fault.start_s, fault.stop_s, faulty_torque),
        (fault.stop_s, 60.0, 5.0),
    ):
        x = solve_ivp(rates, (start, stop), x, "DOP853", rtol=1e-12, atol=1e-12, args=(torque_z,)).y[:, -1]
        row = round(stop / 0.1)
        assert truth.t[row] == stop
        # Runge-Kutta at 0.1 s turns by 5e-9 rad a step too little at 1 rad/s
        assert quaternion.error_angle(truth.q_BN[row], x[:4] / np.linalg.norm(x[:4])) < 4e-6
        np.testing.assert_allclose(truth.omega_BN_B[row], x[4:7], atol=1e-7)
        np.testing.assert_allclose(truth.r_N[row], x[7:10], rtol=0, atol=2e-4)
        np.testing.assert_allclose(truth.v_N[row], x[10:], rtol=0, atol=1e-6)


def assert_standard(z: Array) -> None:
    """Sum of squares of standard normal numbers, within what chance allows once in 1e6; and no column correlates."""
    rows = z.reshape(-1, z.shape[-1])
    assert chi2.ppf(1e-6, rows.size) < float(np.sum(rows**2)) < chi2.isf(1e-6, rows.size)
    assert np.abs(rows.mean(axis=0)).max() < 6 / np.sqrt(len(rows))
    assert np.abs(np.mean(rows[1:] * rows[:-1], axis=0)).max() < 6 / np.sqrt(len(rows))


def test_noises_of_the_sensors(s0: DiagnosisRuns) -> None:
    motion, readings = s0.motion, s0.readings
    assert_standard((readings["gyro_omega_BN_B"] - motion.omega_BN_B) / 0.01)
    assert_standard((readings["gps_r_N"] - motion.r_N) / 10.0)
    assert_standard((readings["accelerometer"] - motion.acceleration_N) / np.sqrt(1e-3))
    turn = quaternion.compose(readings["star_q_BN"], quaternion.inverse(motion.q_BN))
    vector = 2 * turn[..., :3] * np.sign(turn[..., 3:])
    assert_standard(vector / (2 * np.sqrt(1e-7 * np.array([2.29, 1.95, 3.85]))))
    np.testing.assert_array_equal(motion.acceleration_N, motion.gravity_N)


@pytest.mark.parametrize("jitter", [0.0, 0.04])
def test_noise_of_the_motion(jitter: float) -> None:
    runs = simulate_many(replace(scenario_s1(), time_jitter_s=jitter), range(10))
    w, dt = runs.motion.omega_BN_B, np.diff(runs.t, axis=1)
    flat = [each[:, :-1].reshape(-1, each.shape[-1]) for each in (runs.motion.q_BN, w, runs.torque_B)]
    J = np.asarray(runs.scenario.spacecraft.inertia_B)
    _, predicted = attitude_step().batch(*flat, J, dt.reshape(-1))
    added = w[:, 1:] - predicted.reshape(w[:, 1:].shape)
    assert_standard(added / 1e-3 / np.sqrt(dt / 0.1)[..., None])


def test_nine_states_walk_away_from_gravity() -> None:
    scenario = replace(scenario_s0(), orbit=OrbitTruth.NINE_STATE, attitude=AttitudeTruth.EULER)
    runs = simulate_many(scenario, range(60))
    away = (runs.motion.acceleration_N - runs.motion.gravity_N)[:, -1]
    # 600 steps of 1e-2 m/s^2: 0.24 m/s^2
    assert np.sqrt(np.mean(away**2)) == pytest.approx(0.245, abs=0.245 * 5 / np.sqrt(2 * away.size))
    still = simulate(replace(scenario, acceleration_variance=0.0), 1).truth
    kepler = simulate(scenario_s0(), 1).truth
    assert np.linalg.norm(still.r_N[-1] - kepler.r_N[-1]) == pytest.approx(26.0, abs=0.1)


def test_faults_of_the_paper_are_where_they_belong() -> None:
    run = simulate(scenario_s1(), 2)
    t, truth, telemetry = run.truth.t, run.truth, run.telemetry
    np.testing.assert_array_equal(truth.torque_B[:, 2], np.where((t >= 30) & (t < 45), 12.0, 5.0))
    np.testing.assert_array_equal(telemetry.command_torque_B, np.tile([0.0, 0.0, 5.0], (601, 1)))
    assert telemetry.gyro_omega_BN_B is not None
    assert telemetry.accelerometer is not None
    assert telemetry.star_q_BN is not None
    for part, values, start, stop in (
        (Part.GYRO_X, telemetry.gyro_omega_BN_B[:, 0], 0, 0),
        (Part.GYRO_Y, telemetry.gyro_omega_BN_B[:, 1], 25, 30),
        (Part.GYRO_Z, telemetry.gyro_omega_BN_B[:, 2], 25, 30),
        (Part.ACCELEROMETER_X, telemetry.accelerometer[:, 0], 25, 30),
        (Part.ACCELEROMETER_Y, telemetry.accelerometer[:, 1], 30, 40),
        (Part.ACCELEROMETER_Z, telemetry.accelerometer[:, 2], 42, 47),
        (Part.STAR, telemetry.star_q_BN.any(axis=1), 20, 30),
    ):
        np.testing.assert_array_equal(values == 0, (t >= start) & (t < stop))
        np.testing.assert_array_equal(truth.failed(part), values == 0)
    s2 = simulate(scenario_s2(), 2)
    np.testing.assert_array_equal(s2.truth.torque_B[:, 2], np.where((t >= 20) & (t < 30), 2.0, 5.0))
    np.testing.assert_array_equal(s2.truth.failed(Part.GPS), (t >= 35) & (t < 45))
    with pytest.raises(InputError, match=r"no part pressure.x; it has gyro.x"):
        s2.truth.failed(Part.PRESSURE_X)


def test_several_faults_of_one_channel_and_the_other_sensors() -> None:
    scenario = replace(busy(), time_jitter_s=0.0, gaps_s=(), sampling={})
    run, clean = simulate(scenario, 1), simulate(replace(scenario, faults=scenario.faults[:1]), 1)
    t = run.truth.t
    mine, its = run.telemetry, clean.telemetry
    assert mine.gyro_omega_BN_B is not None
    assert its.gyro_omega_BN_B is not None
    change = mine.gyro_omega_BN_B - its.gyro_omega_BN_B
    assert np.all(change[:, 1:] == 0)
    np.testing.assert_allclose(change[(t >= 3) & (t < 4), 0], 0.2, atol=1e-15)
    noisy = change[(t >= 1) & (t < 2), 0]
    assert 0.2 < noisy.std() < 1.0
    np.testing.assert_allclose(change[(t >= 2) & (t < 3), 0].mean(), 0.2, atol=0.6)
    assert mine.skewed_gyro_rate is not None
    assert its.skewed_gyro_rate is not None
    assert set(mine.skewed_gyro_rate[(t >= 1) & (t < 3)]) == {its.skewed_gyro_rate[9]}
    assert mine.pressure_torque_B is not None
    assert its.pressure_torque_B is not None
    np.testing.assert_array_equal(mine.pressure_torque_B[1:40, 1], 3.0 * its.pressure_torque_B[1:40, 1])


def test_pressure_tells_the_torque_before_the_sample() -> None:
    scenario = DiagnosisScenario(
        spacecraft=Spacecraft(pressure=PressureSensor(1e-6)),
        duration=3.0,
        faults=(Fault(Part.THRUSTER_Z, ThrusterFaultKind.CLOSED, 1.0, 2.0),),
    )
    run = simulate(scenario, 1)
    assert run.telemetry.pressure_torque_B is not None
    assert np.isnan(run.telemetry.pressure_torque_B[0]).all()
    np.testing.assert_allclose(run.telemetry.pressure_torque_B[1:], run.truth.torque_B[:-1], atol=1e-5)


def test_bias_and_the_skewed_gyro() -> None:
    run = simulate(busy(faults=()), 4)
    assert run.telemetry.gyro_omega_BN_B is not None
    assert run.telemetry.skewed_gyro_rate is not None
    noise = run.telemetry.gyro_omega_BN_B - run.truth.omega_BN_B - run.truth.gyro_bias
    assert_standard(noise / 0.01)
    np.testing.assert_array_equal(run.truth.gyro_bias[0], [0.01, 0.02, 0.03])
    assert 0 < np.abs(run.truth.gyro_bias - run.truth.gyro_bias[0]).max() < 0.02
    assert_standard((run.telemetry.skewed_gyro_rate - run.truth.omega_BN_B.sum(axis=1) / np.sqrt(3))[:, None] / 0.01)


def test_a_force_is_felt_in_the_body_and_moves_the_orbit() -> None:
    craft = Spacecraft(accelerometer=Accelerometer(1e-12 * np.eye(3), Sensed.SPECIFIC_FORCE, Axes.BODY))
    push = Schedule((1.0, 2.0), ((0.5, 0, 0), (0, 0, 0)))
    runs = simulate_many(DiagnosisScenario(spacecraft=craft, duration=3.0, specific_force_B=push), (1, 2))
    t = runs.t[0]
    felt = np.where((t >= 1) & (t < 2), 0.5, 0.0)
    np.testing.assert_allclose(runs.readings["accelerometer"][..., 0], [felt, felt], atol=1e-5)
    np.testing.assert_allclose(runs.readings["accelerometer"][..., 1:], 0.0, atol=1e-5)
    free = simulate(DiagnosisScenario(spacecraft=craft, duration=3.0), 1).truth
    for run in runs:
        assert np.linalg.norm(run.truth.v_N[-1] - free.v_N[-1]) == pytest.approx(0.5, rel=1e-3)
        np.testing.assert_array_equal(run.truth.r_N[:11], free.r_N[:11])
    assert not np.array_equal(runs.motion.r_N[0, -1], runs.motion.r_N[1, -1])


def test_oblate_truth_differs_by_its_gravity() -> None:
    short = replace(scenario_s0(), duration=1.0)
    oblate, round_ = simulate(replace(short, orbit=OrbitTruth.OBLATE), 1).truth, simulate(short, 1).truth
    pull = gravity(MU, EARTH_J2)(round_.r_N[0]) - gravity(MU)(round_.r_N[0])
    np.testing.assert_allclose(oblate.v_N[-1] - round_.v_N[-1], pull, rtol=2e-3)


def test_rows_are_lost_where_asked() -> None:
    run = simulate(busy(faults=()), 9)
    t = run.telemetry.t
    assert len(t) == 61 - 5
    assert t[0] == 0.0
    nominal = 0.1 * np.delete(np.arange(61), [20, 21, 22, 23, 50])
    assert np.abs(t - nominal).max() <= 0.03
    assert np.abs(t - nominal).max() > 0.02
    assert run.telemetry.star_q_BN is not None
    has_star = run.telemetry.received("star_q_BN")
    np.testing.assert_array_equal(has_star, np.round(nominal / 0.1) % 5 == 0)
    lost = [1 - simulate(busy(faults=()), seed).telemetry.received("gps_r_N").mean() for seed in range(20)]
    assert np.mean(lost) == pytest.approx(0.3, abs=5 * np.sqrt(0.21 / 1120))


def test_telemetry_shares_nothing_with_the_truth() -> None:
    run = simulate(scenario_s1(), 1)
    telemetry = [value for value in vars(run.telemetry).values() if isinstance(value, np.ndarray)]
    truth = [value for value in vars(run.truth).values() if isinstance(value, np.ndarray)]
    assert len(telemetry) == 6
    assert len(truth) == 9
    assert not any(np.shares_memory(a, b) for a in telemetry for b in truth)
    assert not any(array.flags.writeable for array in (*telemetry, *truth))
    assert not any(np.array_equal(a, b) for a in telemetry[2:] for b in truth)


def test_one_row_and_rows_that_fill_no_call() -> None:
    assert len(simulate(replace(scenario_s0(), duration=0.0), 1).telemetry) == 1
    long, short = (simulate(replace(scenario_s0(), duration=d), 1).truth for d in (0.7, 0.3))
    # each row is its own: what follows in a call of five steps is thrown away
    assert (len(long.t), len(short.t)) == (8, 4)
    np.testing.assert_array_equal(long.r_N[:4], short.r_N)


@pytest.mark.parametrize(
    ("seed", "says"),
    [(-1, "`seed` must be a whole number >= 0"), (True, "got True"), (1.5, "got 1.5"), ("1", "got '1'")],
)
def test_seeds_are_checked(seed: object, says: str) -> None:
    with pytest.raises(InputError, match=says):
        simulate(scenario_s0(), seed)  # type: ignore[arg-type]


def test_too_many_or_no_runs() -> None:
    with pytest.raises(InputError, match="holds no seed"):
        simulate_many(scenario_s0(), ())
    with pytest.raises(InputError, match="do not fit into memory"):
        simulate_many(replace(scenario_s0(), duration=60_000.0), range(1000))


def test_interpreted_and_compiled_runs_have_the_same_bits(s0: DiagnosisRuns) -> None:
    # forty at once are compiled, one is interpreted
    for seed in (0, 39):
        assert s0[seed].telemetry.equals(simulate(scenario_s0(), seed).telemetry)
