"""Rates: the figures of the papers, and the same by enumeration."""

import math
from fractions import Fraction

import numpy as np
import pytest

from optsat.campaign.rates import (
    fisher_exact,
    largest_rate_of_none,
    mcnemar_exact,
    paired_rates,
    unpaired_rates,
    wilson,
)


@pytest.mark.parametrize(
    ("count", "cases", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_as_printed_by_newcombe(count: int, cases: int, low: float, high: float) -> None:
    assert wilson(count, cases) == pytest.approx((low, high), abs=6e-5)
    mirrored = wilson(cases - count, cases)
    assert mirrored == pytest.approx((1 - high, 1 - low), abs=6e-5)


@pytest.mark.parametrize(("rate", "cases", "covers"), [(0.01, 100, 0.92), (0.3, 50, 0.95), (0.001, 100, 0.90)])
def test_wilson_covers(rate: float, cases: int, covers: float) -> None:
    """Exact: the probability of the counts whose interval holds the rate."""
    holds = 0.0
    for count in range(cases + 1):
        low, high = wilson(count, cases)
        if low <= rate <= high:
            holds += math.comb(cases, count) * rate**count * (1 - rate) ** (cases - count)
    assert holds == pytest.approx(covers, abs=0.012)


@pytest.mark.parametrize(
    ("first", "second", "low", "high"),
    [((48, 80), (56, 70), 0.0524, 0.3339), ((3, 10), (9, 10), 0.1705, 0.8090), ((0, 20), (10, 10), 0.6791, 1.0)],
)
def test_unpaired_difference_as_printed_by_newcombe(
    first: tuple[int, int], second: tuple[int, int], low: float, high: float
) -> None:
    found = unpaired_rates(*first, *second)
    assert (found.low, found.high) == pytest.approx((low, high), abs=6e-5)
    turned = unpaired_rates(*second, *first)
    assert (turned.low, turned.high) == pytest.approx((-found.high, -found.low))


def test_paired_difference_as_printed_by_newcombe() -> None:
    found = paired_rates(36, 2, 12, 0)
    assert found.difference == pytest.approx(0.2)
    assert (found.low, found.high) == pytest.approx((0.0569, 0.3404), abs=6e-5)


def test_paired_difference_covers() -> None:
    generator = np.random.default_rng(1)
    chances, cases, draws = [0.70, 0.05, 0.10, 0.15], 80, 2000
    tables = generator.multinomial(cases, chances, size=draws)
    inside = [found.low <= 0.05 <= found.high for found in (paired_rates(*map(int, table)) for table in tables)]
    assert 0.93 < np.mean(inside) < 0.98
    # taken as unpaired, the interval is wider than it need be
    wider = [unpaired_rates(int(t[0] + t[1]), cases, int(t[0] + t[2]), cases) for t in tables[:100]]
    narrow = [paired_rates(*map(int, t)) for t in tables[:100]]
    assert all(n.high - n.low < w.high - w.low for n, w in zip(narrow, wider, strict=True))


def test_rates_that_cannot_vary() -> None:
    assert paired_rates(10, 0, 0, 0).p == 1.0
    assert paired_rates(0, 0, 0, 10).difference == 0.0
    assert paired_rates(0, 10, 0, 0).difference == -1.0


@pytest.mark.parametrize(("one", "other"), [(0, 0), (1, 5), (3, 3), (2, 12), (0, 7)])
def test_mcnemar_is_the_sign_test(one: int, other: int) -> None:
    n, fewest = one + other, min(one, other)
    exact = min(Fraction(1), 2 * sum(Fraction(math.comb(n, k), 2**n) for k in range(fewest + 1)))
    assert mcnemar_exact(one, other) == pytest.approx(float(exact))


@pytest.mark.parametrize("table", [(1, 9, 11, 14), (3, 4, 1, 4), (0, 5, 5, 5), (10, 20, 10, 20), (7, 12, 5, 17)])
def test_fisher_by_enumeration(table: tuple[int, int, int, int]) -> None:
    a, n, b, m = table
    total = a + b
    chance = {
        k: Fraction(math.comb(n, k) * math.comb(m, total - k), math.comb(n + m, total))
        for k in range(max(0, total - m), min(total, n) + 1)
    }
    exact = sum(p for p in chance.values() if p <= chance[a])
    assert fisher_exact(a, n, b, m) == pytest.approx(float(exact))


def test_none_in_n_is_about_three_in_n() -> None:
    for cases in (100, 10_000):
        assert largest_rate_of_none(cases) == pytest.approx(3 / cases, rel=0.02)
        assert (1 - largest_rate_of_none(cases)) ** cases == pytest.approx(0.05)
