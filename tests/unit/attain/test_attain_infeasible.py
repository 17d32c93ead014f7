"""Infeasible problems: the constraints that conflict are named, and called a proof only where it is one."""

import casadi as ca
import numpy as np
import pytest

from optsat.attain import goal_attain, minimax
from optsat.errors import NotProvenError
from optsat.problems.attainment import Attainment
from optsat.problems.least_violation import LeastViolation
from optsat.problems.minimax import Minimax
from optsat.solution import Proof, Solution

X = ca.SX.sym("x", 2)


def test_rows_that_contradict_each_other_are_named_and_proven() -> None:
    with pytest.warns(UserWarning, match="stand against each other: A row 0, A row 2"):
        found = minimax(X, ca.sumsqr(X), A=[[1, 1], [1, 0], [-1, -1]], b=[1, 50, -3])
    assert found.proof is Proof.INFEASIBLE
    assert found.answer.conflicting == ("A row 0", "A row 2")
    # 1.5 below 3 and 0.5 above 1 are the same share of the bounds
    assert found.residuals["least_violation"] == pytest.approx(0.5, abs=1e-9)
    assert set(found.answer.violated) >= {"A row 0", "A row 2"}
    with pytest.raises(NotProvenError):
        found.require(Proof.FEASIBLE)


def test_a_row_against_bounds() -> None:
    with pytest.warns(UserWarning, match="No point was found"):
        found = minimax(X, X, lb=0, ub=1, Aeq=[[1, 1]], beq=[-1])
    assert found.proof is Proof.INFEASIBLE
    assert found.answer.conflicting == ("Aeq row 0", "bound of x[0]", "bound of x[1]")


def test_a_hard_goal_out_of_reach() -> None:
    with pytest.warns(UserWarning, match=r"hard goal 0 \(at most\)"):
        found = goal_attain(X, [ca.sumsqr(X) + 1, X[0]], [0, 0], [0, 1])
    assert found.proof is Proof.INFEASIBLE
    assert found.residuals["hard_goal_violation"] == pytest.approx(1, abs=1e-6)


def test_a_nonconvex_conflict_is_named_but_not_called_proven() -> None:
    with pytest.warns(UserWarning, match="constraint 0"):
        found = minimax(X, X[0], constraints=ca.sin(X[0]) - 2, constraints_lb=0)
    assert found.proof is Proof.NOTHING
    assert found.answer.conflicting == ("constraint 0",)
    assert found.answer.violated == pytest.approx({"constraint 0": 1.0}, abs=1e-6)


def test_a_callable_that_cannot_be_satisfied() -> None:
    with pytest.warns(UserWarning, match="constraint 0 by 1"):
        found = minimax([1.0, 1.0], lambda x: x, constraints=lambda x: float(x @ x) + 1)
    assert found.proof is Proof.NOTHING


def test_a_feasible_point_is_found_for_an_engine_that_lost_its_way() -> None:
    """The circle of radius 1 about (50, 0) is met from a far start, by one route or the other."""
    found = minimax(X, -X[0], constraints=(X[0] - 50) ** 2 + X[1] ** 2, constraints_ub=1, start=[-1e3, 1e3])
    assert found.proof is Proof.GLOBAL
    np.testing.assert_allclose(found.answer.x, (51, 0), atol=1e-4)


def least_violation(upper: float) -> Solution[Attainment]:
    from optsat.solve import solve

    problem = Minimax(X, X[0], A=[[1, 0], [-1, 0]], b=[upper, -1], lb=-10, ub=10)
    return solve(LeastViolation(problem))


def test_the_proof_is_sharp() -> None:
    """x <= 1 - 2e-7 contradicts x >= 1 by more than the tolerance, x <= 1 - 1e-9 by less."""
    assert least_violation(1 - 2e-7).proof is Proof.INFEASIBLE
    assert least_violation(1 - 1e-9).proof is not Proof.INFEASIBLE
    assert least_violation(1.0).proof is not Proof.INFEASIBLE
