"""`optsat attitude`: what it finds, what it writes, how it refuses."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from orbit_minute import invoke, write_log

from optsat.attitude import quaternion
from optsat.records.csv_log import read_csv_log, write_csv_log
from optsat.simulation.orbit_scenario import OrbitScenario

KEYS = ["log", "window_s", "spacing_s", "epochs", "start_s", "stop_s", "counts", "median_bound_deg", "max_bound_deg"]
KEYS += ["inconsistent", "rejected", "accuracy", "bad_rows"]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_log(tmp_path_factory.mktemp("log"))


def test_single_frames_meet_the_failure_as_a_contradiction(log: Path) -> None:
    result = invoke("attitude", log)
    assert result.exit_code == 1
    assert result.stderr == ""
    assert "single frames" in result.stdout
    assert "no attitude fits  5 epochs, 20 to 24 s" in result.stdout
    assert "100 % of the errors, 0 beyond it" in result.stdout


def test_a_window_names_the_faulty_channel(log: Path) -> None:
    result = invoke("attitude", log, "--window", 30, "--spacing", 5, "--json")
    assert result.exit_code == 1
    document = json.loads(result.stdout)
    assert list(document) == KEYS
    assert (document["window_s"], document["spacing_s"], document["epochs"]) == (30.0, 5.0, 61)
    assert document["counts"]["ok"] == 61
    assert document["inconsistent"] == []
    assert document["rejected"] == {"magnetometer": [{"start_s": 20.0, "stop_s": 24.0, "epochs": 5}]}
    assert document["accuracy"]["violations"] == 0
    assert document["accuracy"]["containment"] == 1.0
    assert 0 < document["accuracy"]["median_deg"] < document["median_bound_deg"] < document["max_bound_deg"]


def test_a_sound_log_is_no_finding(tmp_path: Path) -> None:
    write_csv_log(tmp_path / "log.csv", OrbitScenario(duration=5.0).simulate(np.random.default_rng(0)))
    result = invoke("attitude", tmp_path / "log.csv", "--json")
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert document["counts"] == {"ok": 6, "unbounded": 0, "inconsistent": 0, "no measurement": 0}


def test_stride_takes_every_so_manieth_epoch(log: Path) -> None:
    document = json.loads(invoke("attitude", log, "--stride", 10, "--json").stdout)
    assert document["epochs"] == 7
    assert document["accuracy"]["violations"] == 0


def test_the_table_reads_back(log: Path, tmp_path: Path) -> None:
    out = tmp_path / "attitude.csv"
    result = invoke("attitude", log, "--window", 30, "--out", out)
    assert str(out) in result.stderr
    with out.open() as stream:
        rows = list(csv.DictReader(stream))
    record = read_csv_log(log)
    assert [float(row["t [s]"]) for row in rows] == record.t.tolist()
    assert {row["t [s]"] for row in rows if row["rejected"] == "magnetometer"} == {f"{k}.0" for k in range(20, 25)}
    q_BN = np.array([[float(row[f"q_BN.{axis} [-]"]) for axis in "xyzw"] for row in rows])
    bound_deg = np.array([float(row["bound [deg]"]) for row in rows])
    assert record.q_BN_true is not None
    assert np.all(np.degrees(quaternion.error_angle(q_BN, record.q_BN_true)) <= bound_deg)


def test_undetermined_epochs_have_empty_cells(log: Path, tmp_path: Path) -> None:
    invoke("attitude", log, "--out", tmp_path / "attitude.csv")
    with (tmp_path / "attitude.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["status"] for row in (rows[0], rows[22], rows[60])] == ["ok", "inconsistent", "unbounded"]
    assert rows[22]["q_BN.x [-]"] == rows[60]["bound [deg]"] == ""


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_figure_is_of_its_kind(kind: str, log: Path, tmp_path: Path) -> None:
    plot = tmp_path / f"attitude.{kind}"
    invoke("attitude", log, "--stride", 5, "--plot", plot)
    assert (b"<svg" in plot.read_bytes()) if kind == "svg" else plot.read_bytes().startswith(b"\x89PNG")


def test_bad_rows_are_listed_with_file_and_line(log: Path, tmp_path: Path) -> None:
    lines = log.read_text().splitlines()
    header = next(k for k, line in enumerate(lines) if line.startswith("t [s]"))
    cells = lines[header + 3].split(",")
    cells[1] = "x"
    lines[header + 3] = ",".join(cells)
    damaged = tmp_path / "damaged.csv"
    damaged.write_text("\n".join(lines[: header + 8]) + "\n")
    result = invoke("attitude", damaged)
    assert result.exit_code == 1
    assert f"{damaged}:{header + 4}" in result.stdout
    (row,) = json.loads(invoke("attitude", damaged, "--json").stdout)["bad_rows"]
    assert (row["line"], row["file"]) == (header + 4, str(damaged))
    strict = invoke("attitude", damaged, "--strict")
    assert strict.exit_code == 2
    assert f"line {header + 4}" in strict.stderr


def test_a_log_without_truth(tmp_path: Path) -> None:
    from dataclasses import replace

    record = OrbitScenario(duration=5.0).simulate(np.random.default_rng(0))
    write_csv_log(tmp_path / "log.csv", replace(record, q_BN_true=None))
    result = invoke("attitude", tmp_path / "log.csv", "--plot", tmp_path / "a.svg")
    assert result.exit_code == 0
    assert "true error" not in result.stdout
    assert json.loads(invoke("attitude", tmp_path / "log.csv", "--json").stdout)["accuracy"] is None


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["none.csv"], "optsat: none.csv: the log cannot be opened: No such file"),
        (["none.mat", "--format", "broad"], "none.mat"),
        (["{log}", "--format", "xml"], "'csv', 'broad'"),
        (["{log}", "--windw", "60"], "--window"),
        (["{log}", "--spacing", "4"], "--spacing needs --window"),
        (["{log}", "--window", "-4"], "must be a positive time"),
        (["{log}", "--window", "60", "--certificates", "c.jsonl"], "leave out --window"),
        (["{log}", "--plot", "a.pdf"], "a.pdf: a figure is written as .svg or .png."),
        (["{log}", "--out", "nowhere/a.csv"], "there is no folder nowhere"),
        (["{log}", "--stride", "0"], "--stride"),
    ],
)
def test_wrong_usage(
    arguments: list[str], says: str, log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = invoke("attitude", *(each.format(log=log) for each in arguments))
    assert result.exit_code == 2
    assert says in result.stderr
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_a_trial_of_broad(shared_data: Callable[[str], Path]) -> None:
    trial = shared_data("broad/01_undisturbed_slow_rotation_A.mat")
    result = invoke("attitude", trial, "--format", "broad", "--stride", 2000, "--json")
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert document["counts"]["ok"] == document["epochs"] == 29
    assert document["accuracy"]["violations"] == 0
