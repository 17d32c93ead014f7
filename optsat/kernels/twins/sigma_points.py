"""Sigma points: the twin of `sigma_points.c`."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.kernels.evaluate import Leaf
from optsat.kernels.status import Status
from optsat.kernels.twins.lane_sums import symmetric

_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class SigmaPointTwin:
    """One step of the filter; leaves and constants by the names that they have in the template."""

    leaves: Mapping[str, Leaf]
    constants: Mapping[str, float]
    n: int
    m: int
    u: int
    full: bool

    def __call__(self, x: Array) -> tuple[int, Array]:
        n, m = self.n, self.m
        ends = np.cumsum([n, n * n, self.u, m, n * n if self.full else n])
        state, P, u, z, Q, R = np.split(x, ends)
        results = np.full(n + n * n + m + m * m + 1, np.nan)
        if not np.isfinite(x).all():
            return Status.NOT_FINITE, results
        with np.errstate(all="ignore"):
            L, before = _factorise(P.reshape(n, n))
            _, shift, covariance, centre = self._transform(self.leaves["f"], state, u, L)
            _add_noise(covariance, Q)
            state = self.leaves["restore"](centre + shift)
            L, after = _factorise(covariance)
            images, shift, S, centre = self._transform(self.leaves["h"], state, u, L)
            _add_noise(S, R)
            factor, definite = _factorise(S)
            expected = centre + shift
            innovation = self.leaves["near"](np.concatenate([expected, z])) - expected
            whitened = _substitute(factor, innovation)
            gain = np.array([self._gain_row(i, L, images, factor) for i in range(n)])
            mean = state + np.array([_ordered_dot(row, whitened) for row in gain])
            for i in range(n):
                for j in range(i + 1):
                    covariance[i, j] -= _ordered_dot(gain[i], gain[j])
                    covariance[j, i] = covariance[i, j]
            if not (before and after and definite):
                return Status.STATE, results
            likelihood = self._log_likelihood(factor, whitened)
            y = np.hstack([self.leaves["restore"](mean), covariance.ravel(), innovation, S.ravel(), likelihood])
        return (Status.OK, y) if np.isfinite(y).all() else (Status.OUTPUT, results)

    def _transform(self, leaf: Leaf, state: Array, u: Array, L: Array) -> tuple[Array, Array, Array, Array]:
        upper = np.tri(self.n, dtype=bool).T
        steps = np.concatenate([np.where(upper, sign * self.constants["DISTANCE"] * L.T, 0.0) for sign in (1.0, -1.0)])
        centre = leaf(np.concatenate([state + 0.0, u]))
        images = np.array([leaf(np.concatenate([state + step, u])) for step in steps]) - centre
        total = np.zeros_like(centre)
        for image in images:
            total = total + image
        shift = total * self.constants["WEIGHT"]
        covariance = np.zeros((len(centre), len(centre)))
        for image in images:
            deviation = image - shift
            covariance = covariance + deviation[:, None] * deviation
        covariance = covariance * self.constants["WEIGHT"] + self.constants["CENTRE"] * (shift[:, None] * shift)
        return images, shift, covariance, centre

    def _gain_row(self, i: int, L: Array, images: Array, factor: Array) -> Array:
        row = np.zeros(self.m)
        for k in range(i + 1):
            row = row + L[i, k] * (images[k] - images[self.n + k])
        return _substitute(factor, row * self.constants["CROSS"])

    def _log_likelihood(self, factor: Array, whitened: Array) -> float:
        determinant = 0.0
        for each in np.diag(factor):
            determinant += self.leaves["log"](np.array([each]))[0]
        return float(-((_ordered_dot(whitened, whitened) / 2.0 + determinant) + self.constants["OFFSET"]))


def _factorise(matrix: Array) -> tuple[Array, bool]:
    a, definite = np.tril(matrix), True
    for j in range(len(a)):
        least = (4.0 * _EPSILON) * a[j, j]
        for k in range(j):
            a[j:, j] -= a[j:, k] * a[j, k]
        usable = bool(least < a[j, j] <= np.finfo(float).max)
        definite = definite and usable
        a[j, j] = np.sqrt(a[j, j] if usable else 1.0)
        a[j + 1 :, j] *= 1.0 / a[j, j]
    return a, definite


def _substitute(L: Array, b: Array) -> Array:
    y = b.copy()
    for i in range(len(y)):
        for k in range(i):
            y[i] -= L[i, k] * y[k]
        y[i] /= L[i, i]
    return y


def _add_noise(covariance: Array, noise: Array) -> None:
    n = len(covariance)
    if noise.size == n:
        covariance[np.diag_indices(n)] += noise
    else:
        covariance += symmetric(noise.reshape(n, n))


def _ordered_dot(a: Array, b: Array) -> float:
    total = 0.0
    for x, y in zip(a, b, strict=True):
        total += x * y
    return float(total)
