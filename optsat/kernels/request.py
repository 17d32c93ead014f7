"""Request: a kernel named by the function that defines it, so that another process can ask for the same."""

import importlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from optsat.errors import InputError, nearest_name
from optsat.kernels.definition import Definition
from optsat.kernels.elementary import Math
from optsat.kernels.source import KernelSource
from optsat.kernels.unit import Real

_NAME = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


@dataclass(frozen=True)
class Request:
    """The defining function as "module:function", its parameters as JSON with sorted names, numbers and functions."""

    definition: str
    parameters: str
    real: Real
    math: Math

    def build(self) -> Definition | KernelSource:
        """Import the module and call the function.

        Raises
        ------
        InputError : there is no such module or function, or it returns no kernel.
        """
        place, _, name = self.definition.partition(":")
        try:
            module = importlib.import_module(place)
        except ModuleNotFoundError as error:
            raise InputError(f"{self.definition}: {error}. Name a module that can be imported from anywhere.") from None
        function: Any = getattr(module, name, None)
        if not callable(function):
            raise InputError(f"{place} has no function `{name}`.{nearest_name(name, sorted(vars(module)))}")
        built: Any = function(**json.loads(self.parameters))
        if not isinstance(built, KernelSource) and not hasattr(built, "casadi"):
            raise InputError(
                f"{self.definition} must return a GeneratedFunction or a KernelSource, got {type(built).__name__}."
            )
        found: Definition | KernelSource = built
        return found


def request(definition: str, real: Real, math: Math, parameters: Mapping[str, Any]) -> Request:
    """Return the request for a kernel.

    Raises
    ------
    InputError : the definition is not "module:function", stands in the script that runs, or a parameter is no plain
        number, text, list or array.
    """
    if not _NAME.fullmatch(definition):
        raise InputError(f"A kernel is defined by 'module:function', got {definition!r}.")
    if definition.startswith("__main__:"):
        raise InputError(f"{definition}: a script cannot be imported elsewhere. Move the function to a module.")
    try:
        text = json.dumps(parameters, sort_keys=True, default=_plain)
    except (TypeError, ValueError):
        raise InputError(
            f"{definition}: its parameters must be numbers, texts, lists or arrays, got {dict(parameters)!r}."
        ) from None
    return Request(definition, text, real, math)


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError
