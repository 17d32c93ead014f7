"""`optsat cache`: what it shows, what it removes, and what it leaves alone."""

import json
import os
import time
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from optsat.cli import app
from optsat.kernels import folders
from optsat.kernels.entry import Entry
from optsat.kernels.linear import cholesky_solve
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.toolchain import CompilerMissingError, find_compiler


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    try:
        find_compiler()
    except CompilerMissingError as error:
        pytest.skip(str(error))
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "own"))
    monkeypatch.setenv("OPTSAT_CFLAGS", "-O0")
    monkeypatch.setattr(folders, "spare_folders", lambda: iter([]))
    return tmp_path / "own"


def run(*arguments: str, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["cache", *arguments])
    assert result.exit_code == code, result.output
    return result.stdout


def entry(folder: Path, size: int) -> Entry:
    return Entry(folder, make_kernel(cholesky_solve(size)).record)


def test_an_empty_cache(own: Path) -> None:
    assert run("show") == "No kernels are kept.\n"
    assert json.loads(run("show", "--json")) == []
    assert run("clean") == f"{own}: nothing kept\n"


def test_it_shows_each_kernel(own: Path) -> None:
    kept = entry(own, 3)
    (document,) = json.loads(run("show", "--json"))
    found: dict[str, Any] = next(each for each in document["kernels"] if each["name"] == "cholesky_solve")
    assert found["key"] == kept.record.key
    assert (found["real"], found["width"], found["libm"], found["sound"]) == ("double", 1, [], True)
    assert found["bytes"] == kept.size()
    assert document["bytes"] == sum(each["bytes"] for each in document["kernels"])
    words = run("show")
    assert words.startswith(f"{own}: {len(document['kernels'])} kernels")
    assert kept.record.key[:12] in words
    assert "within a day" in words


def test_damage_is_a_finding(own: Path) -> None:
    library, record = entry(own, 3), entry(own, 4)
    library.library.unlink()
    library.library.write_bytes(b"no library")
    record.library.with_suffix(".record").write_text("no record")
    (document,) = json.loads(run("show", "--json", code=1))
    assert document["damaged"] == sorted([library.record.key, record.record.key])
    words = run("show", code=1)
    assert "damaged: it is made again" in words
    assert f"{record.record.key[:12]}: its record is damaged" in words


def test_it_removes_all_or_what_is_old(own: Path, tmp_path: Path) -> None:
    kept = [entry(own, size) for size in (3, 4)]
    old = time.time() - 40 * 86_400.0
    os.utime(kept[0].library.with_suffix(".record"), (old, old))
    assert "40 days ago" in run("show")
    (removed,) = json.loads(run("clean", "--unused", "30", "--json"))
    assert (removed["folder"], removed["removed"]) == (str(own), 1)
    assert not kept[0].library.exists()
    assert kept[1].library.exists()
    assert " kernels removed, 0.0 MB" in run("clean")
    assert not list(own.rglob("*.so"))


def test_shared_folders_stay(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = entry(own, 3)
    monkeypatch.setenv(folders.VARIABLE, os.pathsep.join([str(tmp_path / "mine"), str(own)]))
    assert json.loads(run("clean", "--json")) == []
    assert kept.library.exists()
    assert json.loads(run("show", "--json"))[0]["folder"] == str(own)


def test_it_loads_nothing_slow() -> None:
    import subprocess
    import sys

    program = "import sys, optsat.commands.cache as c; print({'casadi', 'cvxpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
