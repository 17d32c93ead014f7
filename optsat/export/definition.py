"""Definition: one kernel with its reference in Python, and what identifies the model that it came from."""

import hashlib
import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.kernels.leaf import leaf_source
from optsat.kernels.lowering import lower
from optsat.kernels.program import Operation
from optsat.kernels.source import KernelSource, Twin
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction


@dataclass(frozen=True)
class Definition:
    """A kernel to export.

    reference : the same computation in Python, x (k_in,) to status and y (k_out,)
    model : SHA-256 of the symbolic function, or of the text of a template with its leaves
    parameters : that the definition was made with; operations : how many by code, of one sample or one iteration
    """

    source: KernelSource
    reference: Twin = field(repr=False)
    model: str
    parameters: Mapping[str, Any]
    operations: Mapping[str, int]

    @property
    def parameters_hash(self) -> str:
        """SHA-256 of the parameters as JSON with sorted names."""
        return sha256(json.dumps(self.parameters, sort_keys=True))


def define(kernel: GeneratedFunction | KernelSource, parameters: Mapping[str, Any] | None = None) -> Definition:
    """Return the definition of a symbolic function or of an instantiated template.

    parameters : numbers baked into it, as plain JSON values

    Raises
    ------
    InputError : neither of the two, too large, an operation that no kernel knows, or no reference in Python.
    """
    if isinstance(kernel, GeneratedFunction):
        return _of_function(kernel, parameters or {})
    if not isinstance(kernel, KernelSource):
        raise InputError(f"A kernel is a GeneratedFunction or a KernelSource, got {type(kernel).__name__}.")
    if kernel.twin is None:
        raise InputError(f"{kernel.name} has no twin in Python, so its C could not be compared with anything.")
    counts = {"all": kernel.operations}
    return Definition(kernel, kernel.twin, sha256(kernel.body), dict(parameters or {}), counts)


def sha256(text: str) -> str:
    """Return the digest of a text in hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()


def _of_function(function: GeneratedFunction, parameters: Mapping[str, Any]) -> Definition:
    names = [[port.name for port in ports] for ports in (function.inputs, function.outputs)]
    program = lower(function.casadi, names_in=names[0], names_out=names[1])
    source = leaf_source(program, function.inputs, function.outputs)
    counts = Counter(node.code for node in program.nodes if isinstance(node, Operation))
    return Definition(
        source,
        _on_machine(function),
        sha256(function.casadi.serialize()),
        dict(parameters),
        dict(sorted(counts.items())),
    )


def _on_machine(function: GeneratedFunction) -> Twin:
    # CasADi's virtual machine, whatever form the function itself is called through
    def run(x: Array) -> tuple[int, Array]:
        parts = np.split(x, np.cumsum([port.size for port in function.inputs])[:-1])
        arguments = [part.reshape(p.rows, p.columns) for part, p in zip(parts, function.inputs, strict=True)]
        results = function.casadi.call(arguments)
        return 0, np.concatenate([_row_major(p, r.full()) for p, r in zip(function.outputs, results, strict=True)])

    return run


def _row_major(port: Port, matrix: Array) -> Array:
    return np.asarray(matrix, dtype=np.float64).reshape(port.size)
