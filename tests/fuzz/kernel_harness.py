"""Random symbolic graphs, and the ways to run them: CasADi's virtual machine, compiled C, NumPy printed and direct."""

import ctypes
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.kernels.codes import ARITY
from optsat.kernels.headers import headers_text
from optsat.kernels.print_numpy import print_numpy
from optsat.kernels.program import Constant, Input, Operation, Program, starts
from optsat.kernels.toolchain import Compiler

SPECIAL = (0.0, -0.0, np.nan, np.inf, -np.inf, 5e-324, -1e-310, 1e308, -1e308, 1.0, -1.0, 0.5, 2.0)
SPECIAL_FLOAT = (0.0, -0.0, np.nan, np.inf, -np.inf, 1.4e-45, -1e-40, 3e38, -3e38, 1.0, -1.0, 0.5, 2.0)
PLAIN = (0.1, np.pi, 3.0, -7.25, 1.0, -1.0, 0.5, 2.0)
CONSTANTS = (*SPECIAL, *PLAIN)
CONSTANTS_FLOAT = (0.0, -0.0, np.nan, np.inf, -np.inf, *PLAIN)
COMPILERS = ("gcc", "clang")
GRAPHS = int(os.environ.get("OPTSAT_FUZZ_GRAPHS", "50"))
"""Random graphs of each kind; a campaign sets OPTSAT_FUZZ_GRAPHS to 500 or more."""


def compiler_named(name: str) -> Compiler:
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not on the path")
    return Compiler((path,))


def any_compiler() -> Compiler:
    for name in COMPILERS:
        if path := shutil.which(name):
            return Compiler((path,))
    pytest.skip(f"no C compiler: none of {', '.join(COMPILERS)} is on the path")


def apply(code: str, *operands: Any) -> Any:
    number = getattr(ca, f"OP_{code}")
    return ca.SX.unary(number, *operands) if ARITY[code] == 1 else ca.SX.binary(number, *operands)


def random_graph(
    rng: np.random.Generator,
    name: str,
    codes: Sequence[str],
    steps: int,
    jacobian: bool,
    constants: Sequence[float] = CONSTANTS,
) -> ca.Function:
    """A function of 40 values or so: a dense and a sparse input, one that is never NaN, a dense and a sparse output."""
    x = ca.SX.sym("x", 3)
    sparse = ca.SX.sym("s", ca.Sparsity(2, 3, [0, 1, 1, 3], [1, 0, 1]))
    never_nan = ca.SX.sym("n", 2)
    signs = [never_nan[0], never_nan[1], -never_nan[0], ca.SX(-2.0)]
    values: list[Any] = [*(x[k] for k in range(3)), *sparse.nonzeros(), never_nan[0], never_nan[1]]

    def operand() -> Any:
        if rng.random() < 0.12:
            return ca.SX(constants[int(rng.integers(len(constants)))])
        recent = values[-8:] if rng.random() < 0.5 else values
        return recent[rng.integers(len(recent))]

    for _ in range(steps):
        code = codes[int(rng.integers(len(codes)))]
        operands = [operand() for _ in range(ARITY[code])]
        if code == "COPYSIGN":
            # of a NaN, the virtual machine takes the sign that this machine happened to give it
            operands[1] = signs[rng.integers(len(signs))]
        values.append(apply(code, *operands))
    column = ca.vertcat(*(values[-1 - k] for k in range(4)), *(values[rng.integers(len(values))] for _ in range(4)))
    scattered: Any = ca.SX(3, 3)
    for place in rng.choice(9, 4, replace=False):
        scattered[int(place) // 3, int(place) % 3] = values[rng.integers(len(values))]
    outputs = [column, scattered]
    if jacobian:
        outputs.append(ca.jacobian(column, x))
    return ca.Function(name, [x, sparse, never_nan], outputs, ["x", "s", "n"], ["y", "m", "J"][: len(outputs)])


def random_inputs(rng: np.random.Generator, count: int, specials: Sequence[float] = SPECIAL) -> Array:
    """(count, 8) values for `random_graph`: 35 % special, one in ten a copy of its neighbour."""
    values = rng.normal(size=(count, 8)) * 10.0 ** rng.uniform(-3.0, 3.0, (count, 8))
    special = np.array(specials)[rng.integers(len(specials), size=values.shape)]
    values = np.where(rng.random(values.shape) < 0.35, special, values)
    copied = np.where(rng.random(values.shape) < 0.1, np.roll(values, 1, axis=1), values)
    copied[:, 6:] = np.where(np.isnan(copied[:, 6:]), -0.0, copied[:, 6:])
    return np.asarray(copied)


def on_machine(function: ca.Function, x: Array) -> Array:
    """The oracle: non-zeros of all inputs in a row to non-zeros of all outputs in a row, through the buffer."""
    buffer: Any
    buffer, trigger = function.buffer()
    inputs = [np.zeros(function.nnz_in(k)) for k in range(function.n_in())]
    outputs = [np.zeros(function.nnz_out(k)) for k in range(function.n_out())]
    for k, array in enumerate(inputs):
        if array.size:
            buffer.set_arg(k, memoryview(array.data))
    for k, array in enumerate(outputs):
        if array.size:
            buffer.set_res(k, memoryview(array.data))
    cuts = np.cumsum([array.size for array in inputs])[:-1]
    results = []
    for sample in x:
        for array, part in zip(inputs, np.split(sample, cuts), strict=True):
            array[:] = part
        trigger()
        results.append(np.concatenate(outputs))
    return np.array(results)


Batch = Callable[[Any], Any]
"""Samples (n, k_in) to results (n, k_out), of one real type."""


def compiled(
    compiler: Compiler,
    leaves: Iterable[tuple[Program, str]],
    folder: Path,
    optimisation: str = "-O2",
    real: type[Any] = np.float64,
    dense: bool = False,
    extra: str = "",
) -> Iterator[Batch]:
    """The printed leaves as functions of (n, k) arrays, all of them in one library, after the text `extra`."""
    leaves = list(leaves)
    text = ["#define OS_REAL_IS_FLOAT" if real is np.float32 else "", headers_text(["os_rt.h"]), extra]
    for program, leaf in leaves:
        k_in, k_out = starts(program.inputs, dense)[-1], starts(program.outputs, dense)[-1]
        name = program.name
        text += [
            leaf,
            f"void {name}(long n, const os_real_t *x, os_real_t *y);",
            f"void {name}(long n, const os_real_t *x, os_real_t *y)",
            f"{{ for (long i = 0; i < n; i++) {{ {name}_leaf(x + i * {k_in}, y + i * {k_out}); }} }}",
        ]
    path = folder / "leaves.so"
    compiler.build_library("\n".join(text), path, optimisation)
    library = ctypes.CDLL(str(path))
    for program, _ in leaves:
        yield _batch(library[program.name], starts(program.outputs, dense)[-1], real)


def _batch(function: Any, k_out: int, real: type[Any]) -> Batch:
    def run(x: Array) -> Array:
        x = np.ascontiguousarray(x, real)
        y = np.full((len(x), k_out), 123.0, real)
        function(ctypes.c_long(len(x)), ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data))
        return y

    return run


def printed_numpy(program: Program, dense: bool = False) -> Batch:
    """The printed NumPy form as a function of (n, k) arrays."""
    return executed(print_numpy(program, dense), program, dense)


def executed(text: str, program: Program, dense: bool = False) -> Batch:
    space: dict[str, Any] = {}
    exec(compile(text, program.name, "exec"), space)
    cuts = starts(program.inputs, dense)[1:-1]

    def run(x: Array) -> Array:
        results = space[program.name](*np.split(x, cuts, axis=-1))
        return np.concatenate(results if isinstance(results, tuple) else (results,), axis=-1)

    return run


def _choice(better: Any) -> Any:
    return lambda a, b: np.where(np.isnan(b) | better(a, b), a, b)


EXACT: dict[str, Callable[..., Any]] = {
    "ADD": np.add,
    "SUB": np.subtract,
    "MUL": np.multiply,
    "DIV": np.divide,
    "NEG": np.negative,
    "SQ": lambda a: a * a,
    "TWICE": lambda a: a + a,
    "INV": lambda a: a.dtype.type(1.0) / a,
    "SQRT": np.sqrt,
    "FABS": np.abs,
    "FLOOR": np.floor,
    "CEIL": np.ceil,
    "FMAX": _choice(np.greater_equal),
    "FMIN": _choice(np.less_equal),
    "SIGN": lambda a: np.where((a > 0.0) | (a < 0.0), np.copysign(np.ones_like(a), a), a),
    "COPYSIGN": lambda a, b: np.where(np.isnan(b), np.abs(a), np.copysign(a, b)),
    "IF_ELSE_ZERO": lambda p, b: np.where(p == 0.0, np.zeros_like(b), b),
    "LT": np.less,
    "LE": np.less_equal,
    "EQ": np.equal,
    "NE": np.not_equal,
    "NOT": lambda p: p == 0.0,
    "AND": lambda p, q: (p != 0.0) & (q != 0.0),
    "OR": lambda p, q: (p != 0.0) | (q != 0.0),
}
"""The codes that have the same bits everywhere, of arrays of any real type."""


def node_by_node(program: Program, real: type[Any]) -> Batch:
    """The program in the arithmetic of one NumPy type, as a function of (n, k) arrays of non-zeros."""
    start = starts(program.inputs, False)

    @np.errstate(all="ignore")
    def run(x: Array) -> Array:
        values: list[Any] = []
        for node in program.nodes:
            if isinstance(node, Input):
                values.append(x[:, start[node.argument] + node.element].astype(real))
            elif isinstance(node, Constant):
                values.append(np.full(len(x), node.value).astype(real))
            else:
                values.append(EXACT[node.code](*(values[i] for i in node.operands)).astype(real))
        return np.stack([values[i] for result in program.results for i in result], axis=1)

    return run


def codes_in(program: Program) -> set[str]:
    return {node.code for node in program.nodes if isinstance(node, Operation)}


def differences(a: Array, b: Array) -> int:
    """How many values differ in a bit; any NaN is any NaN."""
    assert a.shape == b.shape
    whole = {8: np.int64, 4: np.int32}[a.itemsize]
    return int(np.sum((a.view(whole) != b.view(whole)) & ~(np.isnan(a) & np.isnan(b))))
