"""Table: outcomes of cases as columns, and back; the same columns whatever chunks they came in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optsat.campaign.result import Failure
from optsat.campaign.study import Row
from optsat.errors import InputError

_FAILED = "failed/"


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
        full = [table for table in tables if table.columns]
        for table in full:
            first, this = full[0].columns, table.columns
            _check_same(study, first, first["case"][0], this, this["case"][0])
            for name in first:
                _check_shapes(study, name, {first[name].shape[1:], this[name].shape[1:]})
        names = list(full[0].columns) if full else []
        columns = {name: np.concatenate([table.columns[name] for table in full]) for name in names}
        return Table(columns, tuple(failure for table in tables for failure in table.failures))

    def rows(self) -> tuple[Row, ...]:
        """Return one row a succeeded case: plain numbers, words and truth values, and arrays where there are any."""
        lists = {n: column.tolist() if column.ndim == 1 else list(column) for n, column in self.columns.items()}
        return tuple(dict(zip(lists, values, strict=True)) for values in zip(*lists.values(), strict=True))


def _column(study: str, name: str, rows: Sequence[Row]) -> NDArray[Any]:
    values = [row[name] for row in rows]
    _check_shapes(study, name, {np.shape(value) for value in values})
    kinds = {_kind(value) for value in values}
    if len(kinds) > 1 and kinds != {"i", "f"}:
        raise InputError(f"study {study}: `{name}` must be of one kind in all cases.")
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


def _kind(value: Any) -> str:
    return np.asarray(value).dtype.kind
