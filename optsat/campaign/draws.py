"""Draws: the random numbers of many cases at once, the same bits as each case's own generator gives."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.campaign.philox import Words, normals, philox_words, uniforms


class Draws:
    """Random numbers in order: each call takes the next words of every case's own stream.

    `run_batch` gets the draws of its cases; `run` makes those of its one case from its generator, so that both can
    share what they compute from them. Which words a number is made of depends on the calls before it and on nothing
    else: how many cases are drawn together changes no bit.
    """

    def __init__(self, next_words: Callable[[int, int], Words], cases: int) -> None:
        self._next_words, self.cases, self._taken = next_words, cases, 0

    @staticmethod
    def of_cells(key: int, cells: NDArray[np.int64]) -> "Draws":
        """Return the draws of the cases at `cells` (n,) of the campaign `key`."""
        return Draws(lambda first, count: philox_words(key, cells, count, first=first), len(cells))

    @staticmethod
    def of_case(rng: np.random.Generator) -> "Draws":
        """Return the draws of the one case whose generator `rng` is; it moves on with them."""
        return Draws(lambda _, count: rng.bit_generator.random_raw(count)[None, :], 1)

    def uniforms(self, *shape: int) -> Array:
        """Return numbers (cases, *shape) in [0, 1), as `numpy.random.Generator.random` gives them."""
        return uniforms(self._words(shape)).reshape(self.cases, *shape)

    def normals(self, *shape: int) -> Array:
        """Return standard normal numbers (cases, *shape), one word each, by the inverse of their distribution."""
        return normals(self._words(shape)).reshape(self.cases, *shape)

    def _words(self, shape: tuple[int, ...]) -> Words:
        count = math.prod(shape)
        words = self._next_words(self._taken, count)
        self._taken += count
        return words
