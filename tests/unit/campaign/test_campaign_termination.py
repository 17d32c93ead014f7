"""A runner that a batch system ends: as Ctrl-C, code 130, what is finished is kept, no worker is left."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
import slow_study
from test_campaign_kills import chunks, wait_for_a_new_chunk, workers_of

from optsat.campaign.manifest import Manifest
from optsat.campaign.runner import run_study
from optsat.campaign.termination import terminated_as_interrupted

# a shell that runs in the background hands on that SIGINT is ignored
COMMAND = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
COMMAND += "from optsat.cli import app; import optsat.campaign.catalogue as c; import slow_study as s;"
COMMAND += "c.load_study = lambda name: s.study; app()"


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_in_order(tmp_path: Path, workers: int, sent: signal.Signals) -> None:
    path = os.pathsep.join([str(Path(__file__).parent), str(Path(__file__).parents[3])])
    arguments = ["study", "run", "slow-study", "--cases", "3000", "--workers", str(workers), "--out", str(tmp_path)]
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, *arguments],
        env=os.environ | {"PYTHONPATH": path},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    wait_for_a_new_chunk(process, tmp_path, set())
    at_work = workers_of(process.pid)
    process.send_signal(sent)
    said = process.communicate()[1]
    assert (process.returncode, said) == (130, "optsat: interrupted\n")
    assert len(at_work) == (workers if workers > 1 else 0)
    assert not [worker for worker in at_work if Path(f"/proc/{worker}").exists()]
    last = Manifest(tmp_path / "manifest").read()[-1]
    assert last == {"event": "interrupted", "finished": len(chunks(tmp_path))}


def test_the_signal_is_what_it_was_afterwards() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with terminated_as_interrupted():
        assert signal.getsignal(signal.SIGTERM) is not before
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is before


def test_other_threads_run_studies_too(tmp_path: Path) -> None:
    found = []
    thread = threading.Thread(target=lambda: found.append(run_study(slow_study.study, cases=2, out=tmp_path)))
    thread.start()
    thread.join()
    assert len(found[0].rows) == 2
