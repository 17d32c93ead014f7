"""Definitions of kernels that another process can import, for the tests of travel and of warm starts."""

import os

from kernel_examples import turning

from optsat.kernels.linear import cholesky_solve
from optsat.kernels.source import KernelSource
from optsat.symbolic.generated_function import GeneratedFunction


def turned(gain: float = 1.0) -> GeneratedFunction:
    return turning(gain)


def solved(n: int = 3) -> KernelSource:
    return cholesky_solve(n)


def differs_by_process() -> GeneratedFunction:
    """Defined otherwise where the environment says so."""
    return turning(float(os.environ.get("GAIN_OF_THE_TEST", "1")))


def number() -> float:
    return 1.0
