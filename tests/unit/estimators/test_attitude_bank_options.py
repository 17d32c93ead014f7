"""Attitude bank with more sensors and states: gyro bias, skewed gyro, chamber pressures; a bank for a spacecraft."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from optsat.attitude import quaternion
from optsat.errors import InputError
from optsat.estimators.attitude_bank import AttitudeBank
from optsat.estimators.attitude_bank_run import AttitudeBankFilter
from optsat.estimators.bank_result import BankResult
from optsat.estimators.spacecraft_banks import attitude_bank_of, translation_bank_of
from optsat.models.accelerometer import Accelerometer, Sensed
from optsat.models.additive_sensors import PositionReceiver, PressureSensor, RateGyro, SkewedGyro
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.parts import Part
from optsat.models.spacecraft import Spacecraft
from optsat.models.star_tracker import StarTracker
from optsat.simulation.diagnosis_run import DiagnosisRuns, simulate_many
from optsat.simulation.diagnosis_scenario import DiagnosisScenario, scenario_s0

SEEDS = range(3)


def scenario(spacecraft: Spacecraft, *faults: Fault, duration: float = 12.0) -> DiagnosisScenario:
    return replace(scenario_s0(), spacecraft=spacecraft, faults=faults, duration=duration)


def diagnosed(bank: AttitudeBank, runs: DiagnosisRuns) -> BankResult:
    logs = [run.telemetry for run in runs]
    return AttitudeBankFilter(bank).run(logs, runs.motion.q_BN[:, 0], runs.motion.omega_BN_B[:, 0])


def test_a_bias_among_the_states_is_learnt() -> None:
    craft = Spacecraft(gyro=RateGyro(bias=(0.02, -0.01, 0.015)))
    runs = simulate_many(scenario(craft), SEEDS)
    found = diagnosed(attitude_bank_of(craft, faults=(Part.GYRO_Z,), bias_prior=0.03), runs)
    bias, sigma = found.reference["gyro_bias_B"][:, -1], np.sqrt(found.covariance[:, -1, 6, 6])
    assert sigma.max() < 2e-3
    np.testing.assert_allclose(bias, np.broadcast_to([0.02, -0.01, 0.015], bias.shape), rtol=0, atol=5e-3)
    assert quaternion.error_angle(found.reference["q_BN"], runs.motion.q_BN)[:, 50:].max() < 5e-3
    assert found.probability(Part.GYRO_Z)[:, 50:].max() < 0.5


def test_a_skewed_gyro_keeps_the_attitude_where_star_and_gyro_are_lost() -> None:
    craft = Spacecraft(skewed_gyro=SkewedGyro())
    faults = [Fault(part, SensorFaultKind.MISSING, 4.0, 11.0) for part in (Part.STAR, Part.GYRO_Z)]
    runs = simulate_many(scenario(craft, *faults), SEEDS)
    options: dict[str, Any] = {"faults": (Part.GYRO_Z, Part.SKEWED_GYRO)}
    with_it, without = (
        diagnosed(attitude_bank_of(craft, **options), runs),
        diagnosed(AttitudeBank(faults=(Part.GYRO_Z,)), runs),
    )
    row = 105
    for found, most in ((with_it, 0.1), (without, 0.2)):
        error = quaternion.error_angle(found.reference["q_BN"], runs.motion.q_BN)[:, row]
        assert (error < 4.0 * np.sqrt(np.trace(found.covariance[:, row, :3, :3], axis1=1, axis2=2))).all()
        assert error.max() < most
    assert with_it.covariance[0, row, 2, 2] < 0.5 * without.covariance[0, row, 2, 2]


def test_a_dead_skewed_gyro_is_named() -> None:
    craft = Spacecraft(skewed_gyro=SkewedGyro())
    runs = simulate_many(scenario(craft, Fault(Part.SKEWED_GYRO, SensorFaultKind.DEAD, 2.0, 4.0), duration=5.0), SEEDS)
    found = diagnosed(attitude_bank_of(craft, faults=(Part.GYRO_Z, Part.SKEWED_GYRO)), runs)
    assert found.probability(Part.SKEWED_GYRO)[:, 20:40].min() > 0.9
    assert found.probability(Part.GYRO_Z).max() < 0.5


def test_chamber_pressure_finds_a_weak_thruster_sooner() -> None:
    craft = Spacecraft(pressure=PressureSensor(0.5))
    fault = Fault(Part.THRUSTER_Z, ThrusterFaultKind.REDUCED, 2.0, 10.0, (0.4,))
    runs = simulate_many(scenario(craft, fault), SEEDS)
    delays = []
    for bank in (attitude_bank_of(craft, faults=(Part.THRUSTER_Z,)), AttitudeBank(faults=(Part.THRUSTER_Z,))):
        flagged = diagnosed(bank, runs).probability(Part.THRUSTER_Z) > 0.5
        delays.append(np.argmax(flagged, axis=1) * 0.1 - 2.0)
    assert delays[0].max() <= 0.3
    assert delays[1].min() > 0.5


def test_a_bank_follows_its_spacecraft() -> None:
    craft = Spacecraft(gyro=RateGyro(R=np.diag([1e-4, 4e-4, 9e-4])), skewed_gyro=SkewedGyro(sigma=0.02))
    bank = attitude_bank_of(craft, rate_noise=2e-3)
    np.testing.assert_allclose(bank.gyro_deviations, (0.01, 0.02, 0.03))
    np.testing.assert_allclose(bank.star_deviation, AttitudeBank().star_deviation, rtol=1e-12)
    assert (bank.skewed_gyro_deviation, bank.rate_noise, bank.gyro_bias_noise) == (0.02, 2e-3, None)
    assert Part.SKEWED_GYRO in [part for fault in bank.bits for part in fault]
    translation = translation_bank_of(Spacecraft(accelerometer=Accelerometer(sensed=Sensed.SPECIFIC_FORCE)))
    assert (translation.gps_deviation, translation.sensed) == (10.0, Sensed.SPECIFIC_FORCE)


def test_spacecraft_that_no_bank_suits() -> None:
    correlated = 1e-4 * np.array([[1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]])
    with pytest.raises(InputError, match="needs gyro and star tracker"):
        attitude_bank_of(Spacecraft(star=None))
    with pytest.raises(InputError, match=r"`gyro\.R` correlates axes by up to 0\.5"):
        attitude_bank_of(Spacecraft(gyro=RateGyro(R=correlated)))
    with pytest.raises(InputError, match="needs GPS receiver and accelerometer"):
        translation_bank_of(Spacecraft(gps=None))
    with pytest.raises(InputError, match=r"`gps\.R` differs between axes"):
        translation_bank_of(Spacecraft(gps=PositionReceiver(R=np.diag([1.0, 1.0, 4.0]))))
    star = StarTracker(R=1e-7 * (np.eye(4) + 0.2))
    with pytest.raises(InputError, match=r"`star\.R` correlates"):
        attitude_bank_of(Spacecraft(star=star))
