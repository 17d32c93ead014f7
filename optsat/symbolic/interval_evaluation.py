"""Interval evaluation: bounds of a scalar function's results over a box of its arguments, rounded outward."""

import math
from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from optsat.arrays import Array
from optsat.kernels.program import Constant, Input, Program

Interval: TypeAlias = tuple[float, float]

_ALL = (-math.inf, math.inf)
# the mathematical library's own error, in units of the last place, is below this
_LIBM = 4


def evaluate_over_box(program: Program, boxes: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return lower and upper bounds (k,) of the non-zeros of the first result, for arguments within boxes.

    boxes : (lower, upper) of each argument, counted by its non-zeros
    An operation that has no interval rule here yields (-inf, inf).
    """
    values: list[Interval] = []
    for node in program.nodes:
        if isinstance(node, Constant):
            values.append((node.value, node.value))
        elif isinstance(node, Input):
            lower, upper = boxes[node.argument]
            values.append((float(lower[node.element]), float(upper[node.element])))
        else:
            operands = [values[i] for i in node.operands]
            same = len(operands) == 2 and node.operands[0] == node.operands[1]
            values.append(_applied(node.code, operands, same))
    found = [values[i] for i in program.results[0]]
    return np.array([low for low, _ in found]), np.array([high for _, high in found])


def _applied(code: str, operands: list[Interval], same: bool) -> Interval:
    if code == "MUL" and same:
        code, operands = "SQ", operands[:1]
    rule = _RULES.get(code)
    if rule is None:
        return _ALL
    try:
        low, high = rule(*operands)
    except (ValueError, OverflowError, ZeroDivisionError):
        return _ALL
    return _ALL if math.isnan(low) or math.isnan(high) else (low, high)


def _outward(low: float, high: float, steps: int = 1) -> Interval:
    for _ in range(steps):
        low, high = math.nextafter(low, -math.inf), math.nextafter(high, math.inf)
    return low, high


def _times(u: float, v: float) -> float:
    # an infinite bound is never reached, so that zero times it is zero
    return 0.0 if u == 0.0 or v == 0.0 else u * v


def _mul(a: Interval, b: Interval) -> Interval:
    products = [_times(u, v) for u in a for v in b]
    return _outward(min(products), max(products))


def _inv(a: Interval) -> Interval:
    if a[0] <= 0.0 <= a[1]:
        return _ALL
    return _outward(1 / a[1], 1 / a[0])


def _sq(a: Interval) -> Interval:
    low = 0.0 if a[0] <= 0.0 <= a[1] else min(abs(a[0]), abs(a[1])) ** 2
    return max(0.0, math.nextafter(low, -math.inf)), math.nextafter(max(abs(a[0]), abs(a[1])) ** 2, math.inf)


def _pow(a: Interval, b: Interval) -> Interval:
    exponent = b[0]
    if b[0] != b[1]:
        return _ALL
    if exponent == 2.0:
        return _sq(a)
    if a[0] < 0.0 and (exponent != int(exponent)):
        return _ALL
    if exponent < 0.0:
        return _inv(_pow(a, (-exponent, -exponent)))
    ends = [a[0] ** exponent, a[1] ** exponent]
    if exponent % 2 == 0 and a[0] < 0.0 < a[1]:
        ends.append(0.0)
    return _outward(min(ends), max(ends), _LIBM)


def _rising(function: Callable[[float], float]) -> Callable[[Interval], Interval]:
    return lambda a: _outward(function(a[0]), function(a[1]), _LIBM)


def _sin(a: Interval) -> Interval:
    if not math.isfinite(a[0]) or not math.isfinite(a[1]) or a[1] - a[0] >= 2 * math.pi:
        return -1.0, 1.0
    ends = [math.sin(a[0]), math.sin(a[1])]
    low, high = _outward(min(ends), max(ends), _LIBM)
    # a peak or a trough inside, found with a margin for the rounding of pi
    first, last = (a[0] / math.pi - 0.5) - 1e-9, (a[1] / math.pi - 0.5) + 1e-9
    for k in range(math.ceil(first), math.floor(last) + 1):
        low, high = (low, 1.0) if k % 2 == 0 else (-1.0, high)
    return max(low, -1.0), min(high, 1.0)


def _fabs(a: Interval) -> Interval:
    ends = abs(a[0]), abs(a[1])
    return (0.0 if a[0] <= 0.0 <= a[1] else min(ends)), max(ends)


_RULES: Mapping[str, Callable[..., Interval]] = {
    "ADD": lambda a, b: _outward(a[0] + b[0], a[1] + b[1]),
    "SUB": lambda a, b: _outward(a[0] - b[1], a[1] - b[0]),
    "MUL": _mul,
    "DIV": lambda a, b: _mul(a, _inv(b)),
    "NEG": lambda a: (-a[1], -a[0]),
    "TWICE": lambda a: (2 * a[0], 2 * a[1]),
    "SQ": _sq,
    "INV": _inv,
    "POW": _pow,
    "CONSTPOW": _pow,
    "SQRT": _rising(math.sqrt),
    "EXP": _rising(math.exp),
    "EXPM1": _rising(math.expm1),
    "LOG": _rising(math.log),
    "LOG1P": _rising(math.log1p),
    "SINH": _rising(math.sinh),
    "TANH": _rising(math.tanh),
    "ATAN": _rising(math.atan),
    "SIN": _sin,
    "COS": lambda a: _sin(_outward(a[0] + math.pi / 2, a[1] + math.pi / 2)),
    "FABS": _fabs,
    "FMAX": lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    "FMIN": lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
}
