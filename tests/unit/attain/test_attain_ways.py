"""Every way to write one problem gives one answer: SX, MX, Function, generated function, callable, parameters."""

import inspect
from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.attain import goal_attain, minimax
from optsat.port import Port
from optsat.problems.minimax import Minimax
from optsat.smooth_map import SymbolicMap
from optsat.solution import Proof, Solution
from optsat.solvers import SOLVERS
from optsat.solvers.ipopt import Ipopt
from optsat.symbolic.generated_function import generate

# min max((x - a)^2 + y^2, (x + a)^2 + y^2 + 1) subject to x^2 + y^2 >= 1 and y >= 1/2: at a = 2 the circle and balance
# hold, 8 x = 1 and y^2 = 1 - x^2
A_VALUE = 2.0
OPTIMUM = np.array([-0.125, np.sqrt(1 - 0.125**2)])
FACTOR = (0.125 + 2) ** 2 + 1 - 0.125**2


def objectives(x: Any, a: Any) -> list[Any]:
    return [(x[0] - a) ** 2 + x[1] ** 2, (x[0] + a) ** 2 + x[1] ** 2 + 1]


def circle(x: Any, _: Any = None) -> Any:
    return x[0] ** 2 + x[1] ** 2


def symbols(kind: Any) -> tuple[Any, Any]:
    return kind.sym("x", 2), kind.sym("a", 1)


def expressions(kind: Any) -> Solution[Any]:
    x, a = symbols(kind)
    return minimax(
        x,
        objectives(x, a),
        constraints=circle(x),
        constraints_lb=1,
        lb=[-np.inf, 0.5],
        parameters=a,
        parameter_values=A_VALUE,
        start=[1, 2],
    )


def functions(kind: Any) -> Solution[Any]:
    x, a = symbols(kind)
    F, g = ca.Function("F", [x, a], [ca.vertcat(*objectives(x, a))]), ca.Function("g", [x, a], [circle(x)])
    return minimax([1, 2], F, constraints=g, constraints_lb=1, lb=[-np.inf, 0.5], parameter_values=[A_VALUE])


def generated(_: Any) -> Solution[Any]:
    x, a = symbols(ca.SX)
    F = generate(
        "F",
        [(Port("x", (2,), "-"), x), (Port("a", (), "-"), a)],
        [(Port("F", (2,), "-"), ca.vertcat(*objectives(x, a)))],
    )
    return minimax([1, 2], F, constraints=circle, constraints_lb=1, lb=[-np.inf, 0.5], parameter_values=[A_VALUE])


def callables(_: Any) -> Solution[Any]:
    return minimax(
        [1.0, 2.0],
        lambda x, p: objectives(x, p[0]),
        constraints=circle,
        constraints_lb=1,
        lb=[-np.inf, 0.5],
        parameter_values=[A_VALUE],
    )


WAYS = {
    "SX": (expressions, ca.SX),
    "MX": (expressions, ca.MX),
    "SX Function": (functions, ca.SX),
    "MX Function": (functions, ca.MX),
    "generated function": (generated, None),
    "callables": (callables, None),
}


@pytest.mark.parametrize("way", WAYS)
def test_one_answer(way: str) -> None:
    call, kind = WAYS[way]
    found = call(kind)
    assert found.proof is Proof.STATIONARY
    np.testing.assert_allclose(found.answer.x, OPTIMUM, atol=1e-7)
    assert found.answer.factor == pytest.approx(FACTOR, rel=1e-9)
    assert found.answer.active == (0, 1)
    assert found.answer.active_constraints == ("constraint 0",)
    assert found.answer.constraint_multipliers[0] < 0
    assert found.answer.multipliers.sum() == pytest.approx(1, abs=1e-6)


def test_a_function_that_cannot_be_expanded_runs_on_matrix_symbols() -> None:
    """An interpolant has no scalar instructions: no curvature is claimed, the answer stands."""
    table = ca.interpolant("table", "bspline", [np.linspace(-2, 2, 9).tolist()], (np.linspace(-2, 2, 9) ** 2).tolist())
    x = ca.MX.sym("x")
    found = minimax(x, [table(x), 1 - x], start=[0.3])
    assert found.proof is Proof.STATIONARY
    assert found.answer.x[0] == pytest.approx((np.sqrt(5) - 1) / 2, abs=1e-6)


class Square(ca.Callback):
    """A function that lives in this process only; its derivatives are differences."""

    def __init__(self) -> None:
        super().__init__()
        self.construct("square", {"enable_fd": True})

    def eval(self, arg: Any) -> list[Any]:
        return [arg[0] ** 2]


def test_an_expression_that_calls_back_into_python() -> None:
    square, x = Square(), ca.MX.sym("x")
    found = minimax(x, [square(x), 2 - x], start=[0.3])
    assert found.answer.x[0] == pytest.approx(1, abs=1e-5)


def test_equal_expressions_share_one_function() -> None:
    first, second = (
        Minimax(x, objectives(x, a), parameters=a, parameter_values=1) for x, a in map(symbols, [ca.SX] * 2)
    )
    maps = [each.form.objectives for each in (first, second)]
    assert isinstance(maps[0], SymbolicMap)
    assert isinstance(maps[1], SymbolicMap)
    assert maps[0].function is maps[1].function


def test_help_names_every_option() -> None:
    for verb in (goal_attain, minimax):
        assert {"lb", "Aeq", "constraints_ub", "parameter_values", "engine"} <= set(inspect.signature(verb).parameters)


def test_equality_and_inequality_rows() -> None:
    """On the line x + y + z = 3 with x <= y - 1, the sum of squares is least at (1/2, 3/2, 1)."""
    x = ca.SX.sym("x", 3)
    found = minimax(x, ca.sumsqr(x), A=[[1, -1, 0]], b=-1, Aeq=[[1, 1, 1]], beq=3)
    assert found.proof is Proof.GLOBAL
    np.testing.assert_allclose(found.answer.x, (0.5, 1.5, 1), atol=1e-7)
    np.testing.assert_allclose(found.answer.linear_multipliers, (1, -2), atol=1e-6)


def test_absolute_deviations_in_both_directions() -> None:
    x = ca.SX.sym("x")
    one_sided = goal_attain(x, [x, 4 - x], [3, 3], start=[9.0])
    two_sided = goal_attain(x, [x, 4 - x], [3, 3], absolute=True, start=[9.0])
    assert one_sided.answer.factor == pytest.approx(-1, abs=1e-8)
    assert two_sided.answer.factor == pytest.approx(1, abs=1e-8)
    assert two_sided.answer.x[0] == pytest.approx(2, abs=1e-7)


def test_an_exact_goal_is_met_whatever_its_weight() -> None:
    x = ca.SX.sym("x", 2)
    found = goal_attain(x, [ca.sumsqr(x), x[0] + x[1]], [0, 2], [1, 5], exact=[1], start=[3, 0])
    assert found.answer.objectives[1] == pytest.approx(2, abs=1e-8)
    np.testing.assert_allclose(found.answer.x, (1, 1), atol=1e-6)
    assert found.proof is Proof.GLOBAL


def test_weights_are_the_units_of_the_miss() -> None:
    """Goals missed by t w: with weights 1 and 3, x = 1 + t and 5 - x = 1 + 3 t meet at t = 3/4."""
    x = ca.SX.sym("x")
    found = goal_attain(x, [x, 5 - x], [1, 1], [1, 3])
    assert found.answer.factor == pytest.approx(0.75, abs=1e-9)
    assert found.answer.x[0] == pytest.approx(1.75, abs=1e-8)
    weighted = float(np.array([1, 3]) @ found.answer.multipliers)
    assert weighted == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("name", ["ipopt", "sqp_daqp"])
def test_a_warm_start_continues_where_the_last_solution_stood(name: str) -> None:
    x, a = symbols(ca.SX)

    def at(value: float, start: Any) -> Solution[Any]:
        return minimax(
            x, objectives(x, a), constraints=circle(x), constraints_lb=1, parameters=a, parameter_values=value,
            start=start, engine=name,
        )  # fmt: skip

    first = at(2.0, [1, 2])
    cold, warm = at(2.01, [1, 2]), at(2.01, first)
    np.testing.assert_allclose(warm.answer.x, cold.answer.x, atol=1e-6)
    assert warm.stats["iterations"] < cold.stats["iterations"]


def test_starts_are_reproducible_and_the_best_is_kept() -> None:
    x = ca.SX.sym("x")
    wave = [ca.sin(3 * x) + 0.1 * x**2]
    one = minimax(x, wave, lb=-5, ub=5, start=[4.0])
    first, again, other = (minimax(x, wave, lb=-5, ub=5, start=[4.0], starts=12, seed=seed) for seed in (1, 1, 2))
    assert first.answer.factor < one.answer.factor - 0.5
    assert [run.factor for run in first.stats["runs"]] == [run.factor for run in again.stats["runs"]]
    assert [run.factor for run in first.stats["runs"]] != [run.factor for run in other.stats["runs"]]
    assert first.answer.factor == min(run.factor for run in first.stats["runs"])


def test_a_given_engine_runs_alone() -> None:
    x = ca.SX.sym("x")
    for engine in (Ipopt(max_iterations=1), "slsqp"):
        found = minimax(x, [x**4, 1 - x], start=[40.0], engine=engine)
        assert {run.engine for run in found.stats["runs"]} == {getattr(engine, "name", engine)}


def test_the_next_engine_is_tried_when_an_answer_does_not_stand(monkeypatch: pytest.MonkeyPatch) -> None:
    """An engine that claims to have converged far from any optimum is found out, and the result says so."""
    from optsat import solvers
    from optsat.forms import Point
    from optsat.solution import Termination

    class Boastful:
        name = "boastful"

        def accepts(self, form: object) -> bool:
            return True

        def run(self, form: object, start: Point | None = None) -> Point:
            return Point(np.array([7.0]), np.zeros(0), Termination.CONVERGED, 1)

    monkeypatch.setattr(solvers, "SOLVERS", (Boastful(), *SOLVERS))
    x = ca.SX.sym("x")
    found = minimax(x, [ca.exp(x), ca.exp(-x)], ub=10)
    first, second = found.stats["runs"]
    assert (first.engine, first.proof, first.termination) == ("boastful", Proof.FEASIBLE, Termination.CONVERGED)
    assert "not accurate: KKT residual" in first.verdict
    assert (second.engine, second.proof) == ("ipopt", Proof.GLOBAL)
    assert found.answer.factor == pytest.approx(1, abs=1e-8)
    assert found.stats["solver"] == "ipopt"


def test_derivatives_of_a_callable_stay_inside_the_bounds() -> None:
    seen: list[float] = []

    def root(x: Array) -> Array:
        seen.append(float(x[0]))
        return np.array([np.sqrt(x[0]), 1 - x[0]])

    found = minimax([0.5], root, lb=0, ub=1)
    assert min(seen) >= 0
    assert max(seen) <= 1
    assert found.answer.x[0] == pytest.approx((3 - np.sqrt(5)) / 2, abs=1e-8)
