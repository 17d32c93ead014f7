"""A study whose cases take a moment, and one of which kills its worker when told to."""

import os
import signal
import time
from collections.abc import Mapping, Sequence

import numpy as np

from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study

DEADLY = "OPTSAT_TEST_DEADLY_CASE"


def _cases(count: int) -> Sequence[Case]:
    return [{"number": number} for number in range(count)]


def _run(case: Case, rng: np.random.Generator) -> Row:
    if os.environ.get(DEADLY) == str(case["number"]):
        os.kill(os.getpid(), signal.SIGKILL)
    end = time.monotonic() + 0.002
    while time.monotonic() < end:
        pass
    a = rng.standard_normal((6, 6))
    return {"trace": float(np.trace(a @ a)), "q_BN": rng.standard_normal(4)}


def _metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    return {"mean": float(np.mean([row["trace"] for row in rows]))}


def _claims(metrics: Mapping[str, float]) -> Sequence[Claim]:
    return [
        judge_bar("finite", "The mean is a number.", measured=metrics["mean"], holds=bool(np.isfinite(metrics["mean"])))
    ]


study = Study("slow-study", "Cases of two milliseconds", _cases, _run, _metrics, _claims, default_cases=600)
