"""Results on disk: complete, readable, whole or absent."""

import csv
import json
from pathlib import Path

import pytest
import toy_study

from optsat import _version
from optsat.campaign.runner import run_study
from optsat.campaign.store import write_result
from optsat.files import write_atomically


def test_a_result_can_be_read_back(tmp_path: Path) -> None:
    result = run_study(toy_study.study, cases=5)
    write_result(result, tmp_path / "new" / "folder", ["optsat", "study", "run"])
    folder = tmp_path / "new" / "folder"
    assert sorted(path.name for path in folder.iterdir()) == ["result.json", "rows.csv"]

    document = json.loads((folder / "result.json").read_text())
    assert {name: document[name] for name in result.summary()} == result.summary()
    assert document["failed_cases"] == [{"case": 3, "error": "InputError", "message": "the offset is unlucky"}]
    assert document["provenance"]["optsat"] == _version.__version__
    assert document["provenance"]["command"] == ["optsat", "study", "run"]

    with (folder / "rows.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert list(table[0]) == ["case", "failure", "draw", "shifted", "even"]
    assert [int(line["case"]) for line in table] == [0, 1, 2, 3, 4]
    assert [line["failure"] for line in table] == ["", "", "", "InputError: the offset is unlucky", ""]
    assert [float(line["draw"]) for line in table if not line["failure"]] == [row["draw"] for row in result.rows]


def test_the_same_rows_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_result(run_study(toy_study.study, cases=5), tmp_path / name, [])
    assert (tmp_path / "a" / "rows.csv").read_bytes() == (tmp_path / "b" / "rows.csv").read_bytes()


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "result.json"
    path.write_bytes(b"old")

    def full(_handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
