"""No compiler may join a product and a sum into one rounding, whatever the CPU offers."""

import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest

from optsat.kernels.toolchain import Compiler

TURN = """
void turn(double *a, double c, double s);
void turn(double *a, double c, double s)
{
    const double first = (c * a[0]) + (s * a[1]);
    const double second = (c * a[1]) - (s * a[0]);
    a[0] = first;
    a[1] = second;
}
"""


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("level", ["-O2", "-O3"])
def test_a_rotation_keeps_its_two_roundings(compiler: str, level: str, tmp_path: Path) -> None:
    path = shutil.which(compiler)
    if path is None:
        pytest.skip(f"{compiler} is not on the path")
    library = tmp_path / "turn.so"
    Compiler((path,), ("-march=native",)).build_library(TURN, library, level)
    turn = ctypes.CDLL(str(library)).turn
    rng = np.random.default_rng(0)
    for _ in range(200):
        c, s, a, b = rng.normal(size=4)
        pair = np.array([a, b])
        turn(ctypes.c_void_p(pair.ctypes.data), ctypes.c_double(c), ctypes.c_double(s))
        assert pair.tolist() == [c * a + s * b, c * b - s * a]
