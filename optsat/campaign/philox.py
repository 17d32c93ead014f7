"""Philox: the random words of many cells at once, equal to NumPy's own bit generator of each cell bit for bit."""

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.errors import InputError

Words = NDArray[np.uint64]

_MULTIPLIERS = (np.uint64(0xD2E7470EE14C6C93), np.uint64(0xCA5A826395121157))
_WEYL = (np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBB67AE8584CAA73B))
_ROUNDS = 10
_LOW, _HALF = np.uint64(0xFFFFFFFF), np.uint64(32)


def philox_words(key: int, cells: NDArray[np.int64], count: int, stream: int = 0, first: int = 0) -> Words:
    """Return `count` words (cells, count) of Philox(key = (campaign key, cell), counter = (0, 0, stream, 0)).

    key : 64-bit key of the campaign; cells : places in the design, >= 0; stream : number of the draw
    first : words that are left out before

    Raises
    ------
    InputError : a negative cell, count or stream, or a key wider than 64 bits.
    Source: J. Salmon, M. Moraes, R. Dror, D. Shaw, Parallel random numbers: as easy as 1, 2, 3 (2011), Philox4x64-10.
    """
    cells = np.asarray(cells)
    if min(count, stream, first) < 0 or not 0 <= key < 1 << 64 or (cells.size and cells.min() < 0):
        raise InputError("`cells`, `count`, `stream` and `first` must be >= 0 and `key` below 2^64.")
    before, skipped = divmod(first, 4)
    blocks = -(-(skipped + count) // 4)
    # NumPy counts up before the first block
    counter = np.arange(before + 1, before + blocks + 1, dtype=np.uint64)
    shape = (len(cells), blocks)
    x = [np.broadcast_to(counter, shape), np.zeros(shape, np.uint64), np.full(shape, stream, np.uint64)]
    x.append(np.zeros(shape, np.uint64))
    k = [np.full(shape, key, np.uint64), np.broadcast_to(cells.astype(np.uint64)[:, None], shape)]
    for _ in range(_ROUNDS):
        high_0, low_0 = _product(_MULTIPLIERS[0], x[0])
        high_1, low_1 = _product(_MULTIPLIERS[1], x[2])
        x = [high_1 ^ x[1] ^ k[0], low_1, high_0 ^ x[3] ^ k[1], low_0]
        k = [k[0] + _WEYL[0], k[1] + _WEYL[1]]
    return np.stack(x, axis=-1).reshape(len(cells), 4 * blocks)[:, skipped : skipped + count]


def uniforms(words: Words) -> Array:
    """Return numbers in [0, 1) of the same shape, as `numpy.random.Generator.random` makes them of its words."""
    return np.asarray((words >> np.uint64(11)) * 2.0**-53, dtype=np.float64)


def normals(words: Words) -> Array:
    """Return standard normal numbers of the same shape, one a word, by the inverse of their distribution function.

    Of 52 bits, so that the middle of the last interval is still below one and every number is finite.
    """
    from scipy.special import ndtri

    return np.asarray(ndtri(((words >> np.uint64(12)) + 0.5) * 2.0**-52))


def _product(a: np.uint64, b: Words) -> tuple[Words, Words]:
    """Return high and low half of the 128-bit product."""
    a_high, a_low = a >> _HALF, a & _LOW
    b_high, b_low = b >> _HALF, b & _LOW
    low, cross = a_low * b_low, a_high * b_low
    middle = a_low * b_high + (low >> _HALF) + (cross & _LOW)
    return a_high * b_high + (cross >> _HALF) + (middle >> _HALF), a * b
