"""A made-up flight: a smooth rate, its attitude integrated by SciPy, two direction sensors and a gyro with a bias."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from optsat.arrays import Array
from optsat.attitude import dcm
from optsat.records.record import Record, VectorChannel

R_SUN, R_MAG = np.array([1.0, 0.0, 0.0]), np.array([0.6, 0.0, 0.8])
EPS_SUN, EPS_MAG = np.deg2rad(0.05), np.deg2rad(1.0)


def rate(t: Array) -> Array:
    """Return a smooth rate of B relative to N in B (..., 3) [rad/s]."""
    return np.stack((0.02 * np.sin(0.3 * t), 0.03 + 0.01 * np.cos(0.2 * t), -0.02 * np.ones_like(t)), axis=-1)


def attitude(t: Array) -> Array:
    """Return the true attitudes (T, 4) from the identity, q_dot = 1/2 [omega; 0] (x) q."""

    def slope(now: float, q: Array) -> Array:
        w = rate(np.array(now))
        v, s = q[:3], q[3]
        return 0.5 * np.append(s * w - np.cross(w, v), -w @ v)

    found = solve_ivp(slope, (t[0], t[-1]), (0, 0, 0, 1), t_eval=t, rtol=1e-12, atol=1e-13, method="DOP853")
    return np.asarray(found.y.T / np.linalg.norm(found.y.T, axis=1, keepdims=True))


def channel(name: str, q_BN: Array, r_N: Array, eps: float, rng: np.random.Generator, **changes: Any) -> VectorChannel:
    """Return a sensor whose error is nearly its bound, in directions that change from sample to sample."""
    y = dcm.from_quaternion(q_BN) @ r_N
    across = np.cross(y, rng.standard_normal(y.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    fields: dict[str, Any] = {
        "b_B": np.cos(0.95 * eps) * y + np.sin(0.95 * eps) * across,
        "r_N": np.broadcast_to(r_N, y.shape),
        "angle_bound_rad": np.full(len(y), eps),
        "valid": np.ones(len(y), dtype=bool),
    }
    return VectorChannel(name, "B", **(fields | changes))


def flight(
    count: int = 30, dt: float = 1.0, bias: Array | None = None, gyro_bound: float = 1e-5, **changes: Any
) -> Record:
    """Return a record of `count` epochs with a sun sensor, a magnetometer and a gyro of constant bias."""
    rng = np.random.default_rng(0)
    t = dt * np.arange(float(count))
    q_BN = attitude(t)
    fields: dict[str, Any] = {
        "channels": (
            channel("sun", q_BN, R_SUN, EPS_SUN, rng),
            channel("mag", q_BN, R_MAG, EPS_MAG, rng),
        ),
        "omega_BN_B": rate(t) + (np.zeros(3) if bias is None else bias),
        "gyro_bound_rad_s": np.full(count, gyro_bound),
        "q_BN_true": q_BN,
    }
    return Record(t, **(fields | changes))
