"""StudyResult: rows, metrics and claims of one run, and the plain dictionary that is printed and stored."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.campaign.claim import Claim, Verdict
from optsat.campaign.study import Row


@dataclass(frozen=True)
class Failure:
    """A case that raised: its number, the class of the error and the message."""

    case: int
    error: str
    message: str


@dataclass(frozen=True)
class StudyResult:
    """What `run_study` returns.

    rows : one per case that succeeded, in case order, with the case's number under "case"; of a large run in a folder
        read from there as they are asked for
    failures : one per case that raised; rows and failures together hold every case once
    metrics, claims : empty when no case succeeded
    """

    study: str
    version: int
    seed: int
    cases: int
    rows: Sequence[Row]
    metrics: Mapping[str, float]
    claims: tuple[Claim, ...]
    failures: tuple[Failure, ...]

    @property
    def passed(self) -> bool:
        """Whether every case ran and no bar of our own fails."""
        return not self.failures and all(claim.verdict is not Verdict.FAILS for claim in self.claims)

    def summary(self) -> dict[str, Any]:
        """Return what `optsat study run --json` prints; NaN and infinity, which JSON lacks, become None."""
        claims = [
            {
                "id": claim.id,
                "says": claim.says,
                "paper": _json_figure(claim.paper),
                "measured": _json_figure(claim.measured),
                "verdict": claim.verdict.value,
                "interval": None if claim.interval is None else [_json_figure(end) for end in claim.interval],
            }
            for claim in self.claims
        ]
        return {
            "study": self.study,
            "version": self.version,
            "seed": self.seed,
            "cases": self.cases,
            "metrics": {name: _json_figure(value) for name, value in self.metrics.items()},
            "claims": claims,
            "failures": len(self.failures),
        }


def _json_figure(value: Any) -> Any:
    plain = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(plain, float) and not math.isfinite(plain) else plain
