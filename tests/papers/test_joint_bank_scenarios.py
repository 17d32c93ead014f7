"""The joint bank on the scenarios of the paper: delays, kinds, consistency, and faults that its filters follow."""

from dataclasses import replace

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.attitude import quaternion, rotation_vector
from optsat.errors import InputError
from optsat.estimators.attitude_bank_run import AttitudeBankFilter
from optsat.estimators.bank_result import BankResult
from optsat.estimators.thruster_kind import KINDS, kinds_in
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.parts import GYRO, THRUSTERS, Part
from optsat.models.schedule import Schedule
from optsat.simulation.diagnosis_run import DiagnosisRuns, simulate_many
from optsat.simulation.diagnosis_scenario import DiagnosisScenario, scenario_s0, scenario_s1, scenario_s2

SEEDS = range(4)


@pytest.fixture(scope="module")
def bank() -> AttitudeBankFilter:
    return AttitudeBankFilter()


def diagnosed(bank: AttitudeBankFilter, scenario: DiagnosisScenario) -> tuple[DiagnosisRuns, BankResult]:
    runs = simulate_many(scenario, SEEDS)
    rng = np.random.default_rng(17)
    q = quaternion.compose(quaternion.exponential(0.01 * rng.normal(size=(len(runs), 3))), runs.motion.q_BN[:, 0])
    omega = runs.motion.omega_BN_B[:, 0] + 0.02 * rng.normal(size=(len(runs), 3))
    return runs, bank.run([run.telemetry for run in runs], q, omega, keep_modes=False)


def consistency(runs: DiagnosisRuns, found: BankResult) -> float:
    """Normalised squared error of attitude and rate, six for a covariance that tells the truth."""
    turn = quaternion.compose(runs.motion.q_BN, quaternion.inverse(found.reference["q_BN"]))
    rate = runs.motion.omega_BN_B - found.reference["omega_BN_B"]
    error = np.concatenate([rotation_vector.from_quaternion(turn), rate], axis=-1)
    return float(np.mean(error * np.linalg.solve(found.covariance[..., :6, :6], error[..., None])[..., 0]) * 6.0)


def delays(found: BankResult, part: Part, start: float, stop: float) -> Array:
    t = found.t[0]
    flagged = (found.probability(part) > 0.5) & (t >= start - 1e-6) & (t < stop - 1e-6)
    assert flagged.any(axis=1).all()
    return np.asarray(t[np.argmax(flagged, axis=1)] - start)


def acted(runs: DiagnosisRuns) -> Array:
    """The command that acted up to each row."""
    return np.concatenate([runs.command_torque_B[:1], runs.command_torque_B[:-1]])


def test_no_fault(bank: AttitudeBankFilter) -> None:
    runs, found = diagnosed(bank, scenario_s0())
    assert max(found.probability(part).max() for part in (*GYRO, Part.STAR)) < 0.5
    assert max((found.probability(part) > 0.5).mean() for part in THRUSTERS) < 4e-3
    assert 5.4 < consistency(runs, found) < 6.6
    error = quaternion.error_angle(found.reference["q_BN"], runs.motion.q_BN)
    assert np.rad2deg(np.sqrt(np.mean(error**2))) < 0.07


def test_scenario_one(bank: AttitudeBankFilter) -> None:
    runs, found = diagnosed(bank, scenario_s1())
    for part, start, stop in ((Part.GYRO_Y, 25, 30), (Part.GYRO_Z, 25, 30), (Part.STAR, 20, 30)):
        assert delays(found, part, start, stop).max() <= 0.2 + 1e-6
    delay = delays(found, Part.THRUSTER_Z, 30, 45)
    assert np.median(delay) <= 1.4
    assert delay.max() <= 2.0
    late = (found.t[0] >= 37.5) & (found.t[0] < 44.95)
    kinds = kinds_in(found, Part.THRUSTER_Z, acted(runs), 12.0)
    assert (kinds.most_probable[:, late] == KINDS.index(ThrusterFaultKind.OPEN)).mean() >= 0.95
    assert np.sqrt(np.mean((kinds.torque[:, late] - 12.0) ** 2)) < 0.8
    assert 5.0 < consistency(runs, found) < 7.0


def test_scenario_two(bank: AttitudeBankFilter) -> None:
    runs, found = diagnosed(bank, scenario_s2())
    assert delays(found, Part.STAR, 20, 30).max() <= 0.2 + 1e-6
    delay = delays(found, Part.THRUSTER_Z, 20, 30)
    assert np.median(delay) <= 4.0
    assert delay.max() <= 6.0
    late = (found.t[0] >= 25.0) & (found.t[0] < 29.95)
    kinds = kinds_in(found, Part.THRUSTER_Z, acted(runs), 12.0)
    assert (kinds.most_probable[:, late] == KINDS.index(ThrusterFaultKind.REDUCED)).mean() >= 0.6
    assert np.sqrt(np.mean((kinds.torque[:, late] - 2.0) ** 2)) < 1.0
    assert 5.0 < consistency(runs, found) < 7.0


def test_a_frozen_star_tracker_is_not_followed(bank: AttitudeBankFilter) -> None:
    frozen = Fault(Part.STAR, SensorFaultKind.FREEZE, 5.0, 13.0)
    runs, found = diagnosed(bank, replace(scenario_s0(), duration=18.0, faults=(frozen,)))
    error = quaternion.error_angle(found.reference["q_BN"], runs.motion.q_BN)
    assert np.rad2deg(error[:, 5:].max()) < 2.0
    inside = (found.t[0] >= 5.05) & (found.t[0] < 12.95)
    assert found.probability(Part.STAR)[:, inside].min() > 0.9
    assert found.probability(Part.STAR)[:, -30:].max() < 0.5
    assert max((found.probability(part) > 0.5).mean() for part in THRUSTERS) < 0.01


def test_gyro_and_thruster_of_one_axis_at_once(bank: AttitudeBankFilter) -> None:
    faults = (
        Fault(Part.GYRO_Z, SensorFaultKind.DEAD, 5.0, 14.0),
        Fault(Part.THRUSTER_Z, ThrusterFaultKind.REDUCED, 5.0, 14.0, (0.4,)),
    )
    _, found = diagnosed(bank, replace(scenario_s0(), duration=14.0, faults=faults))
    late = found.t[0] >= 11.0
    for part in (Part.GYRO_Z, Part.THRUSTER_Z):
        assert (found.probability(part)[:, late] > 0.5).mean() > 0.8
    for part in (Part.GYRO_X, Part.GYRO_Y, Part.STAR, Part.THRUSTER_X, Part.THRUSTER_Y):
        assert found.probability(part)[:, late].max() < 0.5


def test_a_switching_command_does_not_hide_a_stuck_thruster(bank: AttitudeBankFilter) -> None:
    stuck = Fault(Part.THRUSTER_Z, ThrusterFaultKind.LOCKED, 4.0, 28.0, (7.0,))
    switching = Schedule((0.0, 4.0), ((0.0, 0.0, 5.0), (0.0, 0.0, 0.0)), 8.0)
    scenario = replace(scenario_s0(), duration=28.0, command_torque_B=switching, faults=(stuck,))
    runs, found = diagnosed(bank, scenario)
    flagged = found.probability(Part.THRUSTER_Z) > 0.5
    inside = (found.t[0] >= 8.0) & (found.t[0] < 27.95)
    assert flagged[:, inside].mean() >= 0.85
    error = 7.0 - acted(runs)[:, 2] - found.deviation[..., 2]
    squared = error**2 / found.deviation_variance[..., 2]
    assert squared[flagged & inside].mean() < 2.0


def test_kinds_name_the_thruster(bank: AttitudeBankFilter) -> None:
    runs, found = diagnosed(bank, replace(scenario_s0(), duration=1.0))
    with pytest.raises(InputError, match=r"gyro\.x is no thruster of this bank"):
        kinds_in(found, Part.GYRO_X, acted(runs), 12.0)
    with pytest.raises(InputError, match="`command_B` must be"):
        kinds_in(found, Part.THRUSTER_X, np.zeros(3), 12.0)
