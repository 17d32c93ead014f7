"""Rigid body: rotational motion of one body under a torque."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.attitude import quaternion
from optsat.attitude.backend import Value, norm
from optsat.errors import InputError
from optsat.models.earth import GRAVITATIONAL_PARAMETER
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import rk4_step

EXAMPLE_INERTIA = ((80.0, 0.0, 0.0), (0.0, 80.0, 0.0), (0.0, 0.0, 4.0))
"""Inertia [kg m^2] of the satellite of the example scenario."""

_ROUNDING = 1e-9

_OMEGA = Port("omega_BN_B", (3,), "rad/s")
_TORQUE = Port("torque_B", (3,), "N m")


@dataclass(frozen=True, eq=False)
class RigidBody:
    """A body with inertia matrix `inertia_B` (3, 3) [kg m^2] about its centre of mass.

    Raises
    ------
    InputError : the inertia is not (3, 3), symmetric and positive definite, or no mass distribution can have it (one
        principal moment exceeds the sum of the two others).
    """

    inertia_B: Array | Sequence[Sequence[float]]

    def __post_init__(self) -> None:
        inertia = _physical_inertia(finite_array("inertia_B", self.inertia_B, (3, 3), "kg m^2"))
        inertia.setflags(write=False)
        object.__setattr__(self, "inertia_B", inertia)

    def omega_dot(self) -> GeneratedFunction:
        """Return Euler's equation, omega_dot = J^-1 (torque - omega x J omega) [rad/s^2]."""
        import casadi as ca

        omega, torque = ca.SX.sym("omega_BN_B", 3), ca.SX.sym("torque_B", 3)
        return generate(
            "omega_dot",
            inputs=[(_OMEGA, omega), (_TORQUE, torque)],
            outputs=[(Port("omega_dot_BN_B", (3,), "rad/s^2"), self._acceleration(omega, torque))],
        )

    def derivative(self) -> GeneratedFunction:
        """Return the rates of attitude and angular velocity: q_dot = 1/2 [omega; 0] (x) q, and Euler's equation."""
        import casadi as ca

        q, omega, torque = ca.SX.sym("q_BN", 4), ca.SX.sym("omega_BN_B", 3), ca.SX.sym("torque_B", 3)
        return generate(
            "rigid_body",
            inputs=[(QUATERNION, q), (_OMEGA, omega), (_TORQUE, torque)],
            outputs=[
                (Port("q_dot_BN", (4,), "1/s"), quaternion.derivative(q, omega)),
                (Port("omega_dot_BN_B", (3,), "rad/s^2"), self._acceleration(omega, torque)),
            ],
        )

    def step(self, substeps: int = 1) -> GeneratedFunction:
        """Return (q_BN, omega_BN_B) after `dt` under a torque held in B, by Runge-Kutta; |q| = 1 is restored."""
        return rk4_step(self.derivative(), ("q_BN", "omega_BN_B"), unit_length=("q_BN",), substeps=substeps)

    def gravity_gradient(self, gravitational_parameter: float = GRAVITATIONAL_PARAMETER) -> GeneratedFunction:
        """Return the gravity-gradient torque_B = 3 mu / r^5 r x (J r) [N m] as a function of q_BN and r_N [m].

        Source: Hughes, Spacecraft Attitude Dynamics, 8.1, to second order in body size over distance.
        """
        import casadi as ca

        check_scalar("gravitational_parameter", gravitational_parameter, "m^3/s^2", low=0.0, low_open=True)
        q, r_N = ca.SX.sym("q_BN", 4), ca.SX.sym("r_N", 3)
        distance = norm(r_N)
        up_B = quaternion.transform(q, r_N / distance)
        torque = 3 * gravitational_parameter / distance**3 * ca.cross(up_B, ca.DM(self.inertia_B) @ up_B)
        return generate(
            "gravity_gradient", inputs=[(QUATERNION, q), (Port("r_N", (3,), "m"), r_N)], outputs=[(_TORQUE, torque)]
        )

    def _acceleration(self, omega: Value, torque: Value) -> Value:
        import casadi as ca

        J = np.asarray(self.inertia_B)
        moments = np.diag(J)
        if np.array_equal(J, np.diag(moments)):
            # the cross product that CasADi cannot simplify: half the operations
            following, last = np.roll(moments, -1), np.roll(moments, 1)
            gyroscopic = [(following[i] - last[i]) / moments[i] * (omega[(i + 1) % 3] * omega[i - 1]) for i in range(3)]
            return torque / ca.DM(moments) + ca.vertcat(*gyroscopic)
        return ca.DM(np.linalg.inv(J)) @ (torque - ca.cross(omega, ca.DM(J) @ omega))


def _physical_inertia(inertia: Array) -> Array:
    size = float(np.abs(inertia).max())
    if np.abs(inertia - inertia.T).max() > _ROUNDING * size:
        raise InputError("`inertia_B` must be symmetric [kg m^2]; check signs and places of the products of inertia.")
    symmetric = np.asarray((inertia + inertia.T) / 2)
    low, middle, high = np.linalg.eigvalsh(symmetric)
    if low <= 0:
        raise InputError(f"`inertia_B` must be positive definite [kg m^2]; its least principal moment is {low:.6g}.")
    if high > (low + middle) * (1 + _ROUNDING):
        raise InputError(
            f"`inertia_B` belongs to no mass distribution: principal moment {high:.6g} exceeds the sum of the others, "
            f"{low:.6g} + {middle:.6g} [kg m^2]."
        )
    return symmetric
