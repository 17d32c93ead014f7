"""Bank: the twin of `bank.c`."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.kernels.evaluate import Leaf
from optsat.kernels.source import Twin
from optsat.kernels.status import Status
from optsat.kernels.twins.lane_sums import symmetric

_EPSILON = float(np.finfo(float).eps)
_LARGEST = float(np.finfo(float).max)


@dataclass(frozen=True)
class BankTwin:
    """One step of the bank; sizes and places by the names that they have in the template."""

    filter: Twin
    restore: Leaf
    near: Leaf
    exp: Leaf
    log: Leaf
    modes: int
    n: int
    place: tuple[int, ...]
    stride: tuple[int, ...]
    transition: int
    likelihood: int
    definite: int
    floor: float

    def __call__(self, x: Array) -> tuple[int, Array]:
        modes, n = self.modes, self.n
        state, P, log_probability = np.split(x[: modes * (n + n * n + 1)], [modes * n, modes * (n + n * n)])
        transition = x[self.transition : -1].reshape(modes, modes)
        count = self._count(transition, x[-1])
        failed = np.zeros(modes)
        status = Status.RANGE if count == 0 else Status.OK
        if not np.isfinite(x).all():
            status = Status.NOT_FINITE
        y = np.full(modes * (n + n * n + 2) + n + n * n + 1, np.nan)
        if status is Status.OK:
            results = (state.reshape(modes, n).copy(), P.reshape(modes, n, n).copy(), log_probability.copy(), failed)
            with np.errstate(all="ignore"):
                mean, covariance, evidence = self._step(x, transition[:count, :count], *results)
            if failed[:count].all():
                status = Status.STATE
            elif not (np.isfinite(mean).all() and np.isfinite(covariance).all()):
                status = Status.OUTPUT
            else:
                y = np.hstack([*(each.ravel() for each in results), mean, covariance.ravel(), evidence])
        begin = modes * (n + n * n + 1)
        y[begin : begin + modes] = failed
        return status, y

    def _count(self, transition: Array, number: float) -> int:
        count = int(number) if 1.0 <= number <= self.modes else 0
        good = count >= number
        for i in range(count):
            out = into = 0.0
            for j in range(count):
                good = good and transition[i, j] >= 0.0
                out, into = out + transition[i, j], into + transition[j, i]
            good = bool(good and abs(out - 1.0) <= 64 * self.modes * _EPSILON and into > 0.0)
        return count if good else 0

    def _step(
        self, x: Array, transition: Array, state: Array, P: Array, log_probability: Array, failed: Array
    ) -> tuple[Array, Array, float]:
        count = len(transition)
        self._normalise(log_probability[:count])
        reference = state[np.argmax(log_probability[:count])].copy()
        mixing, log_predicted = self._mixing(transition, log_probability[:count])
        mean, spread = self._mix(mixing, self._offsets(state[:count], reference), P[:count])
        for j in range(count):
            given = np.concatenate([self.restore(reference + mean[:, j]), spread[:, :, j].ravel()])
            others = [x[place + j * stride] for place, stride in zip(self.place, self.stride, strict=True)]
            status, result = self.filter(np.concatenate([given, others[given.size :]]))
            checked = self.definite == self.likelihood or result[self.definite] > 0.0
            good = status == Status.OK and checked and bool(np.isfinite(result).all())
            found = result if good else given
            state[j], P[j] = found[: self.n], found[self.n : given.size].reshape(self.n, self.n)
            failed[j] = 0.0 if good else 1.0
            log_probability[j] = log_predicted[j] + result[self.likelihood] if good else -_LARGEST
        evidence = self._normalise(log_probability[:count])
        reference = state[np.argmax(log_probability[:count])].copy()
        weights = np.array([[self._exp(each)] for each in log_probability[:count]])
        mean, spread = self._mix(weights, self._offsets(state[:count], reference), P[:count])
        return self.restore(reference + mean[:, 0]), spread[:, :, 0], evidence

    def _exp(self, a: float) -> float:
        return float(self.exp(np.array([a]))[0])

    def _log(self, a: float) -> float:
        return float(self.log(np.array([a]))[0])

    def _normalise(self, log_probability: Array) -> float:
        top, total = log_probability.max(), 0.0
        for each in log_probability:
            total += self._exp(max(each - top, self.floor))
        evidence = float(top + self._log(total))
        log_probability[:] = np.maximum(log_probability - evidence, self.floor)
        return evidence

    def _mixing(self, transition: Array, log_probability: Array) -> tuple[Array, Array]:
        mixing, predicted = np.zeros_like(transition), np.zeros(len(transition))
        for j, shares in enumerate(transition.T):
            top = log_probability[shares > 0.0].max()
            total = 0.0
            for i, share in enumerate(shares):
                mixing[i, j] = share * self._exp(log_probability[i] - top) if share > 0.0 else 0.0
                total += mixing[i, j]
            mixing[:, j] /= total
            predicted[j] = top + self._log(total)
        return mixing, predicted

    def _offsets(self, state: Array, reference: Array) -> Array:
        return np.array([self.near(np.concatenate([reference, each])) - reference for each in state])

    def _mix(self, mixing: Array, offsets: Array, P: Array) -> tuple[Array, Array]:
        mean = np.zeros((self.n, mixing.shape[1]))
        spread = np.zeros((self.n, self.n, mixing.shape[1]))
        for share, offset in zip(mixing, offsets, strict=True):
            mean = mean + share * offset[:, None]
        for share, offset, own in zip(mixing, offsets, P, strict=True):
            deviation = offset[:, None] - mean
            spread = spread + share * (symmetric(own)[:, :, None] + deviation[:, None] * deviation[None, :])
        return mean, spread
