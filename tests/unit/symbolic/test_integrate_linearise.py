"""Runge-Kutta steps and linearisation against closed forms."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from optsat.errors import InputError
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import rk4_step
from optsat.symbolic.linearise import linearise

X, U, T = Port("x", (2,), "-"), Port("u", (1,), "-"), Port("t", (), "s")


def oscillator() -> GeneratedFunction:
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u", 1)
    rate = ca.vertcat(x[1], -4 * x[0] - 0.3 * x[1] + u)
    return generate("oscillator", [(X, x), (U, u)], [(Port("x_dot", (2,), "1/s"), rate)])


def pendulum() -> GeneratedFunction:
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u", 1)
    return generate(
        "pendulum", [(X, x), (U, u)], [(Port("x_dot", (2,), "1/s"), ca.vertcat(x[1], -ca.sin(x[0]) + u * x[1]))]
    )


def test_step_is_the_taylor_series_of_the_exponential() -> None:
    A, h = np.array([[0, 1], [-4, -0.3]]), 0.1
    series = np.eye(2) + h * A + h**2 / 2 * A @ A + h**3 / 6 * A @ A @ A + h**4 / 24 * A @ A @ A @ A
    step = rk4_step(oscillator(), ["x"])
    np.testing.assert_allclose(step([1, 2], [0], h), series @ [1, 2], rtol=1e-14)


def test_substeps_converge_with_order_four() -> None:
    exact = expm(np.array([[0, 1], [-4, -0.3]])) @ [1, 2]
    errors = [
        np.abs(rk4_step(oscillator(), ["x"], substeps=n)(x=[1, 2], u=[0], dt=1.0) - exact).max() for n in (8, 16, 32)
    ]
    assert 3.8 < np.log2(errors[0] / errors[1]) < 4.2
    assert 3.8 < np.log2(errors[1] / errors[2]) < 4.2


def test_time_advances_inside_the_step() -> None:
    x, t = ca.SX.sym("x"), ca.SX.sym("t")
    cubic = generate("cubic", [(Port("x", (), "-"), x), (T, t)], [(Port("x_dot", (), "1/s"), 4 * t**3)])
    # Simpson's rule is exact for cubics
    assert rk4_step(cubic, ["x"], time="t")(1.0, 2.0, 0.7) == pytest.approx(1 + 2.7**4 - 2.0**4, rel=1e-14)
    split = rk4_step(cubic, ["x"], time="t", substeps=3)
    assert split(1.0, 2.0, 0.7) == pytest.approx(1 + 2.7**4 - 2.0**4, rel=1e-14)
    assert rk4_step(cubic, ["x"])(1.0, 2.0, 0.7) == pytest.approx(1 + 0.7 * 32, rel=1e-14)


def test_unit_length_is_restored() -> None:
    step = rk4_step(oscillator(), ["x"], unit_length=["x"])
    assert np.linalg.norm(step([0.6, 0.8], [5.0], 0.5)) == pytest.approx(1, abs=1e-15)


def test_linearise_a_linear_system() -> None:
    A, B = linearise(oscillator(), ["x"], ["u"])([3, 4], [1])
    np.testing.assert_array_equal(A, [[0, 1], [-4, -0.3]])
    np.testing.assert_array_equal(B, [[0], [1]])


def test_linearise_depends_on_the_point() -> None:
    A, B = linearise(pendulum(), ["x"], ["u"]).batch(np.array([[0.0, 2.0], [np.pi, 3.0]]), [[0.5], [0.5]])
    np.testing.assert_allclose(A, np.array([[[0, 1], [-1, 0.5]], [[0, 1], [1, 0.5]]]), atol=1e-15)
    np.testing.assert_allclose(B, np.array([[[0], [2]], [[0], [3]]]))


def test_linearised_step_is_the_discrete_system() -> None:
    step = rk4_step(pendulum(), ["x"])
    A, B = linearise(step, ["x"], ["u"])([0.4, 0.3], [0.2], 0.05)
    at, h = np.array([0.4, 0.3]), 1e-6
    columns = [(step(at + h * e, [0.2], 0.05) - step(at - h * e, [0.2], 0.05)) / (2 * h) for e in np.eye(2)]
    np.testing.assert_allclose(A, np.stack(columns, axis=1), atol=1e-9)
    difference = (step(at, [0.2 + h], 0.05) - step(at, [0.2 - h], 0.05)) / (2 * h)
    np.testing.assert_allclose(B[:, 0], difference, atol=1e-9)


def test_refusals() -> None:
    with pytest.raises(InputError, match="oscillator has no port `y`"):
        rk4_step(oscillator(), ["y"])
    with pytest.raises(InputError, match=r"x_dot \(2,\) \[1/s\] cannot be the rate of u \(1,\)"):
        rk4_step(oscillator(), ["u"])
    with pytest.raises(InputError, match="1 outputs for 2 states"):
        rk4_step(oscillator(), ["x", "u"])
    with pytest.raises(InputError, match="`substeps` must be at least 1"):
        rk4_step(oscillator(), ["x"], substeps=0)
    with pytest.raises(InputError, match="`unit_length` names `u`, which is no state"):
        rk4_step(oscillator(), ["x"], unit_length=["u"])
    with pytest.raises(InputError, match="no port `time`"):
        rk4_step(oscillator(), ["x"], time="time")
    with pytest.raises(InputError, match="no port `v`"):
        linearise(oscillator(), ["x"], ["v"])
