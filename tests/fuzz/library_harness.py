"""Libraries of one kernel, compiled for this machine, and called through each of their functions."""

import ctypes
import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from optsat.kernels.leaf import leaf_source
from optsat.kernels.lowering import lower
from optsat.kernels.program import Program
from optsat.kernels.source import KernelSource
from optsat.kernels.toolchain import Compiler
from optsat.kernels.unit import Real, library_text
from optsat.port import Port

NATIVE = ("-march=native", "-fno-math-errno", "-fno-trapping-math", "-Wno-psabi")
TYPES: Mapping[Real, Any] = {"double": np.float64, "float": np.float32}

_number = itertools.count()


def native(compiler: Compiler) -> Compiler:
    return Compiler(compiler.command, (*compiler.flags, *NATIVE))


def source_of(function: ca.Function, math: Any = "own") -> KernelSource:
    program = lower(function)
    return leaf_source(program, *ports_of(program), math=math)


def ports_of(program: Program) -> tuple[list[Port], list[Port]]:
    def ports(patterns: Any) -> list[Port]:
        return [Port(p.name, (p.rows,) if p.columns == 1 else (p.rows, p.columns), "-") for p in patterns]

    return ports(program.inputs), ports(program.outputs)


class Library:
    """The functions of one compiled kernel, over lists of arrays, one for each port."""

    def __init__(
        self,
        source: KernelSource,
        compiler: Compiler,
        folder: Path,
        width: int = 1,
        real: Real = "double",
        optimisation: str = "-O2",
    ) -> None:
        path = folder / f"library_{next(_number)}.so"
        native(compiler).build_library(library_text(source, real, width), path, optimisation)
        self.source, self.type = source, TYPES[real]
        self.library = ctypes.CDLL(str(path))
        self.width = ctypes.c_uint32.in_dll(self.library, "os_width").value

    def call(self, arguments: Sequence[Any]) -> tuple[int, list[Any]]:
        """Status and results of one sample."""
        outputs = [np.full(port.size, 77.0, self.type) for port in self.source.outputs]
        return self._function("call")(_pointers(arguments), _pointers(outputs)), outputs

    def batch(self, n: int, arguments: Sequence[Any], strides: Sequence[int], status: Any = None) -> list[Any]:
        """Results (n, k); what stands behind them in memory must not change."""
        outputs = [np.full(n * port.size + 8, 77.0, self.type) for port in self.source.outputs]
        function = self._function("batch")
        function.restype = ctypes.c_int64
        pointer = None if status is None else ctypes.c_void_p(status.ctypes.data)
        failed = function(ctypes.c_int64(n), _pointers(arguments), _integers(strides), _pointers(outputs), pointer)
        assert failed == 0
        assert all((output[-8:] == 77.0).all() for output in outputs)
        return [o[:-8].reshape(n, p.size) for o, p in zip(outputs, self.source.outputs, strict=True)]

    def tiles(self, tiles: int, arguments: Sequence[Any], strides: Sequence[int]) -> list[Any]:
        """Results (tiles, k, width)."""
        outputs = [np.full((tiles, port.size, self.width), 77.0, self.type) for port in self.source.outputs]
        self._function("tiles")(ctypes.c_int64(tiles), _pointers(arguments), _integers(strides), _pointers(outputs))
        return outputs

    def rows(self, x: Any) -> Any:
        """All arguments in a row (n, k_in) to all results in a row (n, k_out), through the batch function."""
        sizes = [port.size for port in self.source.inputs]
        parts = np.split(np.asarray(x, self.type), np.cumsum(sizes)[:-1], axis=1)
        arguments = [np.ascontiguousarray(part) for part in parts]
        return np.concatenate(self.batch(len(x), arguments, sizes), axis=1)

    def _function(self, name: str) -> Any:
        return self.library[f"{self.source.name}_{name}"]


def _pointers(arrays: Sequence[Any]) -> Any:
    return (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))


def _integers(values: Sequence[int]) -> Any:
    return (ctypes.c_int64 * len(values))(*values)
