"""The examination of the installation: complete, and honest about what is missing or wrong."""

import json
import sys
import tomllib
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from optsat import doctor
from optsat.cli import app
from optsat.doctor import Finding, Health
from optsat.solvers import clarabel


def _names(requirements: list[str]) -> set[str]:
    return {requirement.split(">")[0] for requirement in requirements}


def test_it_examines_what_the_project_depends_on(root: Path) -> None:
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    assert set(doctor.REQUIRED) == _names(project["dependencies"])
    extras = {name: _names(needs) for name, needs in project["optional-dependencies"].items()}
    assert {name: set(needs) for name, needs in doctor.EXTRAS.items()} == {
        name: needs for name, needs in extras.items() if name not in {"test", "dev"}
    }


def test_here_nothing_needed_is_missing() -> None:
    findings = doctor.examine()
    assert [finding for finding in findings if finding.health is Health.BROKEN] == []
    assert len({finding.subject for finding in findings}) == len(findings)


def test_what_is_missing_comes_with_its_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", absent)
    monkeypatch.setattr("shutil.which", lambda _name, path=None: None)
    monkeypatch.delenv("CC", raising=False)
    found = {finding.subject: finding for finding in doctor.examine()}
    assert found["scipy"] == Finding("scipy", Health.BROKEN, "not installed; get it with: pip install scipy")
    assert found["ahrs"].health is Health.ABSENT
    assert "pip install 'optsat[peers]'" in found["ahrs"].says
    compiler = found["C compiler"]
    assert compiler.health is Health.ABSENT
    assert compiler.says.startswith("Not needed: kernels run interpreted")
    assert "Install gcc or clang, or let CC name one." in compiler.says


def test_threads_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert any("OMP_NUM_THREADS=3" in finding.says for finding in doctor.examine())


@pytest.mark.parametrize("library", ["casadi", "clarabel"])
def test_a_library_that_does_not_import_is_reported(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    clarabel._library.cache_clear()
    found = {finding.subject: finding for finding in doctor.examine()}[f"self-check {library}"]
    assert found.health is Health.BROKEN
    assert library in found.says


def test_a_library_that_computes_wrongly_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = SimpleNamespace(x=np.array([-1.0, -0.5]))
    monkeypatch.setattr(clarabel.Clarabel, "run", lambda *_arguments: wrong)
    found = {finding.subject: finding for finding in doctor.examine()}["self-check clarabel"]
    assert found.health is Health.BROKEN
    assert "should be -1.41421, got -1.5" in found.says


def test_the_command_prints_a_line_each_or_json() -> None:
    lines = CliRunner().invoke(app, ["doctor"])
    entries = CliRunner().invoke(app, ["doctor", "--json"])
    assert (lines.exit_code, entries.exit_code) == (0, 0)
    document = json.loads(entries.stdout)
    assert [line.split("  ")[0] for line in lines.stdout.splitlines()] == [entry["subject"] for entry in document]
    assert {entry["health"] for entry in document} <= {"ok", "absent"}


def test_something_broken_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "SELF_CHECKS", (lambda: Finding("probe", Health.BROKEN, "it does not compute"),))
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 1
    assert "probe" in result.stdout
