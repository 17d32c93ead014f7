"""The optsat CSV log: a text file that says its own units, frames and bounds.

    # optsat-log 1
    # epoch = "2026-03-01T12:00:00Z"
    # [frames.S1]
    # dcm_SB = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    # [vectors.sun]
    # frame = "S1"
    # bound_deg = 0.5
    t [s],sun.measured.x [-],sun.measured.y [-],sun.measured.z [-],sun.reference.x [-], ... one line
    0.0,0.6,0.0,0.8,0.0,0.6,0.8
    0.1,,,,0.0,0.6,0.8

The head
--------
- Line 1 is `# optsat-log 1`. The `# ` lines after it are TOML; a remark starts with `##`. All entries are optional:
  `epoch` (ISO 8601, the instant t = 0), `source` (where the data come from),
  `[frames.NAME]` with `dcm_SB` (rows; v_S = dcm_SB v_B) or `q_SB` (the same rotation, scalar last),
  `[vectors.NAME]` with `frame` (default B) and `bound_deg`, `[gyro]` with `frame` and `bound_deg_s`.
- The header row names every column with its unit in brackets, `[-]` for a bare number. The columns, in any order:
  `t` time;
  `NAME.measured.x|y|z` the direction that sensor NAME measured, components in its frame;
  `NAME.reference.x|y|z` the same direction known in N;
  `NAME.bound` the largest angle between the two once the attitude is right, body and reference errors together;
  `gyro.x|y|z` rate of B relative to N, components in the gyro's frame; `gyro.bound` the largest length of its error;
  `truth.x|y|z|w` the true attitude q_BN, scalar last;
  the columns of telemetry, which are read by `optsat.records.telemetry_csv` and of no account here.
- The components of a vector share one unit: none, a flux density, an acceleration or a length. Only the direction is
  used, so the length may be anything but zero.

The body
--------
- One row per epoch, time strictly increasing, '.' in numbers, every row ended by a line break. Cells are separated by
  ',', or by ';' when the header is. Byte order mark, CRLF and blank lines are accepted.
- All components of a measured vector empty = no measurement at that epoch; likewise gyro and truth. That is no fault.
- A fault never becomes a number. A row with a wrong cell count, a bad time, or cut at the end of the file is left out;
  where the times do not increase, the fewest rows are left out that restore the order. A bad cell takes out its own
  measurement and nothing else. Each fault is listed as a `BadRow`, or raised with `strict=True`. Faults of the head are
  always raised.
"""

import os

from optsat.errors import RecordError, explain_unknown_options
from optsat.records.csv_body import read_body
from optsat.records.csv_layout import parse_layout
from optsat.records.csv_table import read_table
from optsat.records.csv_writer import write_csv_log
from optsat.records.record import Record

__all__ = ["read_csv_log", "write_csv_log"]


@explain_unknown_options
def read_csv_log(path: str | os.PathLike[str], strict: bool = False) -> Record:
    """Read a log: directions as unit vectors in B and N, everything in SI, bad rows listed in `record.bad_rows`.

    Raises
    ------
    RecordError : no such file, a fault of the head, no usable row; with `strict`, the first bad row.
    """
    file = os.fspath(path)
    lines, terminated = read_lines(file)
    layout = parse_layout(file, lines)
    table, bad = read_table(file, lines, layout.header_line, layout.names, layout.delimiter, terminated=terminated)
    body, more = read_body(file, layout, table)
    bad = sorted(bad + more, key=lambda row: row.line)
    empty = len(body.t) == 0
    if bad and (strict or empty):
        prefix = "" if strict else "no row can be used; the first reason: "
        raise RecordError(f"{prefix}{bad[0].reason}.", file=file, line=bad[0].line, column=bad[0].column)
    if empty:
        raise RecordError("there are no data rows below the header.", file=file, line=layout.header_line)
    return Record(
        t=body.t,
        channels=body.channels,
        omega_BN_B=body.omega_BN_B,
        gyro_bound_rad_s=body.gyro_bound_rad_s,
        q_BN_true=body.q_BN_true,
        epoch=layout.metadata.epoch,
        source=file if layout.metadata.source is None else layout.metadata.source,
        bad_rows=tuple(bad),
    )


def read_lines(file: str) -> tuple[list[str], bool]:
    """Return the lines of a text file, and whether the last one ends with a line break."""
    try:
        with open(file, "rb") as stream:
            data = stream.read()
    except OSError as error:
        raise RecordError(f"the log cannot be opened: {error.strerror}.", file=file) from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        cure = "save the file as UTF-8 text"
        raise RecordError(f"byte {error.start} is not text; {cure}.", file=file, line=line) from None
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    terminated = lines[-1] == ""
    return lines[:-1] if terminated else lines, terminated
