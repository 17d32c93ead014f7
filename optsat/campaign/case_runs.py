"""Case runs: the cases of one chunk, one after the other or as a batch, and what becomes of those that raise."""

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optsat.campaign.designs import Case, Columns, Layout
from optsat.campaign.draws import Draws
from optsat.campaign.executors import Outcomes
from optsat.campaign.numerics import numerics_print
from optsat.campaign.result import Failure
from optsat.campaign.seeds import case_generator
from optsat.campaign.study import Row, Study
from optsat.campaign.table import Table
from optsat.errors import InputError, OptsatError

# What a computation may raise on unlucky data. Anything else (a TypeError, a misspelt name) is a mistake in the
# study and stops the campaign with its traceback.
_CASE_ERRORS = (OptsatError, ArithmeticError, ValueError, RuntimeError)
_RESERVED = frozenset(("case", "status", "failure"))
_PLAIN = (float, int, bool, str)
_KINDS = {"b": np.bool_, "i": np.int64, "u": np.int64, "f": np.float64, "U": np.str_}


def run_cases(study: Study, layout: Layout, numbers: Sequence[int]) -> Outcomes:
    """Return the outcomes of the cases `numbers`.

    Raises
    ------
    InputError : results that no table holds, or a batch that disagrees with `run`.
    """
    if study.run_batch is None:
        return Outcomes(Table.of(study.name, _one_by_one(study, layout, numbers)), numerics_print())
    parts: list[Table] = []
    _append_batch(study, layout, numbers, parts)
    table = Table.joined(study.name, parts)
    if table.columns:
        _check_alone(study, layout, table)
    return Outcomes(table, numerics_print())


def _one_by_one(study: Study, layout: Layout, numbers: Sequence[int]) -> list[Row | Failure]:
    return [_outcome(study, layout.key, n, case) for n, case in zip(numbers, layout.cases(numbers), strict=True)]


def _outcome(study: Study, key: int, number: int, case: Case) -> Row | Failure:
    try:
        row = study.run(case, case_generator(key, number))
    except _CASE_ERRORS as error:
        return Failure(number, type(error).__name__, str(error))
    _check_names(study, row)
    if all(type(value) in _PLAIN for value in row.values()):
        return {"case": number, **row}
    return {"case": number, **{name: _value(study, number, name, value) for name, value in row.items()}}


def _check_names(study: Study, names: Collection[str]) -> None:
    if not _RESERVED.isdisjoint(names):
        taken = ", ".join(f"`{name}`" for name in sorted(_RESERVED.intersection(names)))
        raise InputError(
            f"study {study.name} returns {taken}, under which the result keeps the number of a case, whether it failed "
            "and why. Give it another name."
        )


def _value(study: Study, number: int, name: str, value: object) -> object:
    if isinstance(value, np.ndarray) and value.dtype.kind in "bif":
        return value
    plain = value.item() if isinstance(value, np.generic) else value
    if not isinstance(plain, float | int | str | bool):
        raise InputError(
            f"study {study.name}: case {number} returned `{name}` of type {type(plain).__name__}. "
            "A row holds numbers, words, truth values and arrays of numbers only."
        )
    return plain


def _append_batch(study: Study, layout: Layout, numbers: Sequence[int], parts: list[Table]) -> None:
    """Run a batch; of one that raises, its halves, down to the case that is at fault."""
    assert study.run_batch is not None
    cells = np.asarray(numbers, dtype=np.int64)
    try:
        found = study.run_batch(layout.columns(numbers), Draws.of_cells(layout.key, cells))
    except _CASE_ERRORS as error:
        if len(numbers) == 1:
            parts.append(Table({}, (Failure(numbers[0], type(error).__name__, str(error)),)))
            return
        half = len(numbers) // 2
        _append_batch(study, layout, numbers[:half], parts)
        _append_batch(study, layout, numbers[half:], parts)
        return
    parts.append(Table({"case": cells, **_columns(study, len(cells), found)}, ()))


def _columns(study: Study, count: int, found: Columns) -> Columns:
    _check_names(study, found)
    columns: dict[str, NDArray[Any]] = {}
    for name, values in found.items():
        column = np.asarray(values)
        if column.dtype.kind not in _KINDS or column.shape[:1] != (count,):
            raise InputError(
                f"study {study.name}: `run_batch` returned `{name}` of type {column.dtype} and shape {column.shape} "
                f"for {count} cases. A column holds numbers, words or truth values, its cases along the first axis."
            )
        columns[name] = column.astype(_KINDS[column.dtype.kind], copy=False)
    return columns


def _check_alone(study: Study, layout: Layout, table: Table) -> None:
    """Run the first case of the table by itself and compare to the last bit."""
    number = int(table.columns["case"][0])
    alone = _one_by_one(study, layout, [number])
    one = Table.of(study.name, alone)
    if one.failures:
        raise InputError(f"study {study.name}: case {number} ran in a batch, and alone it raises {alone[0]}.")
    if list(one.columns) != list(table.columns):
        raise InputError(
            f"study {study.name}: `run` returns {list(one.columns)[1:]}, `run_batch` {list(table.columns)[1:]}; "
            "both must return the same columns in the same order."
        )
    for name, column in table.columns.items():
        if not _same_bits(one.columns[name], column[:1]):
            raise InputError(
                f"study {study.name}: `{name}` of case {number} is {one.columns[name][0]!r} alone and {column[0]!r} in "
                "a batch; they must agree to the last bit. Linear algebra across cases and random numbers drawn in "
                "another order are what makes them differ."
            )


def _same_bits(one: NDArray[Any], other: NDArray[Any]) -> bool:
    if one.dtype.kind == "U":
        return bool(one.tolist() == other.tolist())
    return one.dtype.kind == other.dtype.kind and bool(one.astype(other.dtype).tobytes() == other.tobytes())
