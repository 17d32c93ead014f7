"""The specification's attitude bank in plain NumPy, on `dense_bank`: quaternions scalar first, body to inertial."""

from dataclasses import dataclass, field

import numpy as np
from dense_bank import DenseChannel, Drive, Modes, Outcome, dense_step, normal, transition

from optsat.arrays import Array

BITS = ("gyro_x", "gyro_y", "gyro_z", "star", "thruster_x", "thruster_y", "thruster_z")


@dataclass
class Parameters:
    J: Array
    axes: int = 3
    T: float = 0.1
    gyro: float = 0.01
    star: Array = field(default_factory=lambda: 4e-7 * np.array([2.29, 1.95, 3.85]))
    Qw: float = 1e-6
    sensor: tuple[float, float] = (2e-4, 5e-3)
    thruster: tuple[float, float] = (1e-3, 1e-2)


def product(a: Array, b: Array) -> Array:
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def conjugate(q: Array) -> Array:
    return np.array([q[0], -q[1], -q[2], -q[3]])


def skew(v: Array) -> Array:
    return np.asarray(np.cross(np.eye(3), v))


def exponential(theta: Array) -> Array:
    angle = float(np.linalg.norm(theta))
    axis = theta / angle if angle > 0.0 else theta
    return np.array([np.cos(angle / 2.0), *(np.sin(angle / 2.0) * axis)])


def logarithm(q: Array) -> Array:
    q = q if q[0] >= 0.0 else -q
    sine = float(np.linalg.norm(q[1:]))
    return q[1:] * (2.0 if sine == 0.0 else 2.0 * np.arctan2(sine, q[0]) / sine)


def rates(q: Array, w: Array, torque: Array, J: Array) -> tuple[Array, Array]:
    turn = 0.5 * product(q, np.array([0.0, *w]))
    return turn, np.asarray(np.linalg.solve(J, torque - np.cross(w, J @ w)), np.float64)


def runge_kutta(q: Array, w: Array, torque: Array, J: Array, T: float) -> tuple[Array, Array]:
    a = rates(q, w, torque, J)
    b = rates(q + T / 2 * a[0], w + T / 2 * a[1], torque, J)
    c = rates(q + T / 2 * b[0], w + T / 2 * b[1], torque, J)
    d = rates(q + T * c[0], w + T * c[1], torque, J)
    q = q + T / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
    return np.asarray(q / np.linalg.norm(q)), np.asarray(w + T / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1]))


def over(chain: tuple[float, float], steps: float) -> tuple[float, float]:
    """Chances to fail and to recover over a number of steps: the power of the chain's matrix."""
    values, vectors = np.linalg.eig(np.array([[1.0 - chain[0], chain[0]], [chain[1], 1.0 - chain[1]]]))
    matrix = vectors @ np.diag(values**steps) @ np.linalg.inv(vectors)
    return max(float(matrix[0, 1]), 0.0), max(float(matrix[1, 0]), 0.0)


class DenseAttitude:
    """The bank from one sample to the next; `axes` 3 or 0 thruster axes, which may fail."""

    def __init__(self, p: Parameters, q: Array, w: Array, modes: Modes, command: Array) -> None:
        self.p, self.q, self.w, self.d, self.modes = p, q, w, np.zeros(p.axes), modes
        self.command = command
        self.gyro: list[float | None] = [None, None, None]
        self.star: Array | None = None
        self.dt = p.T

    def step(self, command: Array, gyro: Array, star: Array) -> Outcome:
        """One sample of each sensor; NaN in a gyro axis or in the star tracker is a missing one."""
        p, n, T = self.p, 6 + self.p.axes, self.dt
        chains = [over(each, T / p.T) for each in [p.sensor] * 4 + [p.thruster] * p.axes]
        torque = command + np.append(self.d, np.zeros(3 - p.axes))
        q, w = runge_kutta(self.q, self.w, torque, p.J, T)
        middle = (w + self.w) / 2
        A = np.zeros((n, n))
        A[:3, :3], A[:3, 3:6] = -skew(middle), np.eye(3)
        A[3:6, 3:6] = np.linalg.solve(p.J, skew(p.J @ middle) - skew(middle) @ p.J)
        A[3:6, 6:] = np.linalg.inv(p.J)[:, : p.axes]
        AT = A * T
        F = np.eye(n) + AT + AT @ AT / 2 + AT @ AT @ AT / 6
        Q = np.array([0.0] * 3 + [p.Qw * T / p.T] * 3 + [0.0] * p.axes)
        jump = command - self.command
        drives = [Drive(6 + i, 4 + i, 36.0, -self.d[i], jump[i], 0.01 * T / p.T) for i in range(p.axes)]
        found = dense_step(self.modes, transition(chains), F, Q, drives, self.channels(q, w, gyro, star))
        self.modes, self.command = found.modes, command
        self.q = product(q, exponential(found.merged[:3]))
        self.q = self.q / np.linalg.norm(self.q) * (1.0 if self.q[0] >= 0.0 else -1.0)
        self.w, self.d = w + found.merged[3:6], self.d + found.merged[6:]
        self.modes.m = self.modes.m - found.merged
        found.deviation = [(each + self.d[i] - found.merged[6 + i], v) for i, (each, v) in enumerate(found.deviation)]
        return found

    def channels(self, q: Array, w: Array, gyro: Array, star: Array) -> list[DenseChannel]:
        p, n = self.p, 6 + self.p.axes
        H = np.eye(n)
        found = []
        length = float(np.linalg.norm(star)) if np.isfinite(star).all() else np.nan
        kind = 0 if np.isnan(length) else 2 if abs(length - 1.0) > 0.1 else 1
        z, free = np.zeros(3), -np.inf
        if kind == 1:
            unit = star / length
            z = logarithm(product(conjugate(q), unit))
            if self.star is not None:
                change = product(conjugate(self.star), unit)
                change = 2.0 * change[1:] * (1.0 if change[0] >= 0.0 else -1.0)
                free = np.log(0.25) + sum(normal(each, 2e-6 * R) for each, R in zip(change, p.star, strict=True))
            self.star = unit
        found.append(DenseChannel(3, z, H[:3], p.star, free, 0.3, kind))
        last = self.gyro
        for i in range(3):
            missing = bool(np.isnan(gyro[i]))
            y, s2 = 0.0 if missing else gyro[i], (1e-3 * p.gyro) ** 2
            free = np.log(0.25) + normal(y, s2)
            before = last[i]
            if before is not None:
                free = np.logaddexp(free, np.log(0.25) + normal(y - before, 2.0 * s2))
            R = np.array([p.gyro**2])
            z = np.array([y - w[i]])
            found.append(DenseChannel(i, z, H[3 + i : 4 + i], R, free, 0.3, 0 if missing else 1))
        self.gyro = [b if np.isnan(a) else float(a) for a, b in zip(gyro, last, strict=True)]
        return found
