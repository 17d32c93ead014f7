"""Claim: one sentence with a figure, the figure measured here, and the verdict."""

import enum
import math
from dataclasses import dataclass
from typing import Literal


class Verdict(enum.Enum):
    """What a study found about a claim.

    The first three judge a figure that a paper printed, the last two a bar that we set ourselves. Only FAILS
    makes a study end with exit code 1: a paper's figure that cannot be reproduced is an honest finding.
    """

    REPRODUCED = "REPRODUCED"
    NOT_REPRODUCED = "NOT_REPRODUCED"
    BEATEN = "BEATEN"
    HOLDS = "HOLDS"
    FAILS = "FAILS"


Figure = float | str


@dataclass(frozen=True)
class Claim:
    """A claim and what became of it.

    id : short name, unique within the study
    says : the claim as a sentence, with the unit of its figure
    paper : the printed figure, or None where the bar is our own
    measured : the figure of this run; a word where the claim is not a number
    interval : what the figure may be with other cases, at 95 % confidence, where the study says so
    """

    id: str
    says: str
    paper: Figure | None
    measured: Figure
    verdict: Verdict
    interval: tuple[float, float] | None = None


def judge_paper(
    id: str,
    says: str,
    *,
    paper: float,
    measured: float,
    tolerance: float,
    better: Literal["lower", "higher"] | None = None,
    interval: tuple[float, float] | None = None,
) -> Claim:
    """Return the claim about a printed figure, judged by an absolute tolerance in the figure's own unit.

    REPRODUCED within `tolerance` of the paper; BEATEN further away on the `better` side; else NOT_REPRODUCED.
    A figure that is not finite is never reproduced.

    interval : what the figure may be with other cases; all of it must be within the tolerance, or all of it on the
        better side of the paper's figure, and where it is too wide to tell the claim says so
    """
    low, high = interval if interval is not None else (measured, measured)
    gain = {"lower": paper - measured, "higher": measured - paper, None: -math.inf}[better]
    excludes = {"lower": high < paper, "higher": low > paper, None: False}[better]
    if max(abs(measured - paper), abs(low - paper), abs(high - paper)) <= tolerance:
        verdict = Verdict.REPRODUCED
    elif gain > tolerance and excludes and math.isfinite(measured):
        verdict = Verdict.BEATEN
    else:
        verdict = Verdict.NOT_REPRODUCED
        if low <= paper + tolerance and high >= paper - tolerance:
            says = f"{says}; its interval is too wide to tell, take more cases"
    return Claim(id, says, paper, measured, verdict, interval)


def judge_bar(id: str, says: str, *, measured: Figure, holds: bool) -> Claim:
    """Return the claim about a bar of our own: HOLDS or FAILS."""
    return Claim(id, says, None, measured, Verdict.HOLDS if holds else Verdict.FAILS)
