"""Cases that cost nothing, one by one: what is left is the engine. Measured by `campaign-overhead-timing`."""

from collections.abc import Mapping, Sequence

import numpy as np

from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.designs import RandomDesign
from optsat.campaign.distributions import Uniform
from optsat.campaign.study import Case, Row, Study


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return one draw, shifted and scaled."""
    draw = rng.random()
    return {"draw": draw, "shifted": draw + case["offset"], "scaled": 2.0 * draw}


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the mean in one pass, so that no row is kept."""
    return {"mean": sum(row["draw"] for row in rows) / len(rows)}


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return that the mean is near one half."""
    mean = figures["mean"]
    return [judge_bar("mean", "mean of the draws is near 1/2", measured=mean, holds=abs(mean - 0.5) < 0.05)]


study = Study(
    name="trivial-cases",
    title="Trivial cases one by one",
    cases=RandomDesign({"offset": Uniform(0.0, 1.0)}),
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=100_000,
)
