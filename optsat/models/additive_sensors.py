"""Additive sensors: what reads the truth plus Gaussian noise."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.attitude.backend import dot
from optsat.errors import InputError
from optsat.models.gaussian_errors import covariance, gaussian
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

_RATE = "rad/s"


@dataclass(frozen=True, eq=False)
class RateGyro:
    """Three-axis gyro: the rate plus a bias plus noise of covariance `R` (3, 3) [(rad/s)^2].

    bias : (3,) at t = 0 [rad/s]; bias_walk : its random walk, standard deviation after one second [rad/s]

    Raises
    ------
    InputError : R is not symmetric and positive definite, the bias not finite, the walk negative.
    Source: seed 000 eq. (9), which has no bias.
    """

    R: Array | Sequence[Sequence[float]] = field(default_factory=lambda: 1e-4 * np.eye(3))
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    bias_walk: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", covariance("R", self.R, 3, "(rad/s)^2"))
        finite_array("bias", self.bias, (3,), _RATE)
        check_scalar("bias_walk", self.bias_walk, _RATE, low=0.0)

    def measurement(self) -> GeneratedFunction:
        """Return gyro_omega_BN_B = omega_BN_B + bias + noise [rad/s]."""
        import casadi as ca

        omega, bias, noise = (ca.SX.sym(name, 3) for name in ("omega_BN_B", "bias", "noise"))
        ports = [Port(name, (3,), _RATE) for name in ("omega_BN_B", "bias", "noise")]
        return generate(
            "rate_gyro",
            inputs=list(zip(ports, (omega, bias, noise), strict=True)),
            outputs=[(Port("gyro_omega_BN_B", (3,), _RATE), omega + bias + noise)],
        )

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return noise (count, 3) [rad/s]."""
        return gaussian(rng, count, np.asarray(self.R))

    def draw_bias(self, rng: np.random.Generator, t: Array) -> Array:
        """Return the bias (T, 3) [rad/s] at increasing times t (T,) [s] from t = 0 on."""
        steps = rng.standard_normal((len(t), 3)) * np.sqrt(np.diff(t, prepend=0.0))[:, None]
        return np.asarray(np.array(self.bias) + self.bias_walk * np.cumsum(steps, axis=0))


@dataclass(frozen=True)
class SkewedGyro:
    """Redundant gyro about one axis of B, askew to the three others so that it stands in for any one of them.

    axis_B : (3,) of any length but zero; sigma : standard deviation of its noise [rad/s]

    Raises
    ------
    InputError : the axis is zero or not finite, or sigma is not > 0.
    """

    axis_B: tuple[float, float, float] = (1.0, 1.0, 1.0)
    sigma: float = 0.01

    def __post_init__(self) -> None:
        check_scalar("sigma", self.sigma, _RATE, low=0.0, low_open=True)
        axis = finite_array("axis_B", self.axis_B, (3,))
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            raise InputError("`axis_B` is the zero vector, which has no direction.")
        object.__setattr__(self, "axis_B", tuple((axis / length).tolist()))

    def measurement(self) -> GeneratedFunction:
        """Return skewed_gyro_rate = axis_B . omega_BN_B + noise [rad/s]."""
        import casadi as ca

        omega, noise = ca.SX.sym("omega_BN_B", 3), ca.SX.sym("noise")
        return generate(
            "skewed_gyro",
            inputs=[(Port("omega_BN_B", (3,), _RATE), omega), (Port("noise", (), _RATE), noise)],
            outputs=[(Port("skewed_gyro_rate", (), _RATE), dot(ca.DM(self.axis_B), omega) + noise)],
        )

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return noise (count,) [rad/s]."""
        return self.sigma * rng.standard_normal(count)


@dataclass(frozen=True, eq=False)
class PositionReceiver:
    """GPS receiver: the position plus noise of covariance `R` (3, 3) [m^2]; its components fail together.

    Raises
    ------
    InputError : R is not symmetric and positive definite.
    Source: seed 000 eq. (10).
    """

    R: Array | Sequence[Sequence[float]] = field(default_factory=lambda: 100.0 * np.eye(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", covariance("R", self.R, 3, "m^2"))

    def measurement(self) -> GeneratedFunction:
        """Return gps_r_N = r_N + noise [m]."""
        return _sum("gps", "r_N", "gps_r_N", "m")

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return noise (count, 3) [m]."""
        return gaussian(rng, count, np.asarray(self.R))


@dataclass(frozen=True)
class PressureSensor:
    """Chamber-pressure sensors that tell the torque of each axis of thrusters just before the sample.

    sigma : standard deviation of each torque [N m]

    Raises
    ------
    InputError : sigma is not > 0.
    """

    sigma: float = 0.5

    def __post_init__(self) -> None:
        check_scalar("sigma", self.sigma, "N m", low=0.0, low_open=True)

    def measurement(self) -> GeneratedFunction:
        """Return pressure_torque_B = torque_B + noise [N m]."""
        return _sum("pressure_sensor", "torque_B", "pressure_torque_B", "N m")

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return noise (count, 3) [N m]."""
        return self.sigma * rng.standard_normal((count, 3))


def _sum(name: str, truth: str, reading: str, unit: str) -> GeneratedFunction:
    import casadi as ca

    value, noise = ca.SX.sym(truth, 3), ca.SX.sym("noise", 3)
    return generate(
        name,
        inputs=[(Port(truth, (3,), unit), value), (Port("noise", (3,), unit), noise)],
        outputs=[(Port(reading, (3,), unit), value + noise)],
    )
