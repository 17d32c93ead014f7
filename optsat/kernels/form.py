"""Form: one way of running a kernel; all of them take the same arguments and give the same results."""

from collections.abc import Callable, Sequence
from typing import Any, Literal, Protocol

import numpy as np

from optsat.kernels.arguments import Arguments, Reals, data_type
from optsat.kernels.record import KernelRecord
from optsat.kernels.status import Status
from optsat.port import Port

Kind = Literal["extension", "cached extension", "ctypes", "casadi", "python"]

STATUSES = tuple(Status)
"""Status by value, as the statuses count without gaps from 0."""


class Form(Protocol):
    """How a kernel runs."""

    @property
    def kind(self) -> Kind:
        """Its name."""

    @property
    def call(self) -> Callable[..., Any]:
        """Arguments by position or by name to fresh results of one sample, and the status where it has one."""

    def run(
        self, in_tiles: bool, begin: int, end: int, count: int, arrays: tuple[Reals, ...], statuses: Reals | None
    ) -> tuple[int, int]:
        """Compute samples or tiles from begin to end of count; arrays : arguments, then results, each contiguous.

        Returns how many failed, and which argument is not finite, or -1: results are then of no use.
        """


def unpacked(record: KernelRecord, results: Sequence[Any], status: int) -> Any:
    """Return the results of one sample as a call does."""
    found = [result if port.shape else result[()] for port, result in zip(record.outputs, results, strict=True)]
    if record.has_status:
        found.append(STATUSES[status])
    return found[0] if len(found) == 1 else tuple(found)


def exact_arrays(arguments: Arguments, args: Sequence[Any], kwargs: dict[str, Any]) -> tuple[Reals, ...]:
    """Return the arguments of one sample as finite arrays, without a copy where they are such already."""
    inputs, kind = arguments.inputs, data_type(arguments.real)
    ready = (
        not kwargs
        and len(args) == len(inputs)
        and all(
            type(value) is np.ndarray and value.dtype == kind and value.shape == port.shape
            for port, value in zip(inputs, args, strict=True)
        )
        and all(np.isfinite(value).all() for value in args)
    )
    return tuple(args) if ready else arguments.sample(args, kwargs)


def first_not_finite(inputs: Sequence[Port], arrays: Sequence[Reals], begin: int, end: int) -> int:
    """Return which argument holds a number that is not finite among these samples, or -1."""
    for k, (port, array) in enumerate(zip(inputs, arrays, strict=False)):
        if not np.isfinite(array if array.shape == port.shape else array[begin:end]).all():
            return k
    return -1
