"""Bound form: a compiled kernel behind the binding, an extension module that checks and calls in C."""

from collections.abc import Callable
from typing import Any

from optsat.kernels.arguments import Arguments, Reals
from optsat.kernels.form import STATUSES, Kind
from optsat.kernels.record import KernelRecord
from optsat.kernels.unit import ABI

MAX_PORTS = 64
"""Arguments and results together that the binding has room for."""


class BoundForm:
    """See `Form`."""

    def __init__(self, module: Any, kind: Kind, library: str, record: KernelRecord) -> None:
        """Load the library.

        Raises
        ------
        OSError : the system does not load it, or it holds another kernel or ABI.
        """
        self.kind: Kind = kind
        arguments = Arguments(record.name, record.inputs, record.real)
        self.call: Callable[..., Any]
        self.call, self._run, self.width, self.has_tiles = module.bind(
            library,
            record.name,
            ABI,
            record.real == "float",
            tuple(port.shape for port in record.inputs),
            tuple(port.shape for port in record.outputs),
            STATUSES if record.has_status else None,
            arguments.sample,
        )

    def run(
        self, in_tiles: bool, begin: int, end: int, count: int, arrays: tuple[Reals, ...], statuses: Reals | None
    ) -> tuple[int, int]:
        """See `Form`."""
        failed, not_finite = self._run(in_tiles, begin, end, count, arrays, statuses)
        return failed, not_finite
