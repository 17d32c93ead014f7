"""Integration in fixed steps: order of the methods, geometry, the symbolic step, bits of the twins, where it stops."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from kernel_source_harness import assert_twin_agrees, compiled

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.kernels.integrate import Method, integrate, step
from optsat.kernels.status import Status
from optsat.models.rigid_body import RigidBody
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import rk4_step

BODY = RigidBody(np.diag([10.0, 12.0, 7.0]))
STATES = ("q_BN", "omega_BN_B")


def pendulum() -> GeneratedFunction:
    """A driven pendulum, with an input and with time."""
    angle, rate, torque, t = (ca.SX.sym(name) for name in ("angle", "rate", "torque", "t"))
    slope = ca.vertcat(rate, torque - ca.sin(angle) - 0.1 * rate * t)
    return generate(
        "pendulum",
        inputs=[
            (Port("torque", (), "N m"), torque),
            (Port("angle", (), "rad"), angle),
            (Port("rate", (), "rad/s"), rate),
            (Port("t", (), "s"), t),
        ],
        outputs=[(Port("angle_rate", (), "rad/s"), slope[0]), (Port("rate_rate", (), "rad/s^2"), slope[1])],
    )


def attitude_rate() -> GeneratedFunction:
    """Displacement rate of (q, omega): angular velocity and angular acceleration."""
    derivative = BODY.derivative()
    q, omega, torque = derivative.symbols()
    acceleration = derivative.casadi.call([q, omega, torque])[1]
    ports = derivative.inputs
    return generate(
        "attitude",
        inputs=[(ports[0], q), (ports[1], omega), (ports[2], torque)],
        outputs=[(Port("turn_rate", (3,), "rad/s"), omega), (Port("omega_dot", (3,), "rad/s^2"), acceleration)],
    )


def turned() -> GeneratedFunction:
    """(q, omega) displaced by a rotation vector in B and a change of rate."""
    q, omega, by = ca.SX.sym("q_BN", 4), ca.SX.sym("omega_BN_B", 3), ca.SX.sym("displacement", 6)
    angle = ca.sqrt(ca.sumsqr(by[:3]) + 1e-30)
    v, s = by[:3] * (ca.sin(angle / 2) / angle), ca.cos(angle / 2)
    moved = ca.vertcat(s * q[:3] + q[3] * v - ca.cross(v, q[:3]), s * q[3] - ca.dot(v, q[:3]))
    return generate(
        "turned",
        inputs=[
            (Port("q_BN", (4,), "-"), q),
            (Port("omega_BN_B", (3,), "rad/s"), omega),
            (Port("displacement", (6,), "-"), by),
        ],
        outputs=[(Port("q_BN", (4,), "-"), moved), (Port("omega_BN_B", (3,), "rad/s"), omega + by[3:])],
    )


def start(rng: np.random.Generator) -> Array:
    q = rng.normal(size=4)
    return np.concatenate([q / np.linalg.norm(q), 0.3 * rng.normal(size=3)])


@pytest.mark.parametrize(("method", "order"), [("runge_kutta_4", 4), ("midpoint", 2), ("lie_group", 4)])
def test_error_falls_with_the_order_of_the_method(method: Method, order: int, tmp_path: Path) -> None:
    from scipy.integrate import solve_ivp

    lie = method == "lie_group"
    one = step(
        attitude_rate() if lie else BODY.derivative(), STATES, method, move=turned() if lie else None, name="attitude"
    )
    x0, torque = start(np.random.default_rng(1)), np.array([0.4, -0.2, 0.3])

    def slope(_: float, x: Array) -> Array:
        return np.concatenate(BODY.derivative()(x[:4], x[4:], torque))

    exact = solve_ivp(slope, (0.0, 4.0), x0, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    errors = []
    for steps in (20, 40):
        source = integrate(one, STATES, steps, every=steps, held=True)
        call = compiled(source, tmp_path)
        status, y = call(np.concatenate([x0, torque, [4.0 / steps]]))
        assert (status, y[-1]) == (Status.OK, steps)
        np.testing.assert_array_equal(y[:7], x0)
        errors.append(np.abs(y[7:14] - exact).max())
        if lie:
            assert abs(np.linalg.norm(y[7:11]) - 1.0) < 1e-14
    assert order - 0.35 < np.log2(errors[0] / errors[1]) < order + 0.6
    assert errors[1] < (1e-5 if order == 4 else 1e-2)


def test_one_step_is_the_symbolic_one(tmp_path: Path) -> None:
    function = pendulum()
    symbolic = rk4_step(function, ("angle", "rate"), time="t")
    call = compiled(step(function, ("angle", "rate"), time="t"), tmp_path)
    rng = np.random.default_rng(2)
    for _ in range(50):
        torque, angle, rate, t, dt = rng.normal(size=5)
        status, y = call(np.array([angle, rate, torque, t, abs(dt)]))
        assert status == Status.OK
        expected = symbolic(torque=torque, angle=angle, rate=rate, t=t, dt=abs(dt))
        np.testing.assert_allclose(y, np.array(expected), rtol=0, atol=4e-15)


def test_inputs_and_time_pass_from_step_to_step(tmp_path: Path) -> None:
    steps, every, dt = 7, 3, 0.1
    one = step(pendulum(), ("angle", "rate"), "midpoint", time="t")
    source = integrate(one, ("angle", "rate"), steps, every, time="t")
    assert [port.shape for port in source.outputs] == [(3, 2), ()]
    torque = np.random.default_rng(3).normal(size=steps)
    status, y = compiled(source, tmp_path)(np.concatenate([[0.5, 0.0], torque, [2.0, dt]]))
    assert (status, y[-1]) == (Status.OK, steps)
    assert one.twin is not None
    state, kept = np.array([0.5, 0.0]), [np.array([0.5, 0.0])]
    for k in range(steps):
        state = one.twin(np.concatenate([state, [torque[k], 2.0 + k * dt, dt]]))[1]
        kept += [state] if (k + 1) % every == 0 else []
    np.testing.assert_allclose(y[:-1].reshape(3, 2), kept, rtol=0, atol=1e-14)


def test_it_stops_before_the_first_state_that_is_not_finite(tmp_path: Path) -> None:
    x, gain = ca.SX.sym("x"), ca.SX.sym("gain")
    growth = generate(
        "growth",
        inputs=[(Port("x", (), "-"), x), (Port("gain", (), "-"), gain)],
        outputs=[(Port("rate", (), "-"), gain * x**3)],
    )
    source = integrate(step(growth, ["x"], "midpoint"), ["x"], steps=10)
    call = compiled(source, tmp_path)
    gains = np.zeros(10)
    gains[4:] = 1e300
    status, y = call(np.concatenate([[2.0], gains, [1.0]]))
    assert (status, y[-1]) == (Status.OUTPUT, 4)
    np.testing.assert_array_equal(y[:-1], [2.0] * 5 + [np.nan] * 6)
    status, y = call(np.concatenate([[np.nan], gains, [1.0]]))
    assert (status, y[-1]) == (Status.NOT_FINITE, 0)
    assert np.isnan(y[:-1]).all()


@pytest.mark.parametrize("method", ["runge_kutta_4", "midpoint"])
def test_every_form_has_the_bits_of_the_twin(method: Method, tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    q = ca.SX.sym("x", 7)
    scaled = generate(
        "scaled",
        inputs=[(Port("x", (7,), "-"), q)],
        outputs=[(Port("x", (7,), "-"), ca.vertcat(q[:4] / ca.norm_2(q[:4]), q[4:]))],
    )
    source = integrate(step(BODY.derivative(), STATES, method), STATES, steps=6, every=2, restore=scaled)
    samples = [np.concatenate([start(rng), rng.normal(size=18), [0.2]]) for _ in range(10)]
    hostile = [x * np.where(rng.random(x.shape) < 0.1, rng.choice([1e200, np.nan, 0.0]), 1.0) for x in samples]
    assert_twin_agrees(source, np.array(samples + hostile), tmp_path)
    single = compiled(source, tmp_path, real=np.float32)
    assert source.twin is not None
    for x in samples:
        status, y = single(x)
        assert status == Status.OK
        np.testing.assert_allclose(y, source.twin(x)[1], rtol=0, atol=2e-5)


def test_lie_group_twin_agrees_but_for_the_sine(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    source = step(attitude_rate(), STATES, "lie_group", move=turned())
    call = compiled(source, tmp_path)
    assert source.twin is not None
    for _ in range(20):
        x = np.concatenate([start(rng), rng.normal(size=3), [0.3]])
        np.testing.assert_allclose(call(x)[1], source.twin(x)[1], rtol=0, atol=1e-15)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(InputError, match=r"has no argument `omega_BN`\. Did you mean `omega_BN_B`"):
        step(BODY.derivative(), ("q_BN", "omega_BN"))
    with pytest.raises(InputError, match="gives 6 rates of 7 states"):
        step(attitude_rate(), STATES)
    with pytest.raises(InputError, match="needs `move`"):
        step(attitude_rate(), STATES, "lie_group")
    with pytest.raises(InputError, match="`every` must be a whole number from 1 to 5, got 6"):
        integrate(step(pendulum(), ("angle", "rate"), time="t"), ("angle", "rate"), 5, 6, time="t")
    with pytest.raises(InputError, match="hold 20007 numbers, at most 16384"):
        integrate(step(BODY.derivative(), STATES), STATES, 2000)
