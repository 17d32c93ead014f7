"""Gravity: the field of a point mass or of the oblate Earth, and motion in it under a further force."""

from optsat.attitude.backend import norm
from optsat.models.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER
from optsat.models.orbit import two_body_derivative
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

EARTH_J2 = 1.08262668e-3
"""Second zonal harmonic of the Earth [-], EGM 96."""


def gravity(gravitational_parameter: float = GRAVITATIONAL_PARAMETER, j2: float = 0.0) -> GeneratedFunction:
    """Return gravity_N [m/s^2] as a function of r_N [m], the poles along z of N.

    j2 : second zonal harmonic, about the equatorial radius of the Earth; 0 = point mass

    Raises
    ------
    InputError : a parameter is not finite, or mu not > 0.
    Source: Vallado, Fundamentals of Astrodynamics and Applications, 8.7.1.
    """
    import casadi as ca

    check_scalar("j2", j2, "-")
    derivative = two_body_derivative(gravitational_parameter)
    r_N = ca.SX.sym("r_N", 3)
    _, acceleration = derivative(r_N, ca.SX.zeros(3))
    if j2:
        distance = norm(r_N)
        polar = (r_N[2] / distance) ** 2
        strength = -1.5 * j2 * gravitational_parameter * EQUATORIAL_RADIUS**2 / distance**5
        acceleration += strength * r_N * ca.vertcat(1 - 5 * polar, 1 - 5 * polar, 3 - 5 * polar)
    return generate(
        "gravity",
        inputs=[(Port("r_N", (3,), "m"), r_N)],
        outputs=[(Port("gravity_N", (3,), "m/s^2"), acceleration)],
    )


def translation_derivative(field: GeneratedFunction) -> GeneratedFunction:
    """Return the rates of r_N and v_N in a field of gravity under specific_force_N [m/s^2], all forces but gravity."""
    import casadi as ca

    r_N, v_N, force = ca.SX.sym("r_N", 3), ca.SX.sym("v_N", 3), ca.SX.sym("specific_force_N", 3)
    return generate(
        "translation",
        inputs=[
            (Port("r_N", (3,), "m"), r_N),
            (Port("v_N", (3,), "m/s"), v_N),
            (Port("specific_force_N", (3,), "m/s^2"), force),
        ],
        outputs=[(Port("r_dot_N", (3,), "m/s"), v_N), (Port("v_dot_N", (3,), "m/s^2"), field(r_N) + force)],
    )
