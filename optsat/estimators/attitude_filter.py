"""Attitude filter: quaternion and angular velocity of a rigid body, measured by star tracker and gyro."""

from collections.abc import Sequence
from typing import Literal

from optsat.arrays import Array
from optsat.estimators.extended import extended_step
from optsat.estimators.filter_model import FilterModel
from optsat.estimators.unscented import SigmaPoints, unscented_step
from optsat.models.rigid_body import EXAMPLE_INERTIA, RigidBody
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION
from optsat.symbolic.generated_function import GeneratedFunction, generate


def attitude_filter_model(inertia_B: Array | Sequence[Sequence[float]] = EXAMPLE_INERTIA) -> FilterModel:
    """Return x = (q_BN, omega_BN_B), moved by torque_B over dt in one Runge-Kutta step, and z = both measured.

    The measured quaternion may have either sign; that of the state is kept continuous, so w may be negative.
    inertia_B : (3, 3) [kg m^2]

    Raises
    ------
    InputError : no body has this inertia.
    """
    import casadi as ca

    q, omega = ca.SX.sym("q_BN", 4), ca.SX.sym("omega_BN_B", 3)
    rate = Port("omega_BN_B", (3,), "rad/s")
    measurement = generate(
        "star_tracker_and_gyro",
        inputs=[(QUATERNION, q), (rate, omega)],
        outputs=[(Port("q_measured_BN", (4,), "-"), q), (Port("omega_measured_B", (3,), "rad/s"), omega)],
    )
    return FilterModel(
        transition=RigidBody(inertia_B).step(),
        measurement=measurement,
        states=("q_BN", "omega_BN_B"),
        unit_length=("q_BN",),
        sign_free=("q_measured_BN",),
    )


def extended_filter_7(
    inertia_B: Array | Sequence[Sequence[float]] = EXAMPLE_INERTIA,
    form: Literal["joseph", "symmetric"] = "joseph",
    rounding: float = 2.0**-52,
) -> GeneratedFunction:
    """Return `extended_filter_7`: one step of the extended Kalman filter of this model, noise variances as columns.

    inertia_B : inertia matrix (3, 3) about the centre of mass [kg m^2]
    form : of the covariance update, "joseph" or "symmetric"
    rounding : spacing at 1 of the numbers it runs in
    """
    model = attitude_filter_model(inertia_B)
    return extended_step(model, "extended_filter_7", form, noise="diagonal", rounding=rounding)


def unscented_filter_7(
    inertia_B: Array | Sequence[Sequence[float]] = EXAMPLE_INERTIA,
    alpha: float = 1.0,
    beta: float = 2.0,
    kappa: float = 0.0,
    rounding: float = 2.0**-52,
) -> GeneratedFunction:
    """Return `unscented_filter_7`: one step of the unscented Kalman filter of this model, noise variances as columns.

    inertia_B : inertia matrix (3, 3) about the centre of mass [kg m^2]
    alpha : spread of the sigma points
    beta : knowledge of the distribution, 2 for a Gaussian
    kappa : second spread of the sigma points
    rounding : spacing at 1 of the numbers it runs in
    """
    model = attitude_filter_model(inertia_B)
    return unscented_step(
        model, "unscented_filter_7", SigmaPoints(alpha, beta, kappa), noise="diagonal", rounding=rounding
    )
