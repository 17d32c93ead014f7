"""Kills at random instants: of the runner with its workers, of the runner alone, of a worker; no byte changes.

OPTSAT_KILLS scales the numbers: 1 unless set; 4 gives the 100 group kills, 30 runner kills and 30 worker kills of
the full campaign.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import slow_study

from optsat.campaign.manifest import Manifest
from optsat.campaign.runner import run_study

SCALE = float(os.environ.get("OPTSAT_KILLS", "1"))
GROUP_KILLS, RUNNER_KILLS, WORKER_KILLS = (round(SCALE * count) for count in (25, 7.5, 7.5))
CASES = 600 if SCALE == 1 else 2000
PROGRAM = """
import sys
from pathlib import Path
from typing import Any
from optsat.campaign import runner
import slow_study
runner._chunk_size = lambda *_: 20
runner.run_study(slow_study.study, cases=int(sys.argv[2]), workers=int(sys.argv[3]), out=Path(sys.argv[1]), resume=True)
"""


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("undisturbed")
    run_study(slow_study.study, cases=CASES, out=folder)
    return (folder / "result.nc").read_bytes()


def start(folder: Path, workers: int) -> "subprocess.Popen[bytes]":
    path = os.pathsep.join([str(Path(__file__).parent), str(Path(__file__).parents[3])])
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(folder), str(CASES), str(workers)],
        env=os.environ | {"PYTHONPATH": path},
        start_new_session=True,
        stderr=subprocess.DEVNULL,
    )


def chunks(folder: Path) -> set[str]:
    return {file.name for file in folder.glob("chunks/[0-9]*")}


def wait_for_a_new_chunk(process: "subprocess.Popen[Any]", folder: Path, before: set[str]) -> None:
    while process.poll() is None and chunks(folder) == before:
        time.sleep(0.005)


def campaign_of_kills(folder: Path, kills: int, workers: int, whole_group: bool) -> int:
    """Start and kill until the run is complete; return how many kills of `kills` it took."""
    rng = np.random.default_rng(kills)
    done = 0
    while not (folder / "complete.json").exists():
        before = chunks(folder)
        process = start(folder, workers)
        if done < kills:
            # half of the kills at any time of the start, half once results come
            if rng.random() < 0.5:
                wait_for_a_new_chunk(process, folder, before)
                delay = rng.uniform(0.0, 0.3)
            else:
                delay = rng.uniform(0.02, 1.2)
            try:
                process.wait(delay)
            except subprocess.TimeoutExpired:
                (os.killpg if whole_group else os.kill)(process.pid, signal.SIGKILL)
                done += 1
        process.wait()
        assert before <= chunks(folder), "a finished chunk was lost"
    return done


@pytest.mark.parametrize(("kills", "workers", "whole_group"), [(GROUP_KILLS, 2, True), (RUNNER_KILLS, 2, False)])
def test_kills_of_the_runner(tmp_path: Path, kills: int, workers: int, whole_group: bool, undisturbed: bytes) -> None:
    done, campaign = 0, 0
    while done < kills:
        folder = tmp_path / str(campaign)
        folder.mkdir()
        done += campaign_of_kills(folder, kills - done, workers, whole_group)
        campaign += 1
        assert (folder / "result.nc").read_bytes() == undisturbed
        assert_none_was_computed_twice(folder)


def assert_none_was_computed_twice(folder: Path) -> None:
    stored = [event["chunk"] for event in Manifest(folder / "manifest").read() if event["event"] == "chunk"]
    assert len(set(stored)) == len(stored)


def test_kills_of_workers(tmp_path: Path, undisturbed: bytes) -> None:
    rng = np.random.default_rng(2)
    process = start(tmp_path, 2)
    wait_for_a_new_chunk(process, tmp_path, set())
    done = 0
    while process.poll() is None and done < WORKER_KILLS:
        workers = workers_of(process.pid)
        if workers:
            os.kill(int(rng.choice(workers)), signal.SIGKILL)
            done += 1
        wait_for_a_new_chunk(process, tmp_path, chunks(tmp_path))
    assert process.wait() == 0
    assert done > 0
    assert (tmp_path / "result.nc").read_bytes() == undisturbed
    assert_none_was_computed_twice(tmp_path)


def workers_of(runner: int) -> list[int]:
    """The processes that a runner has started to run cases."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == runner and b"spawn_main" in (folder / "cmdline").read_bytes():
                found.append(int(folder.name))
        except (OSError, IndexError):
            continue
    return sorted(found)


def test_workers_do_not_outlive_their_runner(tmp_path: Path) -> None:
    process = start(tmp_path, 2)
    wait_for_a_new_chunk(process, tmp_path, set())
    workers = workers_of(process.pid)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    end = time.monotonic() + 20.0
    while any(Path(f"/proc/{worker}").exists() for worker in workers) and time.monotonic() < end:
        time.sleep(0.05)
    assert workers
    assert not [worker for worker in workers if Path(f"/proc/{worker}").exists()]


def test_a_case_that_kills_its_worker_is_a_failure_and_the_rest_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(slow_study.DEADLY, "17")
    result = run_study(slow_study.study, cases=40, workers=2, out=tmp_path)
    assert [(failure.case, failure.error) for failure in result.failures] == [(17, "CRASHED")]
    monkeypatch.delenv(slow_study.DEADLY)
    whole = run_study(slow_study.study, cases=40)
    assert [row["trace"] for row in result.rows] == [row["trace"] for row in whole.rows if row["case"] != 17]
