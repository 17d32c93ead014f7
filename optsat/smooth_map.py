"""Smooth map: a vector function of the unknowns with its derivatives, from CasADi or from a plain Python callable."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from optsat.arrays import Array

# the step that balances truncation against rounding in central differences of double precision
_STEP = float(np.cbrt(np.finfo(np.float64).eps))


class SmoothMap(Protocol):
    """A map from n unknowns to `size` values."""

    @property
    def size(self) -> int:
        """Number of values."""
        ...

    def values(self, x: Array) -> Array:
        """Return the values (size,) at x (n,)."""
        ...

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives (size, n) at x (n,)."""
        ...


@dataclass(frozen=True, eq=False)
class SymbolicMap:
    """A CasADi Function of (x, p) with one dense column of values, at fixed parameters p; derivatives are exact."""

    function: Any
    p: Array
    # the last values and where, since problem, solver and proof ask at the same points
    _last: dict[bytes, Array] = field(init=False, repr=False, default_factory=dict)

    @property
    def size(self) -> int:
        """Number of values."""
        return int(self.function.size1_out(0))

    def values(self, x: Array) -> Array:
        """Return the values (size,) at x (n,)."""
        place = x.tobytes()
        known = self._last.get(place)
        if known is None:
            known = _machine(self.function)(x, self.p).reshape(-1)
            self._last.clear()
            self._last[place] = known
        return known.copy()

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives (size, n) at x (n,)."""
        return _machine(_jacobian(self.function))(x, self.p)

    def hessian(self, x: Array, multipliers: Array) -> Array:
        """Return the second derivatives (n, n) of multipliers . values at x (n,)."""
        return _machine(_hessian(self.function))(x, self.p, multipliers)


class _Machine:
    """A Function of dense columns with one dense result, called on memory of its own: conversions cost more than it."""

    def __init__(self, function: Any) -> None:
        self.lock = threading.Lock()
        self.arguments = [np.zeros(function.size1_in(i)) for i in range(function.n_in())]
        # column by column, as CasADi keeps it
        self.result = np.zeros((function.size2_out(0), function.size1_out(0)))
        self.buffer, self.trigger = function.buffer()
        for i, each in enumerate(self.arguments):
            self.buffer.set_arg(i, each.data)
        self.buffer.set_res(0, self.result.reshape(-1).data)

    def __call__(self, *arguments: Array) -> Array:
        with self.lock:
            for kept, value in zip(self.arguments, arguments, strict=True):
                kept[:] = value
            self.trigger()
            if self.buffer.ret():
                raise RuntimeError("a CasADi function failed")
            return self.result.T.copy()


@lru_cache(maxsize=192)
def _machine(function: Any) -> _Machine:
    return _Machine(function)


# derivatives are kept with the Function, so that a new parameter value or a warm start costs no differentiation
@lru_cache(maxsize=64)
def _jacobian(function: Any) -> Any:
    import casadi as ca

    x, p = _symbols_of(function)
    return ca.Function("jacobian", [x, p], [ca.densify(ca.jacobian(function(x, p), x))])


@lru_cache(maxsize=64)
def _hessian(function: Any) -> Any:
    import casadi as ca

    x, p = _symbols_of(function)
    multipliers = type(x).sym("multipliers", function.size1_out(0))
    hessian, _ = ca.hessian(ca.dot(multipliers, function(x, p)), x)
    return ca.Function("hessian", [x, p, multipliers], [ca.densify(hessian)])


def _symbols_of(function: Any) -> tuple[Any, Any]:
    """Return fresh symbols for x and p, SX where the Function is one of scalar instructions."""
    import casadi as ca

    kind: Any = ca.SX if function.is_a("SXFunction") else ca.MX
    return kind.sym("x", function.size1_in(0)), kind.sym("p", function.size1_in(1))


def scalar_instructions(function: Any) -> Any:
    """Return the Function as one of scalar instructions, or itself where it calls what has none."""
    if not function.is_a("MXFunction"):
        return function
    try:
        return function.expand()
    except RuntimeError:
        return function


@dataclass(frozen=True, eq=False)
class CallableMap:
    """A Python callable x (n,) -> values (size,); derivatives are central differences kept inside [lower, upper].

    Accuracy of the derivatives: about 1e-10 of the values' scale where the third derivatives are of order one.
    """

    call: Callable[[Array], Array]
    size: int
    lower: Array
    upper: Array

    def values(self, x: Array) -> Array:
        """Return the values (size,) at x (n,)."""
        return self.call(np.array(x, dtype=np.float64))

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives (size, n) at x (n,) by differences of second order."""
        columns = np.empty((self.size, len(x)))
        for j, here in enumerate(x):
            step = _STEP * max(1.0, abs(float(here)))
            # representable, so that the difference of the arguments is exactly the step
            step = float((here + step) - here)
            offsets, factors = _stencil(float(here), step, float(self.lower[j]), float(self.upper[j]))
            columns[:, j] = sum(
                factor * self.values(np.where(np.arange(len(x)) == j, here + offset, x))
                for offset, factor in zip(offsets, factors, strict=True)
            )
        return columns


def _stencil(here: float, step: float, lower: float, upper: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return offsets and factors of a difference of second order that stays between the bounds where it can."""
    if lower <= here - step and here + step <= upper:
        return (step, -step), (0.5 / step, -0.5 / step)
    if here + 2 * step > upper and here - 2 * step >= lower:
        step = -step
    return (0.0, step, 2 * step), (-1.5 / step, 2 / step, -0.5 / step)


def no_values(like: SmoothMap, lower: Array, upper: Array) -> SmoothMap:
    """Return the map of x without values, symbolic where `like` is; lower, upper (n,) : bounds of x."""
    if isinstance(like, SymbolicMap):
        return SymbolicMap(_no_values(len(lower)), np.zeros(0))
    return CallableMap(lambda x: np.zeros(0), 0, lower, upper)


# one Function for each size, so that solvers kept with their Functions are found again
@lru_cache(maxsize=64)
def _no_values(n: int) -> Any:
    import casadi as ca

    return ca.Function("nothing", [ca.SX.sym("x", n), ca.SX.sym("p", 0)], [ca.SX(0, 1)])
