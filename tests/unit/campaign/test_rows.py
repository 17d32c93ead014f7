"""Rows: a sequence of what ran, the same whatever the tables were, and a content hash that only values change."""

from collections.abc import Sequence

import numpy as np
import pytest

from optsat.campaign import case_blocks, rows
from optsat.campaign.case_blocks import content_hash
from optsat.campaign.result import Failure
from optsat.campaign.rows import Cases, read_cases
from optsat.campaign.study import Row
from optsat.campaign.table import Table
from optsat.errors import InputError

OUTCOMES: list[Row | Failure] = [
    {"case": k, "whole": k if k < 5 else k + 0.5, "word": "é" * k, "is_even": k % 2 == 0, "q": np.arange(4.0) + k}
    if k % 4 != 3
    else Failure(k, "ValueError", f"no. {k}")
    for k in range(11)
]


def cases_in(sizes: Sequence[int]) -> Cases:
    tables, first = [], 0
    for size in sizes:
        tables.append(Table.of("s", OUTCOMES[first : first + size]))
        first += size
    return read_cases("s", tables.__getitem__, len(tables))


def test_rows_are_a_sequence() -> None:
    found = cases_in([3, 1, 7]).rows
    assert len(found) == 9
    assert [row["case"] for row in found] == [0, 1, 2, 4, 5, 6, 8, 9, 10]
    assert (found[-1]["case"], found[3]["case"], found[0]["word"]) == (10, 4, "")
    assert [row["case"] for row in found[2:5]] == [2, 4, 5]
    assert found != found[1:]
    assert found != 3
    with pytest.raises(IndexError):
        found[9]


@pytest.mark.parametrize("sizes", [[11], [3, 1, 7], [4, 4, 3], [1] * 11])
def test_a_column_is_of_one_kind_whatever_the_tables(sizes: list[int]) -> None:
    found = cases_in(sizes)
    assert {type(row["whole"]) for row in found.rows} == {float}
    assert content_hash(found, 11) == content_hash(cases_in([11]), 11)


def test_large_runs_are_not_held(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[int] = []

    def load(k: int) -> Table:
        loaded.append(k)
        return Table.of("s", OUTCOMES[2 * k : 2 * k + 2])

    held = read_cases("s", load, 5).rows
    assert [row["case"] for row in held] == [row["case"] for row in held]
    assert loaded == [0, 1, 2, 3, 4]
    monkeypatch.setattr(rows, "_HELD_BYTES", 0)
    loaded.clear()
    read = read_cases("s", load, 5).rows
    assert [row["case"] for row in read] == [row["case"] for row in held]
    assert loaded == [0, 1, 2, 3, 4] * 2


@pytest.mark.parametrize(("length", "most_bytes"), [(2, 1 << 25), (3, 1 << 25), (4096, 8 * 7 * 2)])
def test_the_content_does_not_depend_on_blocks(length: int, most_bytes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = content_hash(cases_in([11]), 11)
    monkeypatch.setattr(case_blocks, "_MOST_CASES", length)
    monkeypatch.setattr(case_blocks, "_MOST_BYTES", most_bytes)
    assert content_hash(cases_in([3, 1, 7]), 11) == whole


def test_the_content_depends_on_every_value() -> None:
    whole = content_hash(cases_in([11]), 11)
    for k, change in ((1, {"word": "x"}), (2, {"is_even": False}), (4, {"q": np.zeros(4)}), (5, {"whole": 5.25})):
        before = OUTCOMES[k]
        assert isinstance(before, dict)
        changed = [*OUTCOMES[:k], {**before, **change}, *OUTCOMES[k + 1 :]]
        assert content_hash(read_cases("s", [Table.of("s", changed)].__getitem__, 1), 11) != whole
    changed = [*OUTCOMES[:3], Failure(3, "ValueError", "another"), *OUTCOMES[4:]]
    assert content_hash(read_cases("s", [Table.of("s", changed)].__getitem__, 1), 11) != whole


def test_columns_of_other_kinds_do_not_join() -> None:
    tables = [Table.of("s", [{"case": k, "a": value}]) for k, value in enumerate((1.0, "one"))]
    with pytest.raises(InputError, match="`a` must be of one kind"):
        read_cases("s", tables.__getitem__, 2)
