"""Simulated runs for any faults, sampling, jitter and gaps: what is missing or faulty, and that nothing else is."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from optsat.models.additive_sensors import PressureSensor, SkewedGyro
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind, value_count
from optsat.models.parts import Part
from optsat.models.spacecraft import Spacecraft
from optsat.simulation.diagnosis_run import simulate
from optsat.simulation.diagnosis_scenario import DiagnosisScenario, Sampling
from optsat.simulation.readings import DEVICES

CRAFT = Spacecraft(skewed_gyro=SkewedGyro(), pressure=PressureSensor())


@st.composite
def faults(draw: st.DrawFn) -> Fault:
    part = draw(st.sampled_from(Part))
    kind = draw(st.sampled_from(ThrusterFaultKind if part.is_thruster else SensorFaultKind))
    start = draw(st.floats(-0.2, 2.2))
    stop = start + draw(st.floats(0.01, 2.0))
    return Fault(part, kind, start, stop, (0.5,) * value_count(part, kind))


@st.composite
def scenarios(draw: st.DrawFn) -> DiagnosisScenario:
    start = draw(st.floats(0.05, 2.5))
    return DiagnosisScenario(
        spacecraft=CRAFT,
        duration=draw(st.floats(0.0, 2.0)),
        dt=draw(st.sampled_from([0.05, 0.1, 1 / 3])),
        faults=tuple(draw(st.lists(faults(), max_size=4))),
        sampling={
            device: Sampling(draw(st.integers(1, 4)), draw(st.sampled_from([0.0, 0.2, 1.0])))
            for device in draw(st.sets(st.sampled_from(sorted(DEVICES))))
        },
        time_jitter_s=draw(st.sampled_from([0.0, 0.02])),
        gaps_s=((start, start + draw(st.floats(0.01, 1.0))),) if draw(st.booleans()) else (),
    )


@given(scenarios(), st.integers(0, 2**32))
@settings(max_examples=60)
def test_what_is_missing_and_what_is_faulty(scenario: DiagnosisScenario, seed: int) -> None:
    run, clean = simulate(scenario, seed), simulate(replace(scenario, sampling={}, faults=()), seed)
    same_motion = not any(fault.part.is_thruster for fault in scenario.faults)
    truth, telemetry = run.truth, run.telemetry
    np.testing.assert_array_equal(telemetry.t, clean.telemetry.t)
    assert (np.diff(telemetry.t) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(truth.q_BN, axis=1), 1.0, atol=1e-14)
    assert (truth.q_BN[:, 3] >= 0).all()
    for part in truth.parts:
        if part.is_thruster:
            continue
        mine = getattr(telemetry, DEVICES[part.device]).reshape(len(telemetry), -1)
        its = getattr(clean.telemetry, DEVICES[part.device]).reshape(len(telemetry), -1)
        columns = slice(None) if part.axis is None else slice(part.axis, part.axis + 1)
        sampling = scenario.sampling.get(part.device, Sampling())
        healthy = ~truth.failed(part)
        sent = ~np.isnan(mine[:, columns]).any(axis=1)
        if sampling == Sampling() and not scenario.gaps_s:
            first = 1 if part.device == "pressure" else 0
            assert sent[first:][healthy[first:]].all()
        if sampling.dropout == 1.0:
            assert not sent.any()
        if same_motion:
            at = healthy & sent
            np.testing.assert_array_equal(mine[at, columns], its[at, columns])
    failing = {fault.part for fault in scenario.faults if fault.active(truth.t).any()}
    assert failing == {part for part in truth.parts if truth.failed(part).any()}
