"""Linear matrix inequality: the twin of `lmi.c`."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from optsat.arrays import Array
from optsat.kernels.sizes import LANES, padded
from optsat.kernels.source import Twin
from optsat.kernels.status import Status

HALVINGS, FINE, COARSE = 14, 8, 5
REPAIRS = 8
_EPSILON = sys.float_info.epsilon
_STATUS = (Status.OK, Status.RANGE, Status.RANGE, Status.NOT_CONVERGED, Status.NOT_CONVERGED)


def roundoffs(m: int, side: int) -> int:
    """Return what rounding may cost in the sum of m + 1 matrices and in the test of its sign, in unit roundoffs."""
    return side * (m + side + 2)


def twin(m: int, sides: Sequence[int], tolerance: float, iterations: int) -> Twin:
    """Return x (m,), objective, bound and outcome."""

    def run(x: Array) -> tuple[int, Array]:
        with np.errstate(all="ignore"):
            if not np.isfinite(x).all():
                return Status.NOT_FINITE, np.array([*[np.nan] * (m + 2), 4.0])
            return _Programme(m, sides, tolerance, x).solve(iterations)

    return run


@dataclass
class _Step:
    x: Array
    slack: Array
    multiplier: Array
    tau: float
    kappa: float


class _Programme:
    def __init__(self, m: int, sides: Sequence[int], tolerance: float, x: Array) -> None:
        self.m, self.blocks, self.side = m, len(sides), max(sides)
        self.triangle = self.side * (self.side + 1) // 2
        upper = [(row, column) for column in range(self.side) for row in range(column + 1)]
        self.rows, self.columns = (np.array(each) for each in zip(*upper, strict=True))
        self.enough = max(tolerance, 512.0 * _EPSILON)
        self.cost = x[:m]
        own = np.concatenate([b * self.triangle + np.arange(n * (n + 1) // 2) for b, n in enumerate(sides)])
        self.given = np.zeros((m + 1, padded(self.blocks * self.triangle)))
        self.given[:, own] = x[m:].reshape(m + 1, -1)
        self.largest = np.fmax.reduce(np.abs(self.given), axis=1)
        for b, n in enumerate(sides):
            self.given[0, [b * self.triangle + k * (k + 3) // 2 for k in range(n, self.side)]] = 1.0

    def solve(self, iterations: int) -> tuple[int, Array]:
        self._start()
        shown = self._judge()
        for _ in range(iterations):
            if shown != 3 or not self._advance():
                break
            shown = self._judge()
        outcome, value, bound, answer = 4, math.nan, math.nan, np.full(self.m, np.nan)
        lowest = -(self.constant / self.tau)
        if shown in (1, 2):
            outcome = shown
        elif self._repair():
            answer, value, bound = self.x, self._value(self.x), lowest
            size = (1.0 + abs(value)) + abs(bound)
            outcome = 0 if shown == 0 and value - bound <= (10.0 * self.enough) * size else 3
        return _STATUS[outcome], np.array([*answer, value, bound, float(outcome)])

    def _start(self) -> None:
        self.slack_size = float(np.fmax.reduce(self.largest, initial=1.0))
        self.cost_size = float(np.fmax.reduce(np.abs(self.cost), initial=1.0))
        one = np.tile(np.eye(self.side), (self.blocks, 1, 1))
        self.x, self.slack, self.multiplier = np.zeros(self.m), self.slack_size * one, self.cost_size * one
        self.tau, self.kappa = 1.0, self.slack_size * self.cost_size

    def _judge(self) -> Literal[0, 1, 2, 3]:
        enough, value = self.enough, self._value(self.x)
        pulls = self._drawn(self.multiplier)
        self.unmet = self.tau * self.cost - pulls[1:]
        unmet = float(np.fmax.reduce(np.abs(self.unmet), initial=0.0))
        drawn = float(np.fmax.reduce(np.abs(pulls[1:]), initial=0.0))
        self.gap = _inner(self.slack, self.multiplier)
        self.constant = constant = float(pulls[0])
        size = (self.tau + abs(value)) + abs(constant)
        self.rest = self._combined(self.tau, self.x) - self.slack
        rest = _largest(self.rest)
        moved = rest + self.tau * max(float(self.largest[0]), 1.0)
        self.is_near = self.gap <= (0.001 * size) * self.tau
        close = self.gap <= (enough * size) * self.tau and value + constant <= enough * size
        dual = unmet <= (enough * self.cost_size) * self.tau
        if close and dual and rest <= (enough * self.slack_size) * self.tau:
            return 0
        if constant < 0.0 and drawn <= enough * -constant:
            return 1
        return 2 if value < 0.0 and moved <= enough * -value else 3

    def _advance(self) -> bool:
        inverse = _inverse(self.slack)
        if inverse is None or not self._factorise(inverse):
            return False
        self._centre(inverse)
        step = self._step(inverse, 0.0, 1.0, np.zeros_like(self.slack), 0.0)
        left = 1.0 - self._reach(step, COARSE)
        centring = (left * left) * left
        correction = _transformed(inverse, step.slack, step.multiplier)
        mean = (self.gap + self.tau * self.kappa) / float(self.blocks * self.side + 1)
        step = self._step(inverse, centring * mean, 1.0 - centring, correction, step.tau * step.kappa)
        if self.is_near:
            self._refine(inverse, step, 1.0 - centring)
        length = self._reach(step, FINE)
        length = (0.9 + 0.09 * length) * length
        if length > 0.0:
            self._move(step, length)
        return length > 0.0

    def _move(self, step: "_Step", length: float) -> None:
        self.x = self.x + length * step.x
        self.slack = self.slack + length * step.slack
        self.multiplier = self.multiplier + length * step.multiplier
        self.tau = self.tau + length * step.tau
        self.kappa = self.kappa + length * step.kappa

    def _factorise(self, inverse: Array) -> bool:
        matrices = self._unpacked(self.given[1:])
        images = _products(_products(inverse, matrices), self.multiplier)
        schur = np.stack([_sums(self.given[1:] * packed) for packed in self._packed(images)], axis=1)
        diagonal = np.arange(self.m), np.arange(self.m)
        schur[diagonal] = schur[diagonal] + (64.0 * _EPSILON) * schur[diagonal]
        self.pivot = np.zeros(self.m)
        for j in range(self.m):
            pivot = schur[j, j]
            if not abs(pivot) <= sys.float_info.max:
                return False
            if pivot > 0.0:
                self.pivot[j] = 1.0 / pivot
            column = schur[j + 1 :, j].copy()
            factor = column * self.pivot[j]
            schur[j + 1 :, j + 1 :] -= factor[:, None] * column
            schur[j + 1 :, j] = factor
        self.schur = schur
        return True

    def _centre(self, inverse: Array) -> None:
        """What a change of tau alone would do, x / tau kept."""
        self.rest_image = _transformed(inverse, self.rest, self.multiplier)
        self.present = (1.0 / self.tau) * (self.slack + self.rest)
        image = (1.0 / self.tau) * (self.multiplier + self.rest_image)
        self.excess = self._drawn(image)[1:]
        self.sensitivity = self._substituted(self.cost + self.excess)
        self.excess = self.excess - self.cost
        self.lost = self.kappa + _inner(self.present, self.multiplier)
        steepness = self.kappa / self.tau + _inner(self.present, image)
        least = max(0.01 * steepness, sys.float_info.min)
        for each in (self.excess * self.sensitivity).tolist():
            steepness -= each
        self.steepness = steepness if steepness >= least else least

    def _step(self, inverse: Array, target: float, share: float, correction: Array, added: float) -> "_Step":
        image = ((target * inverse - share * self.rest_image) - self.multiplier) - correction
        p = self._substituted(self._drawn(image)[1:] - share * self.unmet)
        wanted = (target - self.tau * self.kappa) - added
        tau = (share * self.lost + _inner(self.present, image)) + wanted / self.tau
        for each in (self.excess * p).tolist():
            tau -= each
        tau = tau / self.steepness
        step = p - tau * self.sensitivity
        slack = (self._combined(0.0, step) + tau * self.present) + share * self.rest
        aim = target * inverse - _transformed(inverse, slack, self.multiplier)
        multiplier = (aim - self.multiplier) - correction
        step = step + (tau / self.tau) * self.x
        return _Step(step, slack, multiplier, tau, (wanted - self.kappa * tau) / self.tau)

    def _refine(self, inverse: Array, step: "_Step", share: float) -> None:
        left = (self._drawn(step.multiplier)[1:] - step.tau * self.cost) - share * self.unmet
        further = self._substituted(left)
        change = self._combined(0.0, further)
        step.x = step.x + further
        step.slack = step.slack + change
        step.multiplier = step.multiplier - _transformed(inverse, change, self.multiplier)

    def _reach(self, step: "_Step", halvings: int, of_multiplier: bool = True) -> float:
        reach = 1.0
        for value, change in ((self.tau, step.tau), (self.kappa, step.kappa)):
            reach = min(reach, -(value / change)) if change < 0.0 else reach
        reach = _reach_of(self.slack, step.slack, reach, halvings)
        return _reach_of(self.multiplier, step.multiplier, reach, halvings) if of_multiplier else reach

    def _substituted(self, right: Array) -> Array:
        step = right.copy()
        for k in range(self.m):
            step[k + 1 :] -= self.schur[k + 1 :, k] * step[k]
        step = step * self.pivot
        for i in reversed(range(self.m)):
            for k in range(i + 1, self.m):
                step[i] -= self.schur[k, i] * step[k]
        return step

    def _holds(self, x: Array) -> bool:
        size = float(self.largest[0])
        for each in (np.abs(x) * self.largest[1:]).tolist():
            size += each
        self.margin = ((0.5 * roundoffs(self.m, self.side)) * _EPSILON) * size
        return all(map(_is_definite, self._combined(1.0, x) - self.margin * np.eye(self.side)))

    def _repair(self) -> bool:
        scale = 1.0 / self.tau
        self.x, self.slack = scale * self.x, scale * self.slack
        mean = ((scale * scale) * self.gap) / float(self.blocks * self.side)
        self.tau, self.kappa = 1.0, 0.0
        for _ in range(REPAIRS):
            if self._holds(self.x):
                break
            self.slack = self.slack + self.margin * np.eye(self.side)
            mean = max(mean, (2.0 * self.margin) * self.cost_size)
            if (inverse := _inverse(self.slack)) is None:
                break
            self.multiplier = mean * inverse
            self._judge()
            if not self._factorise(inverse):
                break
            self._centre(inverse)
            self.steepness = sys.float_info.max
            step = self._step(inverse, mean, 1.0, np.zeros_like(self.slack), 0.0)
            length = self._reach(step, FINE, of_multiplier=False)
            if length > 0.0:
                self._move(step, length if length >= 1.0 else 0.9 * length)
            mean = 4.0 * mean
        return self._holds(self.x)

    def _value(self, x: Array) -> float:
        total = 0.0
        for each in (self.cost * x).tolist():
            total += each
        return total

    def _combined(self, constant: float, x: Array) -> Array:
        packed = constant * self.given[0]
        for share, row in zip(x, self.given[1:], strict=True):
            packed += share * row
        return self._unpacked(packed)

    def _unpacked(self, packed: Array) -> Array:
        own = packed[..., : self.blocks * self.triangle].reshape(*packed.shape[:-1], self.blocks, self.triangle)
        m = np.empty((*own.shape[:-1], self.side, self.side))
        m[..., self.rows, self.columns] = own
        m[..., self.columns, self.rows] = own
        return m

    def _packed(self, m: Array) -> Array:
        both = m[..., self.rows, self.columns] + m[..., self.columns, self.rows]
        own = np.where(self.rows == self.columns, m[..., self.rows, self.columns], both)
        packed = np.zeros((*m.shape[:-3], self.given.shape[1]))
        packed[..., : self.blocks * self.triangle] = own.reshape(*m.shape[:-3], -1)
        return packed

    def _drawn(self, m: Array) -> Array:
        return _sums(self.given * self._packed(m))


def _sums(products: Array) -> Array:
    """Sums along the last axis as `lane_sums.c` forms them."""
    lanes = np.zeros((*products.shape[:-1], LANES))
    for begin in range(0, products.shape[-1], LANES):
        lanes = lanes + products[..., begin : begin + LANES]
    s = [lanes[..., k] for k in range(LANES)]
    return np.asarray(((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7])))


def _products(a: Array, b: Array) -> Array:
    product = np.zeros(np.broadcast_shapes(a.shape, b.shape))
    for k in range(a.shape[-1]):
        product = product + a[..., :, k, None] * b[..., None, k, :]
    return product


def _transformed(inverse: Array, m: Array, other: Array) -> Array:
    whole = _products(_products(inverse, m), other)
    mean = 0.5 * (whole + np.swapaxes(whole, -1, -2))
    return np.where(np.eye(whole.shape[-1]) > 0, whole, mean)


def _inner(a: Array, b: Array) -> float:
    total = 0.0
    for each in (a * b).ravel().tolist():
        total += each
    return total


def _largest(m: Array) -> float:
    return float(np.fmax.reduce(np.abs(m).ravel(), initial=0.0))


def _reach_of(m: Array, step: Array, reach: float, halvings: int) -> float:
    for block, change in zip(m, step, strict=True):
        inside, outside, length = 0.0, reach, reach
        for k in range(1, HALVINGS + 1):
            if _is_definite(block + length * change):
                inside = length
            else:
                outside = length
            length = 0.5 * (inside + outside)
            if not (inside < outside and (k < halvings or inside <= 0.0)):
                break
        reach = inside
    return reach


def _is_definite(rest: Array) -> bool:
    for j in range(len(rest)):
        if not rest[j, j] > 0.0:
            return False
        factor = rest[j + 1 :, j] * (1.0 / rest[j, j])
        rest[j + 1 :, j + 1 :] -= factor[:, None] * rest[j + 1 :, j]
    return True


def _inverse(m: Array) -> Array | None:
    n = m.shape[-1]
    lower, part, inverse = np.zeros_like(m), np.zeros_like(m), np.zeros_like(m)
    for j in range(n):
        column = m[:, j:, j].copy()
        for k in range(j):
            column -= lower[:, j:, k] * lower[:, j, k, None]
        if not ((column[:, 0] > 0.0) & (column[:, 0] <= sys.float_info.max)).all():
            return None
        part[:, j, j] = 1.0 / np.sqrt(column[:, 0])
        lower[:, j + 1 :, j] = column[:, 1:] * part[:, j, j, None]
    for j in range(n):
        for i in range(j + 1, n):
            total = np.zeros(len(m))
            for k in range(j, i):
                total = total + lower[:, i, k] * part[:, k, j]
            part[:, i, j] = -(total * part[:, i, i])
    for i in range(n):
        for j in range(i + 1):
            total = np.zeros(len(m))
            for k in range(i, n):
                total = total + part[:, k, i] * part[:, k, j]
            inverse[:, i, j] = inverse[:, j, i] = total
    return inverse
