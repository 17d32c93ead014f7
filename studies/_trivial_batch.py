"""The same trivial cases as a batch. Measured by `campaign-overhead-timing`."""

import dataclasses

import numpy as np

from optsat.campaign.draws import Draws
from optsat.campaign.study import Case, Columns, Row
from optsat.studies import _trivial_cases


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return one draw, shifted and scaled."""
    return _trivial_cases.run(case, rng)


def run_batch(cases: Columns, draws: Draws) -> Columns:
    """Return the same of many cases."""
    draw = draws.uniforms(1)[:, 0]
    return {"draw": draw, "shifted": draw + cases["offset"], "scaled": 2.0 * draw}


study = dataclasses.replace(
    _trivial_cases.study, name="trivial-batch", title="Trivial cases as a batch", run=run, run_batch=run_batch
)
