"""A study small enough to know its answers; workers import it by this file's name."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from optsat.campaign.claim import Claim, judge_bar, judge_paper
from optsat.campaign.study import Case, Row, Study
from optsat.errors import InputError

UNLUCKY = 3


def _cases(count: int) -> Sequence[Case]:
    return [{"offset": float(number)} for number in range(count)]


def _run(case: Case, rng: np.random.Generator) -> Row:
    if case["offset"] == UNLUCKY:
        raise InputError("the offset is unlucky")
    draw = rng.random()
    return {"draw": draw, "shifted": np.float64(case["offset"] + draw), "even": case["offset"] % 2 == 0}


def _metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    return {"mean_draw": float(np.mean([row["draw"] for row in rows])), "worst": float("nan")}


def _claims(metrics: Mapping[str, float]) -> Sequence[Claim]:
    return [
        judge_paper("mean", "The mean draw is one half [-].", paper=0.5, measured=metrics["mean_draw"], tolerance=0.5),
        judge_bar("range", "Draws lie below one [-].", measured=metrics["mean_draw"], holds=metrics["mean_draw"] < 1.0),
    ]


def _figure(rows: Sequence[Row], path: Path) -> None:
    path.write_text(f"<svg><!-- {len(rows)} rows --></svg>")


study = Study(
    name="toy-study",
    title="A toy",
    cases=_cases,
    run=_run,
    metrics=_metrics,
    claims=_claims,
    default_cases=3,
    figure=_figure,
)
