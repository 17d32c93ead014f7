"""Tiles: samples side by side, number after number, as a kernel computes several at once: (tiles, size, width)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from optsat.errors import InputError
from optsat.kernels.arguments import Reals, data_type, ordered, shared_length
from optsat.kernels.record import KernelRecord
from optsat.port import Port


def tiles_of(port: Port, width: int, array: Reals) -> Reals:
    """Return rows (N, *shape) as tiles, the last filled up with the last sample, and one value (*shape) repeated."""
    if array.shape == port.shape:
        return np.repeat(array.reshape(port.size, 1), width, axis=1)
    count = len(array)
    last = np.minimum(np.arange(-(-count // width) * width), count - 1)
    rows = array.reshape(count, port.size)[last].reshape(-1, width, port.size)
    return np.ascontiguousarray(rows.swapaxes(1, 2))


def rows_of(port: Port, tiles: Reals) -> Reals:
    """Return tiles as rows (N, *shape), or (*shape) of a tile (size, width) that all share."""
    if tiles.ndim == 2:
        return tiles[:, 0].reshape(port.shape)
    return tiles.swapaxes(1, 2).reshape((-1, *port.shape))


def checked_tiles(
    record: KernelRecord, args: Sequence[Any], kwargs: Mapping[str, Any]
) -> tuple[int, tuple[Reals, ...]]:
    """Return the number of tiles and the arguments, contiguous, not looked at for NaN.

    Raises
    ------
    InputError : an argument is no array of tiles of the kernel's numbers, or their lengths differ.
    """
    real, lengths = data_type(record.real), {}
    arrays = ordered(record.name, record.inputs, args, kwargs)
    for port, array in zip(record.inputs, arrays, strict=True):
        tile = (port.size, record.width)
        fits = type(array) is np.ndarray and array.dtype == real and array.shape[-2:] == tile and array.ndim in (2, 3)
        if not fits:
            raise InputError(
                f"{record.name}.batch: `{port.name}` must be an array (tiles, {tile[0]}, {tile[1]}) of {real}, got "
                f"{described(array)}. Make it with `.to_tiles`."
            )
        if array.ndim == 3:
            lengths[port.name] = len(array)
    return shared_length(record.name, lengths), tuple(map(np.ascontiguousarray, arrays))


def described(value: Any) -> str:
    """Return what a value is, for people."""
    return f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
