"""The body of a CSV log as columns of numbers; what is not a number is marked, never guessed."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.errors import RecordError
from optsat.records.record import BadRow, Mask

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?", re.ASCII)
_PLAIN = frozenset("0123456789+-.eE,; \t\n")


@dataclass(frozen=True)
class Table:
    """The rows of a log with the right number of cells.

    lines : (n,) line number of each row
    values : (n, c) numbers as written, in the log's own units; NaN where empty or broken
    empty, broken : (n, c) the cells without text, and those whose text is not a finite number
    texts : the cells as written
    """

    lines: NDArray[np.int64]
    values: Array
    empty: Mask
    broken: Mask
    texts: Sequence[list[str]]

    def select(self, rows: NDArray[np.int64]) -> "Table":
        """Return the table of these rows only."""
        texts = [self.texts[row] for row in rows]
        return Table(self.lines[rows], self.values[rows], self.empty[rows], self.broken[rows], texts)


def read_table(
    file: str, lines: list[str], header_line: int, names: list[str], delimiter: str, *, terminated: bool
) -> tuple[Table, list[BadRow]]:
    """Split the lines below the header into cells and numbers; rows of another cell count come back as bad.

    terminated : the last line ends with a line break; if not, it may have been cut inside a number and is refused

    Raises
    ------
    RecordError : decimal commas, or a cell too long to be one.
    """
    numbers: list[int] = []
    rows: list[list[str]] = []
    bad: list[BadRow] = []
    for number, line in enumerate(lines[header_line:], start=header_line + 1):
        if not line.strip():
            continue
        if number == len(lines) and not terminated:
            reason = "the last row has no line break, so its last number may be cut; end the file with a line break"
            bad.append(BadRow(file, number, "", reason))
            continue
        try:
            cells = next(csv.reader([line], delimiter=delimiter))
        except csv.Error as error:
            raise RecordError(f"the row cannot be split into cells: {error}.", file=file, line=number) from None
        if not rows and not bad and delimiter == ";":
            _refuse_decimal_commas(file, number, names, cells)
        if len(cells) == len(names):
            numbers.append(number)
            rows.append(cells)
        else:
            reason = f"the row has {len(cells)} cells, but the header has {len(names)}"
            bad.append(BadRow(file, number, "", reason))
    plain = all(_PLAIN.issuperset(line) for line in lines[header_line:])
    values = np.full((len(rows), len(names)), np.nan)
    empty, broken = np.zeros(values.shape, dtype=bool), np.zeros(values.shape, dtype=bool)
    for j, texts in enumerate(zip(*rows, strict=True)):
        values[:, j], empty[:, j], broken[:, j] = _numbers(texts, plain)
    return Table(np.array(numbers, dtype=np.int64), values, empty, broken, rows), bad


def _numbers(texts: tuple[str, ...], plain: bool) -> tuple[Array, Mask, Mask]:
    """Return values, empty and broken of one column; `plain` says that no letter can hide in it (nan, inf, 1_000)."""
    empty = np.array([not text or text.isspace() for text in texts])
    values: Array | None = None
    if plain:
        try:
            values = np.array([float(text) if text else np.nan for text in texts])
        except ValueError:
            values = None
    if values is None:
        stripped = (text.strip() for text in texts)
        values = np.array([float(text) if _NUMBER.fullmatch(text) else np.nan for text in stripped])
    broken = ~empty & ~np.isfinite(values)
    values[broken] = np.nan
    return values, empty, broken


def _refuse_decimal_commas(file: str, line: int, names: list[str], cells: list[str]) -> None:
    for name, cell in zip(names, cells, strict=False):
        if _DECIMAL_COMMA.fullmatch(cell.strip()):
            cure = "export with ',' between the cells and '.' in the numbers (';' between the cells is accepted)"
            raise RecordError(f"found the decimal comma {cell.strip()!r}; {cure}.", file=file, line=line, column=name)
