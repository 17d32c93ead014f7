"""Interleaved timing: things run in turn within one process, compared by ratios, so that a slow machine slows all."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError

_MOST_CALLS = 1 << 20


@dataclass(frozen=True)
class InterleavedTimes:
    """Time of one call of each alternative in each round [s]; use `ratio`, a bare time means little on another day."""

    second: Mapping[str, Array]

    def ratio(self, slow: str, fast: str) -> float:
        """Return how many times as long `slow` takes as `fast`: the median over the rounds."""
        return float(np.median(self.second[slow] / self.second[fast]))

    def spread(self, slow: str, fast: str) -> tuple[float, float]:
        """Return the 10th and 90th percentile of that ratio over the rounds."""
        low, high = np.percentile(self.second[slow] / self.second[fast], (10, 90))
        return float(low), float(high)

    def per_second(self, name: str) -> float:
        """Return calls a second in the fastest round, which the machine's other load disturbed least."""
        return float(1.0 / np.min(self.second[name]))


def time_interleaved(
    alternatives: Mapping[str, Callable[[], object]], rounds: int = 9, least_s: float = 0.01
) -> InterleavedTimes:
    """Return the times of the alternatives, each called for at least `least_s` in every round.

    rounds : each runs every alternative once, in order; least_s : time of one measurement [s]

    Raises
    ------
    InputError : no alternative, or no round.
    """
    if not alternatives or rounds < 1:
        raise InputError(f"Timing needs at least one alternative and one round, got {len(alternatives)} and {rounds}.")
    calls = {name: _calls(function, least_s) for name, function in alternatives.items()}
    second: dict[str, list[float]] = {name: [] for name in alternatives}
    for _ in range(rounds):
        for name, function in alternatives.items():
            second[name].append(_time(function, calls[name]) / calls[name])
    return InterleavedTimes({name: np.array(values) for name, values in second.items()})


def _calls(function: Callable[[], object], least_s: float) -> int:
    """Return how many calls fill `least_s`; the first calls also warm caches and lazy imports."""
    function()
    calls = 1
    while (taken := _time(function, calls)) < 0.5 * least_s and calls < _MOST_CALLS:
        calls *= 2
    return min(_MOST_CALLS, max(1, round(calls * least_s / taken)))


def _time(function: Callable[[], object], calls: int) -> float:
    start = time.perf_counter()
    for _ in range(calls):
        function()
    return time.perf_counter() - start
