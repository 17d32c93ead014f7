"""Form: one way of running a kernel; all of them take the same arguments and give the same results."""

from collections.abc import Callable, Sequence
from typing import Any, Literal, Protocol

import numpy as np

from optsat.kernels.arguments import Arguments, Reals, data_type
from optsat.kernels.record import KernelRecord
from optsat.kernels.status import Status
from optsat.kernels.unit import Real
from optsat.port import Port

Kind = Literal["extension", "cached extension", "ctypes", "casadi", "python"]

STATUSES = tuple(Status)
"""Status by value, as the statuses count without gaps from 0."""


class Form(Protocol):
    """How a kernel runs."""

    @property
    def kind(self) -> Kind:
        """Its name."""
        ...

    @property
    def call(self) -> Callable[..., Any]:
        """Arguments by position or by name to fresh results of one sample, and the status where it has one."""
        ...

    def run(
        self, in_tiles: bool, begin: int, end: int, count: int, arrays: tuple[Reals, ...], statuses: Reals | None
    ) -> tuple[int, int]:
        """Compute samples or tiles from begin to end of count; arrays : arguments, then results, each contiguous.

        Returns how many failed, and which argument is not finite, or -1: results are then of no use.
        """
        ...


def unpacked(record: KernelRecord, results: Sequence[Any], status: int) -> Any:
    """Return the results of one sample as a call does."""
    found = [result if port.shape else result[()] for port, result in zip(record.outputs, results, strict=True)]
    if record.has_status:
        found.append(STATUSES[status])
    return found[0] if len(found) == 1 else tuple(found)


class Sample:
    """The arguments of one sample in a row, in memory that is taken once: addresses and arrays cost more than a call.

    Calls of several threads need one each.
    """

    def __init__(self, inputs: Sequence[Port], real: Real) -> None:
        self._type = data_type(real)
        self.row = np.zeros(sum(port.size for port in inputs), self._type)
        parts = np.split(self.row, np.cumsum([port.size for port in inputs])[:-1]) if inputs else []
        self.arrays = [part.reshape(port.shape) for port, part in zip(inputs, parts, strict=True)]

    def take(self, arguments: Arguments, args: Sequence[Any], kwargs: dict[str, Any]) -> None:
        """Copy the arguments here, checked; a refusal is that of `Arguments.sample`."""
        if not (kwargs or len(args) != len(self.arrays)) and self._fit(args):
            for kept, value in zip(self.arrays, args, strict=True):
                kept[...] = value
            if np.isfinite(self.row).all():
                return
        for kept, value in zip(self.arrays, arguments.sample(args, kwargs), strict=True):
            kept[...] = value

    def _fit(self, args: Sequence[Any]) -> bool:
        for kept, value in zip(self.arrays, args, strict=True):
            # of the exact type: a masked array would lose its mask
            if type(value) is not np.ndarray or value.dtype is not self._type or value.shape != kept.shape:
                return False
        return True


def first_not_finite(inputs: Sequence[Port], arrays: Sequence[Reals], begin: int, end: int) -> int:
    """Return which argument holds a number that is not finite among these samples, or -1."""
    for k, (port, array) in enumerate(zip(inputs, arrays, strict=False)):
        if not np.isfinite(array if array.shape == port.shape else array[begin:end]).all():
            return k
    return -1
