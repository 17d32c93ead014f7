"""Single precision: a generated function run operation by operation in float32."""

from collections.abc import Callable
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.kernels.lowering import lower
from optsat.kernels.program import Constant, Input
from optsat.symbolic.generated_function import GeneratedFunction

OPERATIONS: dict[str, Callable[..., Any]] = {
    "ADD": np.add,
    "SUB": np.subtract,
    "MUL": np.multiply,
    "DIV": np.divide,
    "NEG": np.negative,
    "SQ": np.square,
    "TWICE": lambda a: a + a,
    "INV": lambda a: np.float32(1) / a,
    "SQRT": np.sqrt,
    "FABS": np.abs,
    "FMAX": np.fmax,
    "FMIN": np.fmin,
    "SIN": np.sin,
    "COS": np.cos,
    "ATAN2": np.arctan2,
    "LOG": np.log,
    "LT": np.less,
    "LE": np.less_equal,
    "EQ": np.equal,
    "NE": np.not_equal,
    "NOT": lambda a: a == 0,
    "AND": lambda a, b: (a != 0) & (b != 0),
    "OR": lambda a, b: (a != 0) | (b != 0),
    "IF_ELSE_ZERO": lambda c, x: np.where(c != 0, x, np.float32(0)),
}


class SinglePrecision:
    """A generated function in float32."""

    def __init__(self, function: GeneratedFunction) -> None:
        self.function, self.program = function, lower(function.casadi)

    def batch(self, *values: Any) -> list[Array]:
        """The results (N, *shape) of arguments (N, *shape) or (*shape), in float64 that holds what float32 gave."""
        inputs, outputs = self.function.inputs, self.function.outputs
        arrays = [np.asarray(value, np.float32) for value in values]
        count = max(len(a) for a, port in zip(arrays, inputs, strict=True) if a.shape != port.shape)
        columns = []
        for array, port in zip(arrays, inputs, strict=True):
            full = np.broadcast_to(array, (count, *port.shape)).reshape(count, port.rows, port.columns)
            columns.append(np.swapaxes(full, 1, 2).reshape(count, -1))
        found: list[Any] = []
        with np.errstate(all="ignore"):
            for node in self.program.nodes:
                if isinstance(node, Input):
                    value = columns[node.argument][:, node.element]
                elif isinstance(node, Constant):
                    value = np.full(count, node.value, np.float32)
                else:
                    value = OPERATIONS[node.code](*(found[i] for i in node.operands)).astype(np.float32)
                found.append(value)
        results = []
        for port, result in zip(outputs, self.program.results, strict=True):
            flat = np.stack([found[i] for i in result], axis=1).reshape(count, port.columns, port.rows)
            results.append(np.swapaxes(flat, 1, 2).reshape(count, *port.shape).astype(np.float64))
        return results
