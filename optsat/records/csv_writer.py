"""Writes a record as a CSV log that reads back to the same numbers."""

import csv
import io
import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.errors import explain_unknown_options
from optsat.files import write_atomically
from optsat.records.csv_layout import MAGIC
from optsat.records.record import Record, VectorChannel


@explain_unknown_options
def write_csv_log(path: str | os.PathLike[str], record: Record, frames: Mapping[str, ArrayLike] | None = None) -> None:
    """Write `record` in SI with 17 digits, so that reading gives the same numbers bit for bit.

    The file appears complete or not at all. `record.bad_rows` are faults of another file and are not written.

    frames : sensor frames, name to dcm_SB (3, 3). A channel whose frame is among them is written in that frame
    (and reads back to rounding); every other one is written in B, in which the record holds it.

    Raises
    ------
    InputError : a matrix of `frames` is not (3, 3) and finite.
    OSError : the folder is missing or cannot be written.
    """
    rotations = {name: finite_array(f"frames[{name!r}]", dcm, (3, 3)) for name, dcm in (frames or {}).items()}
    write_columns(path, MAGIC, _metadata(record, rotations), _columns(record, rotations))


def write_columns(
    path: str | os.PathLike[str], first_line: str, metadata: Sequence[str], columns: Mapping[str, Array]
) -> None:
    """Write columns (T,) by their headings below a first line and TOML lines; what is not finite is an empty cell.

    Raises
    ------
    OSError : the folder is missing or cannot be written.
    """
    text = io.StringIO()
    text.write(f"{first_line}\n")
    text.writelines(f"# {line}\n" for line in metadata)
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(columns)
    rows.writerows(zip(*(map(_cell, values.tolist()) for values in columns.values()), strict=True))
    write_atomically(Path(path), text.getvalue().encode())


def _metadata(record: Record, rotations: Mapping[str, Array]) -> list[str]:
    used = {channel.frame for channel in record.channels}
    lines = [f"epoch = {toml_text(record.epoch)}"] if record.epoch is not None else []
    lines += [f"source = {toml_text(record.source)}"]
    for name, dcm_SB in rotations.items():
        if name in used:
            lines += [f"[frames.{name}]", f"dcm_SB = {dcm_SB.tolist()}"]
    for channel in record.channels:
        if channel.frame in rotations:
            lines += [f"[vectors.{channel.name}]", f"frame = {toml_text(channel.frame)}"]
    return lines


def toml_text(text: str) -> str:
    """Return a text as TOML writes it."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _columns(record: Record, rotations: Mapping[str, Array]) -> dict[str, Array]:
    columns = {"t [s]": record.t}
    for channel in record.channels:
        columns |= _vector_columns(channel, rotations)
    if record.omega_BN_B is not None:
        columns |= {f"gyro.{axis} [rad/s]": record.omega_BN_B[:, i] for i, axis in enumerate("xyz")}
    if record.gyro_bound_rad_s is not None:
        columns["gyro.bound [rad/s]"] = record.gyro_bound_rad_s
    if record.q_BN_true is not None:
        columns |= {f"truth.{axis} [-]": record.q_BN_true[:, i] for i, axis in enumerate("xyzw")}
    return columns


def _vector_columns(channel: VectorChannel, rotations: Mapping[str, Array]) -> dict[str, Array]:
    measured = channel.b_B
    if channel.frame in rotations:
        measured = measured @ rotations[channel.frame].T
    columns = {f"{channel.name}.measured.{axis} [-]": measured[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"{channel.name}.reference.{axis} [-]": channel.r_N[:, i] for i, axis in enumerate("xyz")}
    return columns | {f"{channel.name}.bound [rad]": channel.angle_bound_rad}


def _cell(value: float) -> str:
    return repr(value) if math.isfinite(value) else ""
