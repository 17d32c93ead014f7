"""Kernels for the tests of the run time: straight-line and with loops, made in every form that a machine may have."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.kernels import binding, loader, open_kernel
from optsat.kernels.linear import cholesky_solve
from optsat.kernels.source import KernelSource
from optsat.kernels.toolchain import CompilerMissingError, find_compiler
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

FORMS = ("extension", "cached extension", "ctypes", "interpreted")


def needs_compiler() -> None:
    try:
        find_compiler()
    except CompilerMissingError as error:
        pytest.skip(str(error))


def turning(gain: float = 1.0) -> GeneratedFunction:
    """Vector, matrix and scalar in; the same out: no library function, so its bits are the same everywhere."""
    x, J, t = ca.SX.sym("x", 3), ca.SX.sym("J", 3, 2), ca.SX.sym("t")
    return generate(
        "turning",
        inputs=[(Port("x", (3,), "m", "B"), x), (Port("J", (3, 2), "-"), J), (Port("t", (), "s"), t)],
        outputs=[
            (Port("y", (2,), "m"), gain * J.T @ x / (1 + t * t)),
            (Port("K", (3, 3), "-"), J @ J.T * t),
            (Port("size", (), "m"), ca.sqrt(ca.dot(x, x))),
            (Port("constant", (2,), "-"), ca.SX([1, 0])),
        ],
    )


def doubled() -> GeneratedFunction:
    """One argument, one result."""
    x = ca.SX.sym("x", 3)
    return generate("doubled", [(Port("x", (3,), "-"), x)], [(Port("y", (3,), "-"), x + x)])


def solving() -> KernelSource:
    """A template, with a status."""
    return cholesky_solve(3)


def samples(count: int, seed: int = 7) -> tuple[Array, Array, Array]:
    """Arguments of `turning`."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 3)), rng.normal(size=(count, 3, 2)), rng.normal(size=count)


def equations(count: int, seed: int = 5) -> tuple[Array, Array]:
    """Arguments of `solving`; every third matrix is not definite."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(count, 3, 3))
    A = root @ root.swapaxes(1, 2) + 0.1 * np.eye(3)
    A[::3] -= 50.0 * np.eye(3)
    return A, rng.normal(size=(count, 3))


def forget(*functions: Any) -> None:
    """Empty what a process remembers, so that the next question is asked again."""
    for function in functions:
        function.cache_clear()


def use_form(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make kernels in one form from now on."""
    if name == "interpreted":

        def refuse(*_arguments: Any, **_options: Any) -> Any:
            raise CompilerMissingError("No C compiler, says this test.")

        monkeypatch.setattr(open_kernel, "compile_form", refuse)
        monkeypatch.setattr(open_kernel, "load_form", lambda _key: None)
        return
    needs_compiler()
    if name == "ctypes":
        monkeypatch.setattr(loader, "find_binding", lambda: None)
        return
    module = binding.installed_binding() if name == "extension" else binding.cached_binding()
    if module is None:
        pytest.skip(
            "optsat was installed without its extension"
            if name == "extension"
            else "the binding cannot be compiled here: no Python.h"
        )
    monkeypatch.setattr(loader, "find_binding", lambda: (module, name))


def bits(value: Any) -> bytes:
    """The bytes of an array or number, so that NaN equals NaN."""
    return np.asarray(value).tobytes()
