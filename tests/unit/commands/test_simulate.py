"""`optsat simulate`: a scenario in, a log out."""

import json
from pathlib import Path

import pytest
from orbit_minute import invoke, write_scenario

from optsat.records.csv_log import read_csv_log
from optsat.simulation.scenario_file import example_text, parse_scenario


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scenario(tmp_path_factory.mktemp("scenario"))


def test_the_log_is_written_and_told(scenario: Path, tmp_path: Path) -> None:
    result = invoke("simulate", scenario, "--out", tmp_path / "log.csv", "--seed", 3)
    assert result.exit_code == 0
    record = read_csv_log(tmp_path / "log.csv", strict=True)
    assert len(record) == 61
    assert record.has_truth.all()
    dark = int((~record.channel("sun").valid).sum())
    assert 15 < dark < 25
    assert f"sun             {61 - dark} measurements" in result.stdout
    assert "magnetometer offset, 20 to 25 s" in result.stdout
    assert result.stderr.strip().endswith("log.csv.")


def test_json(scenario: Path, tmp_path: Path) -> None:
    result = invoke("simulate", scenario, "--out", tmp_path / "log.csv", "--json")
    document = json.loads(result.stdout)
    assert result.stderr == ""
    assert list(document) == [
        "scenario",
        "log",
        "seed",
        "epochs",
        "start_s",
        "stop_s",
        "measurements",
        "gyro",
        "shadow",
        "faults",
    ]
    assert (document["epochs"], document["stop_s"], document["gyro"]) == (61, 60.0, True)
    assert document["faults"][0]["kind"] == "offset"


def test_the_seed_decides(scenario: Path, tmp_path: Path) -> None:
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        invoke("simulate", scenario, "--out", tmp_path / name, "--seed", seed)
    a, b, c = ((tmp_path / name).read_bytes() for name in "abc")
    assert a == b != c


def test_the_example_is_a_scenario() -> None:
    result = invoke("simulate", "--example")
    assert result.exit_code == 0
    assert parse_scenario(result.stdout) == parse_scenario(example_text())


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["none.toml", "--out", "log.csv"], "optsat: none.toml: the scenario cannot be opened: No such file"),
        (["{scenario}"], "--out"),
        (["{scenario}", "--out", "nowhere/log.csv"], "there is no folder nowhere"),
        (["{scenario}", "--out", "."], "it is a folder"),
        (["{scenario}", "--out", "log.csv", "--seed", "-1"], "--seed"),
        (["{scenario}", "--out", "log.csv", "--sed", "1"], "--seed"),
    ],
)
def test_wrong_usage(
    arguments: list[str], says: str, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = invoke("simulate", *(each.format(scenario=scenario) for each in arguments))
    assert result.exit_code == 2
    assert says in result.stderr
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []
