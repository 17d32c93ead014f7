"""Telemetry: shapes are checked, readings are not; logs of it read back to the bit, with their faults listed."""

from pathlib import Path

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.errors import InputError, RecordError, UnknownOptionError
from optsat.records.csv_log import read_csv_log
from optsat.records.telemetry import CHANNELS, Telemetry
from optsat.records.telemetry_csv import read_telemetry, write_telemetry

NAN = float("nan")
ROWS = 4


def full(**changes: object) -> Telemetry:
    rng = np.random.default_rng(1)
    shapes = {name: (ROWS, width) if width > 1 else (ROWS,) for name, (width, _) in CHANNELS.items()}
    values: dict[str, object] = {name: rng.normal(size=shape) for name, shape in shapes.items()}
    return Telemetry(**{"t": 0.1 * np.arange(ROWS), **values, **changes})  # type: ignore[arg-type]


def log(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "log.csv"
    path.write_text(text)
    return path


HEAD = "# optsat-log 1\nt [s],command.x [N m],command.y [N m],command.z [N m]"


def test_what_is_written_reads_back_to_the_bit(tmp_path: Path) -> None:
    missing = np.array([[NAN, 1, 2], [3, NAN, NAN], [NAN, NAN, NAN], [1e-300, 1e300, -0.0]])
    star = np.array([[0, 0, 0, 0], [0, 0, 0, 5.0], [NAN] * 4, [-0.5] * 4])
    written = full(gyro_omega_BN_B=missing, star_q_BN=star, epoch="2026-03-01T12:00:00", source='a "b"\n')
    write_telemetry(tmp_path / "log.csv", written)
    back = read_telemetry(tmp_path / "log.csv", strict=True)
    assert back.equals(written)
    assert (back.epoch, back.source) == (written.epoch, written.source)
    assert written.equals(full(gyro_omega_BN_B=missing, star_q_BN=star))
    assert not written.equals(full())
    assert not full().equals(full(gps_r_N=None))


def test_sensors_that_are_not_there_stay_so(tmp_path: Path) -> None:
    few = full(gyro_omega_BN_B=None, star_q_BN=None, skewed_gyro_rate=None, pressure_torque_B=None)
    write_telemetry(tmp_path / "log.csv", few)
    assert read_telemetry(tmp_path / "log.csv").sensors == ("gps_r_N", "accelerometer")


def test_received_and_repr() -> None:
    telemetry = full(gyro_omega_BN_B=[[1, 2, 3], [NAN, 2, 3], [np.inf, 0, 0], [1e9, 0, 0]])
    assert telemetry.received("gyro_omega_BN_B").tolist() == [True, False, True, True]
    assert telemetry.received("skewed_gyro_rate").all()
    assert "4 epochs, 0 to 0.3 s, gyro_omega_BN_B 3 received, star_q_BN 4 received" in repr(telemetry)
    with pytest.raises(InputError, match="no sensor 'gyro'; it has gyro_omega_BN_B, star_q_BN"):
        telemetry.received("gyro")
    with pytest.raises(ValueError, match="read-only"):
        telemetry.t[0] = 1.0


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"t": [0.0, 0.1, 0.1, 0.2]}, r"`t` must be later than the row before \[s\]: row 2 holds 0.1"),
        ({"t": [0.0, 0.1, NAN, 0.2]}, "`t` must be a finite time .*row 2"),
        ({"t": []}, "at least one epoch"),
        ({"command_torque_B": None}, "`command_torque_B` must be"),
        ({"command_torque_B": [[0, 0, 0]] * 3 + [[0, NAN, 0]]}, "`command_torque_B` must be finite.*row 3"),
        ({"gps_r_N": np.zeros((3, ROWS))}, r"shape \(4, 3\) \[m\].*got \(3, 4\). Did you pass columns"),
        ({"skewed_gyro_rate": np.zeros((ROWS, 1))}, r"shape \(4,\) \[rad/s\].*got \(4, 1\)\."),
    ],
)
def test_shapes_times_and_commands_are_checked(changes: dict[str, Array], says: str) -> None:
    with pytest.raises(InputError, match=says):
        full(**changes)


def test_a_misspelt_sensor_is_named() -> None:
    with pytest.raises(UnknownOptionError, match="Did you mean `gps_r_N`"):
        full(gps_rN=None)


def test_units_empty_cells_and_held_commands(tmp_path: Path) -> None:
    commands = ",".join(f"command.{axis} [mN m]" for axis in "xyz")
    head = f"# optsat-log 1\nt [ms],{commands},{','.join(f'gyro.{axis} [deg/s]' for axis in 'xyz')}"
    telemetry = read_telemetry(log(tmp_path, f"{head}\n0,5000,0,0,180,,0\n100,,,,,,\n250,0,1000,0,1e9,0,0\n"))
    assert telemetry.t.tolist() == pytest.approx([0.0, 0.1, 0.25])
    assert telemetry.command_torque_B.tolist() == [[5, 0, 0], [5, 0, 0], [0, 1, 0]]
    assert telemetry.gyro_omega_BN_B is not None
    np.testing.assert_allclose(telemetry.gyro_omega_BN_B, [[np.pi, NAN, 0], [NAN, NAN, NAN], [1e9 * np.pi / 180, 0, 0]])
    assert telemetry.bad_rows == ()


def test_bad_cells_and_rows_are_listed_and_cost_only_themselves(tmp_path: Path) -> None:
    path = log(
        tmp_path, f"{HEAD},gps.x [m],gps.y [m],gps.z [m]\n0,0,0,0,1,2,3\n1,x,0,0,1,nan,3\n2,0,0\n3,0,0,7,1,2,3\n"
    )
    telemetry = read_telemetry(path)
    assert telemetry.gps_r_N is not None
    np.testing.assert_array_equal(telemetry.gps_r_N, [[1, 2, 3], [1, NAN, 3], [1, 2, 3]])
    assert telemetry.command_torque_B.tolist() == [[0, 0, 0], [0, 0, 0], [0, 0, 7]]
    assert [(bad.line, bad.column, bad.reason) for bad in telemetry.bad_rows] == [
        (4, "command.x", "'x' is not a finite number"),
        (4, "gps.y", "'nan' is not a finite number"),
        (5, "", "the row has 3 cells, but the header has 7"),
    ]
    with pytest.raises(RecordError, match=r"line 4, column command\.x: 'x' is not a finite number"):
        read_telemetry(path, strict=True)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("# optsat-log 1\nt [s],gps.x [m],gps.y [m],gps.z [m]\n0,1,2,3\n", "the log has no commands; add command.x"),
        (f"{HEAD}\n", "there are no data rows"),
        (f"{HEAD}\n0,0,0\n", "no row can be used; the first reason: the row has 3 cells"),
        (f"{HEAD}\n0,,0,0\n1,0,0,0\n", "line 3, column command.x: the first row has no complete command"),
        (f"{HEAD},gps.x [m]\n0,0,0,0,1\n", "gps.y: the column is missing; gps.x, gps.y, gps.z belong together"),
        (f"{HEAD},gps.x [s],gps.y [s],gps.z [s]\n", "which is a time; it must be a length"),
        (f"{HEAD},gsp.x [m]\n", "the column is unknown. Did you mean `gps.x`"),
        (
            "# optsat-log 1\n# [frames.S1]\n# dcm_SB = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]\n# [gyro]\n# frame = 'S1'\n"
            + HEAD.partition("\n")[2]
            + ",gyro.x [rad/s],gyro.y [rad/s],gyro.z [rad/s]\n0,0,0,0,1,2,3\n",
            "mounted askew to B",
        ),
    ],
)
def test_faults_of_a_log(text: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=says):
        read_telemetry(log(tmp_path, text))


def test_a_record_takes_its_own_columns_from_the_same_log(tmp_path: Path) -> None:
    write_telemetry(tmp_path / "log.csv", full())
    record = read_csv_log(tmp_path / "log.csv", strict=True)
    assert len(record) == ROWS
    np.testing.assert_array_equal(record.omega_BN_B, full().gyro_omega_BN_B)
