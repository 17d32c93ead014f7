"""Every way in which a log can be wrong: never a number, always a line, a column and a reason."""

import math
from pathlib import Path

import numpy as np
import pytest

from optsat.errors import RecordError
from optsat.records.csv_log import read_csv_log

SUN = [f"sun.{side}.{axis} [-]" for side in ("measured", "reference") for axis in "xyz"]
HEADER = ["t [s]", *SUN, "sun.bound [deg]", "gyro.x [deg/s]", "gyro.y [deg/s]", "gyro.z [deg/s]", "gyro.bound [rad/s]"]
HEADER += [f"truth.{axis} [-]" for axis in "xyzw"]
ROW = "0,0,2,0,1,0,0.5,90,0,0,0.01,0,0,0,1"
FIRST_LINE = 3  # magic, header, then the rows


def log(rows: list[str], header: list[str] | None = None, meta: str = "") -> str:
    return "# optsat-log 1\n" + meta + ",".join(header or HEADER) + "\n" + "".join(row + "\n" for row in rows)


def with_cell(column: str, text: str, row: int = 2) -> str:
    """A sound log of four rows with one cell replaced."""
    rows = [[str(k / 10), *ROW.split(",")] for k in range(4)]
    rows[row][HEADER.index(column)] = text
    return log([",".join(cells) for cells in rows])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "flight.csv"


def test_sound_log_has_no_bad_rows(path: Path) -> None:
    path.write_text(with_cell("t [s]", "0.2"))
    record = read_csv_log(path, strict=True)
    assert record.bad_rows == ()
    assert record.channel("sun").valid.all()
    assert record.omega_BN_B is not None
    np.testing.assert_allclose(record.omega_BN_B[0], [math.pi / 2, 0, 0], rtol=1e-15)
    np.testing.assert_allclose(record.channel("sun").angle_bound_rad, math.radians(0.5), rtol=1e-15)


CELLS = [
    ("sun.measured.x [-]", "nan", "'nan' is not a finite number"),
    ("sun.measured.y [-]", "-inf", "'-inf' is not a finite number"),
    ("sun.measured.z [-]", "1e999", "'1e999' is not a finite number"),
    ("sun.reference.x [-]", "0.1x", "'0.1x' is not a finite number"),
    ("sun.reference.y [-]", "1_0", "'1_0' is not a finite number"),
    ("sun.reference.z [-]", "0x1p3", "'0x1p3' is not a finite number"),
    ("sun.measured.x [-]", "\u0661", "'\u0661' is not a finite number"),
    ("sun.measured.z [-]", "1 2", "'1 2' is not a finite number"),
    ("sun.measured.y [-]", "", "empty"),
    ("sun.reference.y [-]", " ", "empty"),
    ("sun.bound [deg]", "", "empty"),
    ("sun.bound [deg]", "-0.1", "not in [0, pi)"),
    ("sun.bound [deg]", "180", "degrees"),
    ("sun.bound [deg]", "nan", "'nan' is not a finite number"),
    ("gyro.x [deg/s]", "6000", "looks like deg/s labelled rad/s"),
    ("gyro.y [deg/s]", "", "empty"),
    ("gyro.z [deg/s]", "fast", "'fast' is not a finite number"),
    ("gyro.bound [rad/s]", "-1", "negative"),
    ("gyro.bound [rad/s]", "101", "beyond 100 rad/s"),
    ("truth.x [-]", "0.1", "norm 1.00499, not 1"),
    ("truth.w [-]", "", "empty"),
    ("truth.w [-]", "one", "'one' is not a finite number"),
]


@pytest.mark.parametrize(("column", "text", "reason"), CELLS)
def test_bad_cell_takes_out_its_measurement_only(path: Path, column: str, text: str, reason: str) -> None:
    name = column.split(" ")[0]
    path.write_text(with_cell(column, text), encoding="utf-8")
    record = read_csv_log(path)
    (bad,) = record.bad_rows
    assert (bad.file, bad.line) == (str(path), FIRST_LINE + 2)
    assert bad.column in (name, name[:-1] + "x")
    assert reason in bad.reason
    expected = np.array([True, True, False, True])
    group = name.split(".")[0]
    masks = {"sun": record.channel("sun").valid, "gyro": record.has_rate, "truth": record.has_truth}
    for other, mask in masks.items():
        np.testing.assert_array_equal(mask, expected if other == group else np.ones(4, dtype=bool))
    assert np.isnan(record.channel("sun").b_B[~record.channel("sun").valid]).all()
    with pytest.raises(RecordError) as caught:
        read_csv_log(path, strict=True)
    assert (caught.value.line, caught.value.column) == (bad.line, bad.column)
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("cells", "column"),
    [("0,0,0,1,0,0", "sun.measured.x"), ("1,0,0,0,0,-0.0", "sun.reference.x")],
)
def test_zero_vector(path: Path, cells: str, column: str) -> None:
    path.write_text(log([f"0,{ROW}", f"1,{cells},0.5,90,0,0,0.01,0,0,0,1"]))
    record = read_csv_log(path)
    (bad,) = record.bad_rows
    assert (bad.line, bad.column) == (FIRST_LINE + 1, column)
    assert "zero" in bad.reason
    assert record.pairs(1)[0].shape == (0, 3)


@pytest.mark.parametrize(
    ("row", "line_reason"),
    [
        (f"0.2,{ROW},9", "17 cells, but the header has 16"),
        (f"0.2,{ROW}".rsplit(",", 1)[0], "15 cells, but the header has 16"),
        (f'0.2,"{ROW}', "2 cells, but the header has 16"),
        ("# a remark in the body", "1 cells, but the header has 16"),
    ],
)
def test_wrong_cell_count_drops_the_row(path: Path, row: str, line_reason: str) -> None:
    path.write_text(log([f"0,{ROW}", f"0.1,{ROW}", row, f"0.3,{ROW}"]))
    record = read_csv_log(path)
    np.testing.assert_array_equal(record.t, [0, 0.1, 0.3])
    (bad,) = record.bad_rows
    assert (bad.line, bad.column) == (FIRST_LINE + 2, "")
    assert line_reason in bad.reason


@pytest.mark.parametrize(
    ("times", "kept", "bad_rows"),
    [
        (["0", "1", "1", "2"], [0, 1, 2], [2]),
        (["0", "2", "1", "3"], [0, 2, 3], [2]),
        (["0", "1", "1e9", "2", "3", "4"], [0, 1, 2, 3, 4], [2]),
        (["5", "0", "1", "2"], [0, 1, 2], [0]),
        (["0", "", "2"], [0, 2], [1]),
        (["0", "nan", "2"], [0, 2], [1]),
        (["0", "later", "2"], [0, 2], [1]),
        (["3", "2", "1"], [3], [1, 2]),
    ],
)
def test_bad_time_drops_the_fewest_rows(path: Path, times: list[str], kept: list[float], bad_rows: list[int]) -> None:
    path.write_text(log([f"{t},{ROW}" for t in times]))
    record = read_csv_log(path)
    np.testing.assert_array_equal(record.t, kept)
    assert [bad.line - FIRST_LINE for bad in record.bad_rows] == bad_rows
    assert {bad.column for bad in record.bad_rows} == {"t"}
    with pytest.raises(RecordError, match=rf"line {FIRST_LINE + bad_rows[0]}, column t:"):
        read_csv_log(path, strict=True)


def test_missing_last_line_break_means_cut(path: Path) -> None:
    path.write_text(log([f"0,{ROW}", f"0.1,{ROW}"])[:-1])
    record = read_csv_log(path)
    np.testing.assert_array_equal(record.t, [0])
    assert "line break" in record.bad_rows[0].reason
    assert record.bad_rows[0].line == FIRST_LINE + 1


def test_file_cut_at_every_byte_is_never_a_wrong_number(path: Path) -> None:
    meta = '# epoch = "2026-03-01T12:00:00Z"\n# [vectors.sun]\n# frame = "S1"\n# [frames.S1]\n# q_SB = [0, 0, 0, 1]\n'
    data = log([f"{k}.25,{ROW}" for k in range(3)], meta=meta).encode()
    path.write_bytes(data)
    whole = read_csv_log(path, strict=True)
    outcomes = set()
    for size in range(len(data)):
        path.write_bytes(data[:size])
        try:
            part = read_csv_log(path)
        except RecordError:
            outcomes.add(0)
            continue
        n = len(part)
        outcomes.add(n)
        np.testing.assert_array_equal(part.t, whole.t[:n])
        np.testing.assert_array_equal(part.channels[0].b_B, whole.channels[0].b_B[:n])
        np.testing.assert_array_equal(part.q_BN_true, np.asarray(whole.q_BN_true)[:n])
    assert outcomes == {0, 1, 2}


BARE = ["t [s]", *SUN, "sun.bound [deg]"]
STRUCTURE = [
    (b"", 1, "# optsat-log 1"),
    (b"t [s]\n0\n", 1, "# optsat-log 1"),
    (b"# optsat-log 2\nt [s]\n0\n", 1, "# optsat-log 1"),
    (b"# optsat-log 1\n", 1, "no header row"),
    (log([]).encode(), 2, "no data rows"),
    (log(["1,2"]).encode(), 3, "no row can be used"),
    (log(["0,1"], ["t", "gyro.x"]).encode(), 2, "has no unit"),
    (log(["0,1"], ["t []"]).encode(), 2, "has no unit"),
    (log(["0,1,2"], ["0", "1", "2"]).encode(), 2, "has no unit"),
    (log(["0"], ["t [fortnites]"]).encode(), 2, "unknown unit [fortnites]"),
    (log(["0"], ["t [m]"]).encode(), 2, "[m], which is a length; it must be a time [s, ms"),
    (log(["0"], [*BARE[:-1], "sun.bound [m]"]).encode(), 2, "it must be an angle [rad, deg"),
    (
        log(["0"], ["t [s]", "gyro.x [1/s]", "gyro.y [1/s]", "gyro.z [1/s]"]).encode(),
        2,
        "an angular rate [rad/s, deg/s",
    ),
    (log(["0"], [BARE[0], "sun.measured.x [nT]", *BARE[2:]]).encode(), 2, "one vector has one unit"),
    (log(["0"], [*BARE, "gyrro.x [rad/s]"]).encode(), 2, "Did you mean `gyro.x`?"),
    (log(["0"], [*BARE, "sun.measure.x [-]"]).encode(), 2, "Did you mean `sun.measured.x`?"),
    (log(["0"], [*BARE, "t.measured.x [-]"]).encode(), 2, "the column is unknown"),
    (log(["0"], BARE[:3] + BARE[4:]).encode(), 2, "column sun.measured.z: the column is missing"),
    (log(["0"], BARE[:-1]).encode(), 2, "column sun.bound: the bound of sun is missing"),
    (log(["0"], BARE[1:]).encode(), 2, "column t: the column is missing"),
    (log(["0"], [*BARE, "truth.x [-]"]).encode(), 2, "column truth.y: the column is missing"),
    (log(["0"], [*BARE, "t [ms]"]).encode(), 2, "stands twice"),
    (log(["0"], BARE, '# [vectors.sun]\n# frame = "S2"\n').encode(), 3, "unknown frame `S2`"),
    (log(["0"], BARE, "# [vectors.sum]\n# bound_deg = 1\n").encode(), 4, "Did you mean `sun`?"),
    (log(["0"], BARE, "# [vectors.sun]\n# bound_deg = 1\n").encode(), 4, "given twice"),
    (log(["0"], BARE, "# [vectors.sun]\n# bound_deg = -1\n").encode(), 3, "[0, 180)"),
    (log(["0"], BARE, "# [gyro]\n").encode(), 3, "no columns gyro.x"),
    (log(["0"], BARE, "# made by hand\n").encode(), 2, "'##'"),
    (log(["0"], BARE, "# epoc = 1\n").encode(), 2, "Did you mean `epoch`?"),
    (log(["0"], BARE, '# epoch = "yesterday"\n').encode(), 2, "ISO 8601"),
    (log(["0"], BARE, "# frames = 3\n").encode(), 2, "must be a table"),
    (log(["0"], BARE, "# [frames.S1]\n# dcm_SB = [[1,0,0],[0,1,0],[0,0,-1]]\n").encode(), 2, "must be a rotation"),
    (log(["0"], BARE, "# [frames.S1]\n# dcm_SB = [[1,0],[0,1]]\n").encode(), 2, "(3, 3)"),
    (log(["0"], BARE, "# [frames.S1]\n# q_SB = [0, 0, 1, 1]\n").encode(), 2, "unit quaternion"),
    (log(["0"], BARE, "# [frames.B]\n# q_SB = [0, 0, 0, 1]\n").encode(), 2, "not B itself"),
    (log(["0"], BARE, "# [frames.S1]\n").encode(), 2, "dcm_SB or q_SB"),
    (b"# optsat-log 1\nt [s]\n0\n1\xff\n", 4, "UTF-8"),
    (b"# optsat-log 1\nt [s];gyro.x [rad/s];gyro.y [rad/s];gyro.z [rad/s]\n0,5;1,5;0;0\n", 3, "decimal comma '0,5'"),
    (b"# optsat-log 1\nt [s]\n" + b"9" * 200_000 + b"\n", 3, "cells"),
    (b"# optsat-log 1\n" + b"9" * 200_000 + b"\n", 2, "cells"),
]


@pytest.mark.parametrize(("data", "line", "cure"), STRUCTURE, ids=range(len(STRUCTURE)))
def test_structural_fault_is_always_raised(path: Path, data: bytes, line: int, cure: str) -> None:
    path.write_bytes(data)
    with pytest.raises(RecordError) as caught:
        read_csv_log(path)
    assert cure in str(caught.value)
    assert caught.value.line == line
    assert caught.value.file == str(path)


def test_missing_file_and_folder_name_the_path(tmp_path: Path) -> None:
    for absent in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(RecordError, match=absent.name):
            read_csv_log(absent)
