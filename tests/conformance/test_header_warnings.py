"""The run-time headers and a leaf of every operation: no warning, in both real types, on every target."""

import shutil
import subprocess
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import casadi as ca
import pytest
from kernel_source_harness import STRICT

from optsat.kernels.codes import ARITY
from optsat.kernels.elementary import Math
from optsat.kernels.lowering import lower
from optsat.kernels.print_scalar import print_scalar
from optsat.kernels.program import Program

COMPILERS: dict[str, Sequence[str]] = {
    "gcc": (),
    "clang": (),
    "aarch64-linux-gnu-gcc": (),
    "arm-none-eabi-gcc": ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard"),
}


def every_code() -> Program:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    results = []
    for code in sorted(ARITY):
        number = getattr(ca, f"OP_{code}")
        results.append(ca.SX.unary(number, a) if ARITY[code] == 1 else ca.SX.binary(number, a, b))
    constants = [ca.SX(float("inf")), ca.SX(float("-inf")), ca.SX(float("nan")), ca.SX(-2.5) * a]
    return lower(ca.Function("every_code", [a, b], [ca.vertcat(*results, *constants)]))


@pytest.mark.parametrize("level", ["-O0", "-O2"])
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_no_compiler_warns_of_a_leaf_or_a_header(compiler: str, real: str, level: str, tmp_path: Path) -> None:
    path = shutil.which(compiler)
    if path is None:
        pytest.skip(f"{compiler} is not on the path")
    program = every_code()
    maths: tuple[Math, Math] = ("own", "libm")
    for math in maths:
        wrapper = (
            "void every_code(const os_real_t *x, os_real_t *y);\n"
            "void every_code(const os_real_t *x, os_real_t *y)\n{\n    every_code_leaf(x, y);\n}\n"
        )
        text = f'#include "os_rt.h"\n{print_scalar(program, math=math)}\n{wrapper}'
        kind = ("-DOS_REAL_IS_FLOAT",) if real == "float" else ()
        headers = f"-I{resources.files('optsat.kernels.c')}"
        command = [path, *COMPILERS[compiler], level, *STRICT, *kind, headers, "-c", "-x", "c", "-"]
        done = subprocess.run(
            [*command, "-o", str(tmp_path / "leaf.o")], input=text, text=True, capture_output=True, check=False
        )
        assert done.returncode == 0, done.stderr
