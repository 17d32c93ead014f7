"""Certified attitude: the twin of the search for the best weights."""

import sys

import numpy as np

from optsat.arrays import Array
from optsat.kernels.twins.certified_attitude_ball import EPSILON, UPPER, Ball, Pairs

WIDEST = float(np.sqrt(3.0))
ENOUGH = 1e-5
SHARE = 0.95
_ROWS, _COLUMNS = (np.array(each) for each in zip(*UPPER, strict=True))
_ON_DIAGONAL = _ROWS == _COLUMNS


class Programme:
    """The programme about the centre of a ball, in units of that ball."""

    def __init__(self, pairs: Pairs, ball: Ball) -> None:
        n, u = len(ball.about), pairs.rounding
        radius = np.sqrt(ball.tangent_square) if ball.bounded else WIDEST
        self.scale = float(min(max(radius, 256.0 * EPSILON), WIDEST))
        self.s2 = self.scale * self.scale
        half = np.array(pairs.half_sine)
        value = np.array([each[0] for each in ball.about]) + (2.0 * u) * (2.0 * half + u)
        linear = self.scale * np.array([each[1] for each in ball.about])
        block = self.s2 * np.array([each[2] for each in ball.about])
        entries = np.abs(np.concatenate((value[:, None], linear, block), axis=1))
        self.size = np.maximum(entries.max(axis=1), sys.float_info.min)
        self.value = value / self.size
        scaled = block / self.size[:, None]
        self.coefficient = np.zeros((n, 10))
        self.coefficient[:, :6] = np.where(_ON_DIAGONAL, scaled - (self.s2 * self.value)[:, None], 2.0 * scaled)
        self.coefficient[:, 6:9] = 2.0 * (linear / self.size[:, None])

    def optimise(self, iterations: int) -> list[float] | None:
        """Return weights, sum 1, after so many iterations at most; None where there are none."""
        self._start()
        n, unmet = len(self.value), 1.0
        for iteration in range(iterations):
            inside = self._place_cones(iteration == 0)
            gap = self._gap(0.0, 0.0)
            met = gap <= (ENOUGH + 64.0 * EPSILON) * max(float(self.x[9]), 0.01) and unmet <= 0.0001
            if not inside or met or not gap <= sys.float_info.max or not self._factorise():
                break
            self._correct(False)
            self._find_step(0.0)
            ahead = self._gap(self._reach(False, 4), self._reach(True, 4)) / gap
            centring = min(ahead * ahead + 0.0001, 1.0)
            self._correct(True)
            self._find_step((centring * gap) / float(n + 8))
            primal, dual = SHARE * self._reach(False, 7), SHARE * self._reach(True, 7)
            self._advance(primal, dual)
            unmet = unmet * (1.0 - min(primal, dual))
            if not max(primal, dual) > 0.0:
                break
        return self._weights()

    def _start(self) -> None:
        size = min(0.2, 0.15 / self.s2)
        self.x = np.array([size, 0.0, size, 0.0, 0.0, size, 0.0, 0.0, 0.0, -1.0])
        trace = (self.coefficient[:, 0] + self.coefficient[:, 2]) + self.coefficient[:, 5]
        self.slack = np.fmax(self.value + size * trace, 0.5)
        self.multiplier = 1.0 / self.slack
        self.slack_step = np.zeros_like(self.slack)
        self.multiplier_step = np.zeros_like(self.slack)
        self.cone_multiplier = np.zeros((2, 4, 4))

    def _place_cones(self, first: bool) -> bool:
        self.cone_slack = self._slacks(self.x, 1.0)
        self.cone_inverse = np.zeros((2, 4, 4))
        inside = [_invert(m, into) for m, into in zip(self.cone_slack, self.cone_inverse, strict=True)]
        if first:
            self.cone_multiplier = self.cone_inverse.copy()
        self.cone_slack_step = np.zeros((2, 4, 4))
        self.cone_multiplier_step = np.zeros((2, 4, 4))
        return all(inside)

    def _slacks(self, x: Array, constant: float) -> Array:
        trace = (x[0] + x[2]) + x[5]
        m = np.zeros((2, 4, 4))
        m[0, 0, 0] = constant - self.s2 * trace
        m[1, 0, 0] = trace - x[9]
        diagonal = constant - self.s2 * x[9]
        for which, (side, inner, added) in enumerate(((1.0, 1.0, 0.0), (-1.0, -self.s2, diagonal))):
            m[which, 0, 1:] = m[which, 1:, 0] = side * x[6:9]
            for k, (row, column) in enumerate(UPPER):
                entry = inner * x[k] + (added if row == column else 0.0)
                m[which, row + 1, column + 1] = m[which, column + 1, row + 1] = entry
        return m

    def _adjoint(self, which: int, m: Array) -> Array:
        x = np.empty((*m.shape[:-2], 10))
        corner = m[..., 0, 0] if which else -(self.s2 * m[..., 0, 0])
        trace = (m[..., 1, 1] + m[..., 2, 2]) + m[..., 3, 3]
        entry = (-self.s2 if which else 1.0) * m[..., _ROWS + 1, _COLUMNS + 1]
        x[..., :6] = np.where(_ON_DIAGONAL, entry + corner[..., None], 2.0 * entry)
        x[..., 6:9] = (-2.0 if which else 2.0) * m[..., 0, 1:]
        x[..., 9] = -(m[..., 0, 0] + self.s2 * trace) if which else 0.0
        return x

    def _factorise(self) -> bool:
        schur = np.zeros((10, 10))
        for row, ratio in zip(self.coefficient, self.multiplier / self.slack, strict=True):
            schur += (ratio * row)[:, None] * row
        for which in (0, 1):
            a, m = self.cone_inverse[which], self.cone_multiplier[which]
            # indices k, l of the unit matrix, i, j of its image
            above = a.T[:, None, :, None] * m[None, :, None, :] + a.T[None, :, :, None] * m[:, None, None, :]
            below = a.T[:, None, None, :] * m[None, :, :, None] + a.T[None, :, None, :] * m[:, None, :, None]
            images = self._adjoint(which, 0.25 * (above + below))
            schur += self._adjoint(which, np.moveaxis(images, -1, 0)).T
        self.pivot = np.ones(10)
        for j in range(10):
            pivot = schur[j, j]
            if not 0.0 < pivot <= sys.float_info.max:
                return False
            self.pivot[j] = 1.0 / pivot
            column = schur[j + 1 :, j].copy()
            factor = column * self.pivot[j]
            schur[j + 1 :, j + 1 :] -= factor[:, None] * column
            schur[j + 1 :, j] = factor
        self.schur = schur
        return True

    def _substituted(self, right: Array) -> Array:
        step = right.copy()
        for k in range(10):
            step[k + 1 :] -= self.schur[k + 1 :, k] * step[k]
        step = step * self.pivot
        for i in reversed(range(10)):
            for k in range(i + 1, 10):
                step[i] -= self.schur[k, i] * step[k]
        return step

    def _find_step(self, target: float) -> None:
        rest = _accumulated(self.value, self.coefficient, self.x) - self.slack
        pull = (target - rest * self.multiplier) / self.slack - self.correction
        right = np.zeros(10)
        right[9] = 1.0
        for row, each in zip(self.coefficient, pull, strict=True):
            right[:9] += row[:9] * each
        image = target * self.cone_inverse - self.cone_correction
        for which in (0, 1):
            right += self._adjoint(which, image[which])
        self.x_step = self._substituted(right)
        self.slack_step = _accumulated(rest, self.coefficient, self.x_step)
        aim = (target - self.slack_step * self.multiplier) / self.slack
        self.multiplier_step = (aim - self.multiplier) - self.correction
        self.cone_slack_step = self._slacks(self.x_step, 0.0)
        image = _multiply(self.cone_inverse, self.cone_slack_step, self.cone_multiplier)
        self.cone_multiplier_step = ((target * self.cone_inverse - image) - self.cone_multiplier) - self.cone_correction

    def _correct(self, predicted: bool) -> None:
        if predicted:
            self.correction = (self.slack_step * self.multiplier_step) / self.slack
            self.cone_correction = _multiply(self.cone_inverse, self.cone_slack_step, self.cone_multiplier_step)
        else:
            self.correction = np.zeros_like(self.slack)
            self.cone_correction = np.zeros((2, 4, 4))

    def _reach(self, of_multipliers: bool, halvings: int) -> float:
        if of_multipliers:
            start, step = self.multiplier, self.multiplier_step
            matrices, changes = self.cone_multiplier, self.cone_multiplier_step
        else:
            start, step, matrices, changes = self.slack, self.slack_step, self.cone_slack, self.cone_slack_step
        ends = np.where(step < 0.0, -(start / step), 1.0)
        inside, outside = 0.0, float(np.fmin.reduce(ends, initial=1.0))
        length = outside
        for _ in range(halvings + 1):
            if not inside < outside:
                break
            if all(_is_definite(m + length * change) for m, change in zip(matrices, changes, strict=True)):
                inside = length
            else:
                outside = length
            length = 0.5 * (inside + outside)
        return inside

    def _gap(self, primal: float, dual: float) -> float:
        gap = 0.0
        moved = (self.slack + primal * self.slack_step) * (self.multiplier + dual * self.multiplier_step)
        for each in moved.tolist():
            gap += each
        for which in (0, 1):
            slack, slack_step = self.cone_slack[which], self.cone_slack_step[which]
            multiplier, multiplier_step = self.cone_multiplier[which], self.cone_multiplier_step[which]
            gap += _inner(slack, multiplier)
            gap += dual * _inner(slack, multiplier_step) + primal * _inner(slack_step, multiplier)
            gap += (primal * dual) * _inner(slack_step, multiplier_step)
        return gap

    def _advance(self, primal: float, dual: float) -> None:
        self.x = self.x + primal * self.x_step
        self.slack = self.slack + primal * self.slack_step
        self.multiplier = self.multiplier + dual * self.multiplier_step
        self.cone_multiplier = self.cone_multiplier + dual * self.cone_multiplier_step

    def _weights(self) -> list[float] | None:
        raw = self.multiplier / self.size
        largest = float(np.fmax.reduce(raw, initial=0.0))
        if not 0.0 < largest <= sys.float_info.max:
            return None
        weights = np.fmax(raw / largest, 0.0).tolist()
        total = 0.0
        for weight in weights:
            total += weight
        return [weight / total for weight in weights]


def _accumulated(start: Array, coefficient: Array, x: Array) -> Array:
    value = start
    for k in range(9):
        value = value + coefficient[:, k] * x[k]
    return value


def _products(a: Array, b: Array) -> Array:
    terms = [a[..., :, k, None] * b[..., None, k, :] for k in range(4)]
    return np.asarray((terms[0] + terms[1]) + (terms[2] + terms[3]))


def _multiply(a: Array, b: Array, c: Array) -> Array:
    whole = _products(_products(a, b), c)
    return np.asarray(0.5 * (whole + np.swapaxes(whole, -1, -2)))


def _inner(a: Array, b: Array) -> float:
    total = 0.0
    for row in (a * b).tolist():
        total += (row[0] + row[1]) + (row[2] + row[3])
    return total


def _invert(m: Array, inverse: Array) -> bool:
    lower, part = np.zeros((4, 4)), np.zeros((4, 4))
    definite = True
    for j in range(4):
        column = m[j:, j].copy()
        for k in range(j):
            column -= lower[j:, k] * lower[j, k]
        definite = bool(definite and 0.0 < column[0] <= sys.float_info.max)
        part[j, j] = 1.0 / np.sqrt(column[0] if definite else 1.0)
        lower[j + 1 :, j] = column[1:] * part[j, j]
    for j in range(4):
        for i in range(j + 1, 4):
            total = 0.0
            for k in range(j, i):
                total += lower[i, k] * part[k, j]
            part[i, j] = -(total * part[i, i])
    for i in range(4):
        for j in range(i + 1):
            total = 0.0
            for k in range(i, 4):
                total += part[k, i] * part[k, j]
            inverse[i, j] = inverse[j, i] = total
    return definite


def _is_definite(rest: Array) -> bool:
    for j in range(4):
        if not rest[j, j] > 0.0:
            return False
        factor = rest[j + 1 :, j] * (1.0 / rest[j, j])
        rest[j + 1 :, j + 1 :] -= factor[:, None] * rest[j + 1 :, j]
    return True
