"""Attitude motion: the rates of a rigid body whose inertia is an argument, so that one function serves every body."""

from typing import Any

from optsat.attitude import quaternion
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import euler_step, rk4_step

STATES = ("q_BN", "omega_BN_B")


def attitude_derivative() -> GeneratedFunction:
    """Return the rates of q_BN and omega_BN_B under torque_B of a body of inertia_B.

    q_dot = 1/2 [omega; 0] (x) q, omega_dot = J^-1 (torque - omega x J omega)
    Source: seed 000 eqs. (5)-(7), whose S(q) omega = Omega(omega) q is twice this q_dot; see
    tests/papers/test_quaternion_border.py.
    """
    import casadi as ca

    q, omega, torque = ca.SX.sym("q_BN", 4), ca.SX.sym("omega_BN_B", 3), ca.SX.sym("torque_B", 3)
    J = ca.SX.sym("inertia_B", 3, 3)
    return generate(
        "attitude_motion",
        inputs=[
            (QUATERNION, q),
            (Port("omega_BN_B", (3,), "rad/s"), omega),
            (Port("torque_B", (3,), "N m"), torque),
            (Port("inertia_B", (3, 3), "kg m^2"), J),
        ],
        outputs=[
            (Port("q_dot_BN", (4,), "1/s"), quaternion.derivative(q, omega)),
            (Port("omega_dot_BN_B", (3,), "rad/s^2"), _solved(J, torque - ca.cross(omega, J @ omega))),
        ],
    )


def attitude_step() -> GeneratedFunction:
    """Return q_BN and omega_BN_B after dt under a torque held in B, by Runge-Kutta; |q| = 1 is restored."""
    return rk4_step(attitude_derivative(), STATES, unit_length=("q_BN",))


def attitude_euler_step(renormalise: bool = True) -> GeneratedFunction:
    """Return the same by Euler's forward step, the discretisation of the paper.

    renormalise : restore |q| = 1; without it every step lengthens q by sqrt(1 + (|omega| dt / 2)^2)
    Source: seed 000 eqs. (5)-(7) discretised.
    """
    return euler_step(attitude_derivative(), STATES, unit_length=("q_BN",) if renormalise else ())


def _solved(J: Any, moment: Any) -> Any:
    """Return J^-1 moment by Cramer's rule, as three volumes over a fourth: no pivoting, so no branch."""
    import casadi as ca

    a, b, c = J[:, 0], J[:, 1], J[:, 2]
    volumes = (ca.dot(moment, ca.cross(b, c)), ca.dot(a, ca.cross(moment, c)), ca.dot(a, ca.cross(b, moment)))
    return ca.vertcat(*volumes) / ca.dot(a, ca.cross(b, c))
