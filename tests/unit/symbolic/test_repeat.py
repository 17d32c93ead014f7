"""Repeated steps: the same bits as single ones, with what differs from step to step, and kicks in between."""

import casadi as ca
import numpy as np
import pytest

from optsat.errors import InputError
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import euler_step, rk4_step
from optsat.symbolic.repeat import repeated


def rates() -> GeneratedFunction:
    x, y, u, k = ca.SX.sym("x", 2), ca.SX.sym("y", 1), ca.SX.sym("u", 1), ca.SX.sym("k", 2, 2)
    return generate(
        "rates",
        [(Port("x", (2,), "m"), x), (Port("y", (1,), "-"), y), (Port("u", (1,), "-"), u), (Port("k", (2, 2), "-"), k)],
        [(Port("x_dot", (2,), "m/s"), k @ x + u), (Port("y_dot", (1,), "1/s"), x[0] * y)],
    )


def test_each_step_in_turn() -> None:
    step = rk4_step(rates(), ("x", "y"))
    many = repeated(step, ("x", "y"), ("u", "dt"), 3, kicked="x")
    rng = np.random.default_rng(1)
    x, y, k = rng.normal(size=2), rng.normal(size=1), rng.normal(size=(2, 2))
    u, dt, kick = rng.normal(size=(3, 1)), rng.random(3), rng.normal(size=(3, 2))
    xs, ys = many(x=x, y=y, u=u, k=k, dt=dt, x_kick=kick)
    for row in range(3):
        x, y = step(x, y, u[row], k, dt[row])
        x = x + kick[row]
        np.testing.assert_array_equal(xs[row], x)
        np.testing.assert_array_equal(ys[row], y)
    assert [str(port) for port in many.outputs] == ["x (3, 2) [m]", "y (3, 1) [-]"]


def test_without_kicks_and_of_one_step() -> None:
    step = euler_step(rates(), ("x", "y"))
    x, y, u, k = np.array([1.0, 2.0]), np.array([3.0]), np.array([0.5]), np.eye(2)
    once, alone = repeated(step, ("x", "y"), ("u",), 1)(x, y, u[None], k, 0.1), step(x, y, u, k, 0.1)
    np.testing.assert_array_equal(once[0][0], alone[0])
    np.testing.assert_array_equal(once[1][0], alone[1])
    np.testing.assert_allclose(alone[0], x + 0.1 * (x + 0.5), rtol=1e-15)
    np.testing.assert_allclose(alone[1], [3.0 + 0.1 * 3.0], rtol=1e-15)


def test_euler_restores_length() -> None:
    x, _ = euler_step(rates(), ("x", "y"), unit_length=("x",))(np.ones(2), np.ones(1), np.ones(1), np.eye(2), 0.3)
    np.testing.assert_allclose(x, np.full(2, np.sqrt(0.5)), rtol=1e-15)


def test_refusals() -> None:
    step = euler_step(rates(), ("x", "y"))
    with pytest.raises(InputError, match="at least 1, got 0"):
        repeated(step, ("x", "y"), (), 0)
    with pytest.raises(InputError, match="its outputs must be the states y, x, in this order"):
        repeated(step, ("y", "x"), (), 2)
    with pytest.raises(InputError, match="has no port `v`"):
        repeated(step, ("x", "y"), ("v",), 2)
    with pytest.raises(InputError, match="has no port `z`"):
        repeated(step, ("x", "y"), (), 2, kicked="z")
    with pytest.raises(InputError, match="is a matrix and cannot differ"):
        repeated(step, ("x", "y"), ("k",), 2)
    with pytest.raises(InputError, match="`unit_length` names `u`, which is no state"):
        euler_step(rates(), ("x", "y"), unit_length=("u",))
