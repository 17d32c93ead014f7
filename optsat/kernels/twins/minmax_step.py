"""Min-max, the twin of `minmax_factor.c` and `minmax_step.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.twins.minmax_work import EPSILON, LARGEST, MinmaxStep, MinmaxWork, fmax, largest_of, ordered_sum


def take_residuals(work: MinmaxWork) -> None:
    """Take values, gradients and curvature at the present point, and by how much the conditions are missed there."""
    n, rows, now = work.sizes.unknowns, work.sizes.rows, work.now
    derivative = work.derivatives_leaf(np.concatenate([now.x, work.parameters, work.multiplier[:rows]]))
    work.value = derivative[:rows]
    matrices = derivative[rows:].reshape(-1, work.sizes.padded)[:, : n + 1]
    work.row, work.hessian = matrices[:rows], matrices[rows:]
    gradient, scale = np.zeros(n + 1), np.ones(n + 1)
    for i in range(rows):
        term = work.multiplier[i] * work.row[i]
        gradient = gradient + term
        scale = scale + np.abs(term)
    gradient[n] += 1.0
    work.gradient = gradient[:n]
    pull = work.multiplier[rows : rows + n] - work.multiplier[rows + n :]
    work.dual_residual = np.append(np.where(work.fixed, 0.0, work.gradient - pull), gradient[n])
    work.dual_error = largest_of(np.abs(work.dual_residual) / np.append(scale[:n], 1.0), 0.0)
    work.row_residual = (work.value - work.width * now.gamma) + now.slack[:rows]
    sizes = 1.0 + np.abs(work.value)
    work.row_error = largest_of(np.abs(work.row_residual) / sizes, 0.0)
    work.product = now.slack * work.multiplier
    work.gap = ordered_sum(work.product)
    if not ordered_sum(np.concatenate([scale, sizes])) + work.gap <= LARGEST:
        work.dual_error = LARGEST
    work.error = float(fmax(work.gap / (1.0 + abs(now.gamma)), fmax(work.row_error, work.dual_error)))


def prepare(work: MinmaxWork) -> bool:
    """Form the matrix of the step in x and gamma, damped until its inertia is right."""
    n, rows = work.sizes.unknowns, work.sizes.rows
    work.matrix = work.hessian.copy()
    work.inverse = 1.0 / work.now.slack
    ratio = work.multiplier * work.inverse
    for i in range(rows):
        add_row(work, i, ratio[i])
    for j in range(n):
        work.matrix[j, j] += ratio[rows + j]
        work.matrix[j, j] += ratio[rows + n + j]
        if work.fixed[j]:
            freeze(work, j)
    growth = 8.0 if work.damping > 0.0 else 100.0
    damping = 0.0
    positive = factorise(work, damping)
    for _ in range(20):
        if positive:
            break
        damping = damping * growth if damping > 0.0 else max(1e-4, work.damping / 3.0)
        positive = factorise(work, damping)
    if positive and damping > 0.0:
        work.damping = damping
    return positive


def add_row(work: MinmaxWork, i: int, d: float) -> None:
    """Add d a a' over the row a = (gradient of row i, -width) to the matrix."""
    work.matrix += np.outer(d * work.row[i], work.row[i])


def freeze(work: MinmaxWork, j: int) -> None:
    """Take a variable out of the step."""
    work.matrix[j] = work.matrix[:, j] = 0.0
    work.matrix[j, j] = 1.0


def factorise(work: MinmaxWork, damping: float) -> bool:
    """Factor matrix + damping I; False where a pivot is not safely positive."""
    size = len(work.matrix)
    factor, reciprocal = work.matrix + damping * np.eye(size), np.zeros(size)
    diagonal = np.diag(factor).copy()
    for k in range(size):
        pivot = factor[k, k]
        if not pivot > (16.0 * EPSILON) * abs(diagonal[k]):
            return False
        reciprocal[k] = 1.0 / pivot
        rest = factor[k + 1 :, k].copy()
        factor[k + 1 :, k] = rest * reciprocal[k]
        factor[k + 1 :, k + 1 :] -= np.outer(rest, factor[k + 1 :, k])
    work.factor, work.reciprocal = np.tril(factor, -1), reciprocal
    return True


def solve(work: MinmaxWork, b: Array) -> Array:
    """Return the solution; all entries take part in each step, those above the diagonal with a factor of zero."""
    x = b.copy()
    for k in range(len(x)):
        x -= work.factor[:, k] * x[k]
    x *= work.reciprocal
    for k in reversed(range(len(x))):
        x -= work.factor[k] * x[k]
    return x


def direction(work: MinmaxWork, misfit: Array, product: Array) -> MinmaxStep:
    """Return the step that takes the misfits of the rows to zero, and the products of the pairs down by `product`."""
    n, rows = work.sizes.unknowns, work.sizes.rows
    v = -work.dual_residual
    for i in range(rows):
        v -= work.row[i] * ((work.multiplier[i] * misfit[i] - product[i]) * work.inverse[i])
    pull = np.where(work.present[rows:], product[rows:] * work.inverse[rows:], 0.0)
    v[:n] -= pull[:n]
    v[:n] += pull[n:]
    v[:n] = np.where(work.fixed, 0.0, v[:n])
    v = solve(work, v)
    change = np.zeros(rows)
    for j in range(n + 1):
        change = change + work.row[:, j] * v[j]
    slack = np.where(work.present, np.concatenate([-misfit - change, v[:n], -v[:n]]), 0.0)
    multiplier = np.where(work.present, (-product - work.multiplier * slack) * work.inverse, 0.0)
    return MinmaxStep(v, slack, multiplier)


def length_of(value: Array, step: Array, share: float) -> float:
    """Return the longest step, at most 1, that leaves each value 1 - share of itself."""
    length = 1.0
    for room, change in zip((share * value).tolist(), step.tolist(), strict=True):
        if -change * length > room:
            length = room / -change
    return length
