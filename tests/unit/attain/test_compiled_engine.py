"""The compiled interior point as an engine: the same answers and multipliers, and the others where it does not fit."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.attain import goal_attain, minimax
from optsat.errors import InputError, OptsatError
from optsat.kernels.toolchain import CompilerMissingError, find_compiler
from optsat.problems.goal_attainment import GoalAttainment
from optsat.solution import Proof, Termination
from optsat.solvers import compiled_minmax
from optsat.solvers.compiled_minmax import CompiledMinMax

X = ca.SX.sym("x", 2)
ENGINE = "compiled_minmax"


@pytest.fixture(autouse=True)
def needs_a_compiler() -> None:
    try:
        find_compiler()
    except CompilerMissingError as reason:
        pytest.skip(str(reason))


def arguments(level: float = 3.0) -> dict[str, Any]:
    """Nonlinear and linear constraints on either side, bounds, a hard goal, one from below, one in both directions."""
    return {
        "x": X,
        "objectives": [ca.sumsqr(X - 2), X[0] * X[1], X[0] - X[1], ca.exp(X[0])],
        "goals": [0.0, 0.5, 0.2, 5.0],
        "weights": [1.0, -2.0, 0.5, 0.0],
        "absolute": [2],
        "constraints": [ca.sumsqr(X), X[0] + ca.sin(X[1])],
        "constraints_lb": [0.1, -np.inf],
        "constraints_ub": [level, 1.6],
        "A": [[1, 2]],
        "b": [3.2],
        "lb": [0, -np.inf],
        "ub": [1.5, 2],
        "start": [0.5, 0.5],
    }


def test_every_kind_of_row_gives_the_answer_and_multipliers_of_ipopt() -> None:
    for level in (3.0, 1.2):
        compiled, ipopt = (goal_attain(**arguments(level), engine=name) for name in (ENGINE, "ipopt"))
        assert [run.engine for run in compiled.stats["runs"]] == [ENGINE]
        assert compiled.proof is Proof.STATIONARY
        assert compiled.termination is Termination.CONVERGED
        assert compiled.answer.factor == pytest.approx(ipopt.answer.factor, abs=1e-8)
        np.testing.assert_allclose(compiled.answer.x, ipopt.answer.x, atol=1e-6)
        np.testing.assert_allclose(compiled.answer.dual, ipopt.answer.dual, atol=1e-5)
        assert compiled.residuals["solver_weight_sum"] == pytest.approx(1, abs=1e-6)


def test_goals_weights_and_parameters_are_arguments_of_one_kernel() -> None:
    a: Any = ca.SX.sym("a")
    before = compiled_minmax._kernel.cache_info().misses
    for value in (1.0, 2.0, 3.0):
        found = goal_attain(
            X, [ca.sumsqr(X - a), X[0] + X[1]], [0, value], [1, value], parameters=a, parameter_values=value,
            engine=ENGINE,
        )  # fmt: skip
        check = goal_attain(
            X, [ca.sumsqr(X - a), X[0] + X[1]], [0, value], [1, value], parameters=a, parameter_values=value
        )
        assert found.answer.factor == pytest.approx(check.answer.factor, abs=1e-7)
    assert compiled_minmax._kernel.cache_info().misses == before + 1


def test_the_others_take_over_where_it_stops_short(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: Any) -> Any:
        raise OptsatError("the compiler gave up")

    monkeypatch.setattr(compiled_minmax, "_kernel", refused)
    found = minimax(X, [ca.sumsqr(X), 1 - X[0]], engine=ENGINE)
    first, second, *_ = found.stats["runs"]
    assert (first.engine, first.termination) == (ENGINE, Termination.NUMERICAL_ERROR)
    assert second.engine != ENGINE
    assert found.proof is Proof.GLOBAL


def test_rows_out_of_reach_are_not_called_solved() -> None:
    with pytest.warns(UserWarning, match="stand against each other"):
        found = minimax(X, [ca.sumsqr(X)], A=[[1, 0], [-1, 0]], b=[0, -1], engine=ENGINE)
    assert found.proof is Proof.INFEASIBLE
    assert found.stats["runs"][0].proof is Proof.NOTHING


UNFIT: dict[str, dict[str, Any]] = {
    "an equality of the constraints": {"constraints": X[0], "constraints_lb": 1, "constraints_ub": 1},
    "a linear equality": {"Aeq": [[1, 1]], "beq": [1]},
    "an exact goal": {"exact": [1]},
}


@pytest.mark.parametrize("name", UNFIT)
def test_equalities_are_left_to_others(name: str) -> None:
    problem = GoalAttainment(X, [X[0], X[1]], 0.0, **UNFIT[name])
    assert not CompiledMinMax().accepts(problem.form)
    with pytest.raises(InputError, match="cannot solve this problem"):
        goal_attain(X, [X[0], X[1]], 0.0, engine=ENGINE, **UNFIT[name])


def test_size_kind_and_compiler_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def fits(objectives: Any, x: Any) -> bool:
        return CompiledMinMax().accepts(GoalAttainment(x, objectives, 0.0).form)

    many = ca.SX.sym("x", 25)
    assert not fits(ca.sumsqr(many), many)
    assert not fits([X[0] * k for k in range(161)], X)
    assert not fits(lambda x: x, [0.0])
    assert not CompiledMinMax().accepts(object())
    assert fits(X, X)
    monkeypatch.setenv("CC", "no-such-compiler")
    assert not fits(X, X)


def test_engines_in_an_order_of_ones_own() -> None:
    found = minimax(X, [ca.sumsqr(X - 1) - ca.cos(X[0]), 0.5 - X[1]], engine=("slsqp", "auto"))
    assert found.stats["runs"][0].engine == "slsqp"
    with pytest.raises(InputError, match="`engine` is empty"):
        minimax(X, X, engine=())


def test_auto_does_not_depend_on_a_compiler() -> None:
    found = minimax(X, [ca.sin(X[0]) + ca.sumsqr(X), 1 - X[1]], starts=8, lb=-2, ub=2)
    assert ENGINE not in {run.engine for run in found.stats["runs"]}
