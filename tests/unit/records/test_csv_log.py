"""The CSV log as people write it: units, frames, bounds, separators, and what the writer leaves on the disk."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from optsat.arrays import Array
from optsat.errors import InputError, RecordError
from optsat.records.csv_log import read_csv_log, write_csv_log
from optsat.records.record import Record, VectorChannel

LOG = """# optsat-log 1
## a remark
# epoch = 2026-03-01T12:00:00Z
# [frames.S1]
# dcm_SB = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
# [frames.G]
# q_SB = [0, 0, 0.7071067811865476, 0.7071067811865476]
# [vectors.sun]
# frame = "S1"
# bound_deg = 0.5
# [gyro]
# frame = "G"
# bound_deg_s = 0.1
t [ms],sun.measured.x [nT],sun.measured.y [nT],sun.measured.z [nT],sun.reference.x [km],sun.reference.y [km],\
sun.reference.z [km],gyro.x [deg/s],gyro.y [deg/s],gyro.z [deg/s],truth.x [-],truth.y [-],truth.z [-],truth.w [-]
0,3e4,0,0,0,0,-1e-300,90,0,0,0,0,0.6,-0.8
500,,,,,,,,,,,,,
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "flight.csv"


def check_meaning(record: Record) -> None:
    np.testing.assert_array_equal(record.t, [0, 0.5])
    assert record.epoch == "2026-03-01T12:00:00+00:00"
    sun = record.channel("sun")
    assert (sun.frame, sun.valid.tolist()) == ("S1", [True, False])
    np.testing.assert_array_equal(sun.b_B[0], [0, 1, 0])  # dcm_SB maps (0, 1, 0) in B to (1, 0, 0) in S1
    np.testing.assert_array_equal(sun.r_N[0], [0, 0, -1])
    np.testing.assert_allclose(sun.angle_bound_rad[0], np.deg2rad(0.5), rtol=1e-15)
    assert record.omega_BN_B is not None
    assert record.gyro_bound_rad_s is not None
    assert record.q_BN_true is not None
    into_B = Rotation.from_quat([0, 0, np.sqrt(0.5), np.sqrt(0.5)]).apply([np.pi / 2, 0, 0])
    np.testing.assert_allclose(record.omega_BN_B[0], into_B, atol=1e-15)
    np.testing.assert_allclose(record.gyro_bound_rad_s[0], np.deg2rad(0.1), rtol=1e-15)
    np.testing.assert_allclose(record.q_BN_true[0], [0, 0, -0.6, 0.8], rtol=1e-15)
    assert (record.has_rate.tolist(), record.has_truth.tolist()) == ([True, False], [True, False])
    assert record.bad_rows == ()


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("line_break", ["\n", "\r\n", "\r", "\n\n"])
@pytest.mark.parametrize("quotes", [False, True])
def test_units_frames_and_empty_cells(path: Path, mark: str, line_break: str, quotes: bool) -> None:
    text = LOG.replace("t [ms]", '"t [ms]"').replace("3e4", '" 3e4"') if quotes else LOG
    path.write_bytes((mark + text.replace("\n", line_break)).encode())
    check_meaning(read_csv_log(path, strict=True))


def test_semicolons_with_decimal_points(path: Path) -> None:
    head, body = LOG[: LOG.index("t [ms]")], LOG[LOG.index("t [ms]") :]
    path.write_text(head + body.replace(",", ";"))
    check_meaning(read_csv_log(path, strict=True))


def test_source_is_the_path_unless_the_log_says_otherwise(path: Path) -> None:
    path.write_text(LOG)
    assert read_csv_log(path).source == str(path)
    path.write_text(LOG.replace("## a remark", '# source = "bench"'))
    assert read_csv_log(path).source == "bench"


def record_in_s1() -> tuple[Record, Array]:
    dcm_SB = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    b_B = np.array([[0.6, 0, 0.8], [0, -1, 0]])
    channel = VectorChannel("sun", "S1", b_B, b_B[::-1], np.array([0.01, 0.02]), np.array([True, True]))
    return Record(np.array([0.0, 1.0]), (channel,), source='"quoted" \\ \x7f \n é'), dcm_SB


def test_writer_keeps_the_sensor_frame_when_told(path: Path) -> None:
    record, dcm_SB = record_in_s1()
    write_csv_log(path, record, frames={"S1": dcm_SB, "unused": np.eye(3)})
    back = read_csv_log(path, strict=True)
    assert back.channel("sun").frame == "S1"
    np.testing.assert_allclose(back.channel("sun").b_B, record.channel("sun").b_B, atol=3e-16)
    assert "unused" not in path.read_text(encoding="utf-8")
    first = path.read_text(encoding="utf-8").splitlines()[-2].split(",")
    np.testing.assert_allclose(np.array(first[1:4], dtype=float), dcm_SB @ [0.6, 0, 0.8], atol=3e-16)
    assert back.source == record.source


def test_writer_refuses_a_matrix_that_is_none(path: Path) -> None:
    with pytest.raises(InputError, match="frames"):
        write_csv_log(path, record_in_s1()[0], frames={"S1": [[1, 0], [0, 1]]})
    assert not path.exists()


def test_writer_replaces_whole_files_only(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path.write_text("old")
    record, _ = record_in_s1()

    def full_disk(descriptor: int) -> None:
        raise OSError("disk full")

    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", full_disk)
        with pytest.raises(OSError, match="disk full"):
            write_csv_log(path, record)
    assert path.read_text() == "old"
    assert list(path.parent.iterdir()) == [path]
    write_csv_log(path, record)
    assert len(read_csv_log(path)) == 2
    assert list(path.parent.iterdir()) == [path]


def test_decimal_comma_in_one_row_is_a_bad_row_only(path: Path) -> None:
    path.write_text("# optsat-log 1\nt [s];gyro.x [rad/s];gyro.y [rad/s];gyro.z [rad/s]\n0;0;0;0\n1;0,5;0;0\n")
    record = read_csv_log(path)
    assert [(bad.line, bad.column) for bad in record.bad_rows] == [(4, "gyro.x")]
    with pytest.raises(RecordError, match="0,5"):
        read_csv_log(path, strict=True)
