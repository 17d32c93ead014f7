"""Goal attainment and minimax: the documented examples, every reading of goals and weights, every way to write it."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.attain import goal_attain, minimax
from optsat.solution import Proof


def cb2(x: Any) -> list[Any]:
    return [x[0] ** 2 + x[1] ** 4, (2 - x[0]) ** 2 + (2 - x[1]) ** 2, 2 * ca.exp(x[1] - x[0])]


def cb2_by_hand(a: float, b: float) -> tuple[float, float, float]:
    return a**2 + b**4, (2 - a) ** 2 + (2 - b) ** 2, 2 * float(np.exp(b - a))


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_minimax_of_expressions(kind: Any) -> None:
    x = kind.sym("x", 2)
    solution = minimax(x, cb2(x), start=(1.0, -0.1))
    assert solution.proof in (Proof.STATIONARY, Proof.GLOBAL)
    assert solution.answer.factor == pytest.approx(1.9522244939, rel=1e-9)
    np.testing.assert_allclose(solution.answer.x, (1.139037652, 0.899559938), atol=1e-8)
    np.testing.assert_allclose(solution.answer.objectives, cb2_by_hand(*solution.answer.x))
    assert solution.answer.active == (0, 1)
    assert solution.answer.multipliers.sum() == pytest.approx(1, abs=1e-6)


def test_the_goal_example_of_the_classical_solver() -> None:
    x = ca.SX.sym("x")
    solution = goal_attain(x, [2 + (x - 3) ** 2, 5 + x**2 / 4], (3, 6), (1, 1), start=[1.0])
    np.testing.assert_allclose(solution.answer.x, 2, atol=1e-7)
    np.testing.assert_allclose(solution.answer.objectives, (3, 6), atol=1e-7)
    assert solution.answer.factor == pytest.approx(0, abs=1e-7)


def test_a_negative_weight_asks_for_at_least_the_goal() -> None:
    """Read as a row for positive weights this problem would be unbounded."""
    x = ca.SX.sym("x")
    solution = goal_attain(x, 4 - (x - 1) ** 2, 3, -1, start=[3.0])
    assert solution.answer.factor == pytest.approx(-1, abs=1e-9)
    np.testing.assert_allclose(solution.answer.x, 1, atol=1e-6)
    assert solution.answer.multipliers_below[0] == pytest.approx(1, abs=1e-6)


def test_a_weight_of_zero_is_a_constraint() -> None:
    x = ca.SX.sym("x")
    solution = goal_attain(x, [(x - 3) ** 2, x**2], (0, 1), (1, 0), start=[0.0])
    assert solution.answer.x[0] == pytest.approx(1, abs=1e-8)
    assert solution.answer.objectives[1] <= 1 + 1e-8
    assert solution.residuals["hard_goal_violation"] <= 1e-8
    assert solution.answer.factor == pytest.approx(4, rel=1e-7)
    assert solution.answer.active_constraints == ("hard goal 1 (at most)",)


def closed_loop(K: Array) -> Array:
    """Return the real parts, ascending, of the eigenvalues of A + B K C of the classical pole placement."""
    A = np.array([[-0.5, 0, 0], [0, -2, 10], [0, 1, -2]])
    B, C = np.array([[1.0, 0], [-2, 2], [0, 1]]), np.array([[1.0, 0, 0], [0, 0, 1]])
    return np.sort(np.linalg.eigvals(A + B @ K.reshape(2, 2) @ C).real).astype(np.float64)


def test_pole_placement_of_the_classical_solver() -> None:
    """A black box; with weights |goal| the factor is the over-achievement as a fraction of the goals."""
    goals = np.array([-5.0, -3.0, -1.0])
    solution = goal_attain(-np.ones(4), closed_loop, goals, np.abs(goals), lb=-4, ub=4)
    assert solution.proof is Proof.STATIONARY
    assert solution.answer.factor == pytest.approx(-0.3862602550, abs=1e-7)
    np.testing.assert_allclose(solution.answer.objectives, (-6.93130127, -4.15878077, -1.40991795), atol=1e-6)
    np.testing.assert_allclose(solution.answer.x, (-4, -0.2563553, -4, -4), atol=1e-5)
    assert solution.answer.active_constraints == ("bound of x[0]", "bound of x[2]", "bound of x[3]")
    assert float(np.abs(goals) @ solution.answer.multipliers) == pytest.approx(1, abs=1e-6)
