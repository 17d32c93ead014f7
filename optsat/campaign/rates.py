"""Rates: shares of cases, their intervals at 95 % confidence, and whether two of them differ."""

import math

import numpy as np

from optsat.campaign.intervals import CONFIDENCE, Interval

_TIE = 1 + 1e-7


def wilson(count: int, cases: int) -> tuple[float, float]:
    """Return the interval of a rate that was `count` of `cases`.

    Source: E. Wilson, Probable inference, the law of succession, and statistical inference (1927).
    """
    from scipy.special import ndtri

    z2 = float(ndtri((1 + CONFIDENCE) / 2)) ** 2
    rate = count / cases
    centre, reach = rate + z2 / (2 * cases), math.sqrt(z2 * (rate * (1 - rate) / cases + z2 / (4 * cases**2)))
    scale = 1 + z2 / cases
    return max(0.0, (centre - reach) / scale), min(1.0, (centre + reach) / scale)


def largest_rate_of_none(cases: int) -> float:
    """Return the rate that is exceeded with 5 % confidence only, after none in `cases`: about 3 / cases."""
    return float(1 - (1 - CONFIDENCE) ** (1 / cases))


def unpaired_rates(first: int, first_cases: int, second: int, second_cases: int) -> Interval:
    """Return the difference of two rates by Newcombe's hybrid of Wilson's intervals, with Fisher's exact p.

    Source: R. Newcombe, Interval estimation for the difference between independent proportions (1998), method 10.
    """
    return _hybrid(
        (first / first_cases, *wilson(first, first_cases)),
        (second / second_cases, *wilson(second, second_cases)),
        0.0,
        fisher_exact(first, first_cases, second, second_cases),
    )


def paired_rates(both: int, only_first: int, only_second: int, neither: int) -> Interval:
    """Return the difference of two rates over the same cases by Newcombe's method for pairs, with McNemar's exact p.

    Source: R. Newcombe, Improved confidence intervals for the difference between binomial proportions based on paired
    data (1998), method 10.
    """
    cases = both + only_first + only_second + neither
    first, second = both + only_first, both + only_second
    margins = first * (cases - first) * second * (cases - second)
    product = float(both * neither - only_first * only_second)
    if product > 0:
        product = max(product - cases / 2, 0.0)
    correlation = product / math.sqrt(margins) if margins else 0.0
    return _hybrid(
        (first / cases, *wilson(first, cases)),
        (second / cases, *wilson(second, cases)),
        correlation,
        mcnemar_exact(only_first, only_second),
    )


def _hybrid(
    first: tuple[float, float, float], second: tuple[float, float, float], correlation: float, p: float
) -> Interval:
    a, a_low, a_high = first
    b, b_low, b_high = second

    def reach(of_b: float, of_a: float) -> float:
        return math.sqrt(max(0.0, of_b**2 - 2 * correlation * of_b * of_a + of_a**2))

    return Interval(b - a, b - a - reach(b - b_low, a_high - a), b - a + reach(b_high - b, a - a_low), p)


def mcnemar_exact(only_first: int, only_second: int) -> float:
    """Return the two-sided p value of as many cases changing one way as the other."""
    from scipy.special import bdtr

    changed = only_first + only_second
    return min(1.0, 2 * float(bdtr(min(only_first, only_second), changed, 0.5))) if changed else 1.0


def fisher_exact(first: int, first_cases: int, second: int, second_cases: int) -> float:
    """Return the two-sided p value of equal rates: the tables with these margins that are no likelier than this."""
    from scipy.special import gammaln

    total, cases = first + second, first_cases + second_cases
    k = np.arange(max(0, total - second_cases), min(total, first_cases) + 1)

    def choose(n: int, of: np.ndarray) -> np.ndarray:
        return np.asarray(gammaln(n + 1) - gammaln(of + 1) - gammaln(n - of + 1))

    chance = np.exp(choose(first_cases, k) + choose(second_cases, total - k) - choose(cases, np.array(total)))
    return min(1.0, float(np.sum(chance[chance <= chance[first - k[0]] * _TIE])))
