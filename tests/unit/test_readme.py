"""The README's own code runs, and its files exist."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest


def _block(readme: str, marker: str) -> str:
    match = re.search(rf"<!-- {marker} -->\n```\w*\n(.*?)```", readme, re.DOTALL)
    assert match, f"README.md has no code block under <!-- {marker} -->"
    return match.group(1)


def test_hello_world_runs_and_says_what_it_promises(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = _block((root / "README.md").read_text(encoding="utf-8"), "hello-world")
    assert len(code.splitlines()) <= 30
    exec(compile(code, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "AttitudeStatus.OK" in printed
    assert "3.511" in printed, "the bound of the worked example in degrees"
    assert "AttitudeStatus.INCONSISTENT" in printed
    assert "((2,),)" in printed, "the third measurement is the one to drop"


def test_one_definition_is_called_compiled_and_differentiated(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = _block((root / "README.md").read_text(encoding="utf-8"), "three-forms")
    exec(compile(code, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "(1000, 4)" in printed
    assert "(4, 3)" in printed


def test_goal_attainment_reaches_the_answer_beside_it(
    root: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code = _block((root / "README.md").read_text(encoding="utf-8"), "goal-attainment")
    space: dict[str, Any] = {}
    exec(compile(code, "README.md", "exec"), space)
    answer = space["solution"].answer
    assert answer.x == pytest.approx([2.0693664, 1.9306336], abs=1e-6)
    assert answer.factor == pytest.approx(0.14835623, abs=1e-7)
    # between the two centres the least squares r1, r2 of the distances fulfil sqrt r1 + sqrt r2 = sqrt 2
    assert np.sqrt(space["front"].objectives).sum(axis=1) == pytest.approx(np.sqrt(2), abs=1e-3)
    assert space["robust"].answer.x == pytest.approx([0.5, 0.5], abs=1e-4)
    assert space["robust"].answer.bound == pytest.approx(2.5, rel=1e-5)
    assert (tmp_path / "front.png").stat().st_size > 5000
    assert "Proof.GLOBAL" in capsys.readouterr().out


def test_the_bank_finds_the_faults_that_were_simulated(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = _block((root / "README.md").read_text(encoding="utf-8"), "faults")
    space: dict[str, Any] = {}
    exec(compile(code, "README.md", "exec"), space)
    found, parts = space["found"], space["Part"]
    assert found.probability(parts.STAR)[0, [490, 520, 570]] == pytest.approx([0, 1, 0], abs=0.01)
    assert found.probability(parts.THRUSTER_Z)[0, 400] > 0.95
    assert capsys.readouterr().out


def test_isolability_names_what_cannot_be_told_apart(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = _block((root / "README.md").read_text(encoding="utf-8"), "isolability")
    exec(compile(code, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "thruster" in printed
    assert "gyro" in printed
    assert "second gyro" in printed


def test_the_two_commands_set_up_and_run(root: Path) -> None:
    readme = (root / "README.md").read_text(encoding="utf-8")
    assert _block(readme, "main-command").rstrip().endswith("optsat demo")
    assert " -m pytest " in _block(readme, "test-command")


def test_links_of_the_readme_exist(root: Path) -> None:
    readme = (root / "README.md").read_text(encoding="utf-8")
    targets = [target for target in re.findall(r"\]\(([^)]+)\)", readme) if "://" not in target]
    assert targets
    missing = [target for target in targets if not (root / target).exists()]
    assert not missing
