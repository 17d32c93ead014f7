"""LDL: the twin of `ldl_solve.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.sizes import padded
from optsat.kernels.source import Twin
from optsat.kernels.status import Status
from optsat.kernels.twins.lane_sums import dot, largest, symmetric

_EPSILON = float(np.finfo(float).eps)


def twin(n: int) -> Twin:
    """Return x of A x = b, the relative residual, and the number of negative pivots."""

    def run(x: Array) -> tuple[int, Array]:
        matrix, given = np.zeros((n, padded(n))), np.zeros(padded(n))
        matrix[:, :n] = symmetric(x[: n * n].reshape(n, n).T)
        given[:n] = x[n * n :]
        y = np.full(n + 2, np.nan)
        status = Status.RANGE
        with np.errstate(all="ignore"):
            factors = _factorise(matrix)
            if factors is not None:
                factor, pivot = factors
                solution = np.zeros(padded(n))
                for _ in range(2):
                    solution[:n] += _solve(factor, pivot, _rest(matrix, given, solution))
                y[n] = _relative_rest(matrix, given, solution)
                y[n + 1] = np.sum(pivot < 0.0)
                status = Status.OK if y[n] <= 4 * n * _EPSILON else Status.NOT_CONVERGED
                if not np.isfinite(solution).all():
                    status = Status.OUTPUT
                y[:n] = solution[:n]
        if status is not Status.OK and not np.isfinite(x).all():
            status = Status.NOT_FINITE
        if status not in (Status.OK, Status.NOT_CONVERGED):
            y[:n] = np.nan
        return status, y

    return run


def _factorise(matrix: Array) -> tuple[Array, Array] | None:
    n = len(matrix)
    factor, pivot = np.zeros_like(matrix), np.zeros(n)
    for j in range(n):
        row = matrix[j].copy()
        for k in range(j):
            row -= factor[k] * (factor[k, j] * pivot[k])
        pivot[j] = row[j]
        if not (abs(row[j]) > (n * _EPSILON) * largest(row[j:]) and np.isfinite(row[j])):
            return None
        factor[j] = row * (1.0 / row[j])
        factor[j, :j], factor[j, j] = 0.0, 1.0
    return factor, pivot


def _rest(matrix: Array, given: Array, solution: Array) -> Array:
    rest = given.copy()
    for row, known in zip(matrix, solution, strict=False):
        rest -= row * known
    return rest


def _solve(factor: Array, pivot: Array, rest: Array) -> Array:
    n, width = factor.shape
    correction = np.zeros(width)
    for k in range(n):
        rest[k + 1 :] -= factor[k, k + 1 :] * rest[k]
    for k in reversed(range(n)):
        correction[k] = rest[k] * (1.0 / pivot[k]) - dot(factor[k], correction)
    return np.asarray(correction[:n])


def _relative_rest(matrix: Array, given: Array, solution: Array) -> float:
    widest = 0.0
    for row in matrix:
        total = 0.0
        for entry in row[: len(matrix)]:
            total += abs(entry)
        # a NaN loses, as in `os_fmax`
        widest = widest if np.isnan(total) or widest >= total else total
    rest = largest(_rest(matrix, given, solution))
    scale = widest * largest(solution) + largest(given)
    return float(rest / (scale if scale > 0.0 else 1.0))
