"""Arguments: what a kernel is called with, by position or by name, as arrays of its numbers; refusals name the port."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optsat.errors import InputError, UnknownOptionError, nearest_name
from optsat.kernels.unit import Real
from optsat.port import Port

Reals = NDArray[Any]
"""Doubles or floats, as the kernel has them."""


def ordered(function: str, inputs: Sequence[Port], args: Sequence[Any], kwargs: Mapping[str, Any]) -> list[Any]:
    """Return the arguments in the order of the ports.

    Raises
    ------
    InputError : one is missing, given twice or beyond the last. UnknownOptionError : a name is no port.
    """
    names = [port.name for port in inputs]
    if len(args) > len(names):
        listed = f"{function}({', '.join(map(str, inputs))})"
        raise InputError(f"{function} takes {len(names)} arguments, got {len(args)}: {listed}.")
    given = dict(zip(names, args, strict=False))
    for name, value in kwargs.items():
        if name not in names:
            raise UnknownOptionError(f"{function} has no input `{name}`.{nearest_name(name, names)}")
        if name in given:
            raise InputError(f"{function}: `{name}` was given by position and by name.")
        given[name] = value
    for port in inputs:
        if port.name not in given:
            raise InputError(f"{function}: input {port} is missing.")
    return [given[name] for name in names]


@cache
def data_type(real: Real) -> "np.dtype[Any]":
    """Return NumPy's type of the kernel's numbers."""
    return np.dtype(np.float32 if real == "float" else np.float64)


def shared_length(function: str, lengths: Mapping[str, int]) -> int:
    """Return the number of samples that the inputs agree on.

    lengths : of the inputs that have a sample axis

    Raises
    ------
    InputError : they differ, or there are none.
    """
    if len(set(lengths.values())) != 1:
        got = ", ".join(f"`{name}` {length}" for name, length in lengths.items()) or "none"
        raise InputError(f"{function}.batch: the inputs must hold the same number of samples; lengths: {got}.")
    return next(iter(lengths.values()))


def check_threads(function: str, threads: int) -> None:
    """Refuse what is no number of threads.

    Raises
    ------
    InputError : it is no whole number from 1.
    """
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise InputError(f"{function}.batch: `threads` must be a whole number from 1, got {threads!r}.")


@dataclass(frozen=True)
class Arguments:
    """The checks of one kernel's arguments."""

    function: str
    inputs: tuple[Port, ...]
    real: Real

    def sample(self, args: Sequence[Any], kwargs: Mapping[str, Any]) -> tuple[Reals, ...]:
        """Return one finite, contiguous array of its shape for each port.

        Raises
        ------
        InputError, UnknownOptionError : as `ordered`; not finite, of another shape, or too large for float.
        """
        values = ordered(self.function, self.inputs, args, kwargs)
        return tuple(
            self._as_real(port, port.sample(self.function, value))
            for port, value in zip(self.inputs, values, strict=True)
        )

    def batch(self, args: Sequence[Any], kwargs: Mapping[str, Any]) -> tuple[int, tuple[Reals, ...]]:
        """Return the number of samples and a contiguous array (N, *shape) or, shared by all, (*shape) for each port.

        Arrays that are contiguous and of the kernel's numbers come back as they are, not looked at for NaN.

        Raises
        ------
        InputError, UnknownOptionError : as `sample`, and where the lengths differ or no input has a sample axis.
        """
        values = ordered(self.function, self.inputs, args, kwargs)
        arrays = tuple(
            value if self._is_ready(port, value) else self._as_real(port, port.samples(self.function, value))
            for port, value in zip(self.inputs, values, strict=True)
        )
        lengths = {
            port.name: len(array) for port, array in zip(self.inputs, arrays, strict=True) if array.shape != port.shape
        }
        return shared_length(self.function, lengths), arrays

    def refuse_not_finite(self, arrays: Sequence[Reals]) -> None:
        """Raise what names the first port and sample that is not finite.

        Raises
        ------
        InputError : always, where one is.
        """
        for port, array in zip(self.inputs, arrays, strict=True):
            port.samples(self.function, array)

    def _is_ready(self, port: Port, value: Any) -> bool:
        # of the exact type: a masked array would lose its mask
        return (
            type(value) is np.ndarray
            and value.dtype == data_type(self.real)
            and value.flags.c_contiguous
            and value.flags.aligned
            and (value.shape == port.shape or (value.ndim > 0 and value.shape[1:] == port.shape))
        )

    def _as_real(self, port: Port, array: Reals) -> Reals:
        with np.errstate(over="ignore"):
            found = np.ascontiguousarray(array, data_type(self.real)).reshape(array.shape)
        if self.real == "float" and not np.isfinite(found).all():
            worst = float(array[~np.isfinite(found)][0])
            raise InputError(
                f"{self.function}: `{port.name}` holds {worst:g}, which float cannot hold (at most 3.4e38). "
                "Scale it, or use the kernel in double."
            )
        return found
