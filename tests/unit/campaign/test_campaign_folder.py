"""A run folder against everything that happens to one: kills at every step, damage, other runs, a second runner."""

import functools
import itertools
import json
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import toy_study

from optsat import files
from optsat.campaign import run_folder, runner
from optsat.campaign.chunk_file import ChunkError, read_chunk, write_chunk
from optsat.campaign.designs import Layout
from optsat.campaign.manifest import Manifest
from optsat.campaign.runner import run_study
from optsat.errors import InputError

CASES = 6
FINAL = ("result.nc", "summary.csv", "figure.svg", "complete.json")


@pytest.fixture(autouse=True)
def chunks_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "_chunk_size", lambda *_arguments: 2)


def run(folder: Path, **options: Any) -> None:
    seeded: dict[str, Any] = {"seed": 3} | options
    run_study(toy_study.study, cases=CASES, out=folder, **seeded)


def final_bytes(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in FINAL}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("undisturbed")
    run_study(toy_study.study, cases=CASES, seed=3, out=folder)
    return final_bytes(folder)


def killed_after(step: int, action: Callable[[], None]) -> bool:
    """Run in a process that kills itself at a durable step; return whether it got that far."""

    def child() -> None:
        files._steps = 0
        os.environ[files.CRASH_AFTER] = str(step)
        action()

    process = multiprocessing.get_context("fork").Process(target=child)
    process.start()
    process.join()
    assert process.exitcode in (0, -signal.SIGKILL)
    return process.exitcode != 0


def finished_chunks(folder: Path) -> set[str]:
    return {file.name for file in folder.glob("chunks/[0-9]*")}


def test_a_kill_at_any_step_loses_nothing(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    """Every step of a campaign: open, half a write, sync, rename, half a line, each part of the final files."""
    step = 0
    for step in itertools.count(1):
        folder = tmp_path / str(step)
        if not killed_after(step, functools.partial(run, folder)):
            break
        before = {name: (folder / "chunks" / name).stat().st_mtime_ns for name in finished_chunks(folder)}
        run(folder, resume=True)
        after = {name: (folder / "chunks" / name).stat().st_mtime_ns for name in before}
        assert after == before, f"a finished chunk was written again after a kill at step {step}"
        assert final_bytes(folder) == undisturbed, f"other bytes after a kill at step {step}"
        assert not list(folder.glob("**/.*")), f"something was left behind by a kill at step {step}"
    assert step > 50


def test_two_kills_in_one_run(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    assert killed_after(17, lambda: run(tmp_path))
    assert killed_after(9, lambda: run(tmp_path, resume=True))
    run(tmp_path, resume=True)
    assert final_bytes(tmp_path) == undisturbed
    events = [event["event"] for event in Manifest(tmp_path / "manifest").read()]
    assert (events.count("started"), events.count("resumed"), events[-1]) == (1, 2, "finished")


@pytest.mark.parametrize("size", [1, 4, 6])
def test_no_byte_depends_on_the_chunks(
    tmp_path: Path, size: int, undisturbed: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "_chunk_size", lambda *_arguments: size)
    run(tmp_path)
    assert final_bytes(tmp_path) == undisturbed


def test_no_byte_depends_on_the_workers(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    run(tmp_path, workers=2)
    assert final_bytes(tmp_path) == undisturbed


@pytest.fixture
def unfinished(tmp_path: Path) -> Path:
    """A folder with the run's first chunk or two."""
    assert killed_after(26, lambda: run(tmp_path))
    assert finished_chunks(tmp_path) == {"000000", "000001"}
    return tmp_path


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _data: b"",
    "cut": lambda data: data[:-1],
    "a bit flipped": lambda data: data[:60] + bytes([data[60] ^ 1]) + data[61:],
    "something else": lambda _data: b"hello",
    "another run's": lambda data: write_chunk("other", 1, {"a": np.zeros(2)}),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_chunk_is_set_aside_and_computed_anew(
    unfinished: Path, damage: str, undisturbed: dict[str, bytes]
) -> None:
    file = unfinished / "chunks" / "000001"
    file.write_bytes(DAMAGE[damage](file.read_bytes()))
    run(unfinished, resume=True)
    assert final_bytes(unfinished) == undisturbed
    assert [each.name for each in (unfinished / "quarantine").iterdir()] == ["000001.0"]
    assert "quarantined" in [event["event"] for event in Manifest(unfinished / "manifest").read()]


def test_swapped_and_foreign_chunks_are_set_aside(unfinished: Path, undisturbed: dict[str, bytes]) -> None:
    first, second = (unfinished / "chunks" / name for name in ("000000", "000001"))
    second.write_bytes(first.read_bytes())
    (unfinished / "chunks" / "000009").write_bytes(first.read_bytes())
    (unfinished / "chunks" / "notes.txt").write_text("mine")
    run(unfinished, resume=True)
    assert final_bytes(unfinished) == undisturbed
    assert sorted(each.name for each in (unfinished / "quarantine").iterdir()) == [
        *("000001.0", "000009.0", "notes.txt.0"),
    ]


def test_a_torn_line_of_the_manifest_is_cut(unfinished: Path, undisturbed: dict[str, bytes]) -> None:
    manifest = unfinished / "manifest"
    lines = manifest.read_bytes().splitlines(keepends=True)
    manifest.write_bytes(b"".join(lines[:-1]) + lines[-1][:7])
    run(unfinished, resume=True)
    assert final_bytes(unfinished) == undisturbed
    assert all(len(line) > 9 for line in manifest.read_bytes().splitlines())


def test_an_unfinished_run_waits_for_resume(unfinished: Path) -> None:
    with pytest.raises(InputError, match=r"unfinished run.*--resume"):
        run(unfinished)


def test_another_run_is_refused_and_says_what_differs(unfinished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="seed 3 -> 4"):
        run(unfinished, seed=4, resume=True)
    monkeypatch.setattr(runner, "__version__", "9.9")
    with pytest.raises(InputError, match=r"optsat '.*' -> '9.9'"):
        run(unfinished, resume=True)


def test_another_version_goes_on_where_that_is_accepted(
    unfinished: Path, monkeypatch: pytest.MonkeyPatch, undisturbed: dict[str, bytes]
) -> None:
    monkeypatch.setattr(runner, "__version__", "9.9")
    monkeypatch.setattr(runner, "_source_hash", lambda _study: "other")
    with pytest.raises(InputError, match=r"optsat '.*' -> '9.9'; source .* -> 'other'.* --accept-version"):
        run(unfinished, resume=True)
    with pytest.raises(InputError, match=r"seed 3 -> 4; optsat .*Choose another folder\.$"):
        run(unfinished, resume=True, seed=4, accept_version=True)
    first = (unfinished / "chunks" / "000000").stat().st_mtime_ns
    run(unfinished, resume=True, accept_version=True)
    assert (unfinished / "chunks" / "000000").stat().st_mtime_ns == first
    assert final_bytes(unfinished) == undisturbed
    (accepted,) = [e for e in Manifest(unfinished / "manifest").read() if e["event"] == "accepted"]
    assert accepted["changed"]["optsat"][1] == "9.9"
    assert accepted["changed"]["source"][1] == "other"


def test_other_files_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(InputError, match="other files and no run"):
        run(tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ["thesis.tex"]
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(InputError, match=r"run.json cannot be read"):
        run(tmp_path)


def test_a_second_runner_is_refused_by_name(tmp_path: Path) -> None:
    identity = run_folder.Identity("toy-study", 1, 3, CASES, "0", "")
    with run_folder.open_run(tmp_path, identity, lambda: 2, {}) as _folder:
        before = (tmp_path / "lock").read_text()
        with (
            pytest.raises(InputError, match=f"in use by process {os.getpid()} on"),
            run_folder.open_run(tmp_path, identity, lambda: 2, {}),
        ):
            pass
        assert (tmp_path / "lock").read_text() == before
    (tmp_path / "lock").write_text("?")
    with run_folder.open_run(tmp_path, identity, lambda: 2, {}, resume=True):
        assert json.loads((tmp_path / "lock").read_text())["pid"] == os.getpid()


def test_an_interrupt_is_written_down_and_the_chunks_stay(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    def interrupt(done: int, _total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, progress=interrupt)
    assert finished_chunks(tmp_path) == {"000000"}
    assert Manifest(tmp_path / "manifest").read()[-1] == {"event": "interrupted", "finished": 1}
    run(tmp_path, resume=True)
    assert final_bytes(tmp_path) == undisturbed


def test_chunks_hold_numbers_words_and_arrays() -> None:
    columns = {
        "number": np.array([1.0, -0.0, np.nan]),
        "count": np.array([1, 2, 3]),
        "is_right": np.array([True, False, True]),
        "word": np.array(["", "é", "two\nlines"]),
        "q_BN": np.arange(12.0).reshape(3, 4),
    }
    back = read_chunk(write_chunk("run", 7, columns), "run", 7)
    assert list(back) == list(columns)
    for name, column in columns.items():
        np.testing.assert_array_equal(back[name], column)
    with pytest.raises(InputError, match="`z` holds complex128"):
        write_chunk("run", 7, {"z": np.zeros(2, dtype=complex)})
    with pytest.raises(ChunkError, match="chunk 7 of run run"):
        read_chunk(write_chunk("run", 7, columns), "run", 8)


def test_the_clock_of_the_first_case_sets_the_chunk_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()

    def size(second: float, cases: int, workers: int = 1) -> int:
        ticks: Iterator[float] = iter([0.0, second, 0.0, second])
        monkeypatch.setattr(time, "perf_counter", lambda: next(ticks))
        return runner._chunk_size(toy_study.study, Layout.of("toy-study", toy_study.study.cases, cases, 0), workers)

    assert size(0.1, 1000) == 20
    assert size(10.0, 1000) == 1
    assert size(1e-6, 1000) == 250
    assert size(1e-6, 1000, workers=2) == 125
    assert size(1e-6, 10**5) == 4096
    assert size(0.0, 3) == 1
