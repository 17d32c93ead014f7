"""`optsat simulate` of a diagnosis scenario: log and truth, each in a file of its own."""

import json
from pathlib import Path

import pytest
from orbit_minute import invoke, write_scenario

from optsat.records.telemetry_csv import read_telemetry
from optsat.simulation.diagnosis_file import diagnosis_example, parse_diagnosis_scenario
from optsat.simulation.diagnosis_run import simulate
from optsat.simulation.truth_file import read_truth

TEXT = """
kind = "diagnosis"
duration_s = 3
[gps]
dropout = 1
[[faults]]
part = "gyro.y"
kind = "bias"
start_s = 1
value = 0.5
[[faults]]
part = "thruster.z"
kind = "closed"
start_s = 1
stop_s = 2
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "scenario.toml"
    path.write_text(TEXT)
    return path


def test_log_and_truth_are_written_and_told(scenario: Path, tmp_path: Path) -> None:
    result = invoke("simulate", scenario, "--out", tmp_path / "log.csv", "--seed", 3)
    assert result.exit_code == 0
    run = simulate(parse_diagnosis_scenario(TEXT), 3)
    log = read_telemetry(tmp_path / "log.csv", strict=True)
    assert log.equals(run.telemetry)
    assert read_truth(tmp_path / "log.truth.csv").faults == run.truth.faults
    assert "gps_r_N          0 samples" in result.stdout
    assert "rows             31, 0 to 3 s" in result.stdout
    assert "gyro.y bias, 1 s to the end" in result.stdout
    assert "thruster.z closed, 1 s to 2 s" in result.stdout
    assert result.stderr == f"Written to {tmp_path / 'log.csv'}, the truth to {tmp_path / 'log.truth.csv'}.\n"


def test_json_and_a_place_for_the_truth(scenario: Path, tmp_path: Path) -> None:
    result = invoke("simulate", scenario, "--out", tmp_path / "l.csv", "--truth", tmp_path / "t.csv", "--json")
    document = json.loads(result.stdout)
    assert result.stderr == ""
    assert (document["rows"], document["stop_s"], document["seed"]) == (31, 3.0, 0)
    assert document["truth"] == str(tmp_path / "t.csv")
    assert document["samples"]["gyro_omega_BN_B"] == 31
    assert document["faults"] == [
        {"part": "gyro.y", "kind": "bias", "start_s": 1.0, "stop_s": None, "value": [0.5]},
        {"part": "thruster.z", "kind": "closed", "start_s": 1.0, "stop_s": 2.0, "value": []},
    ]
    assert read_truth(tmp_path / "t.csv").t[-1] == 3.0


def test_the_example(tmp_path: Path) -> None:
    result = invoke("simulate", "--example-diagnosis")
    assert result.exit_code == 0
    assert result.stdout == diagnosis_example()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["{scenario}", "--out", "x.csv", "--truth", "./x.csv"], "are both x.csv"),
        (["{scenario}", "--out", "x.csv", "--truth", "no/x.csv"], "there is no folder no"),
        (["{orbit}", "--out", "x.csv", "--truth", "y.csv"], "--truth is for diagnosis scenarios"),
        (["{wrong}", "--out", "x.csv"], "wrong.toml: `kind` is 'diagnos'. Did you mean `diagnosis`"),
    ],
)
def test_wrong_usage(
    arguments: list[str], says: str, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.toml").write_text('kind = "diagnos"')
    orbit = write_scenario(tmp_path)
    result = invoke(
        "simulate", *(each.format(scenario=scenario, orbit=orbit, wrong="wrong.toml") for each in arguments)
    )
    assert result.exit_code == 2
    assert says in result.stderr
    assert not (tmp_path / "x.csv").exists()
