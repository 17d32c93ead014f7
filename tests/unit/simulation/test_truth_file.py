"""Truth files: they read back to the bit, no log reader takes them, and damage is named."""

from pathlib import Path

import numpy as np
import pytest

from optsat.errors import RecordError
from optsat.models.faults import Fault, SensorFaultKind
from optsat.models.parts import Part
from optsat.records.csv_log import read_csv_log
from optsat.records.telemetry_csv import read_telemetry
from optsat.simulation.diagnosis_run import simulate
from optsat.simulation.diagnosis_scenario import DiagnosisScenario, scenario_s1
from optsat.simulation.diagnosis_truth import DiagnosisTruth
from optsat.simulation.truth_file import read_truth, write_truth


@pytest.fixture(scope="module")
def truth() -> DiagnosisTruth:
    return simulate(scenario_s1(), 1).truth


def write(folder: Path, truth: DiagnosisTruth) -> Path:
    path = folder / "truth.csv"
    write_truth(path, truth, 'S"1"', 3)
    return path


def test_it_reads_back_to_the_bit(truth: DiagnosisTruth, tmp_path: Path) -> None:
    back = read_truth(write(tmp_path, truth))
    for name, value in vars(truth).items():
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(getattr(back, name), value, err_msg=name)
        else:
            assert getattr(back, name) == value
    head = (tmp_path / "truth.csv").read_text().splitlines()[:3]
    assert head == ["# optsat-truth 1", '# scenario = "S\\"1\\""', "# seed = 3"]


def test_faults_without_end_and_with_numbers(tmp_path: Path) -> None:
    faults = (Fault(Part.GPS, SensorFaultKind.BIAS, 0.5, value=(1.0, 2.5, -3.0)),)
    short = simulate(DiagnosisScenario(duration=1.0, faults=faults), 1).truth
    assert read_truth(write(tmp_path, short)).faults == faults
    healthy = simulate(DiagnosisScenario(duration=0.0), 1).truth
    assert read_truth(write(tmp_path, healthy)).faults == ()


@pytest.mark.parametrize("reader", [read_csv_log, read_telemetry])
def test_no_reader_of_logs_takes_it(reader: object, truth: DiagnosisTruth, tmp_path: Path) -> None:
    path = write(tmp_path, truth)
    with pytest.raises(RecordError, match="the first line must be `# optsat-log 1`"):
        reader(path)  # type: ignore[operator]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("# optsat-truth 1", "# optsat-log 1", "line 1: the first line of a truth file is `# optsat-truth 1`"),
        ("rate.x [rad/s]", "rate.x [deg/s]", r"not the columns of a truth file: rate\.x \[deg/s\]"),
        ("faulty.gyro.x", "faulty.gyro.w", r"not the columns of a truth file: faulty\.gyro\.w"),
        ('kind = "dead"', 'kind = "ded"', "line 2: the head cannot be read: 'ded' is not a valid"),
        ('part = "star"', "part = star", "the head cannot be read"),
        ("stop_s = 45.0", "stop_s = 1.0", "the head cannot be read: `stop_s` must be > 30"),
        ("\n0.1,", "\nx,", r"column t \[s\]: there is no number"),
        ("\n0.1,", "\n0.1,0,", "the row has"),
    ],
)
def test_damage_is_named(old: str, new: str, says: str, truth: DiagnosisTruth, tmp_path: Path) -> None:
    path = write(tmp_path, truth)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(RecordError, match=says):
        read_truth(path)


def test_a_file_cut_short(truth: DiagnosisTruth, tmp_path: Path) -> None:
    path = write(tmp_path, truth)
    lines = path.read_text().splitlines(keepends=True)
    header = next(i for i, line in enumerate(lines) if line.startswith("t [s]"))
    for kept, says in ((header + 1, "there is no number"), (header, "not the columns"), (1, "not the columns")):
        path.write_text("".join(lines[:kept]))
        with pytest.raises(RecordError, match=says):
            read_truth(path)
    path.write_text("")
    with pytest.raises(RecordError, match="the first line"):
        read_truth(path)
