"""Peak: how many products and sums one thread of this machine does in a second, the limit of every kernel."""

import ctypes
import tempfile
import time
from pathlib import Path

import numpy as np

from optsat.kernels.fingerprint import fingerprint, tuned
from optsat.kernels.headers import headers_text
from optsat.kernels.processor import lane_width
from optsat.kernels.toolchain import find_compiler
from optsat.kernels.unit import Real

_CHAINS = 12  # as in os_peak.h
_ROUNDS = 1_000_000


def measured_peak(real: Real = "double", repetitions: int = 9) -> float:
    """Return operations a second of one thread in lanes, products and sums half each and never fused [1/s].

    The best of several repetitions: what disturbs a measurement only makes it slower.

    Raises
    ------
    CompilerMissingError, CompilationError : there is no C compiler, or it fails.
    """
    compiler = find_compiler()
    types = {"double": np.float64, "float": np.float32}
    width = lane_width(real)
    head = [f"#define OS_WIDTH {width}", *(["#define OS_REAL_IS_FLOAT"] if real == "float" else [])]
    with tempfile.TemporaryDirectory(prefix="optsat-") as folder:
        path = Path(folder, "peak.so")
        # loops of twelve chains must be unrolled to stay in registers
        text = "\n".join([*head, headers_text(["os_peak.h"])])
        tuned(compiler, fingerprint(compiler)).build_library(text, path, "-O3")
        run = ctypes.CDLL(str(path)).os_peak
        run.restype = ctypes.c_int64
        best = 0.0
        for _ in range(repetitions):
            out = np.full(_CHAINS, 0.5, types[real])
            start = time.perf_counter()
            operations = run(ctypes.c_int64(_ROUNDS), ctypes.c_void_p(out.ctypes.data))
            best = max(best, operations / (time.perf_counter() - start))
    return best
