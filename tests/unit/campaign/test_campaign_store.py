"""The end of a run on the disk: complete, readable, the same bytes, and noticed when it changes."""

import csv
import json
from pathlib import Path
from typing import NoReturn

import pytest
import toy_study

from optsat import _version
from optsat.campaign.rows import read_cases
from optsat.campaign.runner import run_study
from optsat.errors import MissingExtraError, OptsatError
from optsat.files import write_atomically

FILES = ["chunks", "complete.json", "figure.svg", "lock", "manifest", "result.nc", "run.json", "summary.csv"]


def test_a_result_can_be_read_back(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    result = run_study(toy_study.study, cases=5, out=folder)
    assert sorted(path.name for path in folder.iterdir()) == FILES
    document = json.loads((folder / "complete.json").read_text())
    assert {name: document[name] for name in result.summary()} == result.summary()
    assert document["failed_cases"] == [{"case": 3, "error": "InputError", "message": "the offset is unlucky"}]
    assert json.loads((folder / "run.json").read_text())["provenance"]["optsat"] == _version.__version__

    with (folder / "summary.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert list(table[0]) == ["case", "failure", "draw", "shifted", "even"]
    assert [int(line["case"]) for line in table] == [0, 1, 2, 3, 4]
    assert [line["failure"] for line in table] == ["", "", "", "InputError: the offset is unlucky", ""]
    assert [float(line["draw"]) for line in table if not line["failure"]] == [row["draw"] for row in result.rows]


def test_the_final_file_opens_in_xarray(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray", reason="the extra `results` is not installed")
    result = run_study(toy_study.study, cases=5, out=tmp_path)
    with xarray.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as data:
        assert data.sizes["case"] == 5
        assert data["status"].values.tolist() == [0, 0, 0, 1, 0]
        assert data["failure"].values.tolist() == ["", "", "", "InputError: the offset is unlucky", ""]
        assert data["draw"].values[[0, 1, 2, 4]].tolist() == [row["draw"] for row in result.rows]
        assert data["draw"].isnull().values.tolist() == [False, False, False, True, False]
        assert data.attrs["study"] == "toy-study"


def test_a_complete_run_is_read_and_not_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = run_study(toy_study.study, cases=5, out=tmp_path)

    def refuse(*_arguments: object) -> NoReturn:
        raise AssertionError("a case was run")

    monkeypatch.setattr("optsat.campaign.runner.run_cases", refuse)
    again = run_study(toy_study.study, cases=5, out=tmp_path)
    assert (again.rows, again.claims, again.failures) == (first.rows, first.claims, first.failures)


@pytest.mark.parametrize("name", ["result.nc", "summary.csv", "figure.svg"])
def test_a_changed_file_is_noticed_and_written_anew(tmp_path: Path, name: str) -> None:
    run_study(toy_study.study, cases=5, out=tmp_path)
    path = tmp_path / name
    whole = path.read_bytes()
    path.write_bytes(bytes([whole[0] ^ 1]) + whole[1:])
    with pytest.raises(OptsatError, match=f"{name} is not the file"):
        run_study(toy_study.study, cases=5, out=tmp_path)
    (tmp_path / "complete.json").unlink()
    run_study(toy_study.study, cases=5, out=tmp_path, resume=True)
    assert path.read_bytes() == whole


def test_without_the_extra_the_table_is_still_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from optsat.campaign import final_file, store

    monkeypatch.setattr(store, "find_spec", lambda _name: None)
    run_study(toy_study.study, cases=5, out=tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [name for name in FILES if name != "result.nc"]
    monkeypatch.setitem(__import__("sys").modules, "h5netcdf", None)
    with pytest.raises(MissingExtraError, match=r"optsat\[results\]"):
        final_file.write_final_file(tmp_path / "x.nc", read_cases("toy-study", [].__getitem__, 0), 1, {})


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
