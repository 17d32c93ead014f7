"""The other formats of a report, and the command."""

import json
import re
import zlib
from pathlib import Path

import pytest
from finished_runs import finished, study
from typer.testing import CliRunner, Result

from optsat.campaign.finished_run import FinishedRun
from optsat.campaign.runner import run_study
from optsat.cli import app
from optsat.report.markdown_report import markdown_report
from optsat.report.pdf_report import pdf_report


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    return finished(tmp_path_factory.mktemp("run"))


def _report(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["study", "report", *map(str, arguments)], prog_name="optsat")


def test_markdown_holds_tables_and_names_its_figures(run: FinishedRun) -> None:
    text, files = markdown_report(run, "report")
    assert markdown_report(run, "report") == (text, files)
    assert list(files) == ["report-figure-1.svg"]
    assert "](<report-figure-1.svg>)" in text
    assert "| mean angle [deg] | 5 |" in text.replace("\\", "")
    tables = [block.splitlines() for block in text.split("\n\n") if block.startswith("|")]
    assert len(tables) == 5
    for table in tables:
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in table}) == 1
    assert "<script>" not in text


def test_paper_is_the_same_bytes_and_has_a_page_a_figure(run: FinishedRun) -> None:
    data = pdf_report(run)
    assert data.startswith(b"%PDF")
    assert pdf_report(run) == data
    assert b"CreationDate" not in data
    assert len(re.findall(rb"/Type /Page\b", data)) == 2
    streams = [zlib.decompress(s) for s in re.findall(rb"/FlateDecode.*?stream\r?\n(.*?)\r?\nendstream", data, re.S)]
    assert sum(map(len, streams)) > 10_000


def test_paper_goes_on_without_a_figure_that_it_cannot_draw(tmp_path: Path) -> None:
    def odd(_rows: object, path: Path) -> None:
        path.write_text('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><text>x</text></svg>')

    from optsat.campaign.finished_run import read_run
    from optsat.campaign.study import Study

    run_study(Study(**{**vars(study), "figure": odd}), 5, out=tmp_path)
    data = pdf_report(read_run(tmp_path))
    assert len(re.findall(rb"/Type /Page\b", data)) == 1


@pytest.mark.parametrize("kind", ["html", "md", "pdf"])
def test_the_command_writes_into_the_run_folder(tmp_path: Path, kind: str) -> None:
    finished(tmp_path)
    result = _report(tmp_path, "--format", kind)
    assert (result.exit_code, result.stdout) == (0, "")
    assert f"report.{kind}" in result.stderr
    assert (tmp_path / f"report.{kind}").stat().st_size > 1000
    # the folder still holds the run, which is neither run nor written anew
    run_study(study, 260, seed=1, out=tmp_path)


def test_the_command_writes_where_it_is_told(tmp_path: Path) -> None:
    finished(tmp_path / "run")
    result = _report(tmp_path / "run", "--format", "md", "--out", tmp_path / "note.md", "--json")
    assert result.exit_code == 0
    assert json.loads(result.stdout) == {
        "study": "spiteful",
        "files": [str(tmp_path / "note-figure-1.svg"), str(tmp_path / "note.md")],
    }
    assert {path.name for path in tmp_path.iterdir()} == {"run", "note.md", "note-figure-1.svg"}


def test_the_command_refuses(tmp_path: Path) -> None:
    finished(tmp_path / "run")
    for arguments, says in (
        ((tmp_path,), "holds no run of a study"),
        ((tmp_path / "run", "--out", tmp_path / "no" / "page.html"), "there is no folder"),
        ((tmp_path / "run", "--format", "docx"), "'docx'"),
    ):
        result = _report(*arguments)
        assert result.exit_code == 2
        assert says in result.stderr.replace("\n", " ")
    table = tmp_path / "run" / "summary.csv"
    table.write_text(table.read_text().replace("one", "two", 1))
    result = _report(tmp_path / "run")
    assert result.exit_code == 2
    assert "summary.csv is not the file that the run of spiteful wrote" in result.stderr
