"""Progress of a campaign: a bar on a terminal, lines where asked, figures so far, and nothing on standard output."""

import itertools

import numpy as np
import pytest

from optsat.campaign.result import Failure
from optsat.campaign.table import Table
from optsat.commands.campaign_progress import CampaignProgress, campaign_progress

TABLE = Table(
    {
        "case": np.arange(3),
        "angle": np.array([1.0, 2.0, np.nan]),
        "good": np.array([True, False, False]),
        "word": np.array(["a", "b", "c"]),
        "path": np.zeros((3, 2)),
    },
    (Failure(3, "InputError", "no"),),
)


def test_figures_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = itertools.count(0.0, 2.0)
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    shown: list[tuple[int, int, str]] = []
    progress = CampaignProgress(lambda *said: shown.append(said))
    progress.watch(TABLE)
    progress.report(40, 100)
    progress.watch(TABLE)
    progress.report(44, 100)
    assert shown[-1] == (44, 100, "1 cases/s, 2 failed; means so far: angle 1.5, good 0.333")
    assert [said[:2] for said in shown] == [(40, 100), (44, 100)]


def test_a_bar_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "160")
    for terminal in (False, True):
        monkeypatch.setattr("sys.stderr.isatty", lambda terminal=terminal: terminal)
        with campaign_progress("toy-study") as progress:
            progress.watch(TABLE)
            progress.report(3, 4)
        out, err = capfd.readouterr()
        assert out == ""
        assert ("toy-study" in err) is terminal
        assert ("means so far: angle 1.5" in err) is terminal


def test_lines_where_asked(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    now = 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    with campaign_progress("toy-study", verbose=True) as progress:
        for done in range(1, 8):
            now = 10.0 * done
            progress.report(done, 100)
    lines = capfd.readouterr().err.splitlines()
    assert lines == ["toy-study: 3 of 100 cases, 0.1 cases/s", "toy-study: 6 of 100 cases, 0.1 cases/s"]
