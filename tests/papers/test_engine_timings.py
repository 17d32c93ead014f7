"""The benchmarks of engine and pages without their clock: every campaign and page is made; memory does not grow."""

import concurrent.futures
import dataclasses
import multiprocessing
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from optsat.campaign.case_runs import run_cases
from optsat.campaign.claim import Verdict
from optsat.campaign.designs import Layout
from optsat.campaign.runner import run_study
from optsat.campaign.table import Table
from optsat.errors import MissingExtraError, OptsatError
from optsat.studies import _short_cases, _trivial_batch, _trivial_cases, campaign_overhead_timing, pages_timing


def test_every_campaign_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    small = tuple((what, study, 60, workers) for what, study, _, workers in campaign_overhead_timing.MEASURED)
    monkeypatch.setattr(campaign_overhead_timing, "MEASURED", small[:1] + small[4:7])
    result = run_study(campaign_overhead_timing.study, 4)
    assert not result.failures
    assert [row["what"] for row in result.rows] == ["batch", "few", "many", "short"]
    assert {claim.id for claim in result.claims} == {"batch-us-a-case", "memory-growth", "short-overhead"}
    assert all(np.isfinite(value) for value in result.metrics.values())


def test_memory_does_not_grow_with_the_cases() -> None:
    peaks = []
    for count in (10_000, 200_000):
        with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            peaks.append(pool.submit(campaign_overhead_timing.measure, "_trivial_batch", count, 1).result()[2])
    assert peaks[1] < 1.2 * peaks[0]


def test_cases_one_by_one_are_those_of_the_batch() -> None:
    key = 3
    one, other = (
        run_cases(s, Layout.of(s.name, s.cases, 50, key), range(50)).table
        for s in (_trivial_cases.study, dataclasses.replace(_trivial_batch.study, run=_trivial_cases.run))
    )
    for name, column in one.columns.items():
        np.testing.assert_array_equal(column, other.columns[name])
    short = run_cases(_short_cases.study, Layout.of("short-cases", _short_cases.study.cases, 1, key), range(1))
    assert isinstance(short.table, Table)
    assert short.table.columns["taken_s"][0] >= _short_cases.CASE_S


def test_a_system_that_does_not_tell_its_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(*_arguments: object, **_options: object) -> str:
        raise FileNotFoundError

    monkeypatch.setattr("pathlib.Path.read_text", absent)
    with pytest.raises(OptsatError, match="read from /proc"):
        campaign_overhead_timing.peak_memory()


def test_pages_are_small_and_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("chromium") is None or shutil.which("chromedriver") is None or find_spec("selenium") is None:
        pytest.skip("no chromium, no chromedriver or no selenium")
    monkeypatch.setattr(pages_timing, "ROUNDS", 1)
    monkeypatch.setattr(pages_timing, "PAGES", ("report_1000", "view"))
    monkeypatch.setattr(pages_timing, "_SCENARIO", "duration_s = 60")
    monkeypatch.setattr(pages_timing, "MOST_MB", {"report_1000": 0.6, "view": 6.0})
    result = run_study(pages_timing.study, 2)
    assert not result.failures
    sizes = {claim.id: claim.verdict for claim in result.claims if claim.id.endswith("mb")}
    assert sizes == {"report-1000-mb": Verdict.HOLDS, "view-mb": Verdict.HOLDS}
    assert result.metrics["view_ready_s"] > 0


@pytest.mark.parametrize("selenium", [True, False])
def test_without_a_browser_no_page_is_timed(selenium: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    if not selenium:
        monkeypatch.setitem(sys.modules, "selenium.webdriver", None)
    with (
        pytest.raises(MissingExtraError, match="Without chromium and chromedriver" + ("" if selenium else " and sel")),
        pages_timing.browser(tmp_path),
    ):
        pass
