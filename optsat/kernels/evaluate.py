"""Evaluate: a program run in Python, node by node, where no compiler is and as the leaf of every twin."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.kernels.codes import LIBM
from optsat.kernels.program import Constant, Input, Program, starts

Leaf = Callable[[Array], Array]
"""Arguments in a row to results in a row."""

_ELSEWHERE = {
    **{f"a{name}": f"arc{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "tan2")},
    "pow": "power",
}


def _erf(a: Any) -> Any:
    from scipy.special import erf

    return erf(a)


def _remainder(a: Any, b: Any) -> Any:
    size = np.abs(b)
    rest = np.fmod(np.abs(a), 2.0 * size)
    if rest > size - rest:
        rest = rest - size
        rest = rest - size if rest >= size - rest else rest
    return -rest if np.signbit(a) else rest


_ONE, _ZERO = np.float64(1.0), np.float64(0.0)


def _truth(value: Any) -> Any:
    return _ONE if value else _ZERO


_OPERATIONS: Mapping[str, Callable[..., Any]] = {
    **{
        code: getattr(np, _ELSEWHERE.get(name, name)) for code, name in LIBM.items() if name not in ("erf", "remainder")
    },
    "ERF": _erf,
    "REMAINDER": _remainder,
    "ADD": lambda a, b: a + b,
    "SUB": lambda a, b: a - b,
    "MUL": lambda a, b: a * b,
    "DIV": lambda a, b: a / b,
    "NEG": lambda a: -a,
    "SQ": lambda a: a * a,
    "TWICE": lambda a: a + a,
    "INV": lambda a: _ONE / a,
    "SQRT": np.sqrt,
    "FABS": np.abs,
    "FLOOR": np.floor,
    "CEIL": np.ceil,
    "FMAX": lambda a, b: a if b != b or a >= b else b,
    "FMIN": lambda a, b: a if b != b or a <= b else b,
    "SIGN": lambda a: _ONE if a > 0.0 else -_ONE if a < 0.0 else a,
    "COPYSIGN": lambda a, b: np.abs(a) if b != b else np.copysign(a, b),
    "IF_ELSE_ZERO": lambda p, b: b if p != 0.0 else _ZERO,
    "LT": lambda a, b: _truth(a < b),
    "LE": lambda a, b: _truth(a <= b),
    "EQ": lambda a, b: _truth(a == b),
    "NE": lambda a, b: _truth(a != b),
    "NOT": lambda p: _truth(p == 0.0),
    "AND": lambda p, q: _truth(p != 0.0 and q != 0.0),
    "OR": lambda p, q: _truth(p != 0.0 or q != 0.0),
}


def evaluator(program: Program) -> Leaf:
    """Return the program as a function of its arguments in a row, matrices counted by rows, to its results likewise.

    Arithmetic has the bits of the C form; NumPy's elementary functions agree with those of the C library to a few units
    in the last place.
    """
    begin, offsets = starts(program.inputs, dense=True), [each.offsets(dense=True) for each in program.inputs]
    values: list[Any] = [None] * len(program.nodes)
    loads: list[tuple[int, int]] = []
    operations: list[tuple[int, Callable[..., Any], tuple[int, ...]]] = []
    for index, node in enumerate(program.nodes):
        if isinstance(node, Constant):
            values[index] = np.float64(node.value)
        elif isinstance(node, Input):
            loads.append((index, begin[node.argument] + offsets[node.argument][node.element]))
        else:
            operations.append((index, _OPERATIONS[node.code], node.operands))
    stores = [
        (start + offset, index)
        for start, pattern, result in zip(
            starts(program.outputs, dense=True), program.outputs, program.results, strict=False
        )
        for offset, index in zip(pattern.offsets(dense=True), result, strict=True)
    ]
    length = starts(program.outputs, dense=True)[-1]

    def run(x: Array) -> Array:
        found = values.copy()
        with np.errstate(all="ignore"):
            for index, place in loads:
                found[index] = x[place]
            for index, operation, operands in operations:
                found[index] = operation(*[found[i] for i in operands])
        y = np.zeros(length)
        for place, index in stores:
            y[place] = found[index]
        return y

    return run
