"""A bank of hypotheses in plain NumPy: every mode from every other one, M^2 of them, one step after another as written.

Independent of the package's bank: full transition matrix, full covariances, quaternions with the scalar first that map
body to inertial axes (Hamilton's product), as the specification has them.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import logsumexp

from optsat.arrays import Array

FLOOR = 1e-60


@dataclass
class Modes:
    """mu (M,), m (M, n), P (M, n, n)."""

    mu: Array
    m: Array
    P: Array


@dataclass
class DenseChannel:
    """z, H, R of a channel's rows; free: log density of a failed one without the state; kind as in the package."""

    bit: int | None
    z: Array
    H: Array
    R: Array
    free: float
    B: float
    kind: int = 1


@dataclass
class Drive:
    """A state that an actuator drives, its bit, the variance when it fails and what it is where the axis is healthy."""

    state: int
    bit: int
    variance: float
    rest: float
    jump: float = 0.0
    noise: float = 0.0


@dataclass
class Outcome:
    modes: Modes
    mixed: Modes
    c: Array
    merged: Array
    covariance: Array
    evidence: float
    faults: Array
    deviation: list[tuple[float, float]] = field(default_factory=list)
    densities: list[Array] = field(default_factory=list)


def bit_of(mode: int, bit: int) -> int:
    return mode >> bit & 1


def transition(chains: Sequence[tuple[float, float]]) -> Array:
    """Row i: probabilities to go from mode i to each other."""
    modes = range(1 << len(chains))
    matrix = np.ones((len(modes), len(modes)))
    for i, j in itertools.product(modes, modes):
        for bit, (fail, recover) in enumerate(chains):
            failed, fails = bit_of(i, bit), bit_of(j, bit)
            stay = 1.0 - (recover if failed else fail)
            matrix[i, j] *= stay if failed == fails else 1.0 - stay
    return matrix


def moved_to(modes: Modes, target: int, drives: Sequence[Drive]) -> tuple[Array, Array]:
    """Means and covariances of all modes as they are in a mode whose actuators are as in `target`."""
    m, P = modes.m.copy(), modes.P.copy()
    for i in range(len(modes.mu)):
        for drive in drives:
            before, after = bit_of(i, drive.bit), bit_of(target, drive.bit)
            if not before and after:
                P[i, drive.state, drive.state] += drive.variance
            if before and not after:
                m[i, drive.state] = drive.rest
                P[i, drive.state, :] = P[i, :, drive.state] = 0.0
    return m, P


def mix(modes: Modes, matrix: Array, drives: Sequence[Drive]) -> Modes:
    """The textbook mixing of an interacting multiple model estimator, from every mode to every mode."""
    count, n = modes.m.shape
    c = modes.mu @ matrix
    mixed = Modes(c, np.zeros((count, n)), np.zeros((count, n, n)))
    driven = sum({1 << drive.bit for drive in drives})
    for target in sorted({j & driven for j in range(count)}):
        m, P = moved_to(modes, target, drives)
        for j in (j for j in range(count) if j & driven == target):
            share = modes.mu * matrix[:, j] / c[j]
            mixed.m[j] = share @ m
            apart = m - mixed.m[j]
            mixed.P[j] = np.tensordot(share, P, 1) + (share[:, None] * apart).T @ apart
    return mixed


def dense_step(
    modes: Modes, matrix: Array, F: Array, Q: Array, drives: Sequence[Drive], channels: Sequence[DenseChannel]
) -> Outcome:
    """Command step, mixing, prediction, samples, posterior, merge."""
    count, n = modes.m.shape
    for j, drive in itertools.product(range(count), drives):
        if bit_of(j, drive.bit):
            modes.m[j, drive.state] -= drive.jump / 2.0
            modes.P[j, drive.state, drive.state] += drive.jump**2 / 12.0
    mixed = mix(modes, matrix, drives)
    logs, densities = np.zeros(count), [np.zeros(count) for _ in channels]
    after = Modes(mixed.mu.copy(), np.zeros((count, n)), np.zeros((count, n, n)))
    for j in range(count):
        m, P = F @ mixed.m[j], F @ mixed.P[j] @ F.T + np.diag(Q)
        for drive in drives:
            P[drive.state, drive.state] += drive.noise if bit_of(j, drive.bit) else 0.0
        for k, channel in enumerate(channels):
            m, P, densities[k][j] = measured(m, P, channel, channel.bit is not None and bool(bit_of(j, channel.bit)))
        after.m[j], after.P[j] = m, P
        logs[j] = np.log(mixed.mu[j]) + sum(density[j] for density in densities)
    evidence = float(logsumexp(logs))
    mu = np.maximum(np.exp(logs - evidence), FLOOR)
    after.mu = mu / mu.sum()
    merged = after.mu @ after.m
    apart = after.m - merged
    covariance = np.tensordot(after.mu, after.P, 1) + (after.mu[:, None] * apart).T @ apart
    bits = int(np.log2(count))
    faults = np.array([sum(after.mu[j] for j in range(count) if bit_of(j, bit)) for bit in range(bits)])
    found = Outcome(after, mixed, mixed.mu, merged, covariance, evidence, faults, densities=densities)
    for drive in drives:
        chosen = [j for j in range(count) if bit_of(j, drive.bit)]
        share = after.mu[chosen] / after.mu[chosen].sum()
        values = after.m[chosen, drive.state]
        mean = float(share @ values)
        variance = float(share @ (after.P[chosen, drive.state, drive.state] + (values - mean) ** 2))
        found.deviation.append((mean, variance))
    return found


def measured(m: Array, P: Array, channel: DenseChannel, failed: bool) -> tuple[Array, Array, float]:
    """State after a channel's sample, and the log density of the sample."""
    if channel.kind == 0 or (channel.kind == 2 and channel.bit is None):
        return m, P, 0.0
    if channel.kind == 2:
        return m, P, 0.0 if failed else -1000.0
    rows = len(channel.z)
    nu = channel.z - channel.H @ m
    S = channel.H @ P @ channel.H.T + np.diag(channel.R)
    if failed:
        wide = S + channel.B**2 * np.eye(rows)
        square = min(float(nu @ np.linalg.inv(wide) @ nu), 36.0)
        erratic = np.log(0.5) - 0.5 * (square + np.log(np.linalg.det(2.0 * np.pi * wide)))
        return m, P, float(np.logaddexp(channel.free, erratic))
    density = -0.5 * (nu @ np.linalg.inv(S) @ nu + np.log(np.linalg.det(2.0 * np.pi * S)))
    K = P @ channel.H.T @ np.linalg.inv(S)
    left = np.eye(len(m)) - K @ channel.H
    return m + K @ nu, left @ P @ left.T + K @ np.diag(channel.R) @ K.T, float(density)


def normal(y: float, variance: float) -> float:
    """Log density of N(y; 0, variance)."""
    return float(-0.5 * (y * y / variance + np.log(2.0 * np.pi * variance)))
