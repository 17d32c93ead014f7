"""Gyro: a measured angular velocity whose error has a bounded length."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.models import draws
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate


@dataclass(frozen=True)
class Gyro:
    """Three-axis gyro, |measured - true rate| <= `rate_bound` [rad/s].

    Raises
    ------
    InputError : the bound is negative or not finite.
    """

    rate_bound: float

    def __post_init__(self) -> None:
        check_scalar("rate_bound", self.rate_bound, "rad/s", low=0.0)

    def measurement(self) -> GeneratedFunction:
        """Return the measured rate, omega_BN_B + error [rad/s]."""
        import casadi as ca

        omega, error = ca.SX.sym("omega_BN_B", 3), ca.SX.sym("error", 3)
        return generate(
            "gyro",
            inputs=[(Port("omega_BN_B", (3,), "rad/s"), omega), (Port("error", (3,), "rad/s"), error)],
            outputs=[(Port("omega_measured_B", (3,), "rad/s"), omega + error)],
        )

    def draw(
        self, rng: np.random.Generator, count: int, law: draws.BallLaw = "uniform", constant: bool = False
    ) -> Array:
        """Return errors (count, 3) [rad/s]: fresh for every sample, or one `constant` bias for all."""
        if constant:
            return np.repeat(draws.ball(rng, 1, self.rate_bound, law), count, axis=0)
        return draws.ball(rng, count, self.rate_bound, law)
