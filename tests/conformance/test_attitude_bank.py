"""Attitude bank: the compiled one against the dense one, which has the quaternions of the specification."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from dense_attitude import DenseAttitude, Parameters
from dense_bank import Modes, Outcome

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.estimators.attitude_bank_run import AttitudeBankFilter
from optsat.estimators.bank_result import BankResult
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.parts import Part
from optsat.models.schedule import Schedule
from optsat.records.telemetry import Telemetry
from optsat.simulation.diagnosis_run import simulate
from optsat.simulation.diagnosis_scenario import DiagnosisScenario, Sampling, scenario_s1


def dense_run(bank: AttitudeBankFilter, log: Telemetry, q_BN: Array, omega: Array) -> list[Outcome]:
    """The dense bank over a log; its first row is the prior's own, with no motion before it."""
    axes = len(bank.bank.thruster_axes)
    state = bank.start(q_BN[None], omega[None], log.command_torque_B[:1])
    n, modes = 6 + axes, bank.model.structure.modes
    P = np.zeros((modes, n, n))
    lower = np.tril_indices(n)
    P[:, lower[0], lower[1]] = state["covariance"][0].T
    P = np.maximum(P, P.transpose(0, 2, 1))
    parameters = Parameters(np.asarray(bank.bank.body.inertia_B), axes)
    start = Modes(state["probability"][0].copy(), np.zeros((modes, n)), P)
    dense = DenseAttitude(parameters, quaternion.to_scalar_first(q_BN), omega, start, log.command_torque_B[0])
    found = []
    assert log.gyro_omega_BN_B is not None
    assert log.star_q_BN is not None
    for k in range(len(log)):
        star = log.star_q_BN[k][[3, 0, 1, 2]]
        dense.dt = log.t[k] - log.t[k - 1] if k else 0.0
        found.append(dense.step(log.command_torque_B[max(k - 1, 0)], log.gyro_omega_BN_B[k], star))
        found[-1].merged = np.concatenate([dense.q, dense.w, dense.d])
    return found


def differences(result: BankResult, found: Sequence[Outcome]) -> dict[str, float]:
    """Largest difference of each output over all rows."""

    def worst(got: Array, wanted: list[Array]) -> float:
        return float(np.abs(got[0] - np.array(wanted)).max())

    assert result.mode_probability is not None
    axes = result.deviation.shape[-1]
    state = [result.reference["q_BN"][..., [3, 0, 1, 2]], result.reference["omega_BN_B"]]
    state += [result.reference["torque_deviation_B"]] if axes else []
    pairs = [np.array(each.deviation).reshape(axes, 2) for each in found]
    return {
        "state": worst(np.concatenate(state, -1), [each.merged for each in found]),
        "modes": worst(result.mode_probability, [each.modes.mu for each in found]),
        "faults": worst(result.fault_probability, [each.faults for each in found]),
        "covariance": worst(result.covariance, [each.covariance for each in found]),
        "deviation": worst(result.deviation, [each[:, 0] for each in pairs]) if axes else 0.0,
        "variance": worst(result.deviation_variance, [each[:, 1] for each in pairs]) if axes else 0.0,
    }


HARD = replace(
    scenario_s1(),
    duration=8.0,
    sampling={"star": Sampling(2), "gyro": Sampling(1, 0.1)},
    command_torque_B=Schedule((0.0, 0.7), ((0.0, 0.0, 5.0), (4.0, 0.0, 0.0)), 1.0),
    faults=(
        Fault(Part.GYRO_Y, SensorFaultKind.DEAD, 2.0, 4.0),
        Fault(Part.STAR, SensorFaultKind.FREEZE, 3.0, 6.0),
        Fault(Part.STAR, SensorFaultKind.DEAD, 6.0, 7.0),
        Fault(Part.THRUSTER_Z, ThrusterFaultKind.OPEN, 1.0, 6.5),
    ),
)


@pytest.mark.parametrize("scenario", [HARD, scenario_s1()], ids=["hard", "S1"])
def test_compiled_bank_is_the_dense_one(scenario: DiagnosisScenario) -> None:
    run, bank = simulate(scenario, 0), AttitudeBankFilter()
    q, omega = run.truth.q_BN[0], run.truth.omega_BN_B[0]
    result = bank.run(run.telemetry, q, omega)
    found = dense_run(bank, run.telemetry, q, omega)
    assert max(differences(result, found).values()) < 1e-9
    evidence = np.array([each.evidence for each in found])
    np.testing.assert_allclose(result.log_evidence[0], evidence, rtol=1e-9, atol=1e-9)
