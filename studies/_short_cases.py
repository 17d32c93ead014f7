"""Cases of ten milliseconds that say how long they took. Measured by `campaign-overhead-timing`."""

import dataclasses
import time

import numpy as np

from optsat.campaign.study import Case, Row
from optsat.studies import _trivial_cases

CASE_S = 0.01


def run(case: Case, rng: np.random.Generator) -> Row:
    """Wait, and return the time that went by."""
    start = time.perf_counter()
    time.sleep(CASE_S)
    return {"draw": rng.random(), "taken_s": time.perf_counter() - start}


study = dataclasses.replace(_trivial_cases.study, name="short-cases", title="Cases of ten milliseconds", run=run)
