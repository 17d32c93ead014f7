"""Every argument that cannot be used is refused by name, and a number that is not finite never comes back unmarked."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.attain import goal_attain, minimax
from optsat.errors import InputError, UnknownOptionError
from optsat.solution import Proof, Termination

X = ca.SX.sym("x", 2)
F = [X[0] ** 2, X[1] ** 2]
FREE = ca.SX.sym("mass")


def squares(x: Array) -> Array:
    return x**2


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "goals too short": (lambda: goal_attain(X, F, [1.0]), "`goals` must hold one goal per objective: shape (2,)"),
    "weights too long": (lambda: goal_attain(X, F, [1, 1], [1, 1, 1]), "`weights` must hold one weight per objective"),
    "all weights zero": (lambda: goal_attain(X, F, [1, 1], [0, 0]), "`weights` are all zero"),
    "all objectives exact": (lambda: goal_attain(X, F, [1, 1], exact=[0, 1]), "`weights` are all zero"),
    "weight not finite": (lambda: goal_attain(X, F, [1, 1], [1, np.nan]), "`weights` must be finite"),
    "complex goal": (lambda: goal_attain(X, F, [1, 1j]), "`goals` must be real"),
    "complex start": (lambda: minimax(X, F, start=[1j, 0]), "`start` must be real"),
    "complex bound": (lambda: minimax(X, F, lb=1j), "`lb` must"),
    "weights that are text": (lambda: goal_attain(X, F, 0, ["a", "b"]), "`weights` must"),
    "constraints that miss bounds": (
        lambda: minimax(X, F, constraints=[X[0], X[1]], constraints_ub=[1, 2, 3]),
        "`constraints_ub` must be a scalar or of shape (2,)",
    ),
    "goal not finite": (lambda: goal_attain(X, F, [1, np.inf]), "`goals` must be finite"),
    "lb > ub": (lambda: minimax(X, F, lb=[0, 2], ub=[1, 1]), "`lb` must not exceed `ub`: at index 1 they are 2 and 1"),
    "lb NaN": (lambda: minimax(X, F, lb=[0, np.nan]), "`lb` must hold numbers, or -inf for no bound: index 1 is nan"),
    "ub = -inf": (lambda: minimax(X, F, ub=-np.inf), "`ub` must hold numbers, or inf for no bound"),
    "lb text": (lambda: minimax(X, F, lb="low"), "`lb` must hold numbers"),
    "lb too long": (lambda: minimax(X, F, lb=[0, 0, 0]), "`lb` must be a scalar or of shape (2,)"),
    "constraints lb > ub": (
        lambda: minimax(X, F, constraints=X[0], constraints_lb=1, constraints_ub=0),
        "`constraints_lb` must not exceed `constraints_ub`",
    ),
    "constraint bounds alone": (lambda: minimax(X, F, constraints_ub=0), "need `constraints`"),
    "A without b": (lambda: minimax(X, F, A=[[1, 1]]), "`A` was given without `b`"),
    "beq without Aeq": (lambda: minimax(X, F, beq=[1]), "`beq` was given without `Aeq`"),
    "A of wrong width": (lambda: minimax(X, F, A=[[1, 1, 1]], b=[1]), "`A` must have shape (m, 2)"),
    "b too long": (lambda: minimax(X, F, A=[[1, 1]], b=[1, 2]), "`b` must have shape (1,)"),
    "absolute out of range": (
        lambda: minimax(X, F, absolute=[2]),
        "`absolute` must hold indices of objectives in 0..1",
    ),
    "exact out of range": (lambda: goal_attain(X, F, 0, exact=[-1]), "`exact` must hold indices of objectives in 0..1"),
    "start not finite": (lambda: minimax(X, F, start=[0, np.inf]), "`start` must be finite"),
    "start of a callable not finite": (lambda: minimax([np.nan, 0], squares), "`x` must be finite"),
    "start too short": (lambda: minimax(X, F, start=[0]), "`start` must have shape (2,)"),
    "start undefined": (
        lambda: minimax(X, [ca.log(X[0]), X[1]], start=[-1, 0]),
        "`objectives` must be finite at the start: value 0 is nan at x = [-1.  0.]",
    ),
    "NaN from a callable": (
        lambda: minimax([1.0, 1.0], lambda x: [x[0], np.nan]),
        "`objectives` must be finite at the start: value 1 is nan",
    ),
    "NaN from a constraint": (
        lambda: minimax([1.0, 1.0], squares, constraints=lambda x: np.nan),
        "`constraints` must be finite at the start",
    ),
    "complex from a callable": (lambda: minimax([1.0], lambda x: [1j]), "`objectives` must return real numbers"),
    "text from a callable": (lambda: minimax([1.0], lambda x: "high"), "`objectives` must return real numbers"),
    "objective is no function": (lambda: minimax([1.0], X[0]), "for CasADi expressions give the symbol as `x`"),
    "objective is nothing": (lambda: minimax(X, []), "`objectives` is empty"),
    "unknown symbol": (lambda: minimax(X, [X[0] * FREE]), "`objectives` uses mass, which is neither in `x` nor in"),
    "mixed symbols": (lambda: minimax(X, [ca.MX.sym("y")]), "must be CasADi expressions of one kind (SX or MX)"),
    "x is an expression": (lambda: minimax(2 * X, F), "`x` must be a CasADi symbol"),
    "x is a matrix": (lambda: minimax(ca.SX.sym("x", 2, 2), F), "`x` must be a column of unknowns"),
    "x is empty": (lambda: minimax([], squares), "`x` must be a CasADi symbol or a start of shape (n,)"),
    "Function of other size": (
        lambda: minimax([1.0], ca.Function("f", [X], [X[0]])),
        "`objectives` must be a Function of x with inputs of [1] numbers",
    ),
    "parameters without values": (lambda: minimax(X, F, parameters=FREE), "`parameters` needs `parameter_values`"),
    "parameter count": (
        lambda: minimax(X, F, parameters=FREE, parameter_values=[1, 2]),
        "`parameter_values` must have shape (1,)",
    ),
    "parameters of a function": (
        lambda: minimax([1.0], squares, parameters=FREE, parameter_values=[1]),
        "`parameters` are symbols of expressions",
    ),
    "no starts": (lambda: minimax(X, F, starts=0), "`starts` must be a whole number >= 1, got 0"),
    "unknown engine": (lambda: minimax(X, F, engine="ipot"), "Did you mean `ipopt`?"),
    "engine that needs symbols": (lambda: minimax([1.0], squares, engine="ipopt"), "cannot solve this problem"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_by_name(name: str) -> None:
    call, message = REFUSED[name]
    with pytest.raises(InputError) as refused:
        call()
    assert message in str(refused.value)
    assert isinstance(refused.value, ValueError)


@pytest.mark.parametrize("call", [goal_attain, minimax])
def test_a_misspelt_option_offers_the_nearest(call: Callable[..., Any]) -> None:
    with pytest.raises(UnknownOptionError, match="Did you mean `constraints_lb`"):
        call(X, F, constraint_lb=0)


def test_a_callable_that_changes_its_length_is_refused() -> None:
    with pytest.raises(InputError, match="returned 1 values at the start but 2"):
        minimax([1.0], lambda x: [0.0] if x[0] == 1.0 else [0.0, 0.0])


def test_nan_beyond_the_start_stops_the_engine_and_is_told() -> None:
    """The objective has no value below 1: the last finite point comes back, unproven, with the reason."""
    found = minimax([3.0], lambda x: [np.nan if x[0] < 1 else x[0] ** 2, -5.0])
    assert found.proof is not Proof.GLOBAL
    assert found.proof is not Proof.STATIONARY
    assert found.termination is Termination.NUMERICAL_ERROR
    assert np.isfinite(found.answer.factor)
    assert found.answer.x[0] >= 1
    assert "`objectives` is not finite at x = " in found.stats["status"]


def test_an_error_of_the_users_function_comes_through() -> None:
    def broken(x: Array) -> Array:
        if x[0] != 1.0:
            raise ZeroDivisionError("my own")
        return x

    with pytest.raises(ZeroDivisionError, match="my own"):
        minimax([1.0], broken)
