"""Rows: the cases that ran, read from their tables as they are asked for, so that no run is ever held whole."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from optsat.campaign.result import Failure
from optsat.campaign.study import Row
from optsat.campaign.table import Kinds, Table, joined_kinds

_HELD_BYTES = 1 << 22


class Rows(Sequence[Row]):
    """One row a case that ran, in case order, its number under "case"; equal to any sequence of the same rows.

    Small runs are kept in memory; larger ones in a folder are read from it each time, so metrics that go through them
    once hold none of them, and the folder must stay until then.
    """

    def __init__(self, load: Callable[[int], Table], lengths: Sequence[int], kinds: Kinds) -> None:
        self._load, self.kinds = load, kinds
        self._starts = list(itertools.accumulate(lengths, initial=0))
        self._last: tuple[int, Sequence[Row]] = (-1, ())

    def __len__(self) -> int:
        return self._starts[-1]

    def __iter__(self) -> Iterator[Row]:
        for table in self.tables():
            yield from table.rows()

    @overload
    def __getitem__(self, place: int) -> Row: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[Row, ...]: ...
    def __getitem__(self, place: int | slice) -> Row | tuple[Row, ...]:
        if isinstance(place, slice):
            return tuple(self[k] for k in range(*place.indices(len(self))))
        k = range(len(self))[place]
        table = int(np.searchsorted(self._starts, k, side="right")) - 1
        if self._last[0] != table:
            self._last = (table, self._table(table).rows())
        return self._last[1][k - self._starts[table]]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Sequence):
            return NotImplemented
        return len(self) == len(other) and all(one == two for one, two in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]

    def tables(self) -> Iterator[Table]:
        """Yield the tables in case order, each column of one kind in all."""
        return (self._table(k) for k in range(len(self._starts) - 1))

    def _table(self, k: int) -> Table:
        return self._load(k).of_kinds(self.kinds)


@dataclass(frozen=True)
class Cases:
    """All cases of a run: the rows of those that ran, and those that failed."""

    rows: Rows
    failures: tuple[Failure, ...]


def read_cases(study: str, load: Callable[[int], Table], count: int) -> Cases:
    """Return the cases of `count` tables of consecutive cases, `load(k)` being the k-th.

    Raises
    ------
    InputError : tables that hold different columns.
    """
    lengths, size = [], 0
    failures: list[Failure] = []
    kinds: Kinds = {}
    held: list[Table] | None = []
    for k in range(count):
        table = load(k)
        kinds = joined_kinds(study, kinds, table)
        lengths.append(len(table))
        failures.extend(table.failures)
        size += sum(column.nbytes for column in table.columns.values())
        if held is not None:
            held.append(table)
        if size > _HELD_BYTES:
            held = None
    return Cases(Rows(load if held is None else held.__getitem__, lengths, kinds), tuple(failures))
