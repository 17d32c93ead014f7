"""Kernel sources compiled as they stand, called through ctypes, and compared with their twins to the bit."""

import ctypes
import hashlib
import shutil
import subprocess
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.kernels.source import KernelSource

STRICT = (
    *("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wfloat-equal"),
    *("-Wdouble-promotion", "-Wstrict-prototypes", "-Wmissing-prototypes", "-Wundef", "-Wcast-qual", "-Wvla"),
    *("-Werror", "-ffp-contract=off"),
)
SANITIZERS = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
FORMS = (("gcc", "-O0"), ("gcc", "-O3"), ("clang", "-O2"))

Call = Callable[[Array], tuple[int, Array]]

_CALL = """
int32_t call(const os_real_t *x, os_real_t *y);
int32_t call(const os_real_t *x, os_real_t *y)
{{
    {name}_work_t work;
    return (int32_t){name}_body(x, y, &work);
}}
"""

_MAIN = """
#include <stdio.h>
int main(void)
{{
    static os_real_t x[{k_in}];
    static os_real_t y[{k_out}];
    while (fread(x, sizeof x, 1U, stdin) == 1U) {{
        const int32_t status = call(x, y);
        if ((fwrite(&status, sizeof status, 1U, stdout) != 1U) || (fwrite(y, sizeof y, 1U, stdout) != 1U)) {{
            return 1;
        }}
    }}
    return 0;
}}
"""


def tool(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not on the path")
    return path


def sizes(source: KernelSource) -> tuple[int, int]:
    return sum(port.size for port in source.inputs), sum(port.size for port in source.outputs)


def unit_text(source: KernelSource) -> str:
    return "\n".join(['#include "os_rt.h"', source.body, _CALL.format(name=source.name)])


def compile_text(text: str, path: Path, compiler: str, flags: Sequence[str]) -> None:
    headers = resources.files("optsat.kernels.c")
    arguments = [tool(compiler), *flags, *STRICT, f"-I{headers}", "-x", "c", "-", "-o", str(path), "-lm"]
    done = subprocess.run(arguments, input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def compiled(source: KernelSource, folder: Path, compiler: str = "gcc", level: str = "-O2", real: Any = float) -> Call:
    """The kernel as a function of x, strict warnings being errors."""
    single = real is np.float32
    text = unit_text(source)
    # a library of the same path would be the one that is loaded already
    key = hashlib.sha256(text.encode()).hexdigest()[:12]
    path = folder / f"{key}_{compiler}{level}{'_float' if single else ''}.so"
    flags = [level, "-fPIC", "-shared", *(["-DOS_REAL_IS_FLOAT"] if single else [])]
    compile_text(text, path, compiler, flags)
    function = ctypes.CDLL(str(path)).call
    k_in, k_out = sizes(source)

    def call(x: Array) -> tuple[int, Array]:
        x = np.ascontiguousarray(x, real)
        assert x.shape == (k_in,)
        y = np.full(k_out, 123.0, real)
        status = function(ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data))
        return int(status), y

    return call


def sanitized(source: KernelSource, samples: Array, folder: Path) -> list[tuple[int, Array]]:
    """Statuses and results of a program built with the address and undefined-behaviour sanitizers."""
    k_in, k_out = sizes(source)
    path = folder / f"{source.name}_sanitized"
    try:
        compile_text(unit_text(source) + _MAIN.format(k_in=k_in, k_out=k_out), path, "gcc", ["-O1", *SANITIZERS])
    except AssertionError as error:
        if "asan" in str(error) or "ubsan" in str(error):
            pytest.skip("gcc has no sanitizer library here")
        raise
    done = subprocess.run(
        [str(path)], input=np.ascontiguousarray(samples, float).tobytes(), capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr.decode()
    record = np.dtype([("status", np.int32), ("y", np.float64, (k_out,))])
    return [(int(each["status"]), each["y"]) for each in np.frombuffer(done.stdout, record)]


def assert_same_bits(got: tuple[int, Array], expected: tuple[int, Array]) -> None:
    assert got[0] == expected[0]
    both_nan = np.isnan(got[1]) & np.isnan(expected[1])
    differ = (np.asarray(got[1]).view(np.int64) != np.asarray(expected[1]).view(np.int64)) & ~both_nan
    assert not differ.any(), f"{int(differ.sum())} of {differ.size} values differ, first {np.argmax(differ)}"


def assert_twin_agrees(source: KernelSource, samples: Array, folder: Path) -> None:
    """Bits of the twin in every compiler and level, and in a sanitized program."""
    assert source.twin is not None
    expected = [source.twin(x) for x in samples]
    for compiler, level in FORMS:
        call = compiled(source, folder, compiler, level)
        for x, wanted in zip(samples, expected, strict=True):
            assert_same_bits(call(x), wanted)
    for got, wanted in zip(sanitized(source, samples, folder), expected, strict=True):
        assert_same_bits(got, wanted)
