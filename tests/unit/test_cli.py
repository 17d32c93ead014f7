"""The command line: what it prints, on which stream, with which exit code."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from optsat._version import __version__
from optsat.campaign import catalogue
from optsat.cli import app

TOY = Path(__file__).parent / "campaign" / "toy_study.py"
COMMANDS: tuple[list[str], ...] = (
    [],
    *(["demo"], ["attitude"], ["view"], ["verify"], ["simulate"]),
    *(["study"], ["study", "list"], ["study", "run"], ["study", "report"], ["study", "compare"]),
    *(["export"], ["reproduce"], ["bench"], ["cache"], ["cache", "show"], ["cache", "clean"], ["doctor"]),
)


@pytest.fixture
def studies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package of studies that holds the toy."""
    package = f"cli_studies_of_{tmp_path.name.replace('-', '_')}"
    folder = tmp_path / package
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "toy_study.py").write_text(TOY.read_text())
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(catalogue, "_PACKAGE", package)


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, arguments, prog_name="optsat")


def spawn(root: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "optsat.cli", *arguments],
        cwd=root,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_every_command_has_help_with_an_example(command: list[str]) -> None:
    result = invoke(*command, "--help")
    assert result.exit_code == 0
    assert re.search(r"Example: optsat \w+", result.stdout)
    assert invoke(*command, "-h").stdout == result.stdout


def test_the_list_of_commands_above_is_complete() -> None:
    listed = {
        name
        for command in ([], ["study"], ["cache"])
        for name in re.findall(r"^  (\w+)  ", invoke(*command, "-h").stdout, re.M)
    }
    assert listed - {"command"} == {command[-1] for command in COMMANDS if command}


def test_version() -> None:
    result = invoke("--version")
    assert (result.exit_code, result.stdout) == (0, f"optsat {__version__}\n")


def test_help_imports_nothing_heavy(root: Path) -> None:
    program = "import sys; from optsat.cli import app; app(['--help'], standalone_mode=False); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.splitlines()[-1].split())
    heavy = {"cvxpy", "matplotlib", "scipy", "casadi", "clarabel", "pydantic", "pint", "xarray", "distributed"}
    assert "typer" in loaded
    assert not loaded & heavy


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["docter"], "Did you mean 'doctor'"),
        (["study", "rn"], "Did you mean 'run'"),
        (["study", "run", "x", "--case", "3"], "--cases"),
        (["study", "run", "x", "--cases", "0"], "--cases"),
        (["study", "run", "x", "--workers", "two"], "--workers"),
        (["study", "run"], "NAME"),
        (["study", "run", "toy-studdy"], "optsat: There is no study `toy-studdy`. Did you mean `toy-study`?"),
        (["study", "run", "toy-study", "--out", "/dev/null/folder"], "optsat: "),
    ],
)
@pytest.mark.usefixtures("studies")
def test_wrong_usage_is_a_sentence_and_exit_code_2(arguments: list[str], says: str) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert says in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stdout == ""


@pytest.mark.usefixtures("studies")
def test_a_traceback_can_be_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPTSAT_TRACEBACK", "1")
    result = invoke("study", "run", "toy-studdy")
    assert result.exit_code == 2
    assert "Traceback" in result.stderr
    assert "InputError" in result.stderr


@pytest.mark.usefixtures("studies")
def test_study_list() -> None:
    assert invoke("study", "list").stdout.startswith("toy-study  A study small enough")
    (entry,) = json.loads(invoke("study", "list", "--json").stdout)
    assert entry["study"] == "toy-study"


@pytest.mark.usefixtures("studies")
def test_study_run_prints_one_json_document() -> None:
    result = invoke("study", "run", "toy-study", "--seed", "4", "--json")
    assert result.exit_code == 0
    assert result.stderr == ""
    document = json.loads(result.stdout)
    assert list(document) == ["study", "version", "seed", "cases", "metrics", "claims", "failures"]
    assert [document[name] for name in ("study", "version", "seed", "cases", "failures")] == ["toy-study", 1, 4, 3, 0]
    assert list(document["claims"][0]) == ["id", "says", "paper", "measured", "verdict", "interval"]
    assert [claim["verdict"] for claim in document["claims"]] == ["REPRODUCED", "HOLDS"]


@pytest.mark.usefixtures("studies")
def test_study_run_in_words() -> None:
    result = invoke("study", "run", "toy-study", "--cases", "5")
    assert result.exit_code == 1
    for says in ("A toy", "version 1: 5 cases, seed 0", "mean_draw", "REPRODUCED", "paper 0.5", "range: Draws"):
        assert says in result.stdout
    assert "1 of 5 cases failed; the first is case 3: InputError: the offset is unlucky" in result.stdout


@pytest.mark.usefixtures("studies")
def test_study_run_stores_result_rows_and_figure(tmp_path: Path) -> None:
    folder = tmp_path / "runs" / "toy"
    result = invoke("study", "run", "toy-study", "--workers", "2", "--out", str(folder), "--json")
    assert result.exit_code == 0
    assert str(folder) in result.stderr
    assert {path.name for path in folder.iterdir()} >= {"complete.json", "figure.svg", "run.json", "summary.csv"}
    printed, stored = json.loads(result.stdout), json.loads((folder / "complete.json").read_text())
    assert printed == {name: stored[name] for name in printed}


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (OSError(28, "No space left"), 2)])
@pytest.mark.usefixtures("studies")
def test_interruption_and_full_disks_end_quietly(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_arguments: object) -> None:
        raise error

    monkeypatch.setattr("optsat.campaign.runner.run_study", stop)
    result = invoke("study", "run", "toy-study")
    assert result.exit_code == code
    assert len(result.stderr.splitlines()) == 1


def test_a_closed_pipe_is_quiet(root: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "optsat.cli", "doctor"], cwd=root, stdout=writer, stderr=subprocess.PIPE, check=False
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, b"")


def test_progress_is_drawn_on_a_terminal_only(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    from optsat.commands.output import progress_bar

    for terminal in (False, True):
        monkeypatch.setattr("sys.stderr.isatty", lambda terminal=terminal: terminal)
        monkeypatch.setenv("FORCE_COLOR", "1")
        with progress_bar("toy-study") as report:
            report(1, 2)
        out, err = capfd.readouterr()
        assert out == ""
        assert ("toy-study" in err) is terminal


def test_started_as_a_program(root: Path) -> None:
    done = spawn(root, "--version")
    assert (done.returncode, done.stdout) == (0, f"optsat {__version__}\n")
