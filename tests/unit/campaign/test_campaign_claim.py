"""Verdicts: what is reproduced, beaten, not reproduced."""

import math
from typing import Literal

import pytest

from optsat.campaign.claim import Verdict, judge_bar, judge_paper


@pytest.mark.parametrize(
    ("measured", "better", "verdict"),
    [
        (1.0, None, Verdict.REPRODUCED),
        (1.125, "lower", Verdict.REPRODUCED),
        (0.5, "lower", Verdict.BEATEN),
        (0.5, "higher", Verdict.NOT_REPRODUCED),
        (1.5, "higher", Verdict.BEATEN),
        (0.5, None, Verdict.NOT_REPRODUCED),
        (math.nan, "lower", Verdict.NOT_REPRODUCED),
        (-math.inf, "lower", Verdict.NOT_REPRODUCED),
        (math.inf, "higher", Verdict.NOT_REPRODUCED),
    ],
)
def test_a_printed_figure(measured: float, better: Literal["lower", "higher"] | None, verdict: Verdict) -> None:
    claim = judge_paper("id", "says", paper=1.0, measured=measured, tolerance=0.125, better=better)
    assert claim.verdict is verdict
    assert claim.paper == 1.0


def test_a_bar_of_our_own_has_no_paper() -> None:
    claim = judge_bar("id", "says", measured="all", holds=True)
    assert (claim.paper, claim.verdict) == (None, Verdict.HOLDS)
    assert judge_bar("id", "says", measured=2.0, holds=False).verdict is Verdict.FAILS


@pytest.mark.parametrize(
    ("interval", "verdict", "too_few"),
    [
        ((0.9, 1.1), Verdict.REPRODUCED, False),
        ((0.5, 1.1), Verdict.NOT_REPRODUCED, True),
        ((0.3, 0.6), Verdict.BEATEN, False),
        ((0.3, 1.0), Verdict.NOT_REPRODUCED, True),
        ((1.5, 1.7), Verdict.NOT_REPRODUCED, False),
    ],
)
def test_the_whole_interval_is_judged(interval: tuple[float, float], verdict: Verdict, too_few: bool) -> None:
    measured = sum(interval) / 2
    claim = judge_paper("id", "says", paper=1.0, measured=measured, tolerance=0.125, better="lower", interval=interval)
    assert claim.verdict is verdict
    assert claim.interval == interval
    assert ("take more cases" in claim.says) is too_few
