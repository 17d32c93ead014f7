"""Reproduction: every study of a paper, whatever becomes of the others, and one page that says what came of it."""

import json
import re
from pathlib import Path

import pytest
from chromium import Chromium
from looks import assert_alone, assert_fits_a_phone, assert_readable
from typer.testing import CliRunner, Result

from optsat.campaign import catalogue
from optsat.cli import app

_STUDY = '''"""The {name} study."""

import numpy as np

from optsat.campaign.claim import judge_bar, judge_paper
from optsat.campaign.study import Study


def _run(case, rng):
    {body}
    return {{"x": float(rng.random())}}


def _claims(figures):
    mean = figures["mean"]
    about = (mean, mean + 0.01)
    return [
        judge_paper("mean", "mean of {name} [-]", paper={figure}, measured=mean, tolerance=0.4, interval=about),
        judge_bar("bar", "mean of {name} below {bar}", measured=mean, holds=mean < {bar}),
    ]


study = Study(
    name="{name}",
    title="Title of {name}",
    cases=lambda count: [{{"k": k}} for k in range(count)],
    run=_run,
    metrics=lambda rows: {{"mean": float(np.mean([row["x"] for row in rows]))}},
    claims=_claims,
    default_cases=8,
    paper={paper!r},
)
'''


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty package of studies."""
    name = f"reproduced_studies_of_{re.sub(r'[^a-z0-9]', '_', tmp_path.name.lower())}"
    folder = tmp_path / name
    folder.mkdir()
    (folder / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(catalogue, "_PACKAGE", name)
    return folder


def _add(
    package: Path, name: str, figure: float = 0.5, body: str = "pass", bar: float = 1.0, paper: str = "a paper"
) -> None:
    text = _STUDY.format(name=name, figure=figure, body=body, bar=bar, paper=paper)
    (package / f"{name.replace('-', '_')}.py").write_text(text)


def _reproduce(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["reproduce", "--workers", "1", *map(str, arguments)], prog_name="optsat")


def test_each_claim_has_its_row(package: Path, tmp_path: Path) -> None:
    _add(package, "same")
    _add(package, "other", figure=9.0)
    _add(package, "ours", paper="")
    result = _reproduce("--out", tmp_path / "out", "--json")
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert [each["study"] for each in document["studies"]] == ["other", "same"]
    verdicts = {each["study"]: [claim["verdict"] for claim in each["claims"]] for each in document["studies"]}
    assert verdicts == {"other": ["NOT_REPRODUCED", "HOLDS"], "same": ["REPRODUCED", "HOLDS"]}
    page = (tmp_path / "out" / "index.html").read_text()
    assert "2 published claims: 1 reproduced, 1 not reproduced. 2 bars of our own: 2 hold." in page
    for says in (
        "mean of same",
        "mean of other",
        "optsat study run same <span",
        ">--cases 8</span>",
        "same/report.html",
    ):
        assert says in page
    assert "mean of ours" not in page
    assert re.search(r"0\.\d+ \(0\.\d+ to 0\.\d+\)", page), "the interval stands beside the figure"
    assert (tmp_path / "out" / "same" / "report.html").exists()


def test_all_takes_the_others_too(package: Path, tmp_path: Path) -> None:
    _add(package, "same")
    _add(package, "ours", paper="")
    result = _reproduce("--out", tmp_path / "out", "--all", "--cases", 3)
    assert result.exit_code == 0
    assert "ours: mean of ours below" in result.stdout
    page = (tmp_path / "out" / "index.html").read_text()
    assert "optsat reproduce --cases 3 --all" in page
    command = '<code>optsat study run ours <span class="option">--cases 3</span> <span class="option">--seed 0</span>'
    assert command in page, "a command that breaks between its options only"
    groups = re.findall(r'<tr class="group"><th colspan="(\d)"><a href="(\w+)/report.html">', page)
    assert groups == [("4", "ours"), ("4", "same"), ("3", "ours"), ("3", "same")], "claims stand under their study"


def test_a_study_that_fails_is_a_row(package: Path, tmp_path: Path) -> None:
    _add(package, "broken", body='raise TypeError("a mistake of the <study>")')
    _add(package, "empty", body='raise ValueError("bad luck")')
    _add(package, "same")
    (package / "torn.py").write_text('"""Torn."""\nimport nothing_of_this_name\n')
    result = _reproduce("--out", tmp_path / "out")
    assert result.exit_code == 1
    page = (tmp_path / "out" / "index.html").read_text()
    assert "3 studies without a verdict" in page
    for says in ("TypeError: a mistake of the &lt;study&gt;", "No module named", "every case failed", "mean of same"):
        assert says in page
    assert result.stdout.count("no verdict") == 3


def test_a_bar_that_fails_is_exit_code_1(package: Path, tmp_path: Path) -> None:
    _add(package, "same", bar=0.0)
    assert _reproduce("--out", tmp_path / "out").exit_code == 1


def test_it_goes_on_study_by_study(package: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    _add(package, "first")
    _add(package, "second")
    assert _reproduce("--out", out).exit_code == 0
    page = (out / "index.html").read_bytes()
    kept = {path: path.stat().st_mtime_ns for path in out.rglob("result.nc")}
    (out / "second" / "complete.json").unlink()
    result = _reproduce("--out", out)
    assert result.exit_code == 2
    assert "unfinished runs: second. Add --resume" in result.stderr
    assert _reproduce("--out", out, "--resume").exit_code == 0
    assert (out / "index.html").read_bytes() == page
    changed = {path for path in kept if path.stat().st_mtime_ns != kept[path]}
    assert changed == {out / "second" / "result.nc"}


def test_without_a_study_it_says_so(package: Path, tmp_path: Path) -> None:
    assert _reproduce("--out", tmp_path / "out").exit_code == 0
    assert "No study was run." in (tmp_path / "out" / "index.html").read_text()


def test_the_page_in_a_browser(browser: Chromium, package: Path, tmp_path: Path) -> None:
    _add(package, "same")
    _add(package, "other", figure=9.0, bar=0.0)
    _add(package, "broken", body='raise TypeError("a mistake")')
    _reproduce("--out", tmp_path / "out")
    page = tmp_path / "out" / "index.html"
    browser.open(page)
    assert_alone(browser, page)
    browser.resize(1100, min(2400, browser.script("return document.documentElement.scrollHeight")))
    assert_readable(browser)
    assert_fits_a_phone(browser)
    browser.script("document.querySelector('.group a').click()")
    assert "Title of" in browser.script("return document.title")
