"""Interval evaluation: every sampled value lies inside, and the ends are sharp where one variable occurs once."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.kernels.instructions import read_instructions
from optsat.symbolic.interval_evaluation import evaluate_over_box

X = ca.SX.sym("x", 2)
A, B = X[0], X[1]

EXPRESSIONS = {
    "sum": A + B - 3,
    "product": A * B,
    "square": A * A,
    "powers": A**3 + B**-2 + ca.fabs(A) ** 1.5,
    "quotient": A / (3 + B),
    "root": ca.sqrt(4 + A) * ca.log(5 + B),
    "exponentials": ca.exp(A) - ca.expm1(B) + ca.log1p(A / 9),
    "circular": ca.sin(3 * A) + ca.cos(5 * B),
    "hyperbolic": ca.tanh(A) + ca.sinh(B) + ca.atan(A),
    "choice": ca.fmax(A, B) - ca.fmin(A, 2 * B),
    "reciprocal": 1 / (7 + A) + ca.fabs(B),
}


def enclosure(expression: Any, lower: Array, upper: Array) -> tuple[float, float]:
    program = read_instructions(ca.Function("f", [X], [expression]))
    low, high = evaluate_over_box(program, [(lower, upper)])
    return float(low[0]), float(high[0])


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_samples_lie_inside(name: str) -> None:
    function = ca.Function("f", [X], [EXPRESSIONS[name]])
    rng = np.random.default_rng(2)
    for _ in range(40):
        middle, half = rng.uniform(-1.5, 1.5, 2), 10 ** rng.uniform(-8, 0, 2)
        if name == "powers":
            middle = np.abs(middle) + half + 0.1
        low, high = enclosure(EXPRESSIONS[name], middle - half, middle + half)
        points = middle[:, None] + half[:, None] * np.hstack((rng.uniform(-1, 1, (2, 50)), [[1, 1, -1], [1, -1, -1]]))
        values = function(points).full().ravel()
        assert np.all(low <= values)
        assert np.all(values <= high)


def test_ends_are_sharp() -> None:
    one = np.array([-1.0, 2.0]), np.array([3.0, 2.0])
    assert enclosure(A * A, *one) == pytest.approx((0, 9), abs=1e-14)
    assert enclosure(A * A + 2, *one)[0] < 2.0 + 1e-15
    assert enclosure(ca.sin(A), *one) == pytest.approx((np.sin(-1), 1), abs=1e-14)
    assert enclosure(ca.cos(A), *one) == pytest.approx((np.cos(3), 1), abs=1e-14)


def test_what_is_not_defined_or_not_known_is_everything() -> None:
    box = np.array([-1.0, 0.0]), np.array([1.0, 1.0])
    for expression in (1 / A, ca.log(A), ca.sqrt(A), ca.atan2(A, B), A**0.5, ca.exp(1000 * (A + 2))):
        assert enclosure(expression, *box) == (-np.inf, np.inf)
