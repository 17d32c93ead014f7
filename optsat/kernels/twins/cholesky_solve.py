"""Cholesky: the twin of `cholesky_solve.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.sizes import GROUP, padded
from optsat.kernels.source import Twin
from optsat.kernels.status import Status
from optsat.kernels.twins.lane_sums import dot

_EPSILON = float(np.finfo(float).eps)


def twin(n: int) -> Twin:
    """Return x of A x = b, and the least ratio of a pivot to its diagonal."""

    def run(x: Array) -> tuple[int, Array]:
        factor = np.zeros((padded(n), padded(n)))
        factor[:n, :n] = x[: n * n].reshape(n, n)
        y = np.full(n + 1, np.nan)
        with np.errstate(all="ignore"):
            reciprocal, y[n] = _factorise(factor, n)
            status, solution = Status.RANGE, y[:n]
            if y[n] > 0.0:
                solution = _substitute(factor[:n], reciprocal, x[n * n :])
                status = Status.OK if np.isfinite(solution).all() else Status.OUTPUT
        if status is Status.OK:
            y[:n] = solution
        elif not np.isfinite(x).all():
            status = Status.NOT_FINITE
        return status, y

    return run


def _factorise(factor: Array, n: int) -> tuple[Array, float]:
    reciprocal = np.ones(n)
    least = 1.0
    for j in range(n):
        row = factor[j].copy()
        diagonal = row[j]
        for k in range(-(-j // GROUP) * GROUP):
            row -= factor[k] * (factor[k, j] if k < j else 0.0)
        pivot = row[j]
        if not (pivot > (n * _EPSILON) * diagonal and np.isfinite(pivot)):
            return reciprocal, 0.0
        least = min(least, pivot / diagonal)
        reciprocal[j] = 1.0 / np.sqrt(pivot)
        factor[j] = row * reciprocal[j]
        factor[j, :j] = 0.0
    return reciprocal, least


def _substitute(factor: Array, reciprocal: Array, b: Array) -> Array:
    n, width = factor.shape
    rest, solution = np.zeros(width), np.zeros(width)
    rest[:n] = b
    for k in range(n):
        forward = rest[k] * reciprocal[k]
        rest -= factor[k] * forward
        rest[k] = forward
    for k in reversed(range(n)):
        solution[k] = (rest[k] - dot(factor[k], solution)) * reciprocal[k]
    return np.asarray(solution[:n])
