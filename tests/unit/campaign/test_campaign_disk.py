"""Disks that are full, limited or read-only: said in words and bytes, nothing finished is lost, and it goes on."""

import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import toy_study

from optsat.campaign import disk, runner
from optsat.campaign.disk import disk_faults, require_room
from optsat.campaign.runner import run_study
from optsat.errors import InputError, OptsatError

PROGRAM = """
import subprocess, sys
from pathlib import Path
import slow_study
from optsat.campaign import runner
from optsat.errors import OptsatError
runner._chunk_size = lambda *_: 20
disk, result = Path(sys.argv[1]), Path(sys.argv[2])
def attempt():
    try:
        runner.run_study(slow_study.study, cases=200, out=disk / "run", resume=True)
    except OptsatError as error:
        print(error)
    print(len(list(disk.glob("run/chunks/[0-9]*"))), not list(disk.glob("run/**/.*")))
def remount(options):
    subprocess.run(["mount", "-o", f"remount,{options}", str(disk)], check=True)
attempt()
remount("size=92k")
attempt()
remount("ro")
attempt()
remount("rw,size=10m")
attempt()
result.write_bytes((disk / "run/result.nc").read_bytes())
"""


def test_a_disk_that_fills_up_and_one_that_is_read_only(tmp_path: Path) -> None:
    """On a real small disk: full at a chunk, full at the final file, read-only, and enough at last."""
    if shutil.which("unshare") is None or subprocess.run(["unshare", "-rm", "true"], capture_output=True).returncode:
        pytest.skip("this system lets nobody mount a small disk (unshare -rm)")
    small = tmp_path / "small"
    small.mkdir()
    here = Path(__file__)
    script = 'mount -t tmpfs -o size=36k tmpfs "$1" && exec "$2" -c "$3" "$1" "$4"'
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", script, "sh", small, sys.executable, PROGRAM, tmp_path / "result.nc"],
        env={"PYTHONPATH": f"{here.parent}:{here.parents[3]}", "PATH": "/usr/bin:/bin:/usr/sbin:/sbin"},
        capture_output=True,
        text=True,
        check=True,
    )
    chunk, kept, final, all_kept, read_only, still_kept, whole = done.stdout.splitlines()
    assert chunk.startswith(f"No room for the run in {small / 'run'}: about ")
    assert "kB are needed and" in chunk
    assert chunk.endswith("make room, and run the same command with --resume.")
    assert 0 < int(kept.split()[0]) < 10
    assert kept.endswith("True"), "a temporary file was left"
    assert "No room for the run" in final
    assert all_kept == still_kept == whole == "10 True"
    assert "cannot be written (Read-only file system)" in read_only
    import slow_study

    run_study(slow_study.study, cases=200, out=tmp_path / "plain")
    assert (tmp_path / "result.nc").read_bytes() == (tmp_path / "plain" / "result.nc").read_bytes()


def test_a_limit_on_the_size_of_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `ulimit -f` sets it: no shorter file is the trouble, so that the final file is the one that fails."""
    monkeypatch.setattr(runner, "_chunk_size", lambda *_: 2)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    try:
        with pytest.raises(OptsatError, match=r"No room .*File too large.*--resume"):
            run_study(toy_study.study, cases=6, out=tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert len(list(tmp_path.glob("chunks/[0-9]*"))) == 3
    run_study(toy_study.study, cases=6, out=tmp_path, resume=True)
    assert (tmp_path / "complete.json").exists()


def test_other_faults_are_what_they_were(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), disk_faults(tmp_path, lambda: 0):
        (tmp_path / "absent").read_bytes()


def test_a_folder_that_is_not_ours(tmp_path: Path) -> None:
    with (
        pytest.raises(InputError, match=r"cannot be written \(Permission denied\). Choose a folder"),
        disk_faults(tmp_path, lambda: 0),
    ):
        raise PermissionError(13, "Permission denied")


def test_room_is_asked_of_the_disk_where_it_cannot_be_reserved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("os.posix_fallocate", raising=False)
    require_room(tmp_path / "file", 1000)
    monkeypatch.setattr(disk, "_free", lambda _path: 999)
    with pytest.raises(OSError, match="No space left"):
        require_room(tmp_path / "file", 1000)
    assert list(tmp_path.iterdir()) == []
