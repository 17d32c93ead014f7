"""Interleaved timing: every alternative in every round, in turn, and ratios over the rounds."""

import itertools
import time
from collections.abc import Iterator

import numpy as np
import pytest

from optsat.campaign import interleaved
from optsat.campaign.interleaved import InterleavedTimes, time_interleaved
from optsat.errors import InputError


def test_ratios_are_taken_round_by_round() -> None:
    times = InterleavedTimes({"slow": np.array([2.0, 40.0, 6.0]), "fast": np.array([1.0, 10.0, 2.0])})
    assert times.ratio("slow", "fast") == 3.0
    assert times.ratio("fast", "slow") == pytest.approx(1 / 3)
    assert times.spread("slow", "fast") == pytest.approx((2.2, 3.8))
    assert times.per_second("fast") == 1.0


def test_alternatives_run_in_turn_and_for_long_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a clock that only the calls move: one second a call of `slow`, a quarter of `fast`."""
    now = 0.0
    log: list[str] = []

    def clock() -> float:
        return now

    def taking(name: str, seconds: float) -> None:
        nonlocal now
        now += seconds
        log.append(name)

    monkeypatch.setattr(time, "perf_counter", clock)
    times = time_interleaved(
        {"slow": lambda: taking("slow", 1.0), "fast": lambda: taking("fast", 0.25)}, 3, least_s=2.0
    )
    np.testing.assert_allclose(times.second["slow"], 1.0)
    np.testing.assert_allclose(times.second["fast"], 0.25)
    assert times.ratio("slow", "fast") == 4.0
    runs = [(name, len(list(group))) for name, group in itertools.groupby(log)]
    assert runs[-6:] == [("slow", 2), ("fast", 8)] * 3


def test_a_call_too_short_for_the_clock_ends_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interleaved, "_MOST_CALLS", 8)
    ticks: Iterator[int] = itertools.count()
    monkeypatch.setattr(time, "perf_counter", lambda: 1e-3 * next(ticks))
    assert time_interleaved({"nothing": lambda: None}, rounds=2).second["nothing"].shape == (2,)


def test_nothing_to_time() -> None:
    with pytest.raises(InputError, match="at least one alternative"):
        time_interleaved({})
    with pytest.raises(InputError, match="one round"):
        time_interleaved({"a": lambda: None}, rounds=0)
