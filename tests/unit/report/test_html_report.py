"""The page of a run: the same bytes, everything in it, nothing that acts, within its size."""

import base64
import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pytest
from finished_runs import SPITEFUL, finished, large

from optsat.campaign.finished_run import FinishedRun
from optsat.report.case_table import case_table
from optsat.report.html_report import html_report


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    return finished(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def page(run: FinishedRun) -> str:
    return html_report(run)


def _data(page: str) -> dict[str, object]:
    found = re.search(r'<script type="application/json" id="case-data">(.*?)</script>', page, re.S)
    assert found is not None
    return dict(json.loads(found[1]))


def test_the_same_run_gives_the_same_page(run: FinishedRun, page: str, tmp_path: Path) -> None:
    assert html_report(run) == page
    again = finished(tmp_path)
    # the folder's own digests are of files that are the same, so nothing may differ
    assert html_report(again) == page


@pytest.mark.parametrize(
    "says",
    [
        *("reproduced", "beaten", "not reproduced", "holds", "fails", "not finite"),
        "260 cases, 6 of them failed. Claims: 1 reproduced, 1 not reproduced, 1 beaten, 1 holds, 1 fails.",
        "6 of 260 cases failed",
        "optsat study run spiteful --cases 260 --seed 1",
        'name="viewport" content="width=device-width, initial-scale=1"',
    ],
)
def test_it_says(page: str, says: str) -> None:
    assert says in page


def test_words_of_a_study_stay_words(page: str) -> None:
    assert "alert" in page
    assert "<script>alert" not in page
    assert SPITEFUL not in page


def test_only_its_own_script_may_run_and_nothing_may_be_fetched(page: str) -> None:
    scripts = re.findall(r"<script>(.*?)</script>", page, re.S)
    assert len(scripts) == 1
    digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy is not None
    assert "default-src 'none'" in policy[1]
    assert f"script-src 'sha256-{digest}'" in policy[1]
    assert not re.search(r'(?:src|href)="(?!#|data:)', page)
    assert "http:" not in page
    assert "https:" not in re.sub(r"<script.*?</script>", "", page, flags=re.S)


def test_names_within_figures_are_used_once(page: str) -> None:
    names = re.findall(r' id="([^"]+)"', page)
    assert len(names) == len(set(names)) > 5
    assert set(re.findall(r'href="#([^"]*)"', page)) <= set(names)
    assert set(re.findall(r"url\(#([^)]*)\)", page)) <= set(names)


def test_every_case_is_in_the_table_with_six_digits(run: FinishedRun, page: str) -> None:
    data = _data(page)
    columns = {column["name"]: column for column in data["columns"]}  # type: ignore[attr-defined]
    assert data["count"] == 254
    angle = np.array(columns["angle_deg"]["values"])
    assert np.max(np.abs(angle / run.columns["angle_deg"] - 1)) < 5e-6
    assert columns["ratio"]["values"][3:5] == [float("inf"), None]
    assert columns["case"]["values"] == run.columns["case"].tolist()
    words = [columns["word"]["words"][k] for k in columns["word"]["values"]]
    assert words == run.columns["word"].tolist()
    assert [bool(k) for k in columns["within"]["values"]] == run.columns["within"].tolist()


def test_without_a_figure_of_the_study_its_columns_are_drawn(tmp_path: Path) -> None:
    page = html_report(finished(tmp_path, drawn=False))
    assert page.count("<svg ") == 2
    assert "Histograms" in page
    assert "Shares of cases" in page


def test_a_run_in_which_every_case_failed_is_reported(tmp_path: Path) -> None:
    import dataclasses

    run = finished(tmp_path, drawn=False, cases=8)
    empty = {name: column[:0] for name, column in run.columns.items()}
    page = html_report(dataclasses.replace(run, columns=empty, claims=(), metrics={}))
    assert "no claim was judged" in page
    assert "case-data" not in page


@pytest.mark.parametrize(
    ("cases", "columns", "most"),
    [(10_000, 5, 600_000), (10_000, 30, 600_000), (100_000, 5, 3_000_000), (100_000, 30, 3_000_000)],
)
def test_a_page_keeps_its_size(cases: int, columns: int, most: int) -> None:
    assert len(html_report(large(cases, columns)).encode()) < most


def test_a_large_table_keeps_the_extremes_and_says_so() -> None:
    run = large(100_000, 12)
    table = case_table(run.columns, "run")
    assert table.shown < table.cases == 100_000
    assert f"{table.shown:,} of 100,000 cases" in table.says
    assert table == case_table(run.columns, "run")
    assert table.document != case_table(run.columns, "another run").document
    data = json.loads(table.document)
    assert data["count"] == table.shown
    for column in data["columns"][1:-1]:
        values = run.columns[column["name"]]
        assert max(column["values"]) == pytest.approx(values.max(), rel=1e-5)
        assert min(column["values"]) == pytest.approx(values.min(), rel=1e-5)
    cases = data["columns"][0]["values"]
    assert cases == sorted(set(cases))


def test_a_small_table_is_whole() -> None:
    table = case_table(large(10_000).columns, "run")
    assert (table.shown, table.says) == (10_000, "")
    assert json.loads(table.document)["columns"][0] == {"name": "case", "first": 0}
