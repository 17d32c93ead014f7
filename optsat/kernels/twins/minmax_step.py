"""Min-max, the twin of `minmax_factor.c` and `minmax_step.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.twins.minmax_work import EPSILON, LARGEST, MinmaxStep, MinmaxWork, fmax, largest_of, ordered_sum


def take_residuals(work: MinmaxWork) -> None:
    """Take values, gradients and curvature at the present point, and by how much the conditions are missed there."""
    n, rows, now = work.sizes.unknowns, work.sizes.rows, work.now
    derivative = work.derivatives_leaf(np.concatenate([now.x, work.parameters, work.multiplier[:rows]]))
    work.value = derivative[:rows]
    work.jacobian = derivative[rows : rows + rows * n].reshape(rows, n)
    work.hessian = derivative[rows + rows * n :]
    work.gradient, scale = np.zeros(n), np.ones(n)
    for i in range(rows):
        term = work.multiplier[i] * work.jacobian[i]
        work.gradient = work.gradient + term
        scale = scale + np.abs(term)
    free = (work.gradient - work.multiplier[rows : rows + n]) + work.multiplier[rows + n :]
    rest = ordered_sum(-(work.width * work.multiplier[:rows]), 1.0)
    work.dual_residual = np.append(np.where(work.fixed, 0.0, free), rest)
    work.dual_error = largest_of(np.abs(work.dual_residual) / np.append(scale, 1.0), 0.0)
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
    work.matrix = np.zeros((n + 1, n + 1))
    work.matrix[np.tril_indices(n)] = work.hessian
    ratio = work.multiplier / work.now.slack
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
    gradient, n = work.jacobian[i], work.sizes.unknowns
    width = d * work.width[i]
    work.matrix[:n, :n] += np.outer(d * gradient, gradient)
    work.matrix[n, :n] -= width * gradient
    work.matrix[n, n] += width * work.width[i]


def freeze(work: MinmaxWork, j: int) -> None:
    """Take a variable out of the step."""
    work.matrix[j] = work.matrix[:, j] = 0.0
    work.matrix[j, j] = 1.0


def factorise(work: MinmaxWork, damping: float) -> bool:
    """Factor matrix + damping I; False where a pivot is not safely positive."""
    size = len(work.matrix)
    factor, reciprocal = work.matrix.copy(), np.zeros(size)
    factor[np.diag_indices(size)] += damping
    diagonal = np.diag(factor).copy()
    for k in range(size):
        pivot = factor[k, k]
        if not pivot > (16.0 * EPSILON) * abs(diagonal[k]):
            return False
        reciprocal[k] = 1.0 / pivot
        rest = factor[k + 1 :, k].copy()
        factor[k + 1 :, k] = rest * reciprocal[k]
        factor[k + 1 :, k + 1 :] -= np.outer(rest, factor[k + 1 :, k])
    work.factor, work.reciprocal = factor, reciprocal
    return True


def solve(work: MinmaxWork, b: Array) -> Array:
    """Return the solution."""
    x = b.copy()
    for k in range(len(x)):
        x[k + 1 :] -= work.factor[k + 1 :, k] * x[k]
    x *= work.reciprocal
    for i in reversed(range(len(x))):
        x[:i] -= work.factor[i, :i] * x[i]
    return x


def direction(work: MinmaxWork, misfit: Array, product: Array) -> MinmaxStep:
    """Return the step that takes the misfits of the rows to zero, and the products of the pairs down by `product`."""
    n, rows, slack = work.sizes.unknowns, work.sizes.rows, work.now.slack
    v = -work.dual_residual
    for i in range(rows):
        force = (work.multiplier[i] * misfit[i] - product[i]) / slack[i]
        v[:n] -= work.jacobian[i] * force
        v[n] += work.width[i] * force
    pull = np.where(work.present[rows:], product[rows:] / slack[rows:], 0.0)
    v[:n] -= pull[:n]
    v[:n] += pull[n:]
    v[:n] = np.where(work.fixed, 0.0, v[:n])
    v = solve(work, v)
    change = np.zeros(rows)
    for j in range(n):
        change = change + work.jacobian[:, j] * v[j]
    change = np.concatenate([-misfit - (change - work.width * v[n]), v[:n], -v[:n]])
    change = np.where(work.present, change, 0.0)
    multiplier = np.where(work.present, (-product - work.multiplier * change) / slack, 0.0)
    return MinmaxStep(v, change, multiplier)


def lengths(work: MinmaxWork, step: MinmaxStep, share: float) -> tuple[float, float]:
    """Return the longest steps, at most 1, that leave each slack and each multiplier 1 - share of itself."""
    found = []
    for value, change in ((work.now.slack, step.slack), (work.multiplier, step.multiplier)):
        falling = change < 0.0
        found.append(-largest_of(share * value[falling] / change[falling], -1.0))
    return found[0], found[1]
