"""Channel faults, for any readings, window, part and kind: what must change, and that nothing else does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.errors import InputError
from optsat.models.channel_fault import noise_components, spoiled
from optsat.models.draws import rotations
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind, Window, value_count
from optsat.models.parts import Part

K = SensorFaultKind
PARTS = st.sampled_from([part for part in Part if not part.is_thruster])


@st.composite
def cases(draw: st.DrawFn, *kinds: SensorFaultKind) -> tuple[Fault, Array, Array, Array]:
    """A fault, times (N, T) of any spacing, readings with gaps, and noise."""
    part, kind = draw(PARTS), draw(st.sampled_from(kinds))
    runs, count, n = draw(st.integers(1, 3)), draw(st.integers(1, 12)), noise_components(part)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    t = np.cumsum(rng.uniform(0.01, 1.0, (runs, count)), axis=1)
    start = draw(st.floats(-1, 12))
    length = draw(st.sampled_from([0.05, 1.0, 3.0, 100.0]))
    value = rng.uniform(0.1, 2.0, value_count(part, kind))
    fault = Fault(part, kind, start, start + length, tuple(value.tolist()))
    readings = rotations(rng, runs * count).reshape(runs, count, 4) if n == 4 else rng.normal(size=(runs, count, n))
    readings[rng.random((runs, count)) < 0.2] = np.nan
    return fault, t, readings, rng.normal(size=readings.shape)


def inside(fault: Fault, t: Array) -> Window:
    return np.asarray((t >= fault.start_s) & (t < fault.stop_s))


@given(cases(*K))
def test_outside_the_window_every_bit_stays_and_the_argument_too(case: tuple[Fault, Array, Array, Array]) -> None:
    fault, t, readings, noise = case
    before = readings.copy()
    sent = spoiled(fault, t, readings, noise)
    np.testing.assert_array_equal(readings, before)
    np.testing.assert_array_equal(sent[~inside(fault, t)], readings[~inside(fault, t)])


@given(cases(K.DEAD, K.STUCK, K.MISSING, K.DEAD_NOISY))
def test_constants_do_not_depend_on_the_readings(case: tuple[Fault, Array, Array, Array]) -> None:
    fault, t, readings, noise = case
    at = inside(fault, t)
    sent = spoiled(fault, t, readings, noise)[at]
    expected = {
        K.DEAD: np.zeros(sent.shape),
        K.MISSING: np.full(sent.shape, np.nan),
        K.STUCK: np.broadcast_to(fault.value, sent.shape) if fault.kind is K.STUCK else sent,
        K.DEAD_NOISY: fault.value[0] * noise[at] if fault.kind is K.DEAD_NOISY else sent,
    }
    np.testing.assert_array_equal(sent, expected[SensorFaultKind(fault.kind)])


@given(cases(K.BIAS, K.DRIFT, K.NOISE))
def test_shifts_add_to_the_reading_or_turn_the_attitude(case: tuple[Fault, Array, Array, Array]) -> None:
    fault, t, readings, noise = case
    at = np.asarray(inside(fault, t) & ~np.isnan(readings).any(axis=-1))
    sent = spoiled(fault, t, readings, noise)
    np.testing.assert_array_equal(np.isnan(sent), np.isnan(readings))
    value = np.array(fault.value)
    shift = {
        K.BIAS: np.broadcast_to(value, (*t.shape, len(value))),
        K.DRIFT: value * (t - fault.start_s)[..., None],
        K.NOISE: value * noise[..., :3],
    }[SensorFaultKind(fault.kind)][at]
    if not at.any():
        return
    if fault.part is Part.STAR:
        turn = quaternion.compose(sent[at], quaternion.inverse(readings[at]))
        wanted = quaternion.exponential(shift)
        assert np.abs(np.abs(np.sum(turn * wanted, axis=-1)) - 1).max() < 1e-12
        np.testing.assert_allclose(np.linalg.norm(sent[at], axis=-1), 1.0, atol=1e-12)
    else:
        np.testing.assert_allclose(sent[at] - readings[at], shift, rtol=0, atol=1e-12)


@given(cases(K.SCALE))
def test_scale(case: tuple[Fault, Array, Array, Array]) -> None:
    fault, t, readings, noise = case
    at = inside(fault, t)
    np.testing.assert_array_equal(spoiled(fault, t, readings, noise)[at], fault.value[0] * readings[at])


@given(cases(K.FREEZE))
def test_freeze_repeats_what_was_sent_last(case: tuple[Fault, Array, Array, Array]) -> None:
    fault, t, readings, noise = case
    sent = spoiled(fault, t, readings, noise)
    for run in range(len(t)):
        at = inside(fault, t)[run]
        kept = [k for k in range(t.shape[1]) if not np.isnan(readings[run, k]).any()]
        before = [k for k in kept if t[run, k] < fault.start_s]
        within = [k for k in kept if at[k]]
        if at.any() and (before or within):
            source = before[-1] if before else within[0]
            np.testing.assert_array_equal(sent[run, at], np.tile(readings[run, source], (int(at.sum()), 1)))
        elif at.any():
            assert np.isnan(sent[run, at]).all()


@given(cases(*K))
def test_many_runs_at_once_are_each_alone(case: tuple[Fault, Array, Array, Array]) -> None:
    fault, t, readings, noise = case
    together = spoiled(fault, t, readings, noise)
    for run in range(len(t)):
        np.testing.assert_array_equal(spoiled(fault, t[run], readings[run], noise[run]), together[run])


def test_wrong_use() -> None:
    t, one = np.arange(3.0), np.zeros((3, 1))
    with pytest.raises(InputError, match=r"thruster.x is no sensor"):
        spoiled(Fault(Part.THRUSTER_X, ThrusterFaultKind.OPEN, 0), t, one, one)
    with pytest.raises(InputError, match=r"of gps must have shape \(3, 3\), got \(3, 1\)"):
        spoiled(Fault(Part.GPS, K.DEAD, 0), t, one, one)
