"""Curvature: what the rules of composition find, and that they never call convex what is not."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.errors import InputError
from optsat.symbolic.curvature import Rest, Shape, positive_semidefinite, shapes_of, square_root

X = ca.SX.sym("x", 3)
P = ca.SX.sym("p", 1)
A, B, C = X[0], X[1], X[2]


def shape(expression: Any, lower: float = -np.inf, upper: float = np.inf, p: float = 2.0) -> Shape:
    function = ca.Function("f", [X, P], [ca.densify(ca.SX(expression))])
    return shapes_of(function, np.array([p]), np.full(3, lower), np.full(3, upper))[0]


CONVEX = {
    "affine": A - 2 * B + 3,
    "square written out": A**2 - 2 * A * B + B**2,
    "product that a square outweighs": 3 * A**2 + 2 * A * B + B**2,
    "norm": ca.norm_2(X - 1),
    "norm of a line": ca.sqrt((A + B) ** 2),
    "smoothed norm": ca.sqrt(1 + A**2 + (B - C) ** 2),
    "absolute value": ca.fabs(A - B),
    "exponential of a norm": ca.exp(ca.norm_2(X)),
    "fourth power": (A - B) ** 4 + C**2,
    "fourth power of a norm": (A**2 + B**2) ** 2,
    "maximum": ca.fmax(A**2, ca.exp(B) - C),
    "minus logarithm": -ca.log(3 - A - B),
    "minus root": -ca.sqrt(2 - A),
    "power 1.5": (5 + A) ** 1.5,
    "quotient by a parameter": A**2 / P,
    "hypotenuse": ca.hypot(A - 1, B),
}

NOT_CONVEX = {
    "saddle": A * B,
    "minus square": A - B**2,
    "sine": ca.sin(A),
    "cube": A**3,
    "root": ca.sqrt(A + 5),
    "difference of norms": ca.norm_2(X) - ca.fabs(A),
    "minimum": ca.fmin(A, -A),
    "square of a square less one": (A**2 - 1) ** 2,
    "reciprocal of either sign": 1 / A,
    "quotient by a negative parameter": A**2 / (P - 5),
    "product of squares": A**2 * B**2,
    "condition": ca.if_else(A > 0, A**2, B),
}


@pytest.mark.parametrize("name", CONVEX)
def test_convex(name: str) -> None:
    assert shape(CONVEX[name]).convex
    assert shape(-CONVEX[name]).concave


@pytest.mark.parametrize("name", NOT_CONVEX)
def test_not_called_convex(name: str) -> None:
    assert not shape(NOT_CONVEX[name]).convex


@pytest.mark.parametrize("expression", [1 / A, A**3, A**-2, (A + B) ** 3, 1 / ca.sqrt(A)], ids=str)
def test_convex_where_the_bounds_give_the_sign(expression: Any) -> None:
    assert shape(expression, lower=0.5).convex
    assert not shape(expression, lower=-1.0).convex or "sqrt" in str(expression)


@pytest.mark.parametrize("name", [*CONVEX, *NOT_CONVEX])
def test_against_samples(name: str) -> None:
    """Midpoint convexity over random pairs, and values within the enclosure."""
    expression = {**CONVEX, **NOT_CONVEX}[name]
    found = shape(expression, -0.9, 0.9)
    function = ca.Function("f", [X, P], [expression])
    rng = np.random.default_rng(0)
    u, v = rng.uniform(-0.9, 0.9, (2, 3, 200))
    at_u, at_v, middle = (function(z, 2.0).full().ravel() for z in (u, v, (u + v) / 2))
    slack = (at_u + at_v) / 2 - middle
    if found.convex:
        assert slack.min() >= -1e-12
    if found.concave:
        assert slack.max() <= 1e-12
    assert np.all(at_u >= found.low - 1e-12)
    assert np.all(at_u <= found.high + 1e-12)


def test_the_parts_of_a_value() -> None:
    found = shape(A**2 + 3 * A * B - C + 2 * ca.norm_2(ca.vertcat(A - 1, B)) + 7)
    np.testing.assert_allclose(found.Q, [[2, 3, 0], [3, 0, 0], [0, 0, 0]])
    np.testing.assert_allclose(found.c, (0, 0, -1))
    assert found.d == 7
    ((factor, norm),) = found.norms
    x = np.array([0.3, -2.0, 5.0])
    assert factor * np.linalg.norm(norm.L @ x + norm.e) == pytest.approx(2 * np.hypot(-0.7, -2.0), rel=1e-12)
    assert found.rest is Rest.NONE


def test_parameters_are_numbers() -> None:
    assert shape(P * A**2, p=2.0).convex
    assert shape(P * A**2, p=-2.0).concave


def test_square_root() -> None:
    rng = np.random.default_rng(1)
    R = rng.standard_normal((2, 4))
    root = square_root(R.T @ R)
    assert root.shape == (2, 4)
    np.testing.assert_allclose(root.T @ root, R.T @ R, atol=1e-12)
    assert positive_semidefinite(R.T @ R)
    assert not positive_semidefinite(R.T @ R - 1e-6 * np.eye(4))


def test_a_matrix_function_cannot_be_read() -> None:
    x = ca.MX.sym("x", 3)
    with pytest.raises(InputError, match="no function of SX symbols"):
        shapes_of(ca.Function("f", [x, ca.MX.sym("p", 0)], [ca.sumsqr(x)]), np.zeros(0), np.zeros(3), np.ones(3))
