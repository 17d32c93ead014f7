"""Binding: the extension module that calls kernels, as installed or else compiled once beside the kernels."""

import importlib
import sys
from functools import cache
from importlib import resources, util
from typing import Any, Literal

import numpy as np

from optsat.errors import OptsatError
from optsat.kernels.compilation import compiled, digest_of
from optsat.kernels.record import KernelRecord

INTERFACE = 2
"""Number of the arguments of the module's functions."""

_NAME = "optsat.kernels._binding"


@cache
def find_binding() -> tuple[Any, Literal["extension", "cached extension"]] | None:
    """Return the module and where it comes from; None where it was not installed and cannot be compiled."""
    if (module := installed_binding()) is not None:
        return module, "extension"
    if (module := cached_binding()) is not None:
        return module, "cached extension"
    return None


@cache
def installed_binding() -> Any:
    """Return the module that the installation brought; None without one, or where it is older than this file."""
    try:
        module = importlib.import_module(_NAME)
    except ImportError:
        return None
    return module if getattr(module, "INTERFACE", 0) == INTERFACE else None


@cache
def cached_binding() -> Any:
    """Return the module compiled from its source into the cache, or None; that needs a compiler and Python.h."""
    import sysconfig

    # compiled with headers of NumPy 1, it does not run with NumPy 2
    source = resources.files("optsat.kernels").joinpath("_binding.c").read_text(encoding="utf-8")
    text = f"/* for NumPy {np.__version__} */\n{source}"
    record = KernelRecord("_binding", "double", (), (), text=digest_of(text))
    extra = [f"-I{sysconfig.get_paths()['include']}", f"-I{np.get_include()}"]
    if sys.platform == "darwin":
        extra += ["-undefined", "dynamic_lookup"]
    try:
        return compiled(record, text, _imported, extra)[0]
    except OptsatError:
        return None


def _imported(path: str, _record: KernelRecord) -> Any:
    from importlib.machinery import ExtensionFileLoader

    spec = util.spec_from_file_location(_NAME, path, loader=ExtensionFileLoader(_NAME, path))
    if spec is None or spec.loader is None:
        raise OSError(f"{path} is no extension module")
    try:
        module = util.module_from_spec(spec)
        spec.loader.exec_module(module)
    except ImportError as error:
        raise OSError(str(error)) from None
    return module
