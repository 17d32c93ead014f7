"""Translation bank: the compiled one against the dense one, both kinds of accelerometer, and what each can tell."""

from dataclasses import replace
from itertools import pairwise
from math import prod
from typing import Any

import numpy as np
import pytest
from dense_bank import DenseChannel, Modes, Outcome, dense_step, normal, transition

from optsat.arrays import Array
from optsat.attitude import dcm
from optsat.errors import InputError
from optsat.estimators.bank_kernels import translation_bank_16
from optsat.estimators.bank_result import BankResult
from optsat.estimators.bank_run import joined
from optsat.estimators.spacecraft_banks import translation_bank_of
from optsat.estimators.translation_bank import TranslationBank
from optsat.estimators.translation_bank_run import TranslationBankFilter
from optsat.kernels.open_kernel import make_kernel
from optsat.models.accelerometer import Accelerometer, Axes, Sensed
from optsat.models.faults import Fault, SensorFaultKind
from optsat.models.parts import Part
from optsat.models.schedule import constant
from optsat.models.spacecraft import SEED_GRAVITATIONAL_PARAMETER, Spacecraft
from optsat.records.telemetry import Telemetry
from optsat.simulation.diagnosis_run import DiagnosisRun, DiagnosisRuns, simulate_many
from optsat.simulation.diagnosis_scenario import DiagnosisScenario, Sampling, scenario_s0

MU = SEED_GRAVITATIONAL_PARAMETER


def scenario(sensed: Sensed, axes: Axes, *faults: Fault) -> DiagnosisScenario:
    craft = Spacecraft(accelerometer=Accelerometer(sensed=sensed, axes=axes))
    return replace(scenario_s0(), spacecraft=craft, duration=8.0, faults=faults)


FAULTS = (
    Fault(Part.ACCELEROMETER_Y, SensorFaultKind.DEAD, 2.0, 4.0),
    Fault(Part.GPS, SensorFaultKind.FREEZE, 3.0, 5.0),
    Fault(Part.GPS, SensorFaultKind.DEAD, 6.0, 7.0),
)


def diagnosed(bank: TranslationBank, runs: DiagnosisRuns) -> BankResult:
    motion = runs.motion
    logs = [run.telemetry for run in runs]
    return TranslationBankFilter(bank).run(logs, motion.r_N[:, 0], motion.v_N[:, 0], motion.q_BN)


def pull(r: Array) -> Array:
    return np.asarray(-MU * r / np.linalg.norm(r) ** 3)


def gradient(r: Array) -> Array:
    length = np.linalg.norm(r)
    return np.asarray(MU / length**3 * (3.0 * np.outer(r, r) / length**2 - np.eye(3)))


def moved(r: Array, v: Array, T: float) -> tuple[Array, Array]:
    k1, k2 = (v, pull(r)), (v + T / 2 * pull(r), pull(r + T / 2 * v))
    k3 = (v + T / 2 * k2[1], pull(r + T / 2 * k2[0]))
    k4 = (v + T * k3[1], pull(r + T * k3[0]))
    mean = [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
    return r + T * mean[0], v + T * mean[1]


def dense_run(run: DiagnosisRun, sensed: Sensed, axes: Axes) -> list[Outcome]:
    log, truth, found = run.telemetry, run.truth, []
    prior = [1e-3 if bit else 1.0 - 1e-3 for bit in (0, 1)]
    mu = np.array([prod(prior[mode >> bit & 1] for bit in range(4)) for mode in range(16)])
    modes = Modes(mu, np.zeros((16, 6)), np.tile(np.diag([1e4] * 3 + [1.0] * 3), (16, 1, 1)))
    r, v = truth.r_N[0], truth.v_N[0]
    last: list[Array | float | None] = [None] * 4
    assert log.gps_r_N is not None
    assert log.accelerometer is not None
    for k, (before, now) in enumerate(pairwise([log.t[0], *log.t])):
        T = now - before
        start = r
        r, v = moved(r, v, T)
        A = np.zeros((6, 6))
        A[:3, 3:], A[3:, :3] = np.eye(3), gradient((start + r) / 2)
        AT = A * T
        F = np.eye(6) + AT + AT @ AT / 2 + AT @ AT @ AT / 6
        chain = [(2e-4, 5e-3)] * 4 if k else [(0.0, 0.0)] * 4
        turn = dcm.from_quaternion(truth.q_BN[k]) if axes is Axes.BODY else np.eye(3)
        g = turn @ pull(r)
        channels = []
        y = log.gps_r_N[k]
        for c, (value, expected, H, R, B) in enumerate(
            [
                (y, r, np.eye(6)[:3], np.full(3, 100.0), 3e3),
                *(
                    (
                        log.accelerometer[k, i : i + 1],
                        np.array([g[i] if sensed is Sensed.TOTAL else 0.0]),
                        np.hstack([turn @ gradient(r), np.zeros((3, 3))])[i : i + 1] * (sensed is Sensed.TOTAL),
                        np.array([1e-3 + (1e-6 * (g @ g - g[i] ** 2) if _turned(sensed, axes) else 0.0)]),
                        2.0,
                    )
                    for i in range(3)
                ),
            ]
        ):
            there = bool(np.isfinite(value).all())
            sent, s2 = (value if there else np.zeros(len(R))), 1e-6 * (100.0 if c == 0 else 1e-3)
            free = np.log(0.25) + sum(normal(each, s2) for each in sent)
            previous = last[c]
            if previous is not None:
                free = np.logaddexp(free, np.log(0.25) + sum(normal(each, 2 * s2) for each in sent - previous))
            last[c] = sent if there else previous
            bit = 3 if c == 0 else c - 1
            channels.append(DenseChannel(bit, sent - expected, H, R, free, B, int(there)))
        noise = np.array([0.0] * 3 + [1e-4 * T / 0.1] * 3)
        outcome = dense_step(modes, transition(chain), F, noise, [], channels)
        modes = outcome.modes
        r, v = r + outcome.merged[:3], v + outcome.merged[3:]
        modes.m = modes.m - outcome.merged
        outcome.merged = np.concatenate([r, v])
        found.append(outcome)
    return found


def _turned(sensed: Sensed, axes: Axes) -> bool:
    return sensed is Sensed.TOTAL and axes is Axes.BODY


@pytest.mark.parametrize(("sensed", "axes"), [(Sensed.TOTAL, Axes.BODY), (Sensed.SPECIFIC_FORCE, Axes.INERTIAL)])
def test_compiled_bank_is_the_dense_one(sensed: Sensed, axes: Axes) -> None:
    simulated = replace(
        scenario(sensed, axes, *FAULTS), sampling={"gps": Sampling(2), "accelerometer": Sampling(1, 0.1)}
    )
    runs = simulate_many(simulated, [0])
    result = diagnosed(translation_bank_of(simulated.spacecraft), runs)
    found = dense_run(runs[0], sensed, axes)
    assert result.mode_probability is not None
    np.testing.assert_allclose(result.mode_probability[0], [each.modes.mu for each in found], rtol=0, atol=1e-9)
    state = np.concatenate([result.reference["r_N"][0], result.reference["v_N"][0]], axis=-1)
    # of seven million metres, one unit in the last place is 1e-9
    np.testing.assert_allclose(state, [each.merged for each in found], rtol=0, atol=2e-7)
    np.testing.assert_allclose(result.covariance[0], [each.covariance for each in found], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(result.log_evidence[0], [each.evidence for each in found], rtol=1e-7, atol=1e-7)


def test_faults_are_named_and_the_orbit_is_kept() -> None:
    simulated = scenario(Sensed.TOTAL, Axes.BODY, *FAULTS)
    runs = simulate_many(simulated, range(4))
    found = diagnosed(translation_bank_of(simulated.spacecraft), runs)
    t = found.t[0]
    for part, start, stop in ((Part.ACCELEROMETER_Y, 2.0, 4.0), (Part.GPS, 3.0, 5.0), (Part.GPS, 6.0, 7.0)):
        inside = (t >= start + 0.05) & (t < stop - 0.05)
        assert found.probability(part)[:, inside].min() > 0.9
    for part in (Part.ACCELEROMETER_X, Part.ACCELEROMETER_Z):
        assert found.probability(part).max() < 0.5
    error = np.concatenate(
        [runs.motion.r_N - found.reference["r_N"], runs.motion.v_N - found.reference["v_N"]], axis=-1
    )
    nees = np.einsum("nti,nti->nt", error, np.linalg.solve(found.covariance, error[..., None])[..., 0])
    assert nees.mean() < 8.0


def test_known_thrust_is_no_fault() -> None:
    simulated = replace(scenario(Sensed.TOTAL, Axes.BODY), specific_force_B=constant(0.5, 0.0, -0.2))
    runs, bank = simulate_many(simulated, [0]), TranslationBankFilter(translation_bank_of(simulated.spacecraft))
    run, motion = runs[0], runs.motion
    force = np.broadcast_to([0.5, 0.0, -0.2], (*runs.t.shape, 3))
    told = bank.run(run.telemetry, motion.r_N[0, 0], motion.v_N[0, 0], motion.q_BN, force)
    untold = bank.run(run.telemetry, motion.r_N[0, 0], motion.v_N[0, 0], motion.q_BN)
    assert told.fault_probability[0, 5:].max() < 0.05
    assert untold.probability(Part.ACCELEROMETER_X)[0, 5:].min() > 0.9


def test_input_is_checked() -> None:
    with pytest.raises(InputError, match="`gps_deviation`"):
        TranslationBank(gps_deviation=0.0)
    with pytest.raises(InputError, match="`chance` must be two chances"):
        TranslationBank(chance=(1.0, 1.0))
    with pytest.raises(InputError, match=r"gyro\.x.* is no part of this bank"):
        TranslationBank(faults=(Part.GYRO_X,))
    simulated = scenario(Sensed.TOTAL, Axes.BODY)
    run = simulate_many(simulated, [0])[0]
    bank = TranslationBankFilter(translation_bank_of(simulated.spacecraft))
    with pytest.raises(InputError, match=r"`q_BN` .* is needed"):
        bank.run(run.telemetry, run.truth.r_N[0], run.truth.v_N[0])
    with pytest.raises(InputError, match="`q_BN` must have shape"):
        bank.run(run.telemetry, run.truth.r_N[0], run.truth.v_N[0], run.truth.q_BN)
    with pytest.raises(InputError, match=r"`r_N`.* are needed"):
        bank.run(run.telemetry, q_BN=run.truth.q_BN[None])
    with pytest.raises(InputError, match=r"`v_N` must have shape \(3,\)"):
        bank.run(run.telemetry, run.truth.r_N[0], np.zeros(2), run.truth.q_BN[None])
    with pytest.raises(InputError, match="`axes` must be one of inertial, body, got 'B'"):
        translation_bank_16(axes="B")


def test_part_after_part_is_the_whole() -> None:
    simulated = scenario(Sensed.TOTAL, Axes.BODY, *FAULTS)
    run = simulate_many(simulated, [0])[0]
    log, q = run.telemetry, run.truth.q_BN[None]
    bank = TranslationBankFilter(translation_bank_of(simulated.spacecraft))
    whole = bank.run(log, run.truth.r_N[0], run.truth.v_N[0], q)
    assert log.gps_r_N is not None
    assert log.accelerometer is not None
    parts: list[BankResult] = []
    for rows in (slice(0, 35), slice(35, 81)):
        part = Telemetry(
            log.t[rows], log.command_torque_B[rows], gps_r_N=log.gps_r_N[rows], accelerometer=log.accelerometer[rows]
        )
        start: dict[str, Any] = {"after": parts[0]} if parts else {"r_N": run.truth.r_N[0], "v_N": run.truth.v_N[0]}
        parts.append(bank.run(part, q_BN=q[:, rows], **start))
    np.testing.assert_array_equal(joined(parts).fault_probability, whole.fault_probability)
    with pytest.raises(InputError, match="result of 1 logs, got 2"):
        bank.run([log, log], q_BN=np.concatenate([q, q]), after=parts[0])


def test_offered_kernel_answers_as_its_twin() -> None:
    source, rng = translation_bank_16(), np.random.default_rng(3)
    kernel = make_kernel(source)
    assert source.twin is not None
    assert source.example is not None
    for _ in range(5):
        x = source.example(rng)
        parts = np.split(x, np.cumsum([port.size for port in source.inputs])[:-1])
        arguments = [part.reshape(port.shape) for part, port in zip(parts, source.inputs, strict=True)]
        *results, status = kernel(*arguments)
        wanted, y = source.twin(x)
        assert status == wanted == 0
        ends = np.cumsum([port.size for port in source.outputs])[:-1]
        for got, expected in zip(results, np.split(y, ends), strict=True):
            scale = float(np.abs(expected).max())
            np.testing.assert_allclose(np.ravel(got), expected, rtol=0, atol=1e-11 * max(scale, 1e-3))
