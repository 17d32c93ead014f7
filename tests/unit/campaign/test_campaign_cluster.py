"""A campaign on a Dask cluster of two workers on the loopback: the same bytes, deaths survived, faults in words."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import batch_study
import pytest
import slow_study

from optsat.campaign import case_runs, runner
from optsat.campaign.dask_executor import Dask
from optsat.campaign.runner import run_study
from optsat.errors import InputError, MissingExtraError, OptsatError

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

CASES = 60
DEADLY = 61


def _start(module: str, folder: Path, *arguments: str) -> "subprocess.Popen[bytes]":
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), str(Path(__file__).parents[3])]),
        **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
        slow_study.DEADLY: str(DEADLY),
        # a task is given up after the first worker that it kills, not after four
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0",
    }
    with (folder / "log").open("ab") as log:
        command = [sys.executable, "-m", f"distributed.cli.{module}", *arguments, "--host", "127.0.0.1"]
        return subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=log, start_new_session=True)


def _start_scheduler(folder: Path) -> tuple["subprocess.Popen[bytes]", str]:
    file = folder / "scheduler.json"
    ports = ("--port", "0", "--dashboard-address", "127.0.0.1:0")
    scheduler = _start("dask_scheduler", folder, *ports, "--scheduler-file", str(file))
    end = time.monotonic() + 60.0
    while not (file.exists() and file.stat().st_size > 0):
        assert time.monotonic() < end, "the scheduler did not start"
        time.sleep(0.05)
    return scheduler, json.loads(file.read_text())["address"]


def _start_worker(folder: Path, address: str) -> "subprocess.Popen[bytes]":
    return _start("dask_worker", folder, address, "--nthreads", "1", "--no-dashboard", "--death-timeout", "30")


def _stop(processes: "Iterable[subprocess.Popen[bytes]]") -> None:
    for process in processes:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("cluster")
    scheduler, address = _start_scheduler(folder)
    processes = [scheduler]
    try:
        processes += [_start_worker(folder, address) for _ in range(2)]
        yield address
    finally:
        _stop(processes)


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "_chunk_size", lambda *_arguments: 7)


def _bytes(folder: Path) -> tuple[bytes, bytes]:
    return (folder / "result.nc").read_bytes(), (folder / "summary.csv").read_bytes()


def test_a_cluster_gives_the_same_bytes(cluster: str, tmp_path: Path) -> None:
    run_study(slow_study.study, cases=CASES, out=tmp_path / "serial")
    result = run_study(slow_study.study, cases=CASES, out=tmp_path / "dask", executor=Dask(cluster))
    assert result.passed
    assert _bytes(tmp_path / "dask") == _bytes(tmp_path / "serial")


def test_a_cluster_gives_the_same_bytes_of_batches(
    cluster: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Chunks of seven on two workers of the cluster, in two processes, and one chunk here."""
    run_study(batch_study.study, out=tmp_path / "dask", executor=Dask(cluster))
    run_study(batch_study.study, out=tmp_path / "processes", workers=2)
    monkeypatch.setattr(runner, "_chunk_size", lambda *_arguments: 60)
    run_study(batch_study.study, out=tmp_path / "serial")
    found = {(*_bytes(folder), (folder / "complete.json").read_bytes()) for folder in tmp_path.iterdir()}
    assert len(found) == 1


def test_a_case_that_kills_its_workers_is_a_failure_and_the_rest_is_there(cluster: str, tmp_path: Path) -> None:
    result = run_study(slow_study.study, cases=63, out=tmp_path, executor=Dask(cluster))
    assert [(failure.case, failure.error) for failure in result.failures] == [(DEADLY, "CRASHED")]
    whole = run_study(slow_study.study, cases=63)
    assert [row["trace"] for row in result.rows] == [row["trace"] for row in whole.rows if row["case"] != DEADLY]


def test_a_cluster_without_workers_and_one_that_is_lost(tmp_path: Path) -> None:
    scheduler, address = _start_scheduler(tmp_path)
    processes = [scheduler]
    folder = tmp_path / "run"

    def lose(done: int, _total: int) -> None:
        if done == 14:
            _stop([scheduler])

    try:
        with pytest.raises(OptsatError, match=r"has no worker\. Start some with `dask worker tcp://"):
            run_study(slow_study.study, cases=2, executor=Dask(address, connect_s=0.5))
        processes.append(_start_worker(tmp_path, address))
        with pytest.raises(OptsatError, match=r"was lost \(.*run the same command with --resume"):
            run_study(slow_study.study, cases=CASES, out=folder, executor=Dask(address, connect_s=60), progress=lose)
    finally:
        _stop(processes[1:] if scheduler.poll() is not None else processes)
    assert len(list(folder.glob("chunks/[0-9]*"))) >= 2
    run_study(slow_study.study, cases=CASES, out=folder, resume=True, workers=2)
    run_study(slow_study.study, cases=CASES, out=tmp_path / "serial")
    assert _bytes(folder) == _bytes(tmp_path / "serial")


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"optsat\[cluster\]"):
        run_study(slow_study.study, cases=2, executor=Dask("tcp://127.0.0.1:9"))


def test_without_a_cluster(tmp_path: Path) -> None:
    with pytest.raises(OptsatError, match=r"No Dask scheduler answers at tcp://127.0.0.1:9"):
        run_study(slow_study.study, cases=2, executor=Dask("tcp://127.0.0.1:9", connect_s=0.5))
    with pytest.raises(OptsatError, match="No Dask scheduler answers"):
        run_study(slow_study.study, cases=2, executor=Dask("nonsense", connect_s=0.5))


def test_a_study_that_workers_cannot_import(cluster: str) -> None:
    import dataclasses

    with pytest.raises(InputError, match="holds another object"):
        run_study(dataclasses.replace(slow_study.study, title="a copy"), cases=2, executor=Dask(cluster))


def test_another_version_on_the_workers_is_refused(cluster: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("optsat.campaign.dask_executor.__version__", "9.9")
    with pytest.raises(OptsatError, match=r"Every worker needs optsat 9.9: tcp://.* has "):
        run_study(slow_study.study, cases=2, executor=Dask(cluster))


def test_another_arithmetic_is_refused_unless_allowed(
    cluster: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(case_runs, "numerics_print", lambda: "another")

        def stop(done: int, _total: int) -> None:
            if done >= 14:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            run_study(slow_study.study, cases=CASES, out=tmp_path, progress=stop)
    with pytest.raises(OptsatError, match=r"computes with other last bits.*--mixed-machines"):
        run_study(slow_study.study, cases=CASES, out=tmp_path, resume=True, executor=Dask(cluster))
    result = run_study(
        slow_study.study, cases=CASES, out=tmp_path, resume=True, executor=Dask(cluster), mixed_machines=True
    )
    assert result.passed
    assert b'"event":"other numerics"' in (tmp_path / "manifest").read_bytes()
