"""The report in a real browser: silent, sorted, readable in the light, in the dark, on a phone and on paper."""

from pathlib import Path

import numpy as np
import pytest
from chromium import Chromium
from finished_runs import finished, large
from looks import VISIBLE, assert_alone, assert_fits_a_phone, assert_readable, contrast, text_contrasts

from optsat.report.html_report import html_report

_CELLS = "return [...document.querySelectorAll(`#cases tbody td:nth-child(${arguments[0]})`)].map(c => c.textContent)"
_HEAD = "document.querySelector(`#cases th:nth-child(${arguments[0]}) button`).click()"
_SORT = "return document.querySelector(`#cases th:nth-child(${arguments[0]})`).getAttribute('aria-sort')"
_STATUS = "return document.getElementById('case-status').textContent"


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    page = folder / "report.html"
    page.write_text(html_report(finished(folder / "run")))
    return page


@pytest.fixture(scope="module")
def columns_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("columns")
    page = folder / "report.html"
    page.write_text(html_report(finished(folder / "run", drawn=False)))
    return page


def test_it_opens_alone_and_without_complaint(browser: Chromium, report: Path) -> None:
    browser.open(report)
    assert browser.script("return document.title").startswith("Angles <script>alert")
    assert browser.script(_STATUS) == "Rows 1 to 100 of 254"
    assert_alone(browser, report)


def _number(cell: str) -> float:
    return float(cell.replace("\u2212", "-").replace("Infinity", "inf").replace("\u2013", "nan"))


@pytest.mark.parametrize("column", [1, 2, 3])
def test_numbers_sort_both_ways(browser: Chromium, report: Path, column: int) -> None:
    browser.open(report)
    for way, sign in (("ascending", 1), ("descending", -1)):
        browser.script(_HEAD, column)
        assert browser.script(_SORT, column) == way
        values = np.array([_number(cell) for cell in browser.script(_CELLS, column)])
        assert len(values) == 100
        finite = values[np.isfinite(values)]
        assert np.all(sign * np.diff(finite) >= 0)
        assert sign * (finite[-1] - finite[0]) > 0
    assert browser.script(_STATUS).endswith("largest first")


def test_what_is_no_number_is_last_either_way(browser: Chromium, report: Path) -> None:
    browser.open(report)
    for _ in range(2):
        browser.script(_HEAD, 3)
        for _ in range(2):
            browser.script("document.querySelectorAll('.pager button')[1].click()")
        cells = browser.script(_CELLS, 3)
        assert cells[-1] == "\u2013"
        assert "\u2013" not in cells[:-1]


def test_words_sort_and_pages_turn(browser: Chromium, report: Path) -> None:
    browser.open(report)
    browser.script(_HEAD, 6)
    cells = browser.script(_CELLS, 6)
    assert cells == sorted(cells)
    seen = browser.script(_CELLS, 1)
    for page, (status, count) in enumerate((("101 to 200", 100), ("201 to 254", 54))):
        browser.script("document.querySelectorAll('.pager button')[1].click()")
        assert status in browser.script(_STATUS)
        assert len(browser.script(_CELLS, 1)) == count
        assert browser.script("return document.querySelectorAll('.pager button')[1].disabled") is (page == 1)
        seen += browser.script(_CELLS, 1)
    assert len(set(seen)) == 254
    browser.script("document.querySelectorAll('.pager button')[0].click()")
    assert "101 to 200" in browser.script(_STATUS)


def test_text_and_figures_are_readable_in_light_and_dark(browser: Chromium, report: Path, columns_report: Path) -> None:
    for page in (report, columns_report):
        browser.open(page)
        browser.resize(1100, min(2400, browser.script("return document.documentElement.scrollHeight")))
        assert_readable(browser)
        boxes = browser.script(
            "return [...document.querySelectorAll('svg')].map(s => s.getBoundingClientRect())"
            ".map(b => [b.left, b.top, b.width, b.height])"
        )
        assert boxes
        for dark in (False, True):
            browser.dark(dark)
            shot = browser.picture()
            for left, top, width, height in boxes:
                assert min(width, height) > 100
                drawn = shot[int(top) : int(top + height), int(left) : int(left + width)]
                assert contrast(drawn) > VISIBLE
                # the paper of the figure is that of the page
                assert np.abs(drawn[1, 1].astype(int) - shot[2, 2]).max() <= 3


def test_black_text_on_a_dark_page_would_be_noticed(browser: Chromium, report: Path) -> None:
    browser.open(report)
    browser.resize(1100, min(2400, browser.script("return document.documentElement.scrollHeight")))
    browser.dark(True)
    browser.script("for (const g of document.querySelectorAll('svg .text')) g.style.fill = 'black'")
    assert text_contrasts(browser).min() < VISIBLE


def test_it_fits_a_phone(browser: Chromium, report: Path, columns_report: Path) -> None:
    for page in (report, columns_report):
        browser.open(page)
        assert_fits_a_phone(browser)


def test_print_is_black_on_white(browser: Chromium, report: Path) -> None:
    browser.open(report)
    browser.printing()
    assert browser.picture()[2, 2].min() > 250
    assert browser.script("return getComputedStyle(document.querySelector('.pager button')).display") == "none"


@pytest.mark.parametrize("cases", [10_000, 100_000])
def test_a_large_report_sorts(browser: Chromium, tmp_path: Path, cases: int) -> None:
    page = tmp_path / "large.html"
    page.write_text(html_report(large(cases)))
    browser.open(page)
    browser.script(_HEAD, 2)
    values = np.array([_number(cell) for cell in browser.script(_CELLS, 2)])
    assert np.all(np.diff(values) >= 0)
    assert values[0] == pytest.approx(large(cases).columns["column_0"].min(), rel=1e-5)
    assert_alone(browser, page)
