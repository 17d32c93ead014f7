"""GMRES: the twin of `gmres.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.sizes import GROUP, padded
from optsat.kernels.source import Twin
from optsat.kernels.status import Status
from optsat.kernels.twins.lane_sums import dot, largest

_EPSILON = float(np.finfo(float).eps)


def twin(n: int, m: int, cycles: int) -> Twin:
    """Return x of A x = b, |b - A x| / |b|, and the iterations."""

    def run(x: Array) -> tuple[int, Array]:
        columns, given = np.zeros((padded(n), padded(n))), np.zeros(padded(n))
        columns[:n, :n] = x[: n * n].reshape(n, n).T
        given[:n] = x[n * n : -1]
        with np.errstate(all="ignore"):
            best, residual, iterations = _solve(columns, given, float(x[-1]), (n, m, cycles))
        status = Status.OK if residual <= x[-1] else Status.NOT_CONVERGED
        if not np.isfinite(x).all():
            status = Status.NOT_FINITE
        elif not x[-1] > 0.0:
            status = Status.RANGE
        elif not np.isfinite(best).all():
            status = Status.OUTPUT
        y = np.concatenate([best[:n], [residual, iterations]])
        if status not in (Status.OK, Status.NOT_CONVERGED):
            y[: n + 1] = np.nan
        return status, y

    return run


def _solve(columns: Array, given: Array, tolerance: float, sizes: tuple[int, int, int]) -> tuple[Array, float, int]:
    n, m, cycles = sizes
    point, best = np.zeros_like(given), np.zeros_like(given)
    length = _length(given)
    whole = length if length > 0.0 else 1.0
    residual, iterations, rest = length / whole, 0, given
    for _ in range(cycles):
        if not (residual > tolerance and length <= np.finfo(float).max):
            break
        correction, used = _cycle(columns, rest, length, tolerance * whole, n, m)
        for term in correction:
            point = point + term
        iterations += used
        rest = given - _multiply(columns, point)
        length = _length(rest)
        if not length / whole < residual:
            break
        residual, best = length / whole, point
    return best, residual, iterations


def _cycle(columns: Array, rest: Array, length: float, enough: float, n: int, m: int) -> tuple[list[Array], int]:
    basis, reduced = [rest / length], [length]
    triangle: list[list[float]] = []
    rotations: list[tuple[float, float]] = []
    for _ in range(m):
        fresh = _multiply(columns, basis[-1])
        before = np.sqrt(dot(fresh, fresh))
        column: list[float] = []
        for first in range(0, len(basis), GROUP):
            group = basis[first : first + GROUP]
            along = [dot(fresh, known) for known in group]
            column += along
            for known, each in zip(group, along, strict=True):
                fresh = fresh - known * each
            # beyond the basis there are zeros
            for _ in range(GROUP - len(group)):
                fresh = fresh - 0.0 * dot(fresh, np.zeros_like(fresh))
        below = np.sqrt(dot(fresh, fresh))
        for i, (cosine, sine) in enumerate(rotations):
            upper = cosine * column[i] + sine * column[i + 1]
            column[i + 1] = cosine * column[i + 1] - sine * column[i]
            column[i] = upper
        radius = np.sqrt(column[-1] * column[-1] + below * below)
        if not radius > (n * _EPSILON) * before:
            break
        rotations.append((column[-1] / radius, below / radius))
        column[-1] = radius
        triangle.append(column)
        reduced.append(-(rotations[-1][1] * reduced[-1]))
        reduced[-2] = rotations[-1][0] * reduced[-2]
        basis.append(fresh * (1.0 / (below if below > 0.0 else 1.0)))
        if not abs(reduced[-1]) > enough:
            break
    used = len(triangle)
    for i in reversed(range(used)):
        for k in range(i + 1, used):
            reduced[i] = reduced[i] - triangle[k][i] * reduced[k]
        reduced[i] = reduced[i] / triangle[i][i]
    return [vector * factor for vector, factor in zip(basis, reduced[:used], strict=False)], used


def _multiply(columns: Array, factor: Array) -> Array:
    product = np.zeros(columns.shape[1])
    for column, each in zip(columns, factor, strict=True):
        product = product + column * each
    return product


def _length(a: Array) -> float:
    unit = largest(a) or 1.0
    return float(unit * np.sqrt(dot(a / unit, a / unit)))
