"""Min-max, the twin of `minmax.c`, `minmax_iterate.c` and `minmax_fallback.c`."""

from collections.abc import Mapping

import numpy as np

from optsat.arrays import Array
from optsat.kernels.evaluate import evaluator
from optsat.kernels.program import Program
from optsat.kernels.source import Twin
from optsat.kernels.status import Status
from optsat.kernels.twins.minmax_search import measure, measure_gaps, remember, search
from optsat.kernels.twins.minmax_step import (
    add_row,
    direction,
    factorise,
    freeze,
    length_of,
    prepare,
    solve,
    take_residuals,
)
from optsat.kernels.twins.minmax_work import (
    ADAPTIVE_STEPS,
    EPSILON,
    FALLBACK_STEPS,
    LARGEST,
    STEPS,
    TOLERANCE,
    MinmaxPoint,
    MinmaxStep,
    MinmaxWork,
    Sizes,
    fmax,
    fmin,
    largest_of,
    ordered_sum,
)


def twin(sizes: Sizes, leaves: Mapping[str, Program], unbounded: float) -> Twin:
    """Return the min-max kernel of these leaves in plain Python."""
    rows_leaf, derivatives_leaf, widths_leaf = (evaluator(leaves[slot]) for slot in ("rows", "derivatives", "widths"))

    def run(x: Array) -> tuple[int, Array]:
        with np.errstate(all="ignore"):
            work = MinmaxWork(sizes, rows_leaf, derivatives_leaf, x, unbounded)
            work.width = widths_leaf(work.parameters)
            status = _checked(work, x)
            residual = LARGEST
            if status is Status.OK:
                residual = _solved(work)
                status = Status.OK if residual <= TOLERANCE else Status.NOT_CONVERGED
            return status, _results(work, status, residual)

    return run


def _checked(work: MinmaxWork, x: Array) -> Status:
    if not np.isfinite(x).all():
        return Status.NOT_FINITE
    if not ((work.lower <= work.upper).all() and (work.width > 0.0).any()):
        return Status.RANGE
    return Status.OK if _start(work) else Status.NOT_FINITE


def _solved(work: MinmaxWork) -> float:
    _iterate(work)
    residual = _verify(work)
    if not residual <= TOLERANCE:
        _fall_back(work)
        work.now.x = work.best_x.copy()
        _start(work)
        _iterate(work)
        residual = _verify(work)
    if not residual <= TOLERANCE:
        work.now.x = work.best_x.copy()
        measure_gaps(work, work.now)
        take_residuals(work)
        residual = _verify(work)
    return residual


def _results(work: MinmaxWork, status: Status, residual: float) -> Array:
    n, rows = work.sizes.unknowns, work.sizes.rows
    y = np.full(2 * n + rows + 3, np.nan)
    y[-1] = work.iterations
    if status in (Status.OK, Status.NOT_CONVERGED):
        pull = work.multiplier[rows : rows + n] - work.multiplier[rows + n :]
        multipliers = np.concatenate([work.multiplier[:rows], np.where(work.fixed, work.gradient, pull)])
        finite = np.isfinite(work.multiplier).all() and np.isfinite(work.gradient).all()
        y[:-1] = [*work.now.x, work.now.gamma, *(multipliers if finite else np.zeros(n + rows)), residual]
    return y


def _start(work: MinmaxWork) -> bool:
    n, rows, now = work.sizes.unknowns, work.sizes.rows, work.now
    share = 0.01 * (work.upper - work.lower)
    inner_low = work.lower + fmin(0.01 * fmax(np.abs(work.lower), 1.0), share)
    inner_high = work.upper - fmin(0.01 * fmax(np.abs(work.upper), 1.0), share)
    now.x = np.where(work.present[rows : rows + n], fmax(now.x, inner_low), now.x)
    now.x = np.where(work.present[rows + n :], fmin(now.x, inner_high), now.x)
    now.x = np.where(work.fixed, work.lower, now.x)
    if not (measure_gaps(work, now) and work.evaluate(now)):
        return False
    remember(work, now)
    attained = now.row[~work.hard] / work.width[~work.hard]
    most, least = largest_of(attained, -LARGEST), -largest_of(-attained, -LARGEST)
    now.gamma = most + 0.1 * (1.0 + (most - least))
    fitting = work.fitting(now)
    now.slack[:rows] = np.where(work.hard, fmax(fitting, 0.1), fitting)
    total = ordered_sum(work.width / now.slack[:rows])
    work.multiplier = np.where(work.present, (1.0 / total) / now.slack, 0.0)
    measure(work, now)
    work.damping, work.penalty = 0.0, 1.0
    return True


def _verify(work: MinmaxWork) -> float:
    now, rows = work.now, work.sizes.rows
    now.row = work.value
    now.gamma = largest_of(now.row[~work.hard] / work.width[~work.hard], -LARGEST)
    residual = largest_of(now.row[work.hard], work.dual_error)
    gap = ordered_sum(np.abs(work.multiplier[:rows] * work.fitting(now)))
    gap = ordered_sum(work.product[rows:], gap)
    residual = float(fmax(gap / (1.0 + abs(now.gamma)), residual))
    known = np.isfinite(work.value).all() and np.isfinite(work.row).all() and residual <= LARGEST
    return residual if known else LARGEST


def _iterate(work: MinmaxWork) -> None:
    failures, barrier = 0, 0.0
    for k in range(STEPS + 1):
        take_residuals(work)
        if k == STEPS or work.error <= TOLERANCE * 0.25 or not (prepare(work) and work.penalty < 1.0 / EPSILON):
            return
        mu = work.gap / work.count
        least = ((0.0125 * TOLERANCE) * (1.0 + abs(work.now.gamma))) / work.count
        found = False
        if k < ADAPTIVE_STEPS:
            step, target = _predict(work, mu, least)
            found = search(work, step, target)
        else:
            target = barrier = _lower_barrier(work, mu if k == ADAPTIVE_STEPS else barrier, least)
        if not found:
            step = direction(work, work.row_residual, work.product - target)
            found = search(work, step, target)
        work.iterations += 1.0
        if not found:
            failures += 1
            if failures > 3 or not work.error > TOLERANCE:
                return
            _recentre(work, mu)


def _predict(work: MinmaxWork, mu: float, least: float) -> tuple[MinmaxStep, float]:
    step = direction(work, work.row_residual, work.product)
    primal = length_of(work.now.slack, step.slack, 1.0)
    dual = length_of(work.multiplier, step.multiplier, 1.0)
    slack, multiplier = work.now.slack + primal * step.slack, work.multiplier + dual * step.multiplier
    left = ordered_sum(slack * multiplier)
    ratio = float(fmin(fmax(left / work.gap, 0.0), 1.0))
    residual = float(fmax(work.dual_error, work.row_error))
    balance = fmin(fmin(1e-4, 1e-2 * residual) * residual, 10.0 * mu)
    target = float(fmax((ratio * ratio) * ratio * mu, fmax(least, balance)))
    change = (work.product - target) + step.slack * step.multiplier
    return direction(work, work.row_residual, change), target


def _lower_barrier(work: MinmaxWork, barrier: float, least: float) -> float:
    error = float(fmax(work.dual_error, work.row_error))
    error = largest_of(np.abs(work.product - barrier)[work.present], error)
    for _ in range(4):
        if not (error <= 10.0 * barrier and barrier > least):
            break
        barrier = float(fmax(fmin(0.2 * barrier, barrier * np.sqrt(barrier)), least))
    return barrier


def _recentre(work: MinmaxWork, mu: float) -> None:
    rows, now = work.sizes.rows, work.now
    barrier = float(fmax(mu, 1e-6)) * 10.0
    now.slack[:rows] = fmax(now.slack[:rows], work.fitting(now))
    total = ordered_sum(work.width * (barrier / now.slack[:rows]))
    work.multiplier = np.where(work.present, (barrier / now.slack) / total, 0.0)
    measure(work, now)
    work.damping = float(fmax(1e-4, work.damping)) * 100.0
    work.penalty = 1.0


def _fall_back(work: MinmaxWork) -> None:
    smoothing = float(fmax(1e-3, 0.1 * (1.0 + abs(work.best_gamma))))
    damping = 1.0
    work.now.x = work.best_x.copy()
    work.multiplier = np.zeros(work.sizes.pairs)
    work.now.gamma = work.best_gamma
    work.evaluate(work.now)
    for k in range(1, FALLBACK_STEPS + 1):
        gradient = _linearise(work, smoothing)
        for _ in range(12):
            improved = _descend(work, gradient, smoothing, damping)
            damping = float(fmax(damping * 0.25, 1e-10)) if improved else damping * 8.0
            if improved:
                work.now = work.trial
                remember(work, work.now)
                break
        if k % 8 == 0:
            smoothing *= 0.1
        work.iterations += 1.0


def _smoothed(work: MinmaxWork, point: MinmaxPoint, smoothing: float) -> float:
    excess = fmax(point.row - work.width * point.gamma, 0.0)
    return point.gamma + ordered_sum(excess * excess) / (2.0 * smoothing)


def _linearise(work: MinmaxWork, smoothing: float) -> Array:
    n, now = work.sizes.unknowns, work.now
    take_residuals(work)
    work.matrix = np.zeros((n + 1, n + 1))
    gradient = np.append(np.zeros(n), 1.0)
    excess = work.value - work.width * now.gamma
    for i in np.flatnonzero(excess > 0.0):
        force = excess[i] / smoothing
        gradient += force * work.row[i]
        add_row(work, int(i), 1.0 / smoothing)
    low = (now.x <= work.lower) & (gradient[:n] > 0.0)
    high = (now.x >= work.upper) & (gradient[:n] < 0.0)
    for j in np.flatnonzero(low | high | work.fixed):
        freeze(work, int(j))
        gradient[j] = 0.0
    return gradient


def _descend(work: MinmaxWork, gradient: Array, smoothing: float, damping: float) -> bool:
    n, now = work.sizes.unknowns, work.now
    if not factorise(work, damping):
        return False
    v = solve(work, -gradient)
    x = fmin(fmax(now.x + v[:n], work.lower), work.upper)
    work.trial = MinmaxPoint(x, now.gamma + v[n], now.row, now.slack.copy())
    return work.evaluate(work.trial) and _smoothed(work, work.trial, smoothing) < _smoothed(work, now, smoothing)
