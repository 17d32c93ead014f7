"""Intervals that hold what they promise: against tables, exact enumeration and repeated draws from known truths."""

import math

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.campaign.intervals import (
    Interval,
    accelerated_interval,
    holm,
    normal_interval,
    paired_t,
    percentile_interval,
    resampled_differences,
    resampled_places,
    welch_t,
)

_DRAWS = 400
# 95 % of 400 draws, give or take four standard deviations
_LEAST, _MOST = 0.95 - 4 * math.sqrt(0.95 * 0.05 / _DRAWS), 0.95 + 4 * math.sqrt(0.95 * 0.05 / _DRAWS)


def test_student_on_the_sleep_data() -> None:
    """The ten pairs of Student (1908): difference 1.58, interval 0.70 to 2.46, p 0.00283, in every textbook."""
    first = np.array([0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0])
    second = np.array([1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4])
    found = paired_t(first, second)
    assert found.difference == pytest.approx(1.58)
    assert (found.low, found.high) == pytest.approx((0.7001, 2.4599), abs=1e-4)
    assert found.p == pytest.approx(0.002833, abs=1e-6)
    # without the pairs: Welch, 17.776 degrees of freedom, -0.2055 to 3.3655, p 0.07939
    found = welch_t(first, second)
    assert (found.low, found.high) == pytest.approx((-0.2055, 3.3655), abs=1e-4)
    assert found.p == pytest.approx(0.07939, abs=1e-5)


def test_without_spread_there_is_no_doubt() -> None:
    same = np.ones(5)
    assert paired_t(same, same) == Interval(0.0, 0.0, 0.0, 1.0)
    assert paired_t(same, same + 1) == Interval(1.0, 1.0, 1.0, 0.0)
    assert welch_t(same, same + 1).p == 0.0
    assert normal_interval(0.0, 0.0).p == 1.0


def test_the_normal_interval_is_that_of_the_tables() -> None:
    found = normal_interval(1.0, 0.5)
    assert (found.low, found.high) == pytest.approx((1 - 0.5 * 1.959964, 1 + 0.5 * 1.959964))
    assert found.p == pytest.approx(0.0455003)


def _covered(intervals: list[Interval], truth: float) -> float:
    return float(np.mean([found.low <= truth <= found.high for found in intervals]))


@pytest.mark.parametrize("size", [5, 30])
def test_student_covers(size: int) -> None:
    generator = np.random.default_rng(1)
    found = []
    for _ in range(_DRAWS):
        first = generator.normal(size=size)
        found.append(paired_t(first, first + 0.3 + generator.normal(size=size)))
    assert _LEAST <= _covered(found, 0.3) <= _MOST
    found = [welch_t(generator.normal(size=size), 0.3 + 3 * generator.normal(size=2 * size)) for _ in range(_DRAWS)]
    assert _LEAST <= _covered(found, 0.3) <= _MOST


def _mean(samples: Array) -> Array:
    return np.asarray(np.mean(samples, axis=1, keepdims=True))


def test_the_accelerated_bootstrap_covers_skewed_means_and_its_p_value_agrees_with_it() -> None:
    generator = np.random.default_rng(2)
    found = []
    for k in range(_DRAWS):
        first = generator.exponential(size=200)
        second = first + generator.lognormal(sigma=1.0, size=200)
        drawn = resampled_differences(first, second, True, _mean, 7, k, resamples=400)[:, 0]
        difference = float(np.mean(second - first))
        found.append(accelerated_interval(difference, drawn, second - first - difference))
        shifted = accelerated_interval(difference - found[-1].low, drawn - found[-1].low, second - first - difference)
        assert shifted.p == pytest.approx(0.05, abs=0.02), "an end at zero is where p is 5 %"
    # of lognormal differences a plain percentile bootstrap covers less; 0.91 is what the method is known for
    assert 0.90 <= _covered(found, math.exp(0.5)) <= _MOST


def test_the_percentile_bootstrap_covers_medians() -> None:
    generator = np.random.default_rng(3)
    found = []
    for k in range(_DRAWS):
        first, second = generator.exponential(size=150), 0.5 + generator.exponential(size=201)
        drawn = resampled_differences(
            first, second, False, lambda s: np.median(s, axis=1, keepdims=True), 7, k, resamples=200
        )[:, 0]
        found.append(percentile_interval(float(np.median(second) - np.median(first)), drawn))
    assert 0.91 <= _covered(found, 0.5) <= 0.99


def test_p_is_uniform_where_there_is_no_difference() -> None:
    generator = np.random.default_rng(4)
    p = np.empty(_DRAWS)
    for k in range(_DRAWS):
        first, second = generator.normal(size=60), generator.normal(size=60)
        drawn = resampled_differences(first, second, True, _mean, 9, k, resamples=300)[:, 0]
        d = second - first
        p[k] = accelerated_interval(float(d.mean()), drawn, d - d.mean()).p
    for level in (0.05, 0.25, 0.5):
        assert abs(np.mean(p < level) - level) < 4 * math.sqrt(level * (1 - level) / _DRAWS) + 0.01


def test_resamples_are_drawn_by_place() -> None:
    whole = resampled_places(5, np.arange(6), 1000, 3)
    assert np.array_equal(whole[4:], resampled_places(5, np.array([4, 5]), 1000, 3))
    assert not np.array_equal(whole, resampled_places(5, np.arange(6), 1000, 4))
    assert whole.min() >= 0
    assert whole.max() < 1000
    counts = np.bincount(resampled_places(5, np.arange(2000), 10, 0).ravel(), minlength=10)
    assert np.sum((counts - 2000) ** 2 / 2000) < 30, "chi-square of 9 degrees of freedom"


def test_far_from_zero_p_is_smaller_than_resamples_can_count() -> None:
    drawn = 5 + np.random.default_rng(1).normal(size=500)
    assert 0 < percentile_interval(5.0, drawn).p < 1e-5
    assert 0 < accelerated_interval(5.0, drawn, drawn - 5).p < 1e-5


def test_holm_on_a_worked_example() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([]) == []
    assert holm([0.9, 0.8]) == [1.0, 1.0]
