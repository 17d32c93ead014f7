"""Attitude series: the window contains the truth, tightens the bound, isolates a jump, and ends at a gyro gap."""

from typing import Any

import numpy as np
import pytest
from flown_record import EPS_MAG, R_MAG, attitude, channel, flight

import optsat
from optsat.arrays import Mask
from optsat.attitude import dcm
from optsat.errors import InputError
from optsat.estimators.attitude_series import AttitudeSeries
from optsat.records.record import Record, VectorChannel

WINDOW = optsat.Window(length_s=8.0, spacing_s=1.0)


def held(series: AttitudeSeries, record: Record) -> Mask:
    """Return whether each determined epoch's error is within its bound (n,)."""
    assert record.q_BN_true is not None
    known = np.isfinite(series.error_rad(record.q_BN_true))
    return np.asarray(series.error_rad(record.q_BN_true)[known] <= series.bound_rad[known])


def with_fault(first: int, count: int = 20, turn_deg: float = 25.0) -> Record:
    """Return a flight whose magnetometer is turned from epoch `first` on."""
    record = flight(count)
    sun, mag = record.channels
    b_B = mag.b_B.copy()
    half = np.deg2rad(turn_deg) / 2
    b_B[first:] = b_B[first:] @ dcm.from_quaternion(np.array([0.0, np.sin(half), 0.0, np.cos(half)])).T
    return flight(count, channels=(sun, VectorChannel("mag", "B", b_B, mag.r_N, mag.angle_bound_rad, mag.valid)))


def test_single_frames_are_certify_attitude_epoch_by_epoch() -> None:
    record = flight(12)
    series = optsat.certify_record(record)
    for k in range(12):
        b_B, r_N, bound, _ = record.pairs(k)
        one = optsat.certify_attitude(b_B, r_N, bound)
        assert series.bound_rad[k] == pytest.approx(one.bound_rad, rel=1e-9)
        np.testing.assert_allclose(series.q_BN[k], one.q_BN, atol=1e-9)
    assert np.all(held(series, record))
    assert series.used.tolist() == [2] * 12
    assert not series.windowed
    assert series.channels == ("sun", "mag")
    assert series.counts() == {"ok": 12, "unbounded": 0, "inconsistent": 0, "no measurement": 0}


@pytest.mark.parametrize("bias", [(0, 0, 0), (1e-4, 0, 0), (0, -1e-4, 0), (0, 6e-5, 8e-5)])
def test_the_window_holds_the_truth_and_tightens_the_bound(bias: Any) -> None:
    record = flight(20, bias=np.array(bias), gyro_bound=1e-4)
    single, windowed = optsat.certify_record(record), optsat.certify_record(record, WINDOW)
    assert windowed.windowed
    assert windowed.ok.all()
    assert len(held(windowed, record)) == 20
    assert np.all(held(windowed, record))
    assert np.median(windowed.bound_rad) < 0.7 * np.median(single.bound_rad)
    assert windowed.used.max() == 2 + 2 * 8
    assert not windowed.rejected.any()


def test_a_jump_is_isolated_by_the_window_only() -> None:
    record = with_fault(first=12)
    windowed = optsat.certify_record(record, WINDOW)
    mag = record.channel("mag").name
    column = windowed.channels.index(mag)
    assert np.all(windowed.rejected[12:, column])
    assert not windowed.rejected[:12].any()
    assert not windowed.rejected[:, 1 - column].any()
    assert np.all(held(windowed, record))
    # two directions that contradict each other do not say which is wrong
    single = optsat.certify_record(record)
    assert not single.rejected.any()
    assert single.counts()["inconsistent"] == 8


def test_a_jump_is_only_reported_when_isolation_is_off() -> None:
    record = with_fault(first=12)
    series = optsat.certify_record(record, optsat.Window(8.0, 1.0, isolate=False))
    assert not series.rejected.any()
    assert series.counts()["inconsistent"] >= 8
    assert np.all(np.isnan(series.bound_rad[12:]))
    assert np.all(held(series, record))


def test_a_gyro_gap_breaks_the_window() -> None:
    record = flight(16)
    assert record.omega_BN_B is not None
    omega = np.array(record.omega_BN_B)
    omega[8] = np.nan
    broken = flight(16, omega_BN_B=omega)
    series, whole, single = (
        optsat.certify_record(broken, WINDOW),
        optsat.certify_record(record, WINDOW),
        optsat.certify_record(record),
    )
    assert series.used[[7, 8, 9, 10]].tolist() == [16, 2, 2, 4]
    np.testing.assert_allclose(series.bound_rad[[8, 9]], single.bound_rad[[8, 9]], rtol=1e-6)
    np.testing.assert_array_equal(series.bound_rad[:7], whole.bound_rad[:7])
    assert np.all(held(series, record))


def test_the_window_carries_over_missing_measurements() -> None:
    valid = np.ones(16, dtype=bool)
    valid[10:13] = False
    q_BN = attitude(np.arange(16.0))
    rng = np.random.default_rng(1)
    channels = (
        channel("sun", q_BN, np.array([1.0, 0, 0]), 0.001, rng, valid=valid),
        channel("mag", q_BN, R_MAG, EPS_MAG, rng, valid=valid),
    )
    record = flight(16, channels=channels, gyro_bound=1e-4)
    single = optsat.certify_record(record)
    assert single.status_index[10:13].tolist() == [-1, -1, -1]
    assert np.all(np.isnan(single.bound_rad[10:13]))
    assert single.counts()["no measurement"] == 3
    windowed = optsat.certify_record(record, WINDOW)
    assert windowed.ok.all()
    assert np.all(held(windowed, record))
    # without a new measurement the bound grows
    assert np.all(np.diff(windowed.bound_rad[9:13]) > 0)


def test_one_direction_becomes_an_attitude_by_moving() -> None:
    """A sensor leaves a rotation free in every frame; over a window it sees its reference in two directions."""
    t = np.arange(30.0)
    r_N = np.stack((np.cos(0.05 * t), np.sin(0.05 * t), 0 * t), axis=1)
    b_B = np.einsum("nij,nj->ni", dcm.from_quaternion(attitude(t)), r_N)
    sun = VectorChannel("sun", "B", b_B, r_N, np.full(30, 0.002), np.ones(30, dtype=bool))
    record = flight(30, channels=(sun,))
    assert optsat.certify_record(record).counts()["unbounded"] == 30
    series = optsat.certify_record(record, optsat.Window(20.0, 4.0))
    assert series.ok[-1]
    assert series.bound_rad[-1] < 0.1
    assert np.all(held(series, record))


def test_an_empty_past_and_no_channels() -> None:
    record = flight(5, channels=())
    for window in (None, WINDOW):
        series = optsat.certify_record(record, window)
        assert series.counts()["no measurement"] == 5
        assert np.all(np.isnan(series.q_BN))
        assert np.all(series.used == 0)


def test_a_contradiction_without_a_past_is_reported() -> None:
    """Without a past there is nothing to appeal to: every frame is inconsistent, and no channel is blamed."""
    record = with_fault(first=0)
    series = optsat.certify_record(record, WINDOW)
    assert series.counts()["inconsistent"] == 20
    assert not series.rejected.any()


def test_a_lying_gyro_spoils_the_past_only() -> None:
    """Sensors that agree with one another outvote the past; one of them alone does not, until the next epoch."""
    record = flight(40, dt=0.1)
    assert record.omega_BN_B is not None
    omega = np.array(record.omega_BN_B)
    omega[10:12] += (0.8, 0.4, 0.2)
    series = optsat.certify_record(flight(40, dt=0.1, omega_BN_B=omega), optsat.Window(0.8, 0.1))
    assert not series.rejected[:10].any()
    assert series.rejected[10:13].any()
    assert not series.rejected.all(axis=1).any()
    assert not series.rejected[13:].any()
    assert series.used[13] == 5
    assert np.all(held(series, record))
    assert len(held(series, record)) == 40


def test_what_is_no_record_and_no_window_is_refused_by_name() -> None:
    wrong: Any = "flight.csv"
    with pytest.raises(InputError, match=r"`record` must be a Record, got str; optsat.read_csv_log"):
        optsat.certify_record(wrong)
    with pytest.raises(InputError, match=r"`window` must be an optsat.Window"):
        optsat.certify_record(flight(3), wrong)
    misspelt: Any = optsat.certify_record
    with pytest.raises(optsat.UnknownOptionError, match="Did you mean `window`"):
        misspelt(flight(3), windw=WINDOW)


def test_every_nth_epoch_and_progress() -> None:
    record = flight(20)
    seen: list[tuple[int, int]] = []
    series = optsat.certify_record(record, WINDOW, lambda *at: seen.append(at), every=3)
    np.testing.assert_array_equal(series.t, record.t[::3])
    assert seen[-1] == (7, 7)
    assert [done for done, _ in seen[:7]] == list(range(1, 8))
    assert record.q_BN_true is not None
    assert np.all(series.error_rad(record.q_BN_true[::3]) <= series.bound_rad)
    wrong: list[Any] = [0, -1, 1.5, True]
    for every in wrong:
        with pytest.raises(InputError, match="`every` must be a whole number >= 1"):
            optsat.certify_record(record, every=every)
