"""`optsat demo`, in a minute of orbit instead of twenty."""

import json
from pathlib import Path
from typing import Any

import pytest
from orbit_minute import invoke, write_scenario

FILES = ["attitude-60-s-window.csv", "attitude-single-frame.csv", "certificate.json", "figure.png", "figure.svg"]
FILES += ["log.csv", "scenario.toml"]


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scenario(tmp_path_factory.mktemp("scenario"))


@pytest.fixture(scope="module")
def demo(scenario: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    folder = tmp_path_factory.mktemp("demo") / "a" / "b"
    return folder, invoke("demo", "--scenario", scenario, "--out", folder)


def test_in_words(demo: tuple[Path, Any]) -> None:
    folder, result = demo
    assert (result.exit_code, result.stderr) == (0, "")
    for says in (
        "single frame",
        "60 s window",
        "61 of 61",
        "RMS of the true error [deg]",
        "magnetometer 5 epochs, 20 to 24 s",
        "Certificate accepted: Every attitude",
    ):
        assert says in result.stdout
    assert sorted(file.name for file in folder.iterdir()) == FILES
    assert len(result.stdout.split("\n\n")[-1].splitlines()) == 3


def test_what_it_recommends_works(demo: tuple[Path, Any]) -> None:
    folder, result = demo
    commands = [line.partition("  ")[0].split() for line in result.stdout.splitlines() if line.startswith("optsat ")]
    assert [command[1] for command in commands] == ["verify", "attitude"]
    assert invoke(*commands[0][1:]).exit_code == 0
    assert invoke(*commands[1][1:]).exit_code == 1
    assert invoke("simulate", folder / "scenario.toml", "--out", folder.parent / "again.csv").exit_code == 0
    assert (folder.parent / "again.csv").read_bytes() == (folder / "log.csv").read_bytes()


def test_what_a_single_frame_cannot_see_is_explained(scenario: Path, tmp_path: Path) -> None:
    result = invoke("demo", "--scenario", scenario, "--out", tmp_path, "--seed", 5)
    assert result.exit_code == 0
    assert "no single frame can notice" in result.stdout


def test_json(scenario: Path, tmp_path: Path) -> None:
    result = invoke("demo", "--scenario", scenario, "--out", tmp_path, "--seed", 5, "--json")
    assert (result.exit_code, result.stderr) == (0, "")
    document = json.loads(result.stdout)
    assert list(document) == ["folder", "seed", "series", "certificate", "files"]
    assert document["files"] == FILES
    assert document["certificate"]["accepted"]
    single, windowed = document["series"].values()
    assert single["counts"]["ok"] < windowed["counts"]["ok"] == 61
    both = single["where_both_are_determined"], windowed["where_both_are_determined"]
    assert both[0]["epochs"] == both[1]["epochs"] == single["counts"]["ok"]
    # with this seed the failure turns the magnetometer about the line to the Sun
    assert single["accuracy"]["violations"] == 4
    assert windowed["accuracy"]["violations"] == 0
    assert both[1]["median_bound_deg"] < both[0]["median_bound_deg"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (None, "mine.toml: the scenario cannot be opened"),
        ("duration_s = 3", "mine.toml: the demo carries the past by a gyro"),
        ("dt = 3", "mine.toml: `dt` is no known entry. Did you mean `dt_s`?"),
    ],
)
def test_scenarios_that_do_not_fit(text: str | None, says: str, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / "mine.toml").write_text(text)
    result = invoke("demo", "--scenario", tmp_path / "mine.toml", "--out", tmp_path / "demo")
    assert result.exit_code == 2
    assert says in result.stderr
    assert not (tmp_path / "demo").exists()


def test_a_scenario_in_the_dark_says_so(tmp_path: Path) -> None:
    text = "duration_s = 2\norbit = {argument_of_latitude_deg = 150}\nsun = {eclipse = true}\ngyro = {bound_deg_s = 0}"
    (tmp_path / "night.toml").write_text(text)
    result = invoke("demo", "--scenario", tmp_path / "night.toml", "--out", tmp_path / "demo")
    assert result.exit_code == 2
    assert "let the satellite see the Sun" in result.stderr
