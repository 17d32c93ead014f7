"""Hypothesis bank: the twin of `hypothesis_bank.c`, all modes side by side."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from optsat.arrays import Array, Mask
from optsat.kernels.evaluate import Leaf
from optsat.kernels.status import Status

if TYPE_CHECKING:
    from optsat.kernels.hypothesis_bank import BankStructure


Rows: TypeAlias = list[list[tuple[int, float]]]
"""Columns and values of each row of a matrix."""


@dataclass(frozen=True)
class HypothesisBankTwin:
    """One step of the bank; P[e, f] is a row over the modes, the upper triangle held beside the lower one."""

    structure: BankStructure
    sizes: Mapping[str, int]
    constants: Mapping[str, float]
    leaves: Mapping[str, Leaf]

    def __call__(self, x: Array) -> tuple[int, Array]:
        sizes, modes, n = self.sizes, self.structure.modes, self.structure.states
        y = np.full(sizes["RESULTS"], np.nan)
        ends = np.cumsum([modes, n * modes, sizes["PACKED"] * modes])
        if not np.isfinite(x).all():
            return Status.NOT_FINITE, y
        probability, mean, packed, given = (part.copy() for part in np.split(x, ends))
        lower = np.tril_indices(n)
        P = np.zeros((n, n, modes))
        P[lower] = packed.reshape(-1, modes)
        P.transpose(1, 0, 2)[lower] = packed.reshape(-1, modes)
        mean = mean.reshape(n, modes)
        if not ((probability >= 0.0).all() and probability.sum() > 0.0 and (P[range(n), range(n)] >= 0.0).all()):
            return Status.STATE, y
        with np.errstate(all="ignore"):
            result = self._step(probability, mean, P, given)
        if result is None:
            return Status.STATE, y
        return (Status.OK, result) if np.isfinite(result).all() else (Status.OUTPUT, y)

    def _step(self, probability: Array, mean: Array, P: Array, given: Array) -> Array | None:
        reference = self.sizes["REFERENCE"]
        moved = self.leaves["predict"](given)
        F, noise, chain, jump, spread, rest = self._predicted(moved[reference:])
        failed = (np.arange(self.structure.modes) >> np.arange(self.structure.bits)[:, None]) & 1 == 1
        for a, (bit, _) in enumerate(self.structure.actuated):
            e = self._first + a
            mean[e] -= np.where(failed[bit], jump[a], 0.0)
            P[e, e] += np.where(failed[bit], spread[a], 0.0)
        for bit in range(self.structure.bits):
            probability, mean, P = self._mixed(probability, mean, P, failed, bit, chain[bit], rest)
        mean = _product(F, mean)
        P = _product(F, _product(F, P).transpose(1, 0, 2)).transpose(1, 0, 2)
        for e in range(self.structure.states):
            bits = [bit for bit, _ in self.structure.actuated][e - self._first :] if e >= self._first else []
            P[e, e] += noise[e] * (failed[bits[0]] if bits else 1.0)
        at = np.concatenate([moved[:reference], given[reference:]])
        observed = self.leaves["observe"](at)
        log_density = self._measured(mean, P, failed, observed)
        if log_density is None:
            return None
        before = probability.sum()
        logs = np.log(np.maximum(probability, self.constants["FLOOR"])) + log_density
        shares = np.exp(logs - logs.max())
        evidence = logs.max() + math.log(shares.sum() / before)
        probability = np.maximum(shares / shares.sum(), self.constants["FLOOR"])
        probability = probability / probability.sum()
        return self._merged(probability, mean, P, failed, at, observed, evidence)

    @property
    def _first(self) -> int:
        return self.structure.states - len(self.structure.actuated)

    def _predicted(self, numbers: Array) -> tuple[Rows, Array, Array, Array, Array, Array]:
        s, n, actuated = self.structure, self.structure.states, len(self.structure.actuated)
        ends = np.cumsum([len(s.F_pattern), n, 2 * s.bits, actuated, actuated])
        values, noise, chain, jump, spread, rest = np.split(numbers, ends)
        F = _rows(s.F_pattern, values, n)
        return F, noise, chain.reshape(-1, 2), jump, spread, rest

    def _mixed(
        self, probability: Array, mean: Array, P: Array, failed: Mask, bit: int, chain: Array, rest: Array
    ) -> tuple[Array, Array, Array]:
        low, high = np.flatnonzero(~failed[bit]), np.flatnonzero(failed[bit])
        out, back = chain[0] * probability[low], chain[1] * probability[high]
        mixed = probability.copy()
        mixed[low], mixed[high] = (probability[low] - out) + back, (probability[high] - back) + out
        share_back = np.where(mixed[low] > 0.0, back / mixed[low], 0.0)
        share_out = np.where(mixed[high] > 0.0, out / mixed[high], 0.0)
        distance = mean[:, high] - mean[:, low]
        square = distance[:, None] * distance[None, :]
        m, C = mean.copy(), P.copy()
        m[:, low], m[:, high] = mean[:, low] + share_back * distance, mean[:, high] - share_out * distance
        difference = P[:, :, high] - P[:, :, low]
        C[:, :, low] = (P[:, :, low] + share_back * difference) + share_back * (1.0 - share_back) * square
        prior = np.zeros_like(P[:, :, low])
        reset = [(self._first + a, a) for a, (owner, _) in enumerate(self.structure.actuated) if owner == bit]
        for e, a in reset:
            prior[e, e] = self.structure.actuated[a][1]
        widened = (P[:, :, low] + prior) - P[:, :, high]
        C[:, :, high] = (P[:, :, high] + share_out * widened) + share_out * (1.0 - share_out) * square
        for e, a in reset:
            m[e, low] = rest[a]
            C[e, :, low] = C[:, e, low] = 0.0
        return mixed, m, C

    def _measured(self, mean: Array, P: Array, failed: Mask, observed: Array) -> Array | None:
        s, modes = self.structure, self.structure.modes
        channels = len(s.channels)
        ends = np.cumsum([channels, channels, s.measured, s.measured, len(s.H_pattern)])
        kind, free, innovation, noise, values, _ = np.split(observed, ends)
        H = _rows(s.H_pattern, values, s.measured)
        total, begin = np.zeros(modes), 0
        for c, channel in enumerate(s.channels):
            rows = slice(begin, begin + channel.rows)
            begin += channel.rows
            bad = np.zeros(modes, bool) if channel.bit is None else failed[channel.bit]
            if kind[c] > 1.5:
                total += np.where(bad | (channel.bit is None), 0.0, self.constants["INVALID"])
            elif kind[c] > 0.5:
                log_failed = self._failed_density(mean, P, H[rows], innovation[rows], noise[rows], c, free[c])
                determinant, square = np.ones(modes), np.zeros(modes)
                for h, z, R in zip(H[rows], innovation[rows], noise[rows], strict=True):
                    column = _product([h], P)[0]
                    variance, residual = R + _product([h], column)[0], z - _product([h], mean)[0]
                    if not (variance > 0.0).all():
                        return None
                    determinant *= variance
                    square += residual * residual / variance
                    gain = np.where(bad, 0.0, column / variance)
                    mean += gain * residual
                    P -= gain[:, None] * column[None, :]
                healthy = -0.5 * (square + np.log(determinant) + channel.rows * math.log(2.0 * math.pi))
                total += np.where(bad, log_failed, healthy)
        return total

    def _failed_density(
        self, mean: Array, P: Array, H: Rows, innovation: Array, noise: Array, c: int, free: float
    ) -> Array:
        channel = self.structure.channels[c]
        width = channel.erratic_deviation**2
        S = _product(H, _product(H, P).transpose(1, 0, 2)).transpose(2, 0, 1) + np.diag(noise + width)
        z = innovation - _product(H, mean).T
        square = np.einsum("mr,mr->m", z, np.linalg.solve(S, z[:, :, None])[:, :, 0])
        square = np.minimum(square, self.constants["FARTHEST"])
        offset = channel.rows * math.log(2.0 * math.pi) + 2.0 * math.log(2.0)
        return np.asarray(np.logaddexp(-0.5 * (square + np.log(np.linalg.det(S)) + offset), free))

    def _merged(
        self, probability: Array, mean: Array, P: Array, failed: Mask, at: Array, observed: Array, evidence: float
    ) -> Array:
        s, n = self.structure, self.structure.states
        merged = mean @ probability
        mean = mean - merged[:, None]
        covariance = np.einsum("m,ijm->ij", probability, P + mean[:, None] * mean[None, :])
        reference = self.leaves["shift"](np.concatenate([at[: self.sizes["REFERENCE"]], merged]))
        failing = np.array([probability[each].sum() for each in failed])
        deviation, variance = np.zeros((2, len(s.actuated)))
        for a, (bit, _) in enumerate(s.actuated):
            e, weight = self._first + a, np.where(failed[bit], probability, 0.0) / failing[bit]
            centre = weight @ mean[e]
            variance[a] = weight @ (P[e, e] + (mean[e] - centre) ** 2)
            deviation[a] = centre + reference[len(reference) - len(s.actuated) + a]
        carried = observed[len(observed) - self.sizes["CARRIED"] :]
        parts = [probability, mean.ravel(), P[np.tril_indices(n)].ravel(), reference, carried]
        return np.concatenate([*parts, failing, deviation, variance, covariance.ravel(), [evidence]])


def _rows(pattern: Sequence[tuple[int, int]], values: Array, count: int) -> Rows:
    rows: Rows = [[] for _ in range(count)]
    for (i, j), value in zip(pattern, values, strict=True):
        rows[i].append((j, float(value)))
    return rows


def _product(rows: Rows, array: Array) -> Array:
    """Matrix times the first axis of an array; what is zero by structure takes no part, not even of an infinity."""
    found = np.zeros((len(rows), *array.shape[1:]))
    for i, row in enumerate(rows):
        for j, value in row:
            found[i] = found[i] + value * array[j]
    return found
