"""A study on a compiled kernel; workers import it by this file's name and must find the kernel compiled."""

import functools
from collections.abc import Mapping, Sequence

import numpy as np

from optsat.campaign.claim import Claim
from optsat.campaign.study import Case, Row, Study
from optsat.export.catalogue import build
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import make_kernel


@functools.cache
def kernel() -> Kernel:
    """Return the compiled kernel."""
    return make_kernel(build("quaternion_compose"))


def _run(case: Case, rng: np.random.Generator) -> Row:
    q = rng.standard_normal((2, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return {"q": np.asarray(kernel()(q[0].copy(), q[1].copy())).ravel(), "form": kernel().form}


def _metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    return {"first": float(rows[0]["q"][0])}


def _claims(_metrics: Mapping[str, float]) -> Sequence[Claim]:
    return []


study = Study("kernel-study", "A kernel", lambda count: [{}] * count, _run, _metrics, _claims, default_cases=20)
