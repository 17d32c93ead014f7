"""A bank of hypotheses in plain NumPy: every mode from every other one, M^2 of them, one step after another as written.

Independent of the package's bank: full transition matrix, full covariances, quaternions with the scalar first that map
body to inertial axes (Hamilton's product), as the specification has them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import logsumexp

from optsat.arrays import Array, Mask

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


def failed_in(count: int, bit: int | None) -> Mask:
    """Whether a fault is there, for each mode."""
    return np.asarray(np.arange(count) >> bit & 1 == 1) if bit is not None else np.zeros(count, dtype=bool)


def transition(chains: Sequence[tuple[float, float]]) -> Array:
    """Row i: probabilities to go from mode i to each other."""
    matrix: Array = np.ones((1, 1))
    for fail, recover in chains:
        matrix = np.asarray(np.kron(np.array([[1.0 - fail, fail], [recover, 1.0 - recover]]), matrix), np.float64)
    return matrix


def moved_to(modes: Modes, target: int, drives: Sequence[Drive]) -> tuple[Array, Array]:
    """Means and covariances of all modes as they are in a mode whose actuators are as in `target`."""
    m, P = modes.m.copy(), modes.P.copy()
    for drive in drives:
        before, after = failed_in(len(modes.mu), drive.bit), bool(target >> drive.bit & 1)
        if after:
            P[~before, drive.state, drive.state] += drive.variance
        else:
            m[before, drive.state] = drive.rest
            P[before, drive.state, :] = 0.0
            P[before, :, drive.state] = 0.0
    return m, P


def mix(modes: Modes, matrix: Array, drives: Sequence[Drive]) -> Modes:
    """The textbook mixing of an interacting multiple model estimator, from every mode to every mode."""
    count, n = modes.m.shape
    c = modes.mu @ matrix
    mixed = Modes(c, np.zeros((count, n)), np.zeros((count, n, n)))
    driven = sum({1 << drive.bit for drive in drives})
    for target in sorted({j & driven for j in range(count)}):
        m, P = moved_to(modes, target, drives)
        into = [j for j in range(count) if j & driven == target]
        share = (modes.mu[:, None] * matrix[:, into] / c[into]).T
        mixed.m[into] = share @ m
        apart = m - mixed.m[into][:, None]
        spread = (share[:, :, None] * apart).transpose(0, 2, 1) @ apart
        mixed.P[into] = np.tensordot(share, P, 1) + spread
    return mixed


def dense_step(
    modes: Modes, matrix: Array, F: Array, Q: Array, drives: Sequence[Drive], channels: Sequence[DenseChannel]
) -> Outcome:
    """Command step, mixing, prediction, samples, posterior, merge."""
    count = len(modes.mu)
    for drive in drives:
        failed = failed_in(count, drive.bit)
        modes.m[failed, drive.state] -= drive.jump / 2.0
        modes.P[failed, drive.state, drive.state] += drive.jump**2 / 12.0
    mixed = mix(modes, matrix, drives)
    m, P = mixed.m @ F.T, F @ mixed.P @ F.T + np.diag(Q)
    for drive in drives:
        P[failed_in(count, drive.bit), drive.state, drive.state] += drive.noise
    densities = []
    for channel in channels:
        m, P, density = measured(m, P, channel, failed_in(count, channel.bit))
        densities.append(density)
    logs = np.log(mixed.mu) + sum(densities)
    evidence = float(logsumexp(logs))
    mu = np.maximum(np.exp(logs - evidence), FLOOR)
    after = Modes(mu / mu.sum(), m, P)
    merged = after.mu @ m
    apart = m - merged
    covariance = np.tensordot(after.mu, P, 1) + (after.mu[:, None] * apart).T @ apart
    faults = np.array([after.mu[failed_in(count, bit)].sum() for bit in range(int(np.log2(count)))])
    found = Outcome(after, mixed, mixed.mu, merged, covariance, evidence, faults, densities=densities)
    for drive in drives:
        chosen = failed_in(count, drive.bit)
        share, values = after.mu[chosen] / after.mu[chosen].sum(), m[chosen, drive.state]
        mean = float(share @ values)
        variance = float(share @ (P[chosen, drive.state, drive.state] + (values - mean) ** 2))
        found.deviation.append((mean, variance))
    return found


def measured(m: Array, P: Array, channel: DenseChannel, failed: Mask) -> tuple[Array, Array, Array]:
    """All modes after a channel's sample, taken as a whole, and the log density of the sample in each."""
    if channel.kind == 0:
        return m, P, np.zeros(len(m))
    if channel.kind == 2:
        return m, P, np.where(failed | (channel.bit is None), 0.0, -1000.0)
    nu = channel.z - m @ channel.H.T
    S = channel.H @ P @ channel.H.T + np.diag(channel.R)
    wide = S + channel.B**2 * np.eye(len(channel.z))
    erratic = np.log(0.5) - 0.5 * (np.minimum(distance(nu, wide), 36.0) + np.log(np.linalg.det(2.0 * np.pi * wide)))
    healthy = -0.5 * (distance(nu, S) + np.log(np.linalg.det(2.0 * np.pi * S)))
    K = P @ channel.H.T @ np.linalg.inv(S)
    left = np.eye(m.shape[1]) - K @ channel.H
    updated = left @ P @ left.transpose(0, 2, 1) + K @ np.diag(channel.R) @ K.transpose(0, 2, 1)
    moved = m + np.einsum("mij,mj->mi", K, nu)
    density = np.where(failed, np.logaddexp(channel.free, erratic), healthy)
    return np.where(failed[:, None], m, moved), np.where(failed[:, None, None], P, updated), density


def distance(nu: Array, S: Array) -> Array:
    """Squared distance in deviations, for each mode."""
    return np.asarray(np.einsum("mi,mij,mj->m", nu, np.linalg.inv(S), nu))


def normal(y: float, variance: float) -> float:
    """Log density of N(y; 0, variance)."""
    return float(-0.5 * (y * y / variance + np.log(2.0 * np.pi * variance)))
