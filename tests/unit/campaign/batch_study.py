"""A study whose chunks are computed at once; workers import it by this file's name."""

from collections.abc import Mapping, Sequence

import numpy as np

from optsat.campaign.claim import Claim
from optsat.campaign.designs import Columns, RandomDesign
from optsat.campaign.distributions import LogUniform, Uniform
from optsat.campaign.draws import Draws
from optsat.campaign.study import Case, Row, Study
from optsat.errors import InputError

UNLUCKY = 0.9


def _run(case: Case, rng: np.random.Generator) -> Row:
    row = _run_batch({name: np.array([value]) for name, value in case.items()}, Draws.of_case(rng))
    return {name: column[0] for name, column in row.items()}


def _run_batch(cases: Columns, draws: Draws) -> Columns:
    share = draws.uniforms(1)[:, 0]
    if np.any(share > UNLUCKY):
        raise InputError("a share is unlucky")
    noise = draws.normals(2, 3)
    return {
        "share": share,
        "scaled": cases["rate"] * share,
        "noise": noise,
        "is_fast": cases["rate"] > 0.5,
        "steps": (10 * share).astype(np.int32),
        "word": np.where(share < 0.5, "low", "high"),
    }


def _metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    return {"mean": float(np.mean([row["share"] for row in rows]))}


def _claims(_metrics: Mapping[str, float]) -> Sequence[Claim]:
    return []


study = Study(
    name="batch-study",
    title="A batch",
    cases=RandomDesign({"rate": Uniform(0.0, 1.0), "bound": LogUniform(1e-3, 1.0)}),
    run=_run,
    run_batch=_run_batch,
    metrics=_metrics,
    claims=_claims,
    default_cases=60,
)
