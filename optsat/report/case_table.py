"""Case table: the columns of a study as JSON inside a page, all cases or as many as the page can carry."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Columns = Mapping[str, NDArray[Any]]

_DIGITS = 6
_LEAST_BYTES, _MOST_BYTES, _BYTES_A_CASE = 380_000, 2_500_000, 38
_EXTREMES_SHARE = 0.2
_MEASURED, _SURELY_MORE, _MARGIN = 1000, 1.1, 0.95


@dataclass(frozen=True)
class CaseTable:
    """A table for the script of the page.

    document : {"count", "columns": [{"name", and one of "first", "values", "words" with "values"}]} as JSON text
    shown, cases : rows in it, and rows there are
    """

    document: str
    shown: int
    cases: int

    @property
    def says(self) -> str:
        """Which cases are shown, where not all are."""
        if self.shown == self.cases:
            return ""
        return (
            f"{self.shown:,} of {self.cases:,} cases: those with the smallest and the largest values of each column, "
            "and a random sample of the others. All cases are in summary.csv of the run folder."
        )


def case_table(columns: Columns, run: str) -> CaseTable:
    """Return the table of all cases, or of the extreme ones and a sample where all would be too large for a page.

    columns : (cases,) each, "case" first; run : name of the run, which fixes the sample
    """
    cases = len(columns["case"])
    budget = min(max(_LEAST_BYTES, _BYTES_A_CASE * cases), _MOST_BYTES)
    few = _rows(columns, np.unique(np.linspace(0, cases - 1, min(cases, _MEASURED)).round().astype(np.int64)))
    size = len(_as_json(few, len(few["case"]))) * cases / len(few["case"])
    if size <= _SURELY_MORE * budget:
        text = _as_json(columns, cases)
        if len(text) <= budget:
            return CaseTable(text, cases, cases)
        size = len(text)
    rows = _chosen(columns, max(1, int(_MARGIN * budget * cases / size)), run)
    return CaseTable(_as_json(_rows(columns, rows), len(rows)), len(rows), cases)


def _rows(columns: Columns, rows: NDArray[np.int64]) -> Columns:
    return {name: column[rows] for name, column in columns.items()}


def _chosen(columns: Columns, count: int, run: str) -> NDArray[np.int64]:
    """Return the rows of the extremes of each column and a sample, in order."""
    cases = len(columns["case"])
    numeric = [name for name, column in columns.items() if name != "case" and column.dtype.kind in "if"]
    each = int(_EXTREMES_SHARE * count / max(1, 2 * len(numeric)))
    kept: set[int] = set()
    for name in numeric:
        order = np.argsort(columns[name], kind="stable")
        order = order[np.isfinite(columns[name][order])]
        kept.update(order[:each].tolist(), order[len(order) - each :].tolist())
    others = np.setdiff1d(np.arange(cases), np.array(sorted(kept), dtype=np.int64))
    key = int.from_bytes(hashlib.blake2b(run.encode(), digest_size=8).digest(), "little")
    generator = np.random.Generator(np.random.Philox(key=key))
    # not Generator.choice: NumPy promises the words of its bit generators, not the streams made of them
    order = np.argsort(generator.bit_generator.random_raw(len(others)), kind="stable")
    return np.sort(np.concatenate((np.array(sorted(kept), dtype=np.int64), others[order[: count - len(kept)]])))


def _as_json(columns: Columns, count: int) -> str:
    described = ",".join(_column(name, column) for name, column in columns.items())
    return f'{{"count":{count},"columns":[{described}]}}'


def _column(name: str, column: NDArray[Any]) -> str:
    said = json.dumps(name)
    if column.dtype.kind == "b":
        return (
            f'{{"name":{said},"words":["no","yes"],"values":[{",".join("1" if v else "0" for v in column.tolist())}]}}'
        )
    if column.dtype.kind == "U":
        words, index = np.unique(column, return_inverse=True)
        return f'{{"name":{said},"words":{json.dumps(words.tolist())},"values":[{",".join(map(str, index.tolist()))}]}}'
    if column.dtype.kind == "i":
        first = int(column[0]) if len(column) else 0
        if np.array_equal(column, np.arange(first, first + len(column))):
            return f'{{"name":{said},"first":{first}}}'
        return f'{{"name":{said},"values":[{",".join(map(str, column.tolist()))}]}}'
    return f'{{"name":{said},"values":[{",".join(map(_number, column.tolist()))}]}}'


def _number(value: float) -> str:
    """Return six digits; NaN as null, infinity as a number that no double holds, for JSON has neither."""
    if value != value:
        return "null"
    if value in (float("inf"), float("-inf")):
        return "1e999" if value > 0 else "-1e999"
    text = f"{value:.{_DIGITS}g}"
    return text.replace("e+", "e").replace("e-0", "e-").replace("e0", "e")
