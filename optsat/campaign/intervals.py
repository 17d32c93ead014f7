"""Intervals: how far apart two means, quantiles or rates may be, at 95 % confidence, with the p value of no difference.

Differences are second less first throughout.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.campaign.philox import philox_words, uniforms

CONFIDENCE = 0.95
RESAMPLES = 2000

_TAIL = (1 - CONFIDENCE) / 2
_BLOCK_NUMBERS = 1 << 21


@dataclass(frozen=True)
class Interval:
    """A difference, the interval that holds the true one with 95 % confidence, and the p value of none."""

    difference: float
    low: float
    high: float
    p: float


def paired_t(first: Array, second: Array) -> Interval:
    """Return the difference of the means of pairs (n,), n >= 2, by Student's t."""
    d = second - first
    return _by_t(float(np.mean(d)), float(np.std(d, ddof=1)) / math.sqrt(len(d)), len(d) - 1)


def welch_t(first: Array, second: Array) -> Interval:
    """Return the difference of the means of two samples, each of 2 and more, by Welch's t."""
    parts = [float(np.var(sample, ddof=1)) / len(sample) for sample in (first, second)]
    scale = sum(part**2 / (len(sample) - 1) for part, sample in zip(parts, (first, second), strict=True))
    freedom = sum(parts) ** 2 / scale if scale > 0 else 1.0
    return _by_t(float(np.mean(second) - np.mean(first)), math.sqrt(sum(parts)), freedom)


def _by_t(difference: float, error: float, freedom: float) -> Interval:
    from scipy.special import stdtr, stdtrit

    if error == 0:
        return Interval(difference, difference, difference, 1.0 if difference == 0 else 0.0)
    reach = float(stdtrit(freedom, 1 - _TAIL)) * error
    return Interval(
        difference, difference - reach, difference + reach, 2 * float(stdtr(freedom, -abs(difference) / error))
    )


def normal_interval(difference: float, error: float) -> Interval:
    """Return the interval of a difference with a known standard error."""
    from scipy.special import ndtr, ndtri

    if error == 0:
        return Interval(difference, difference, difference, 1.0 if difference == 0 else 0.0)
    reach = float(ndtri(1 - _TAIL)) * error
    return Interval(difference, difference - reach, difference + reach, 2 * float(ndtr(-abs(difference) / error)))


Statistic = Callable[[Array], Array]
"""Of samples (k, n), one a row, their statistics (k, s)."""


def resampled_differences(
    first: Array, second: Array, paired: bool, statistic: Statistic, key: int, stream: int, resamples: int = RESAMPLES
) -> Array:
    """Return the differences of statistics (resamples, s) over resamples with replacement, pairs kept where paired.

    key, stream : fix the random numbers, Philox words by place
    """
    rows = max(1, _BLOCK_NUMBERS // max(len(first), len(second)))
    found = []
    for start in range(0, resamples, rows):
        cells = np.arange(start, min(start + rows, resamples))
        places = resampled_places(key, cells, len(first), 2 * stream)
        others = places if paired else resampled_places(key, cells, len(second), 2 * stream + 1)
        found.append(statistic(second[others]) - statistic(first[places]))
    return np.concatenate(found)


def resampled_places(key: int, cells: NDArray[np.int64], count: int, stream: int) -> NDArray[np.int64]:
    """Return places (cells, count) below `count`, drawn with replacement; a cell always draws the same."""
    return (uniforms(philox_words(key, cells, count, stream)) * count).astype(np.int64)


def percentile_interval(difference: float, resampled: Array) -> Interval:
    """Return the interval between the percentiles of resampled differences (k,)."""
    low, high = np.quantile(resampled, (_TAIL, 1 - _TAIL))
    tail = min(np.sum(resampled <= 0), np.sum(resampled >= 0))
    p = min(1.0, 2 * (1 + float(tail)) / (1 + len(resampled)))
    return Interval(difference, float(low), float(high), p if tail else _beyond(difference, resampled, p))


def accelerated_interval(difference: float, resampled: Array, influence: Array) -> Interval:
    """Return the bias-corrected and accelerated interval of resampled differences (k,), and p by its inversion.

    influence : of each observation on the difference, up to a common factor

    Source: B. Efron, R. Tibshirani, An introduction to the bootstrap (1993), chapter 14.
    """
    from scipy.special import ndtr, ndtri

    def share_below(value: float) -> float:
        share = (np.sum(resampled < value) + np.sum(resampled <= value)) / (2 * len(resampled))
        return float(np.clip(share, 1 / (len(resampled) + 1), len(resampled) / (len(resampled) + 1)))

    spread = float(np.sum(influence**2))
    if spread == 0:
        return percentile_interval(difference, resampled)
    acceleration = float(np.sum(influence**3)) / (6 * spread**1.5)
    bias = float(ndtri(share_below(difference)))
    ends = bias + ndtri(np.array([_TAIL, 1 - _TAIL]))
    low, high = np.quantile(resampled, ndtr(bias + ends / (1 - acceleration * ends)))
    shift = float(ndtri(share_below(0.0))) - bias
    tail = float(ndtr(shift / (1 + acceleration * shift) - bias))
    p = min(1.0, 2 * min(tail, 1 - tail))
    outside = np.all(resampled > 0) or np.all(resampled < 0)
    return Interval(difference, float(low), float(high), _beyond(difference, resampled, p) if outside else p)


def _beyond(difference: float, resampled: Array, most: float) -> float:
    """Return p where no resample reached zero: the normal tail, for resamples cannot count below one in them."""
    return min(most, normal_interval(difference, float(np.std(resampled, ddof=1))).p)


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p values adjusted for being several, by Holm's method, in the order given."""
    adjusted = [0.0] * len(p_values)
    reached = 0.0
    for place, k in enumerate(sorted(range(len(p_values)), key=lambda k: p_values[k])):
        reached = max(reached, min(1.0, (len(p_values) - place) * p_values[k]))
        adjusted[k] = reached
    return adjusted
