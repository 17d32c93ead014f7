"""Min-max, the twin of `minmax_merit.c` and `minmax_search.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.twins.minmax_step import direction, length_of
from optsat.kernels.twins.minmax_work import (
    EPSILON,
    LARGEST,
    SMALLEST,
    TOLERANCE,
    MinmaxPoint,
    MinmaxStep,
    MinmaxWork,
    fmin,
    largest_of,
    ordered_sum,
)

_LOW = float(np.sqrt(SMALLEST))
_HIGH = 1.0 / _LOW
_UP, _DOWN = 2.0**32, 2.0**-32


def log_sum(values: Array) -> float:
    """Return the sum of the logarithms of positive numbers, from their product."""
    product, exponent = 1.0, 0.0
    for value in values.tolist():
        product *= min(value, _HIGH) if value > _LOW else _LOW
        while product < _LOW:
            product, exponent = product * _UP, exponent - 32.0
        while product > _HIGH:
            product, exponent = product * _DOWN, exponent + 32.0
    while product < 1.0:
        product, exponent = product * _UP, exponent - 32.0
    while product >= _UP:
        product, exponent = product * _DOWN, exponent + 32.0
    for count in (16, 8, 4, 2, 1):
        if product >= 2.0**count:
            product, exponent = product / 2.0**count, exponent + count
    s = (product - 1.4142135623730951) / (product + 1.4142135623730951)
    series = 0.0
    for odd in range(23, 1, -2):
        series = (series + 1.0 / odd) * (s * s)
    return (exponent + 0.5) * 0.6931471805599453 + 2.0 * (s + s * series)


def measure(work: MinmaxWork, point: MinmaxPoint) -> None:
    """Take the two parts of the merit."""
    rows = work.sizes.rows
    point.log_sum = log_sum(point.slack)
    point.misfit = ordered_sum(np.abs((point.row - work.width * point.gamma) + point.slack[:rows]))


def merit(work: MinmaxWork, point: MinmaxPoint, mu: float) -> float:
    """Return gamma, minus mu times the logarithms, plus the penalty on misfits."""
    return (point.gamma - mu * point.log_sum) + work.penalty * point.misfit


def measure_gaps(work: MinmaxWork, point: MinmaxPoint) -> bool:
    """Take the distances to the bounds that are there; False where one is not positive."""
    rows = work.sizes.rows
    gaps = np.concatenate([point.x - work.lower, work.upper - point.x])
    point.slack[rows:] = np.where(work.present[rows:], gaps, 1.0)
    return bool((point.slack[rows:] > 0.0).all())


def remember(work: MinmaxWork, point: MinmaxPoint) -> None:
    """Keep the point with the least violation, and among those without any that of the least gamma."""
    hard = work.hard
    attained = largest_of(point.row[~hard] / work.width[~hard], -LARGEST)
    violation = largest_of(point.row[hard], 0.0)
    violation = violation if violation > TOLERANCE else 0.0
    feasible = violation <= 0.0 and work.best_violation <= 0.0
    if violation < work.best_violation or (feasible and attained < work.best_gamma):
        work.best_violation, work.best_gamma, work.best_x = violation, attained, point.x.copy()


def search(work: MinmaxWork, step: MinmaxStep, mu: float) -> bool:
    """Go along the step by Armijo's rule, with one correction of second order and at most 12 halvings."""
    rows, now = work.sizes.rows, work.now
    share = max(0.99, 1.0 - mu)
    length = length_of(now.slack, step.slack, share)
    dual = length_of(work.multiplier, step.multiplier, share)
    most = largest_of(np.abs(work.multiplier[:rows] + step.multiplier[:rows]), 0.0)
    if work.penalty < 1.1 * most:
        work.penalty = 1.5 * most
    before = merit(work, now, mu)
    slope = (step.v[-1] - mu * ordered_sum(step.slack * work.inverse)) - work.penalty * now.misfit
    rounding = (10.0 * EPSILON) * abs(before)
    if not slope <= rounding:
        return False
    for k in range(13):
        usable = _try(work, step, length, mu)
        if usable and _descends(work, mu, before + rounding, length * slope):
            _accept(work, step, dual)
            return True
        if k == 0 and usable and work.trial.misfit >= now.misfit:
            second = _second_order(work, step, length, mu)
            longest = length_of(now.slack, second.slack, share)
            if _try(work, second, longest, mu) and _descends(work, mu, before + rounding, longest * slope):
                _accept(work, second, length_of(work.multiplier, second.multiplier, share))
                return True
        length *= 0.5
    return False


def _try(work: MinmaxWork, step: MinmaxStep, length: float, mu: float) -> bool:
    n, rows, now = work.sizes.unknowns, work.sizes.rows, work.now
    x, gamma = now.x + length * step.v[:n], now.gamma + length * step.v[n]
    trial = work.trial = MinmaxPoint(x, gamma, now.row, now.slack.copy())
    if not (measure_gaps(work, trial) and work.evaluate(trial)):
        return False
    along = now.slack[:rows] + length * step.slack[:rows]
    fitting = work.fitting(trial)
    trial.slack[:rows] = np.where(fitting > fmin(along, mu / work.penalty), fitting, along)
    measure(work, trial)
    return True


def _descends(work: MinmaxWork, mu: float, before: float, expected: float) -> bool:
    return merit(work, work.trial, mu) <= before + 1e-4 * expected


def _accept(work: MinmaxWork, step: MinmaxStep, dual: float) -> None:
    work.now = work.trial
    work.multiplier = work.multiplier + dual * step.multiplier
    remember(work, work.now)


def _second_order(work: MinmaxWork, step: MinmaxStep, length: float, mu: float) -> MinmaxStep:
    rows = work.sizes.rows
    along = work.now.slack[:rows] + length * step.slack[:rows]
    met = (work.trial.row - work.width * work.trial.gamma) + along
    return direction(work, length * work.row_residual + met, work.product - mu)
