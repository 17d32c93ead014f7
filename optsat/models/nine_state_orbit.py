"""Nine-state orbit: position, velocity and acceleration as states, which lets noise add forces that nobody modelled."""

from optsat.models.earth import GRAVITATIONAL_PARAMETER
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import euler_step, rk4_step

STATES = ("r_N", "v_N", "a_N")


def nine_state_derivative(gravitational_parameter: float = GRAVITATIONAL_PARAMETER) -> GeneratedFunction:
    """Return the rates of r_N, v_N and a_N: r_dot = v, v_dot = a, a_dot = -mu v / |r|^3 + 3 mu (r.v) r / |r|^5.

    a_dot is the rate of -mu r / |r|^3 along the motion; in its last term stands the range rate r.v / |r|, not |v|.

    Raises
    ------
    InputError : mu is not finite and > 0.
    Source: seed 000 eqs. (1)-(3).
    """
    import casadi as ca

    check_scalar("gravitational_parameter", gravitational_parameter, "m^3/s^2", low=0.0, low_open=True)
    r, v, a = (ca.SX.sym(name, 3) for name in STATES)
    distance = ca.norm_2(r)
    jerk = gravitational_parameter * (3 * ca.dot(r, v) * r / distance**5 - v / distance**3)
    units = ("m", "m/s", "m/s^2", "m/s^3")
    return generate(
        "nine_state_orbit",
        inputs=[(Port(name, (3,), unit), x) for name, unit, x in zip(STATES, units[:3], (r, v, a), strict=True)],
        outputs=[
            (Port(f"{name[0]}_dot_N", (3,), unit), rate)
            for name, unit, rate in zip(STATES, units[1:], (v, a, jerk), strict=True)
        ],
    )


def nine_state_euler_step(gravitational_parameter: float = GRAVITATIONAL_PARAMETER) -> GeneratedFunction:
    """Return r_N, v_N and a_N after dt by Euler's forward step, the discretisation of the paper."""
    return euler_step(nine_state_derivative(gravitational_parameter), STATES)


def nine_state_step(gravitational_parameter: float = GRAVITATIONAL_PARAMETER) -> GeneratedFunction:
    """Return the same by Runge-Kutta."""
    return rk4_step(nine_state_derivative(gravitational_parameter), STATES)
