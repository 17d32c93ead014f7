"""Designs: the parameters of every case from its cell alone, so that no list of a million cases is ever held.

A case keeps its parameters when more cases are asked for. Random parts come from the campaign's key and the cell;
their streams are apart from those that cases draw from.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.campaign.distributions import Distribution
from optsat.campaign.philox import philox_words
from optsat.errors import InputError

Case: TypeAlias = Mapping[str, Any]
Columns: TypeAlias = Mapping[str, NDArray[Any]]
"""Parameters or results by name, their cases along the first axis."""

_POINT_STREAM, _SHIFT_STREAM = 1 << 62, (1 << 62) + 1
_SOBOL_BITS = 30


class Design(Protocol):
    """A way to lay out cases."""

    def columns(self, key: int, cells: NDArray[np.int64]) -> Columns:
        """Return the parameters of the cases at consecutive `cells` (n,) of the campaign `key`."""
        ...


@dataclass(frozen=True)
class Grid:
    """Every combination of the values of its factors, the last factor fastest, over and over.

    A pass over the whole grid is a replicate, which the parameter `replicate` counts: so a longer campaign holds the
    shorter one, and a number of cases that is a multiple of `points` treats all combinations alike.
    """

    factors: Mapping[str, Sequence[float | int | str | bool]]

    def __post_init__(self) -> None:
        empty = [name for name, values in self.factors.items() if not len(values)]
        if empty or not self.factors:
            raise InputError(f"A grid needs factors with values; {', '.join(empty) or 'it'} has none.")
        if "replicate" in self.factors:
            raise InputError("`replicate` is what a grid counts its passes by; give the factor another name.")

    @property
    def points(self) -> int:
        """Number of combinations."""
        return math.prod(len(values) for values in self.factors.values())

    def columns(self, key: int, cells: NDArray[np.int64]) -> Columns:
        """Return each factor's values and the replicate; nothing here is random."""
        replicate, place = np.divmod(np.asarray(cells, dtype=np.int64), self.points)
        places = np.unravel_index(place, [len(values) for values in self.factors.values()])
        found = {n: np.array(values)[k] for (n, values), k in zip(self.factors.items(), places, strict=True)}
        return {**found, "replicate": replicate}


@dataclass(frozen=True)
class RandomDesign:
    """Each factor drawn for each case by itself."""

    factors: Mapping[str, Distribution]

    def __post_init__(self) -> None:
        _check_factors("random design", self.factors)

    def columns(self, key: int, cells: NDArray[np.int64]) -> Columns:
        """Return values drawn from the campaign's key and the cells."""
        words = philox_words(key, cells, len(self.factors), _POINT_STREAM)
        u = ((words >> np.uint64(12)) + 0.5) * 2.0**-52
        return _spread(self.factors, np.asarray(u, dtype=np.float64))


@dataclass(frozen=True)
class SobolDesign:
    """Points that fill the space of the factors evenly: Sobol's sequence with a random digital shift.

    Every 2^k cases from a multiple of 2^k on are spread evenly over each factor; so take a power of two of them. The
    shift comes from the campaign's key, so campaigns of other seeds are independent and each is without bias.
    Source: I. Sobol (1967), direction numbers of S. Joe and F. Kuo (2008); shift: A. Owen, Monte Carlo theory, 17.
    """

    factors: Mapping[str, Distribution]

    def __post_init__(self) -> None:
        _check_factors("Sobol design", self.factors)

    def columns(self, key: int, cells: NDArray[np.int64]) -> Columns:
        """Return the values of the points at the cells.

        Raises
        ------
        InputError : cells beyond 2^30, where the sequence ends.
        """
        points = _sobol_points(len(self.factors), np.asarray(cells, dtype=np.int64))
        shift = philox_words(key, np.zeros(1, dtype=np.int64), len(self.factors), _SHIFT_STREAM) >> np.uint64(
            64 - _SOBOL_BITS
        )
        u = ((points ^ shift) + 0.5) * 2.0**-_SOBOL_BITS
        return _spread(self.factors, np.asarray(u, dtype=np.float64))


def _sobol_points(dimensions: int, cells: NDArray[np.int64]) -> NDArray[np.uint64]:
    """Return points (n, dimensions) of the plain sequence as whole numbers below 2^30."""
    if not cells.size:
        return np.zeros((0, dimensions), dtype=np.uint64)
    from scipy.stats import qmc

    first, last = int(cells.min()), int(cells.max())
    if last >= 1 << _SOBOL_BITS:
        raise InputError(f"a Sobol design has {1 << _SOBOL_BITS} cases at most, case {last} was asked for.")
    source = qmc.Sobol(dimensions, scramble=False, bits=_SOBOL_BITS)
    points = np.zeros((last - first + 1, dimensions))
    # the point of cell 0 is the origin; asked for together with others, SciPy warns unless 2^k are asked for
    start = max(first, 1)
    if last >= start:
        source.fast_forward(start)
        points[start - first :] = source.random(last - start + 1)
    return np.asarray((points * 2.0**_SOBOL_BITS).astype(np.uint64)[cells - first])


def _spread(factors: Mapping[str, Distribution], u: Array) -> Columns:
    return {name: factor.quantile(u[:, k]) for k, (name, factor) in enumerate(factors.items())}


def _check_factors(what: str, factors: Mapping[str, Distribution]) -> None:
    if not factors:
        raise InputError(f"A {what} needs at least one factor.")


@dataclass(frozen=True)
class Layout:
    """The cases of one campaign: those of a list, or of a design at a key."""

    count: int
    key: int
    source: Sequence[Case] | Design

    @staticmethod
    def of(study: str, cases: Callable[[int], Sequence[Case]] | Design, count: int, key: int) -> "Layout":
        """Return the layout of `count` cases.

        Raises
        ------
        InputError : a function that lays out another number of them.
        """
        if not callable(cases):
            return Layout(count, key, cases)
        listed = cases(count)
        if len(listed) != count:
            raise InputError(f"study {study} laid out {len(listed)} cases where {count} were asked for.")
        return Layout(count, key, listed)

    def cases(self, numbers: Sequence[int]) -> list[Case]:
        """Return the parameters of each case."""
        if isinstance(self.source, Sequence):
            return [self.source[number] for number in numbers]
        lists = {name: column.tolist() for name, column in self.columns(numbers).items()}
        return [dict(zip(lists, values, strict=True)) for values in zip(*lists.values(), strict=True)]

    def columns(self, numbers: Sequence[int]) -> Columns:
        """Return the parameters by name."""
        if not isinstance(self.source, Sequence):
            return self.source.columns(self.key, np.asarray(numbers, dtype=np.int64))
        cases = self.cases(numbers)
        return {name: np.array([case[name] for case in cases]) for name in (cases[0] if cases else ())}
