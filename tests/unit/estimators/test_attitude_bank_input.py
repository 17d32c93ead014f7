"""Attitude bank: what it accepts, what it refuses, and what becomes of samples that no sensor should send."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.errors import InputError
from optsat.estimators.attitude_bank import AttitudeBank
from optsat.estimators.attitude_bank_model import attitude_bank_model
from optsat.estimators.attitude_bank_run import AttitudeBankFilter
from optsat.estimators.bank_result import BankResult, ChannelStatus
from optsat.estimators.bank_run import BankFailedError, joined
from optsat.models.parts import GYRO, PRESSURE, THRUSTERS, Part
from optsat.records.telemetry import Telemetry
from optsat.simulation.diagnosis_run import DiagnosisRun, simulate
from optsat.simulation.diagnosis_scenario import DiagnosisScenario, scenario_s0

SENSORS = (*GYRO, Part.STAR)
ROWS = 60


@pytest.fixture(scope="module")
def bank() -> AttitudeBankFilter:
    return AttitudeBankFilter(AttitudeBank(faults=SENSORS))


@pytest.fixture(scope="module")
def run() -> DiagnosisRun:
    return simulate(replace(scenario_s0(), duration=(ROWS - 1) * 0.1), 3)


def changed(log: Telemetry, **changes: Callable[[Array], None]) -> Telemetry:
    """The log with some arrays changed in place by functions of their copies."""
    arrays: dict[str, Any] = {}
    for name in ("t", "command_torque_B", "gyro_omega_BN_B", "star_q_BN"):
        arrays[name] = np.array(getattr(log, name))
        if name in changes:
            changes[name](arrays[name])
    return Telemetry(**arrays)


def setter(rows: Any, value: Any) -> Callable[[Array], None]:
    def put(array: Array) -> None:
        array[rows] = value

    return put


def result_of(bank: AttitudeBankFilter, run: DiagnosisRun, log: Telemetry | None = None, **options: Any) -> BankResult:
    truth = run.truth
    return bank.run(run.telemetry if log is None else log, truth.q_BN[0], truth.omega_BN_B[0], **options)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"inertia_B": np.diag([1.0, 1.0, 3.0])}, "exceeds the sum of the others"),
        ({"inertia_B": np.diag([1.0, 1.0, -1.0])}, "positive definite"),
        ({"gyro_deviation": 0.0}, "`gyro_deviation` must be positive"),
        ({"gyro_deviation": (0.01, 0.01)}, "one number or three"),
        ({"star_deviation": (1e-3, -1e-3, 1e-3)}, "`star_deviation` must be positive .*axis 1"),
        ({"rate_noise": -1.0}, "`rate_noise`"),
        ({"sample_time": np.inf}, "`sample_time` must be finite"),
        ({"sensor_chance": (0.5, 0.5)}, "`sensor_chance` must be two chances"),
        ({"thruster_chance": (0.1, -0.1)}, "`thruster_chance` must be two chances"),
        ({"fault_prior": 1.0}, "`fault_prior`"),
        ({"faults": ()}, "1 to 10 faults"),
        ({"faults": (Part.GPS,)}, "gps.* is no part of this bank"),
        ({"faults": (Part.STAR, Part.STAR)}, "names star twice"),
        ({"faults": ((Part.GYRO_X, Part.GYRO_Y),)}, "only thrusters can share a fault"),
        ({"faults": ("star",)}, "no part of this bank"),
        ({"skewed_gyro_axis_B": (1.0, 1.0, 1.0)}, "must have length 1"),
        ({"faults": SENSORS, "pressure_deviation": 0.5}, "no thruster may fail"),
        ({"pressure_deviation": 0.0}, "`pressure_deviation`"),
    ],
)
def test_parameters_are_checked(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        AttitudeBank(**fields)


@pytest.mark.parametrize(
    ("faults", "modes", "states"),
    [
        ((*SENSORS, *THRUSTERS), 128, 9),
        ((*SENSORS, THRUSTERS), 32, 9),
        (SENSORS, 16, 6),
        ((Part.STAR, Part.THRUSTER_Z), 4, 7),
        ((Part.GYRO_X,), 2, 6),
    ],
)
def test_any_subset_makes_a_bank(faults: Any, modes: int, states: int) -> None:
    model = attitude_bank_model(AttitudeBank(faults=faults))
    assert (model.structure.modes, model.structure.states, len(model.states)) == (modes, states, states)


def test_missing_is_neither_dead_nor_invalid(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    log = changed(
        run.telemetry,
        gyro_omega_BN_B=setter((slice(20, 25), 1), np.nan),
        star_q_BN=setter((slice(30, 32), 2), np.nan),
    )
    found = result_of(bank, run, log)
    status = found.channel_status(Part.GYRO_Y)[0]
    assert status[18:27].tolist() == [0, 0, ChannelStatus.LOST, ChannelStatus.LOST, *[ChannelStatus.MISSING] * 3, 0, 0]
    assert found.channel_status(Part.GYRO_X)[0].max() == ChannelStatus.USED
    assert found.channel_status(Part.STAR)[0, 30:32].tolist() == [ChannelStatus.LOST] * 2
    # without a sample, the probability of a fault follows the chances to fail and to recover alone
    p, (fail, recover) = found.probability(Part.GYRO_Y)[0], bank.bank.sensor_chance
    np.testing.assert_allclose(p[20:25], p[19:24] * (1 - recover) + (1 - p[19:24]) * fail, rtol=2e-2)
    assert p[:60].max() < 0.01
    assert np.isfinite(found.covariance).all()


def test_infinite_samples_are_missing_and_counted(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    lost = changed(run.telemetry, gyro_omega_BN_B=setter((10, 0), np.nan), star_q_BN=setter(12, np.nan))
    infinite = changed(run.telemetry, gyro_omega_BN_B=setter((10, 0), -np.inf), star_q_BN=setter((12, 3), np.inf))
    one, other = result_of(bank, run, lost), result_of(bank, run, infinite)
    np.testing.assert_array_equal(one.fault_probability, other.fault_probability)
    assert (one.not_finite[0], other.not_finite[0]) == (0, 2)


@pytest.mark.parametrize("value", [np.zeros(4), np.array([0.0, 0.0, 0.0, 1.2])])
def test_a_quaternion_that_is_none_speaks_for_a_fault(
    bank: AttitudeBankFilter, run: DiagnosisRun, value: Array
) -> None:
    found = result_of(bank, run, changed(run.telemetry, star_q_BN=setter(20, value)))
    assert found.channel_status(Part.STAR)[0, 20] == ChannelStatus.INVALID
    assert found.probability(Part.STAR)[0, 20] > 0.999
    assert found.probability(Part.STAR)[0, 19] < 1e-3


def test_a_length_off_by_little_is_repaired_and_counted(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    def scale(array: Array) -> None:
        array[10:15] *= 1.05

    plain, found = result_of(bank, run), result_of(bank, run, changed(run.telemetry, star_q_BN=scale))
    assert (plain.rescaled[0], found.rescaled[0]) == (0, 5)
    np.testing.assert_allclose(found.reference["q_BN"], plain.reference["q_BN"], rtol=0, atol=1e-12)


def test_signs_of_quaternions_are_invisible(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    def flip(array: Array) -> None:
        array[::2] *= -1.0

    plain, found = result_of(bank, run), result_of(bank, run, changed(run.telemetry, star_q_BN=flip))
    np.testing.assert_allclose(found.fault_probability, plain.fault_probability, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.reference["q_BN"], plain.reference["q_BN"], rtol=0, atol=1e-12)


@pytest.mark.parametrize("channel", [0, 1, 2, 3])
def test_one_gross_outlier_moves_nothing_for_long(bank: AttitudeBankFilter, run: DiagnosisRun, channel: int) -> None:
    if channel < 3:
        log = changed(run.telemetry, gyro_omega_BN_B=setter((30, channel), 1e6 * 0.01))
    else:
        log = changed(run.telemetry, star_q_BN=setter(30, [1.0, 0.0, 0.0, 0.0]))
    plain, found = result_of(bank, run), result_of(bank, run, log)
    apart = np.abs(found.fault_probability - plain.fault_probability)[0]
    assert apart[30, channel] > 0.99
    others = [bit for bit in range(4) if bit != channel]
    assert apart[30:, others].max() < 0.01
    assert apart[35:].max() < 0.01
    sigma = np.sqrt(np.diagonal(plain.covariance[0], axis1=1, axis2=2))
    moved = quaternion.error_angle(found.reference["q_BN"][0], plain.reference["q_BN"][0])
    assert (moved < 3.0 * sigma[:, :3].max(axis=1)).all()
    rate = np.abs(found.reference["omega_BN_B"] - plain.reference["omega_BN_B"])[0]
    assert (rate < 3.0 * sigma[:, 3:6]).all()


def test_many_logs_side_by_side_are_each_alone(bank: AttitudeBankFilter) -> None:
    runs = [simulate(replace(scenario_s0(), duration=2.0), seed) for seed in range(3)]
    q, omega = (np.stack([getattr(each.truth, name)[0] for each in runs]) for name in ("q_BN", "omega_BN_B"))
    together = bank.run([each.telemetry for each in runs], q, omega)
    for k, each in enumerate(runs):
        alone = bank.run(each.telemetry, q[k], omega[k])
        np.testing.assert_array_equal(together.fault_probability[k], alone.fault_probability[0])
        np.testing.assert_array_equal(together.covariance[k], alone.covariance[0])


def test_gaps_are_gone_through_in_steps_and_long_ones_widen(bank: AttitudeBankFilter) -> None:
    def spread(gap: tuple[float, float]) -> BankResult:
        scenario = replace(scenario_s0(), duration=4.0, gaps_s=(gap,), rate_variance=0.0)
        return result_of(bank, simulate(scenario, 0))

    short, long = spread((2.05, 2.45)), spread((2.05, 2.95))
    assert not short.after_gap.any()
    assert long.after_gap[0].tolist() == [bool(k == 21) for k in range(long.t.shape[1])]
    deviation = np.sqrt(long.covariance[0, :, 3, 3])
    assert deviation[21] > 1.2 * deviation[20]
    # the star tracker tells the attitude again at once
    assert np.sqrt(long.covariance[0, 21, 0, 0]) < 1.5e-3
    assert max(short.fault_probability.max(), long.fault_probability.max()) < 0.05


def test_sub_steps_are_the_samples_that_did_not_come(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    keep = np.r_[0:20, 23:ROWS]
    log = run.telemetry
    assert log.gyro_omega_BN_B is not None
    assert log.star_q_BN is not None
    gone = Telemetry(log.t[keep], log.command_torque_B[keep], log.gyro_omega_BN_B[keep], log.star_q_BN[keep])
    lost = changed(log, gyro_omega_BN_B=setter(slice(20, 23), np.nan), star_q_BN=setter(slice(20, 23), np.nan))
    one, other = result_of(bank, run, gone), result_of(bank, run, lost)
    np.testing.assert_allclose(one.fault_probability[0], other.fault_probability[0, keep], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(one.covariance[0], other.covariance[0, keep], rtol=1e-9, atol=1e-15)


def test_a_start_with_other_priors(bank: AttitudeBankFilter) -> None:
    q, none = np.array([[0.0, 0.0, 0.0, 1.0]]), np.zeros((1, 3))
    state = bank.start(q, none, none, [0.9, 1e-3, 1e-3, 1e-3], [0.5, 0.5, 0.5, 0.05, 0.05, 0.05])
    assert state["probability"][0, 1] == pytest.approx(0.9 * 0.999**3)
    np.testing.assert_allclose(state["covariance"][0, [0, 2, 5, 9, 14, 20], 0], [0.25] * 3 + [0.0025] * 3)
    for prior, spread, message in (
        ([0.5, 0.5], None, r"one number or \(4,\)"),
        (1.0, None, "between 0 and 1"),
        (0.5, [-1.0] * 6, "must not be negative"),
        (0.5, [1.0], "`spread` must have shape"),
    ):
        with pytest.raises(InputError, match=message):
            bank.start(q, none, none, prior, spread)


def test_part_after_part_is_the_whole(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    log = changed(run.telemetry, gyro_omega_BN_B=setter((slice(28, 32), 1), np.nan))
    assert log.gyro_omega_BN_B is not None
    assert log.star_q_BN is not None
    parts: list[BankResult] = []
    whole = result_of(bank, run, log)
    for rows in (slice(0, 30), slice(30, 31), slice(31, ROWS)):
        part = Telemetry(log.t[rows], log.command_torque_B[rows], log.gyro_omega_BN_B[rows], log.star_q_BN[rows])
        parts.append(bank.run(part, after=parts[-1]) if parts else result_of(bank, run, part))
    together = joined(parts)
    for name in ("t", "fault_probability", "mode_probability", "covariance", "log_evidence", "status"):
        np.testing.assert_array_equal(getattr(together, name), getattr(whole, name))
    np.testing.assert_array_equal(together.reference["q_BN"], whole.reference["q_BN"])
    with pytest.raises(InputError, match="result of 1 logs, got 2"):
        bank.run([log, log], after=parts[-1])
    with pytest.raises(InputError, match="`t` must increase: row 0 of run 0"):
        bank.run(log, after=parts[-1])
    with pytest.raises(InputError, match="one at least"):
        joined([])


def test_it_starts_from_the_first_samples(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    found = bank.run(run.telemetry)
    assert quaternion.error_angle(found.reference["q_BN"][0, -1], run.truth.q_BN[-1]) < 5e-3
    with pytest.raises(InputError, match="Row 0 of log 0 has no valid sample of star; give `q_BN`"):
        bank.run(changed(run.telemetry, star_q_BN=setter(0, 0.0)))
    with pytest.raises(InputError, match=r"gyro.x, gyro.y, gyro.z; give `omega_BN_B`"):
        bank.run(changed(run.telemetry, gyro_omega_BN_B=setter((0, 1), np.nan)))


def test_logs_are_checked(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    log, truth = run.telemetry, run.truth
    with pytest.raises(InputError, match="equally many rows"):
        bank.run([])
    with pytest.raises(InputError, match="Log 0 has no `star_q_BN`"):
        bank.run(Telemetry(log.t, log.command_torque_B, log.gyro_omega_BN_B))
    with pytest.raises(InputError, match=r"from 0 to 12 N m: row 4, axis 1 of log 0 holds -1.* `signed=True`"):
        bank.run(changed(log, command_torque_B=setter((4, 1), -1.0)))
    with pytest.raises(InputError, match=r"`q_BN` must have shape \(4,\) or \(1, 4\)"):
        bank.run(log, np.ones(3), truth.omega_BN_B[0])
    with pytest.raises(InputError, match="row 0 has length 2"):
        bank.run(log, 2.0 * truth.q_BN[0], truth.omega_BN_B[0])


def test_numbers_beyond_all_measure_are_an_error(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    with pytest.raises(BankFailedError, match="row 0 of run 0 ends with"):
        bank.run(run.telemetry, run.truth.q_BN[0], np.full(3, 1e200))


def test_probabilities_of_several_parts(bank: AttitudeBankFilter, run: DiagnosisRun) -> None:
    log = changed(run.telemetry, gyro_omega_BN_B=setter((slice(30, 40), 1), 0.0))
    found, bare = result_of(bank, run, log), result_of(bank, run, log, keep_modes=False)
    either = found.any_probability((Part.GYRO_X, Part.GYRO_Y))
    x, y = found.probability(Part.GYRO_X), found.probability(Part.GYRO_Y)
    assert (either <= x + y + 1e-12).all()
    assert (either >= np.maximum(x, y) - 1e-12).all()
    assert y[0, 30:40].min() > 0.99
    with pytest.raises(InputError, match="keep_modes=True"):
        bare.any_probability((Part.GYRO_X,))
    with pytest.raises(InputError, match=r"does not ask whether thruster\.x fails"):
        found.probability(Part.THRUSTER_X)
    with pytest.raises(InputError, match=r"no channel pressure\.x"):
        found.channel_status(PRESSURE[0])


def test_covariances_stay_semidefinite(bank: AttitudeBankFilter) -> None:
    scenario: DiagnosisScenario = replace(scenario_s0(), duration=10.0)
    log = simulate(scenario, 1).telemetry
    state = bank.start(np.array([[0.0, 0.0, 0.0, 1.0]]), np.zeros((1, 3)), log.command_torque_B[:1])
    found = bank.run(log, np.array([0.0, 0.0, 0.0, 1.0]), scenario.omega_BN_B)
    assert state["covariance"].shape == (1, 21, 16)
    least = np.linalg.eigvalsh(found.covariance[0])[:, 0]
    assert least.min() > 0.0
