"""Star tracker: a measured attitude whose noise is a small rotation in the body, not an addition to the quaternion."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.backend import norm
from optsat.models.gaussian_errors import covariance, gaussian
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION
from optsat.symbolic.generated_function import GeneratedFunction, generate


@dataclass(frozen=True, eq=False)
class StarTracker:
    """Star tracker that reads unit(1 + noise) (x) q_BN; `R` (4, 4) is the covariance of the noise, scalar last [-].

    Raises
    ------
    InputError : R is not symmetric and positive definite.
    Source: seed 000 eq. (11), y = q (x) nu with scalar first, body to inertial, Hamilton's product. Those four numbers
    are q_BN scalar last, and the product runs the other way here; see tests/papers/test_quaternion_border.py.
    """

    R: Array | Sequence[Sequence[float]] = field(default_factory=lambda: 1e-7 * np.diag([2.29, 1.95, 3.85, 1.98]))

    def __post_init__(self) -> None:
        object.__setattr__(self, "R", covariance("R", self.R, 4, "-"))

    @property
    def rotation_covariance(self) -> Array:
        """Covariance (3, 3) of the rotation vector from the true to the measured B [rad^2], to first order: the noise
        of the vector part counts twice.
        """
        return np.asarray(4 * np.asarray(self.R)[:3, :3])

    def measurement(self) -> GeneratedFunction:
        """Return star_q_BN, the measured attitude with w >= 0, as a function of q_BN and noise (4,)."""
        import casadi as ca

        q, noise = ca.SX.sym("q_BN", 4), ca.SX.sym("noise", 4)
        turn = noise + ca.DM(quaternion.identity())
        measured = quaternion.canonical(quaternion.compose(turn / norm(turn), q))
        return generate(
            "star_tracker",
            inputs=[(QUATERNION, q), (Port("noise", (4,), "-"), noise)],
            outputs=[(Port("star_q_BN", (4,), "-"), measured)],
        )

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return noise (count, 4) [-], scalar last."""
        return gaussian(rng, count, np.asarray(self.R))
