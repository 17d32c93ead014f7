"""Accelerometer: three axes that read total acceleration, as some papers have it, or specific force, as real ones do.

In free fall a real accelerometer reads about zero whether it works or is dead: a dead one shows by its vanished noise
or while something but gravity acts. The published results of the fault-diagnosis paper hold only for TOTAL.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.models.gaussian_errors import covariance, gaussian
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION
from optsat.symbolic.generated_function import GeneratedFunction, generate

_ACCELERATION = "m/s^2"


class Sensed(Enum):
    """What an accelerometer reads."""

    TOTAL = "total"
    """the acceleration r_dotdot, gravity included"""
    SPECIFIC_FORCE = "specific_force"
    """r_dotdot less gravity: all forces but gravity, per mass"""


class Axes(Enum):
    """Along which axes an accelerometer reads."""

    INERTIAL = "inertial"
    """N, as the equations of the paper have it"""
    BODY = "body"
    """B, as its text has it"""


@dataclass(frozen=True, eq=False)
class Accelerometer:
    """Accelerometer with Gaussian noise of covariance `R` (3, 3) [(m/s^2)^2].

    Raises
    ------
    InputError : R is not symmetric and positive definite.
    Source: seed 000 eq. (8); its text says body axes, its equations add the noise along N.
    """

    R: Array | Sequence[Sequence[float]] = field(default_factory=lambda: 1e-3 * np.eye(3))
    sensed: Sensed = Sensed.TOTAL
    axes: Axes = Axes.INERTIAL

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", covariance("R", self.R, 3, "(m/s^2)^2"))

    def measurement(self) -> GeneratedFunction:
        """Return the reading [m/s^2] as a function of q_BN, acceleration_N, gravity_N and noise along its axes."""
        import casadi as ca

        q = ca.SX.sym("q_BN", 4)
        acceleration, gravity, noise = (ca.SX.sym(name, 3) for name in ("acceleration_N", "gravity_N", "noise"))
        sensed = acceleration if self.sensed is Sensed.TOTAL else acceleration - gravity
        if self.axes is Axes.BODY:
            sensed = quaternion.transform(q, sensed)
        return generate(
            "accelerometer",
            inputs=[
                (QUATERNION, q),
                (Port("acceleration_N", (3,), _ACCELERATION), acceleration),
                (Port("gravity_N", (3,), _ACCELERATION), gravity),
                (Port("noise", (3,), _ACCELERATION), noise),
            ],
            outputs=[(Port("accelerometer", (3,), _ACCELERATION), sensed + noise)],
        )

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return noise (count, 3) [m/s^2]."""
        return gaussian(rng, count, np.asarray(self.R))
