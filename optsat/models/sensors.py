"""Vector sensors: a measured direction whose error is bounded in a stated way.

Each kind of error is a frozen class with the same three members: `angle_bound`, the angle [rad] that no admissible
error exceeds; `measurement()`, b_B as a function of attitude, reference vector and error; `draw`, admissible errors.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.attitude import quaternion
from optsat.attitude.backend import Value, components, norm
from optsat.errors import InputError
from optsat.models import draws
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate


class VectorSensor(Protocol):
    """What every vector sensor offers."""

    @property
    def angle_bound(self) -> float:
        """Largest angle between measured and true direction [rad]."""
        ...

    def measurement(self) -> GeneratedFunction:
        """Return b_B, a unit vector, as a function of q_BN, r_N (any length and unit) and the error."""
        ...

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return admissible errors (count, k)."""
        ...


@dataclass(frozen=True)
class ConeSensor:
    """Measured direction within `half_angle` [rad] of the true one; the error is (angle, azimuth) [rad].

    Raises
    ------
    InputError : the half angle is not in [0, pi).
    """

    half_angle: float

    def __post_init__(self) -> None:
        check_scalar("half_angle", self.half_angle, "rad", low=0.0, high=math.pi, high_open=True)

    @property
    def angle_bound(self) -> float:
        """Largest angle between measured and true direction [rad]."""
        return self.half_angle

    def measurement(self) -> GeneratedFunction:
        """Return b_B turned off the true direction by `angle` towards `azimuth`."""
        import casadi as ca

        q, r_N, error = ca.SX.sym("q_BN", 4), ca.SX.sym("r_N", 3), ca.SX.sym("error", 2)
        y = quaternion.transform(q, r_N / norm(r_N))
        e1, e2 = _across(y)
        angle, azimuth = components(error)
        b = ca.cos(angle) * y + ca.sin(angle) * (ca.cos(azimuth) * e1 + ca.sin(azimuth) * e2)
        return _measurement("cone_sensor", q, r_N, Port("error", (2,), "rad"), error, b)

    def draw(self, rng: np.random.Generator, count: int, law: draws.ConeLaw = "cap") -> Array:
        """Return errors (count, 2), azimuth uniform; laws as in `draws.cone_angles`."""
        angle = draws.cone_angles(rng, count, self.half_angle, law)
        return np.stack((angle, rng.uniform(-math.pi, math.pi, count)), axis=-1)


@dataclass(frozen=True, eq=False)
class BoxSensor:
    """Each component of the measured unit vector is off by at most `half_width` (3,) [-] before scaling to length 1.

    Raises
    ------
    InputError : a half width is negative, or the corner is not shorter than 1, so that no angle is certain.
    """

    half_width: Array | Sequence[float]

    def __post_init__(self) -> None:
        half_width = finite_array("half_width", self.half_width, (3,))
        if np.any(half_width < 0) or float(np.linalg.norm(half_width)) >= 1:
            raise InputError(f"`half_width` must be >= 0 with a corner shorter than 1 [-], got {half_width.tolist()}.")
        half_width.setflags(write=False)
        object.__setattr__(self, "half_width", half_width)

    @property
    def angle_bound(self) -> float:
        """Largest angle between measured and true direction [rad]: asin of the corner's length."""
        return math.asin(float(np.linalg.norm(self.half_width)))

    def measurement(self) -> GeneratedFunction:
        """Return b_B = unit(A(q) r + error)."""
        import casadi as ca

        q, r_N, error = ca.SX.sym("q_BN", 4), ca.SX.sym("r_N", 3), ca.SX.sym("error", 3)
        y = quaternion.transform(q, r_N / norm(r_N))
        return _measurement("box_sensor", q, r_N, Port("error", (3,), "-"), error, y + error)

    def draw(self, rng: np.random.Generator, count: int, law: draws.BallLaw = "uniform") -> Array:
        """Return errors (count, 3), uniform in the box or at its corners."""
        return draws.box(rng, count, np.asarray(self.half_width), law)


@dataclass(frozen=True)
class MisalignedSensor:
    """A misalignment of up to `misalignment_bound` [rad], then a bias on the unit vector of up to `bias_bound` [-].

    The error is (bias, rotation vector of the misalignment). Both are constants of a sensor: repeat one row over a run.

    Raises
    ------
    InputError : the bias is not below 1, or the misalignment is above pi / 2.
    """

    bias_bound: float
    misalignment_bound: float

    def __post_init__(self) -> None:
        check_scalar("bias_bound", self.bias_bound, "-", low=0.0, high=1.0, high_open=True)
        check_scalar("misalignment_bound", self.misalignment_bound, "rad", low=0.0, high=math.pi / 2)

    @property
    def angle_bound(self) -> float:
        """Largest angle between measured and true direction [rad]."""
        return self.misalignment_bound + math.asin(self.bias_bound)

    def measurement(self) -> GeneratedFunction:
        """Return b_B = unit(A(misalignment) A(q) r + bias)."""
        import casadi as ca

        q, r_N, error = ca.SX.sym("q_BN", 4), ca.SX.sym("r_N", 3), ca.SX.sym("error", 6)
        y = quaternion.transform(q, r_N / norm(r_N))
        turned = quaternion.transform(quaternion.exponential(error[3:]), y)
        return _measurement("misaligned_sensor", q, r_N, Port("error", (6,), "-, rad"), error, turned + error[:3])

    def draw(self, rng: np.random.Generator, count: int, law: draws.BallLaw = "uniform") -> Array:
        """Return errors (count, 6), each part uniform in its ball or on its boundary."""
        bias = draws.ball(rng, count, self.bias_bound, law)
        return np.concatenate((bias, draws.ball(rng, count, self.misalignment_bound, law)), axis=-1)


def _across(y: Value) -> tuple[Value, Value]:
    """Return two unit vectors that complete y to a right-handed basis, with one switch, at y_z = 0.

    Source: Duff et al., Building an orthonormal basis, revisited, J. Computer Graphics Techniques 6 (2017).
    """
    import casadi as ca

    y1, y2, y3 = components(y)
    sign = ca.if_else(y3 < 0, -1.0, 1.0)
    a = -1 / (sign + y3)
    b = y1 * y2 * a
    return ca.vertcat(1 + sign * y1 * y1 * a, sign * b, -sign * y1), ca.vertcat(b, sign + y2 * y2 * a, -y2)


def _measurement(name: str, q: Value, r_N: Value, port: Port, error: Value, vector: Value) -> GeneratedFunction:
    return generate(
        name,
        inputs=[(Port("q_BN", (4,), "-"), q), (Port("r_N", (3,), "any"), r_N), (port, error)],
        outputs=[(Port("b_B", (3,), "-"), vector / norm(vector))],
    )
