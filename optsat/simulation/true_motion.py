"""True motion: the attitude of a rigid body in orbit under the gravity-gradient torque, on a uniform time grid."""

import math

import numpy as np

from optsat.arrays import Array
from optsat.models.orbit import CircularOrbit
from optsat.models.rigid_body import RigidBody
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import rk4_step

LONGEST_STEP_S = 1.0
"""Orbital motion turns a body by a milliradian a second; one such step of order four errs by less than 1e-15 rad."""


def true_motion(
    body: RigidBody,
    orbit: CircularOrbit,
    q_BN: Array,
    omega_BN_B: Array,
    dt: float,
    count: int,
    longest_step: float = LONGEST_STEP_S,
) -> tuple[Array, Array]:
    """Return q_BN (count, 4) and omega_BN_B (count, 3) [rad/s] at t = 0, dt, 2 dt, ...

    q_BN (4,), omega_BN_B (3,) : at t = 0; longest_step : of the integration [s]
    """
    substeps = max(1, math.ceil(dt / longest_step))
    step = rk4_step(rates(body, orbit), ("q_BN", "omega_BN_B"), time="t", unit_length=("q_BN",))
    steps = (count - 1) * substeps
    if steps == 0:
        return q_BN[None], omega_BN_B[None]
    h = dt / substeps
    # the whole run is one call; stepping from Python would cost 60 us a step
    run = step.casadi.mapaccum("true_motion", steps, [0, 1], [0, 1])
    columns = run.call([q_BN, omega_BN_B, np.arange(steps)[None] * h, np.full((1, steps), h)])
    q, omega = (
        np.concatenate((start[None], port.from_columns(column.full())))[::substeps]
        for start, port, column in zip((q_BN, omega_BN_B), step.outputs, columns, strict=True)
    )
    return q, omega


def rates(body: RigidBody, orbit: CircularOrbit) -> GeneratedFunction:
    """Return the rates of q_BN and omega_BN_B under the gravity gradient as a function of both and t [s]."""
    import casadi as ca

    q, omega, t = ca.SX.sym("q_BN", 4), ca.SX.sym("omega_BN_B", 3), ca.SX.sym("t")
    r_N, _ = orbit.motion()(t)
    q_dot, omega_dot = body.derivative()(q, omega, body.gravity_gradient()(q, r_N))
    return generate(
        "motion_in_orbit",
        inputs=[(Port("q_BN", (4,), "-"), q), (Port("omega_BN_B", (3,), "rad/s"), omega), (Port("t", (), "s"), t)],
        outputs=[(Port("q_dot_BN", (4,), "1/s"), q_dot), (Port("omega_dot_BN_B", (3,), "rad/s^2"), omega_dot)],
    )
