"""Random numbers of a case from its place in the design: order, workers and restarts change nothing."""

import hashlib
import json
from operator import index
from typing import Any

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from optsat.errors import InputError


def campaign_key(study: str, seed: int) -> int:
    """Return the 64-bit key of a campaign: the first 8 bytes, little endian, of BLAKE2b over [study, seed].

    The text that is hashed is canonical JSON. Hashed rather than added: with `seed + case`, case 1 of seed 7 would
    be case 0 of seed 8.
    """
    text = json.dumps([study, int(index(seed))], separators=(",", ":"))
    return int.from_bytes(hashlib.blake2b(text.encode()).digest()[:8], "little")


def case_generator(key: int, cell: int, stream: int = 0) -> np.random.Generator:
    """Return the generator of one case: Philox(key = (campaign key, cell), counter = (0, 0, stream, 0)).

    Raises
    ------
    InputError : `cell` or `stream` is negative.
    """
    if cell < 0 or stream < 0:
        raise InputError(f"`cell` and `stream` must be >= 0, got {cell} and {stream}.")
    words = np.array([key, cell], dtype=np.uint64)
    counter = np.array([0, 0, stream, 0], dtype=np.uint64)
    # NumPy documents that any ISeedSequence will do; its annotations do not
    source: Any = _Key(words)
    return np.random.Generator(np.random.Philox(source, counter=counter))


class _Key(ISeedSequence):
    """The two words themselves where NumPy asks a seed for some; given as `key` NumPy first gathers entropy for naught.

    It cannot be spawned from, so that no case draws from a stream that another run would not repeat.
    """

    __slots__ = ("_words",)

    def __init__(self, words: NDArray[np.uint64]) -> None:
        self._words = words

    def generate_state(self, n_words: int, dtype: object = np.uint32) -> NDArray[np.uint64]:
        return self._words
