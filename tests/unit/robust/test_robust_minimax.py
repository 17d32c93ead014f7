"""Robust minimax: worst cases known in closed form, proofs of corners, and bounds checked against dense samples."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.certificates.box_maximum import largest_over_box
from optsat.errors import InputError
from optsat.problems.uncertain_rows import uncertain_rows
from optsat.robust import robust_minimax
from optsat.solution import Proof

X = ca.SX.sym("x", 2)
U = ca.SX.sym("u", 2)
V = ca.SX.sym("v")


def test_the_centre_of_a_box_is_nearest_to_its_worst_corner() -> None:
    found = robust_minimax(X, ca.sumsqr(X - U), U, [-1, 0], [2, 1], start=[3, 3])
    np.testing.assert_allclose(found.answer.x, 0.5, atol=1e-7)
    assert found.answer.worst == pytest.approx(1.5**2 + 0.5**2, rel=1e-9)
    assert found.answer.bound == found.answer.worst
    assert found.answer.exact == (True,)
    assert found.proof is Proof.GLOBAL
    assert found.stats["cases"] == 4


def test_the_best_line_for_the_exponential() -> None:
    """Chebyshev, semi-infinite: slope sinh 1, and the tangent parallel to the chord is as far off as the ends."""
    error = X[0] + X[1] * V - ca.exp(V)
    found = robust_minimax(X, [error, -error], V, -1, 1)
    slope = np.sinh(1)
    largest = 0.5 * (np.cosh(1) - slope + slope * np.log(slope))
    assert found.answer.exact == (False, True)
    np.testing.assert_allclose(found.answer.x, (np.cosh(1) - largest, slope), atol=1e-5)
    assert found.answer.worst == pytest.approx(largest, abs=1e-6)
    assert found.answer.worst <= found.answer.bound <= found.answer.worst + 1e-6
    assert found.proof is Proof.GLOBAL
    v = np.linspace(-1, 1, 4001)
    sampled = np.abs(found.answer.x[0] + found.answer.x[1] * v - np.exp(v)).max()
    assert sampled <= found.answer.bound


def test_waves_are_bounded_by_search() -> None:
    F = [ca.sin(3 * U[0] + X[0]) * (1 + X[1] ** 2) + U[0] * X[0], X[0] ** 2 + ca.cos(U[1]) * X[1]]
    found = robust_minimax(X, F, U, -1, 1, lb=-2, ub=2, start=[0.3, 0.3], starts=2)
    a, b = found.answer.x
    grid = np.linspace(-1, 1, 2001)
    sampled = max(np.max(np.sin(3 * grid + a) * (1 + b**2) + grid * a), np.max(a**2 + np.cos(grid) * b))
    assert found.answer.exact == (False, False)
    assert sampled <= found.answer.bound
    assert found.answer.worst == pytest.approx(sampled, abs=2e-6)
    assert found.proof is Proof.STATIONARY
    assert found.stats["rounds"] > 1
    assert found.stats["boxes"] > 2
    other = min(
        max(np.max(np.sin(3 * grid + p) * (1 + q**2) + grid * p), np.max(p**2 + np.cos(grid) * q))
        for p in np.linspace(-2, 2, 41)
        for q in np.linspace(-2, 2, 41)
    )
    assert found.answer.worst <= other + 1e-6


def test_a_constraint_must_hold_all_over_the_box() -> None:
    """x0 + u x1 <= 1 for |u| <= 1 is x0 + |x1| <= 1; the point nearest to (2, 2) is (1/2, 1/2)."""
    found = robust_minimax(X, ca.sumsqr(X - 2), V, -1, 1, constraints=X[0] + V * X[1] - 1)
    np.testing.assert_allclose(found.answer.x, 0.5, atol=1e-6)
    assert found.answer.constraint_bound <= 1e-8
    assert found.proof is Proof.GLOBAL


def test_a_curved_constraint_is_searched() -> None:
    """x0 + x1 sin(3 v) <= 1 for |v| <= 1 reaches sin = +-1 inside the box."""
    found = robust_minimax(X, ca.sumsqr(X - 2), V, -1, 1, constraints=[X[0] + X[1] * ca.sin(3 * V) - 1])
    np.testing.assert_allclose(found.answer.x, 0.5, atol=1e-5)
    assert found.answer.exact == (True, False)
    assert found.answer.constraint_bound <= 1e-5


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_parameters_and_both_kinds_of_symbols(kind: Any) -> None:
    x, u, p = kind.sym("x"), kind.sym("u"), kind.sym("p")
    found = robust_minimax(x, (x - p - u) ** 2, u, -1, 3, parameters=p, parameter_values=5)
    assert found.answer.x[0] == pytest.approx(6, abs=1e-6)
    assert found.answer.worst == pytest.approx(4, abs=1e-6)


def corners_of(value: Any, low: float = -1, high: float = 1, x: tuple[float, float] = (-np.inf, np.inf)) -> Any:
    boxes = [(np.full(2, x[0]), np.full(2, x[1])), (np.full(2, low), np.full(2, high)), (np.zeros(0), np.zeros(0))]
    return uncertain_rows(ca.SX(value), X, U, ca.SX.sym("p", 0), boxes)[0].corners


PROVEN: dict[str, tuple[Any, int]] = {
    "square of a difference": ((U[0] - X[0]) ** 2, 2),
    "product of components": (U[0] * U[1] * X[0], 4),
    "rising and convex": (ca.exp(U[0]) + U[1] ** 2 + X[0], 2),
    "absolute values": (ca.fabs(U[0] - X[0]) + ca.fabs(U[1]), 4),
    "larger of two": (ca.fmax(U[0] + X[0], -U[0]), 2),
    "norm": (ca.sqrt((U[0] - X[0]) ** 2 + (U[1] - X[1]) ** 2), 4),
    "no dependence": (X[0] ** 2, 1),
}


@pytest.mark.parametrize("name", PROVEN)
def test_corners_are_proven(name: str) -> None:
    value, count = PROVEN[name]
    corners = corners_of(value)
    assert len(corners) == count
    function = ca.Function("f", [X, U], [value])
    rng = np.random.default_rng(0)
    for x in rng.uniform(-3, 3, (20, 2)):
        largest = max(float(function(x, corner)) for corner in corners)
        assert max(float(function(x, u)) for u in rng.uniform(-1, 1, (50, 2))) <= largest + 1e-12


NOT_PROVEN = {
    "concave": -(U[0] ** 2),
    "concave kink, whose second derivative vanishes": -ca.fabs(U[0] - 0.3),
    "smaller of two": ca.fmin(U[0], -U[0]),
    "jump": ca.if_else(U[0] < 0.5, U[0], 0),
    "wave": ca.sin(4 * U[0]),
    "product with a sign of x": X[0] * U[0] ** 2,
    "undefined inside": ca.log(U[0]),
}


@pytest.mark.parametrize("name", NOT_PROVEN)
def test_corners_are_not_claimed(name: str) -> None:
    assert corners_of(NOT_PROVEN[name]) is None


def test_bounds_of_x_can_settle_the_sign() -> None:
    assert corners_of(X[0] * U[0] ** 2, x=(0, 5)) is not None


def test_too_many_corners_give_way_to_the_search() -> None:
    x, u = ca.SX.sym("x"), ca.SX.sym("u", 9)
    boxes = [(np.full(1, -np.inf), np.full(1, np.inf)), (-np.ones(9), np.ones(9)), (np.zeros(0), np.zeros(0))]
    value = sum((u[i] - x) ** 2 for i in range(9))
    assert uncertain_rows(ca.SX(value), x, u, ca.SX.sym("p", 0), boxes)[0].corners is None


@pytest.mark.parametrize("seed", range(8))
def test_the_search_bounds_what_no_sample_exceeds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, c, d = (float(each) for each in rng.normal(size=3))
    value = ca.sin(a + 3 * U[0]) * ca.cos(c * U[1]) + d * U[0] * U[1] - ca.exp(U[0] * U[1]) / 3
    boxes = [(np.zeros(2), np.zeros(2)), (np.full(2, -1.0), np.full(2, 2.0)), (np.zeros(0), np.zeros(0))]
    row = uncertain_rows(ca.SX(value), X, U, ca.SX.sym("p", 0), boxes)[0]
    function = ca.Function("f", [X, U], [value])
    samples = np.asarray(function.map(4000)(np.zeros((2, 4000)), rng.uniform(-1, 2, (2, 4000))).full())
    for most, tolerance in ((4000, 1e-6), (15, 1e-9)):
        found = largest_over_box(row.row, np.zeros(2), np.zeros(0), boxes[1][0], boxes[1][1], tolerance, most)
        assert samples.max() <= found.bound
        assert found.value <= found.bound
        assert float(function(np.zeros(2), found.u)) == pytest.approx(found.value, abs=1e-12)
        assert found.bound - found.value <= (1e-6 if most == 4000 else np.inf)
    assert found.boxes <= 16


def test_a_search_that_is_cut_short_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("optsat.robust._MOST_BOXES", 3)
    with pytest.warns(UserWarning, match="wider than the tolerance"):
        found = robust_minimax(X, ca.sin(9 * U[0]) * ca.cos(7 * U[1]) + ca.sumsqr(X), U, -1, 1)
    assert found.proof is Proof.NOTHING
    assert found.answer.bound > found.answer.worst + 1e-3


def test_constraints_that_no_answer_can_hold() -> None:
    with pytest.warns(UserWarning, match="No point was found"):
        found = robust_minimax(X, X[0], V, -1, 1, constraints=V * X[1] + 1, lb=-5, ub=5)
    assert found.proof is Proof.INFEASIBLE


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "no symbols": (lambda: robust_minimax(X, X[0], [1.0], -1, 1), "`uncertain` must be a column of CasADi symbols"),
    "infinite box": (lambda: robust_minimax(X, X[0] * V, V, -np.inf, 1), "`uncertain_lb` must be finite"),
    "box upside down": (lambda: robust_minimax(X, X[0] * V, V, 1, -1), "`uncertain_lb` must not exceed"),
    "box too long": (lambda: robust_minimax(X, X[0] * V, V, [0, 0], 1), "`uncertain_lb` must have shape (1,)"),
    "tolerance": (lambda: robust_minimax(X, X[0] * V, V, 0, 1, tolerance=0), "`tolerance` must be > 0"),
    "unknown symbol": (lambda: robust_minimax(X, X[0] * U[0], V, 0, 1), "`objectives` must be CasADi expressions of"),
    "no objective": (lambda: robust_minimax(X, [], V, 0, 1), "`objectives` is empty"),
    "two kinds": (lambda: robust_minimax(X, X[0], ca.MX.sym("v"), 0, 1), "of one kind"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_robust_problem_refuses_by_name(name: str) -> None:
    call, message = REFUSED[name]
    with pytest.raises(InputError) as refused:
        call()
    assert message in str(refused.value)
