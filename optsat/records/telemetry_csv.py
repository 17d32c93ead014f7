"""Telemetry in the optsat CSV log: raw readings of sensors and the commands, in columns beside those of directions.

    # optsat-log 1
    t [s],command.x [N m],command.y [N m],command.z [N m],gyro.x [rad/s],gyro.y [rad/s],gyro.z [rad/s],gps.x [m], ...
    0.0,0.0,0.0,5.0,0.01,0.02,0.0,
    0.1,,,,0.01,,0.0,

Head, units and rows are as `optsat.records.csv_log` says; the columns, all along B where nothing else is said:
  `command.x|y|z` torque commanded from this row on; all empty = the command of the row before holds. It may not be
  missing altogether: a log without thrusters has zeros;
  `gyro.x|y|z` rates, each axis for itself; `skewed_gyro.rate` the rate of a redundant single-axis gyro;
  `star.x|y|z|w` attitude q_BN from the star tracker, scalar last; `gps.x|y|z` position in N;
  `accelerometer.x|y|z` acceleration; `pressure.x|y|z` torque told from the chamber pressures.
An empty cell is a missing sample and no fault. A cell that is no finite number is missing too, and listed as a
`BadRow`. Readings of any size are taken as they are: whether they can be right is what diagnosis decides.
"""

import os

import numpy as np

from optsat.arrays import Array
from optsat.errors import RecordError, explain_unknown_options
from optsat.records.csv_gate import Gate, in_time_order
from optsat.records.csv_layout import DEVICES, MAGIC, Layout, parse_layout
from optsat.records.csv_log import read_lines
from optsat.records.csv_table import Table, read_table
from optsat.records.csv_writer import toml_text, write_columns
from optsat.records.record import BadRow
from optsat.records.telemetry import CHANNELS, Telemetry

_FIELDS = {
    "command": "command_torque_B",
    "gyro": "gyro_omega_BN_B",
    "star": "star_q_BN",
    "gps": "gps_r_N",
    "accelerometer": "accelerometer",
    "skewed_gyro": "skewed_gyro_rate",
    "pressure": "pressure_torque_B",
}
"""The array of `Telemetry` that each device of the log fills."""


@explain_unknown_options
def read_telemetry(path: str | os.PathLike[str], strict: bool = False) -> Telemetry:
    """Return the telemetry of a log in SI, refused cells and rows listed in `bad_rows`.

    Raises
    ------
    RecordError : no such file, a fault of the head, no commands, no usable row; with `strict`, the first bad row.
    """
    file = os.fspath(path)
    lines, terminated = read_lines(file)
    layout = parse_layout(file, lines)
    if "command" not in layout.devices:
        cure = "add command.x [N m], command.y [N m], command.z [N m], with zeros where no thrusters are used"
        raise RecordError(f"the log has no commands; {cure}.", file=file, line=layout.header_line, column="command.x")
    if layout.gyro is not None and not np.array_equal(layout.gyro.mounting.dcm_SB, np.eye(3)):
        raise RecordError(
            "the gyro is mounted askew to B, but its axes fail one by one; log it along B.",
            file=file,
            column="gyro",
        )
    table, bad = read_table(file, lines, layout.header_line, layout.names, layout.delimiter, terminated=terminated)
    table, t = in_time_order(Gate(file, layout.names, table, bad), layout.time, layout.time_factor)
    values = _values(layout, table)
    used = sorted(column for columns, _ in _devices(layout).values() for column in columns)
    for row, column in np.argwhere(table.broken[:, used]):
        text = table.texts[row][used[column]].strip()
        reason = f"{text!r} is not a finite number"
        bad.append(BadRow(file, int(table.lines[row]), layout.names[used[column]], reason))
    bad.sort(key=lambda each: each.line)
    if bad and (strict or not len(t)):
        prefix = "" if strict else "no row can be used; the first reason: "
        raise RecordError(f"{prefix}{bad[0].reason}.", file=file, line=bad[0].line, column=bad[0].column)
    if not len(t):
        raise RecordError("there are no data rows below the header.", file=file, line=layout.header_line)
    values["command_torque_B"] = _held(file, table, values["command_torque_B"])
    metadata = layout.metadata
    return Telemetry(
        t,
        **values,
        epoch=metadata.epoch,
        source=file if metadata.source is None else metadata.source,
        bad_rows=tuple(bad),
    )


@explain_unknown_options
def write_telemetry(path: str | os.PathLike[str], telemetry: Telemetry) -> None:
    """Write telemetry in SI with 17 digits, so that reading gives the same numbers bit for bit.

    The file appears complete or not at all. Readings that are not finite become empty cells; `telemetry.bad_rows` are
    faults of another file and are not written.

    Raises
    ------
    OSError : the folder is missing or cannot be written.
    """
    columns = {"t [s]": telemetry.t}
    for device, field in _FIELDS.items():
        values = getattr(telemetry, field)
        if values is not None:
            parts, unit = _parts(device), CHANNELS[field][1]
            grid = values.reshape(len(telemetry), -1)
            columns |= {f"{device}.{part} [{unit}]": grid[:, i] for i, part in enumerate(parts)}
    metadata = [] if telemetry.epoch is None else [f"epoch = {toml_text(telemetry.epoch)}"]
    write_columns(path, MAGIC, [*metadata, f"source = {toml_text(telemetry.source)}"], columns)


def _parts(device: str) -> tuple[str, ...]:
    return DEVICES[device][0] if device in DEVICES else ("x", "y", "z")


def _devices(layout: Layout) -> dict[str, tuple[list[int], float]]:
    gyro = {} if layout.gyro is None else {"gyro": (layout.gyro.measured, layout.gyro.factor)}
    return {**layout.devices, **gyro}


def _values(layout: Layout, table: Table) -> dict[str, Array]:
    """Return the readings of each device in SI; NaN where a cell is empty or broken."""
    found = {}
    for device, (columns, factor) in _devices(layout).items():
        values = table.values[:, columns] * factor
        found[_FIELDS[device]] = values[:, 0] if len(columns) == 1 else values
    return found


def _held(file: str, table: Table, commands: Array) -> Array:
    """Return the commands (T, 3), each held until the next complete one."""
    given = np.asarray(np.isfinite(commands).all(axis=1))
    if not given[0]:
        raise RecordError(
            "the first row has no complete command; write zeros where the thrusters are off.",
            file=file,
            line=int(table.lines[0]),
            column="command.x",
        )
    return np.asarray(commands[np.maximum.accumulate(np.where(given, np.arange(len(given)), 0))])
