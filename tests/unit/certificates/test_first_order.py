"""First-order residuals and dual bound: judged on problems whose multipliers are known by hand."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from optsat.certificates.dual_bound import dual_bound
from optsat.certificates.first_order import first_order
from optsat.convex_rows import convex_rows
from optsat.problems.goal_attainment import GoalAttainment
from optsat.problems.minimax import Minimax

X = ca.SX.sym("x", 2)
# min max(x^2 + y^2, 2 - x) with y >= 1: at (a, 1) with a^2 + 1 = 2 - a
PARABOLA = Minimax(X, [ca.sumsqr(X), 2 - X[0]], lb=[-np.inf, 1]).form
ROOT = (np.sqrt(5) - 1) / 2
OPTIMUM = np.array([ROOT, 1.0])
# mu 2 a = 1 - mu
SHARE = 1 / (1 + 2 * ROOT)


def test_multipliers_are_found_without_a_solver() -> None:
    state = first_order(PARABOLA, OPTIMUM, np.zeros(0))
    assert state.residual <= 1e-14
    np.testing.assert_allclose(state.dual, (SHARE, 1 - SHARE, 0, -2 * SHARE), atol=1e-12)
    assert np.isnan(state.weight_sum)


def test_wrong_multipliers_of_a_solver_are_not_believed() -> None:
    state = first_order(PARABOLA, OPTIMUM, np.array([0.9, 0.3, 0.0, 5.0]))
    assert state.weight_sum == pytest.approx(1.2)
    assert state.residual <= 1e-14


def test_away_from_the_optimum_the_residual_shows_it() -> None:
    for step in ([1e-3, 0.0], [0.0, 1e-3], [-1e-3, 1e-3]):
        assert first_order(PARABOLA, OPTIMUM + step, np.zeros(0)).residual > 1e-4


def test_violation_is_relative_to_the_bound() -> None:
    form = Minimax(X, X[0], A=[[1, 0]], b=[100]).form
    assert first_order(form, np.array([101.0, 0.0]), np.zeros(0)).violation == pytest.approx(0.01)


def test_hard_goals_and_two_sided_rows_have_their_places() -> None:
    """F_0 = x with |x - 3| <= 2 t, F_1 = y <= 1 hard, F_2 >= 5 - t: x + y >= 5 - t."""
    form = GoalAttainment(X, [X[0], X[1], X[0] + X[1]], [3, 1, 5], [2, 0, -1], absolute=[0]).form
    np.testing.assert_array_equal(form.objective, (0, 0, 1, 2))
    np.testing.assert_array_equal(form.sign, (1, -1, 1, -1))
    np.testing.assert_array_equal(form.weight, (2, 2, 0, 1))
    # y = 1, x = 3 + 2 t, x + y = 5 - t: t = 1/3
    x = np.array([3 + 2 / 3, 1.0])
    state = first_order(form, x, np.zeros(0))
    assert form.factor(form.objectives.values(x)) == pytest.approx(1 / 3)
    assert state.residual <= 1e-12
    np.testing.assert_allclose(state.dual[:4], (1 / 3, 0, 1 / 3, 1 / 3), atol=1e-12)


def test_the_dual_bound_meets_the_optimum_and_grows_with_the_distance() -> None:
    convex = convex_rows(PARABOLA)
    assert convex is not None
    factor = 2 - ROOT
    assert dual_bound(PARABOLA, convex, first_order(PARABOLA, OPTIMUM, np.zeros(0)), OPTIMUM) == pytest.approx(
        factor, abs=1e-14
    )
    for step in (1e-6, 1e-3, 0.3):
        x = OPTIMUM + step
        bound = dual_bound(PARABOLA, convex, first_order(PARABOLA, x, np.zeros(0)), x)
        assert bound <= factor + 1e-14


def test_a_linear_problem_without_bounds_is_proven_by_its_vertex() -> None:
    form = Minimax(X, [X[0] + X[1], X[0] - 2 * X[1], -3 * X[0] + 0.1 * X[1], X[0] - 9]).form
    convex = convex_rows(form)
    assert convex is not None
    state = first_order(form, np.zeros(2), np.zeros(0))
    assert dual_bound(form, convex, state, np.zeros(2)) == pytest.approx(0, abs=1e-15)


def test_no_bound_without_growth_or_reach() -> None:
    """A slope has no minimum: no bound without bounds on x, and the value at the far end with them."""
    x = ca.SX.sym("x")
    form = Minimax(x, [(1 - 1e-9) * x]).form
    convex = convex_rows(form)
    assert convex is not None
    state = first_order(form, np.zeros(1), np.zeros(0))
    assert dual_bound(form, convex, state, np.zeros(1)) == -np.inf
    boxed = Minimax(x, [(1 - 1e-9) * x], lb=-2, ub=2).form
    boxed_convex = convex_rows(boxed)
    assert boxed_convex is not None
    assert dual_bound(boxed, boxed_convex, first_order(boxed, np.zeros(1), np.zeros(0)), np.zeros(1)) == pytest.approx(
        -2
    )


def test_multipliers_that_leave_no_weight_on_the_objectives_prove_nothing() -> None:
    """Found by the campaign: x <= 1 with multiplier 5 outweighs the objective x with 0.1, and balancing drops it."""
    form = Minimax(X, [X[0]], A=[[1, 0]], b=[1]).form
    convex = convex_rows(form)
    assert convex is not None
    state = first_order(form, np.array([1.0, 0.0]), np.zeros(0))
    given = replace(state, multipliers=np.array([0.1, 5.0]), dual=np.array([0.1, 5.0, 0.0, 0.0]))
    assert dual_bound(form, convex, given, np.array([1.0, 0.0])) == -np.inf
