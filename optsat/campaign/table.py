"""Table: outcomes of cases as columns, and back; the same columns whatever chunks they came in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from optsat.campaign.result import Failure
from optsat.campaign.study import Row
from optsat.errors import InputError

_FAILED = "failed/"
_PLAIN = {float: "f", int: "i", bool: "b", str: "U"}


@dataclass(frozen=True)
class Kind:
    """What a column holds in all cases of a run; shape : of one case; case : the first one that showed it."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    case: int

    @property
    def kind(self) -> str:
        """NumPy's letter: f, i, b or U."""
        return self.dtype.kind


Kinds: TypeAlias = Mapping[str, Kind]


@dataclass(frozen=True)
class Table:
    """Columns of the cases that succeeded, and of those that failed.

    columns : results by name, "case" among them, one entry a succeeded case; arrays have further axes
    failures : one each, in case order
    """

    columns: Mapping[str, NDArray[Any]]
    failures: tuple[Failure, ...]

    @staticmethod
    def of(study: str, outcomes: Sequence[Row | Failure]) -> "Table":
        """Return the table of outcomes in case order.

        Raises
        ------
        InputError : cases that return different columns, or one column in different shapes.
        """
        failures = tuple(outcome for outcome in outcomes if isinstance(outcome, Failure))
        rows = [outcome for outcome in outcomes if not isinstance(outcome, Failure)]
        for row in rows:
            _check_same(study, rows[0], rows[0]["case"], row, row["case"])
        return Table({name: _column(study, name, rows) for name in (rows[0] if rows else ())}, failures)

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Return all of it as named arrays, for a chunk file."""
        failed = {name: np.array([getattr(f, name) for f in self.failures]) for name in ("case", "error", "message")}
        return {
            **self.columns,
            **({_FAILED + name: column for name, column in failed.items()} if self.failures else {}),
        }

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[Any]]) -> "Table":
        """Return the table that `to_arrays` gave."""
        failed = [arrays[_FAILED + name].tolist() for name in ("case", "error", "message") if _FAILED + name in arrays]
        failures = tuple(Failure(*parts) for parts in zip(*failed, strict=True))
        return Table({n: column for n, column in arrays.items() if not n.startswith(_FAILED)}, failures)

    @staticmethod
    def joined(study: str, tables: Sequence["Table"]) -> "Table":
        """Return tables of consecutive cases as one.

        Raises
        ------
        InputError : they hold different columns.
        """
        kinds: Kinds = {}
        for table in tables:
            kinds = joined_kinds(study, kinds, table)
        full = [table.of_kinds(kinds) for table in tables if table.columns]
        columns = {name: np.concatenate([table.columns[name] for table in full]) for name in kinds}
        return Table(columns, tuple(failure for table in tables for failure in table.failures))

    def of_kinds(self, kinds: "Kinds") -> "Table":
        """Return this table with whole numbers as numbers where the run has numbers."""
        columns = {
            n: c if n not in kinds or c.dtype.kind == kinds[n].kind else c.astype(kinds[n].dtype)
            for n, c in self.columns.items()
        }
        return Table(columns, self.failures)

    def __len__(self) -> int:
        return len(self.columns["case"]) if self.columns else 0

    def rows(self) -> tuple[Row, ...]:
        """Return one row a succeeded case: plain numbers, words and truth values, and arrays where there are any."""
        lists = {n: column.tolist() if column.ndim == 1 else list(column) for n, column in self.columns.items()}
        return tuple(dict(zip(lists, values, strict=True)) for values in zip(*lists.values(), strict=True))


def joined_kinds(study: str, kinds: Kinds, table: Table) -> Kinds:
    """Return the kinds of the columns of tables seen so far and of one more.

    Raises
    ------
    InputError : it holds other columns, another shape, or another kind than whole numbers beside numbers.
    """
    if not table.columns:
        return kinds
    case = int(table.columns["case"][0])
    if not kinds:
        return {name: Kind(column.dtype, column.shape[1:], case) for name, column in table.columns.items()}
    _check_same(study, kinds, kinds["case"].case, table.columns, case)
    return {name: _joined_kind(study, name, kind, table.columns[name]) for name, kind in kinds.items()}


def _joined_kind(study: str, name: str, kind: Kind, column: NDArray[Any]) -> Kind:
    _check_shapes(study, name, {kind.shape, column.shape[1:]})
    if column.dtype.kind == kind.kind:
        return kind
    _check_kinds(study, name, {kind.kind, column.dtype.kind})
    return Kind(np.dtype(np.float64), kind.shape, kind.case)


def _column(study: str, name: str, rows: Sequence[Row]) -> NDArray[Any]:
    values = [row[name] for row in rows]
    types = set(map(type, values))
    if types <= _PLAIN.keys():
        _check_kinds(study, name, {_PLAIN[each] for each in types})
    else:
        _check_shapes(study, name, {np.shape(value) for value in values})
        _check_kinds(study, name, {np.asarray(value).dtype.kind for value in values})
    return np.array(values)


def _check_same(study: str, first: Mapping[str, Any], case: int, other: Mapping[str, Any], other_case: int) -> None:
    if list(other) != list(first):
        raise InputError(
            f"study {study}: every case must return the same columns; case {case} returned {list(first)[1:]}, "
            f"case {other_case} returned {list(other)[1:]}."
        )


def _check_shapes(study: str, name: str, shapes: set[tuple[int, ...]]) -> None:
    if len(shapes) > 1:
        raise InputError(f"study {study}: `{name}` must have one shape in all cases, got {sorted(shapes)}.")


def _check_kinds(study: str, name: str, kinds: set[str]) -> None:
    if len(kinds) > 1 and kinds != {"i", "f"}:
        raise InputError(f"study {study}: `{name}` must be of one kind in all cases.")
