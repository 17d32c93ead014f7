"""User function: what a user may hand in as objectives or constraints, turned into a smooth map of the unknowns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.attitude.backend import is_symbolic
from optsat.errors import InputError
from optsat.smooth_map import CallableMap, SmoothMap, SymbolicMap, scalar_instructions
from optsat.symbolic.generated_function import GeneratedFunction


@dataclass(frozen=True)
class Unknowns:
    """The unknowns x (n,) and parameters p of a problem, as symbols where the user wrote expressions.

    symbol, parameters : CasADi columns, or None where the functions are called with numbers
    p (np,) : values of the parameters, empty where there are none
    """

    n: int
    symbol: Any
    parameters: Any
    p: Array
    start: Array
    lower: Array
    upper: Array


def count_of(x: Any) -> int:
    """Return the number of unknowns of a CasADi symbol, or of a start.

    Raises
    ------
    InputError : not a column of symbols, or a start that is not finite.
    """
    if is_symbolic(x):
        if not hasattr(x, "is_valid_input") or not x.is_valid_input() or x.numel() == 0:
            raise InputError(f"`x` must be a CasADi symbol (SX.sym or MX.sym) or its start, got {x}.")
        if x.shape[1] != 1:
            raise InputError(f"`x` must be a column of unknowns, got shape {x.shape}.")
        return int(x.numel())
    start = finite_array("x", x)
    if start.ndim != 1 or len(start) == 0:
        raise InputError(f"`x` must be a CasADi symbol or a start of shape (n,), got shape {start.shape}.")
    return len(start)


def parameter_values(parameters: Any, values: Any) -> Array:
    """Return the parameters' values (np,).

    Raises
    ------
    InputError : symbols without values, not finite, wrong count.
    """
    if values is None:
        if parameters is not None:
            raise InputError("`parameters` needs `parameter_values`.")
        return np.zeros(0)
    p = finite_array("parameter_values", np.atleast_1d(np.asarray(values)))
    if p.ndim != 1:
        raise InputError(f"`parameter_values` must have shape (n,), got {p.shape}.")
    if parameters is not None:
        if not hasattr(parameters, "is_valid_input") or not parameters.is_valid_input():
            raise InputError(f"`parameters` must be a column of CasADi symbols, got {parameters}.")
        if parameters.shape != (len(p), 1):
            raise InputError(f"`parameter_values` must have shape ({parameters.shape[0]},), got {p.shape}.")
    return p


def smooth_map(name: str, function: Any, unknowns: Unknowns) -> SmoothMap:
    """Return what the user gave as a map of the unknowns, evaluated once at the start.

    function : CasADi expression or sequence of them, CasADi Function or GeneratedFunction of (x) or (x, p),
    or a Python callable likewise

    Raises
    ------
    InputError : symbols that are not known, a wrong signature, a result that is no vector of finite numbers.
    """
    if isinstance(function, GeneratedFunction):
        function = function.casadi
    if type(function).__name__ == "Function" and is_symbolic(function):
        result: SmoothMap = SymbolicMap(_of_function(name, function, unknowns), unknowns.p)
    elif callable(function):
        result = _of_callable(name, function, unknowns)
    elif unknowns.symbol is None:
        raise InputError(
            f"`{name}` must be a CasADi Function or a Python callable when `x` is a start; "
            "for CasADi expressions give the symbol as `x` and the numbers as `start`."
        )
    else:
        result = SymbolicMap(_of_expression(name, function, unknowns), unknowns.p)
    values = result.values(unknowns.start)
    if not np.all(np.isfinite(values)):
        i = int(np.argmax(~np.isfinite(values)))
        raise InputError(
            f"`{name}` must be finite at the start: value {i} is {values[i]:g} at x = "
            f"{np.array2string(unknowns.start, precision=6)}. Give a start where all functions are defined."
        )
    return result


def _of_expression(name: str, expression: Any, unknowns: Unknowns) -> Any:
    import casadi as ca

    parts = list(expression) if isinstance(expression, Sequence) else [expression]
    try:
        column = type(unknowns.symbol)(ca.vertcat(*(ca.vec(part) if is_symbolic(part) else part for part in parts)))
    except (NotImplementedError, RuntimeError):
        raise InputError(f"`{name}` must be CasADi expressions of one kind (SX or MX), got {expression!r}.") from None
    if isinstance(column, ca.SX):
        return _of_same_elements(_Elements.of(unknowns, column), name)
    return _function(name, unknowns, column)


@dataclass(frozen=True)
class _Elements:
    """Expressions by the identity of their elements, which live as long as this does."""

    identity: tuple[int, ...]
    unknowns: Unknowns = field(compare=False)
    column: Any = field(compare=False)

    @classmethod
    def of(cls, unknowns: Unknowns, column: Any) -> "_Elements":
        symbols = [unknowns.symbol] if unknowns.parameters is None else [unknowns.symbol, unknowns.parameters]
        counted = [each.element_hash() for part in (*symbols, column) for each in part.elements()]
        return cls((*map(len, map(type(column).elements, symbols)), *counted), unknowns, type(column)(column))


# the very same expressions again, perhaps with other goals and parameters, need not even be read
@lru_cache(maxsize=64)
def _of_same_elements(elements: _Elements, name: str) -> Any:
    return _function(name, elements.unknowns, elements.column)


def _of_function(name: str, function: Any, unknowns: Unknowns) -> Any:
    sizes = [function.numel_in(i) for i in range(function.n_in())]
    wanted = [unknowns.n, len(unknowns.p)] if len(unknowns.p) else [unknowns.n]
    if sizes != wanted:
        raise InputError(
            f"`{name}` must be a Function of {'(x, p)' if len(unknowns.p) else 'x'} with inputs of "
            f"{wanted} numbers, got {function}."
        )
    return _column_function(function, unknowns.n, len(unknowns.p))


# kept, so that a second call with the same Function finds its derivatives ready
@lru_cache(maxsize=64)
def _column_function(function: Any, unknowns: int, parameters: int) -> Any:
    import casadi as ca

    kind: Any = ca.SX if function.is_a("SXFunction") else ca.MX
    x, p = kind.sym("x", unknowns), kind.sym("p", parameters)
    shaped = [ca.reshape(value, *function.size_in(i)) for i, value in zip(range(function.n_in()), (x, p), strict=False)]
    column = ca.vertcat(*(ca.vec(part) for part in function.call(shaped)))
    return scalar_instructions(ca.Function("values", [x, p], [ca.densify(column)]))


def _function(name: str, unknowns: Unknowns, column: Any) -> Any:
    import casadi as ca

    kind = type(unknowns.symbol)
    parameters = kind.sym("p", 0) if unknowns.parameters is None else unknowns.parameters
    function = ca.Function(name, [unknowns.symbol, parameters], [ca.densify(column)], {"allow_free": True})
    if function.has_free():
        raise InputError(
            f"`{name}` uses {', '.join(map(str, function.get_free()))}, which is neither in `x` nor in `parameters`."
        )
    function = scalar_instructions(function)
    # what calls other functions may call back into Python, which its text does not tell
    return _kept(_Written(function.serialize(), function)) if function.is_a("SXFunction") else function


@dataclass(frozen=True)
class _Written:
    """A Function of scalar instructions, equal to another that computes the same."""

    text: str
    function: Any = field(compare=False)


# one Function for equal expressions, so that a problem written again finds its derivatives and solvers ready
@lru_cache(maxsize=64)
def _kept(written: _Written) -> Any:
    return written.function


def _of_callable(name: str, function: Callable[..., Any], unknowns: Unknowns) -> CallableMap:
    def call(x: Array) -> Array:
        value = function(x, unknowns.p.copy()) if len(unknowns.p) else function(x)
        try:
            return np.asarray(value, dtype=np.float64).reshape(-1)
        except (TypeError, ValueError):
            raise InputError(f"`{name}` must return real numbers, got {value!r}.") from None

    size = len(call(unknowns.start.copy()))

    def checked(x: Array) -> Array:
        values = call(x)
        if len(values) != size:
            raise InputError(f"`{name}` returned {size} values at the start but {len(values)} at x = {x}.")
        return values

    return CallableMap(checked, size, unknowns.lower, unknowns.upper)
