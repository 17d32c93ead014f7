"""Truth file: the truth of a simulated run beside its log, in a file that no reader of logs takes.

# optsat-truth 1
# scenario = "S1"
# seed = 3
# [[faults]]
# part = "thruster.z"
# ...
t [s],attitude.x [-],attitude.y [-],attitude.z [-],attitude.w [-],rate.x [rad/s], ... ,faulty.gyro.x [-], ...
"""

import json
import math
import os
import tomllib
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError, RecordError
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.parts import Part
from optsat.records.csv_log import read_lines
from optsat.records.csv_table import read_table
from optsat.records.csv_writer import write_columns
from optsat.simulation.diagnosis_truth import DiagnosisTruth

MAGIC = "# optsat-truth 1"
_QUANTITIES = {
    "attitude": ("q_BN", "xyzw", "-"),
    "rate": ("omega_BN_B", "xyz", "rad/s"),
    "position": ("r_N", "xyz", "m"),
    "velocity": ("v_N", "xyz", "m/s"),
    "acceleration": ("acceleration_N", "xyz", "m/s^2"),
    "torque": ("torque_B", "xyz", "N m"),
    "gyro_bias": ("gyro_bias", "xyz", "rad/s"),
}


def write_truth(path: str | os.PathLike[str], truth: DiagnosisTruth, scenario: str = "", seed: int = 0) -> None:
    """Write the truth with 17 digits; scenario, seed : where it comes from, for people.

    Raises
    ------
    OSError : the folder is missing or cannot be written.
    """
    head = [f"scenario = {json.dumps(scenario)}", f"seed = {seed}"]
    for fault in truth.faults:
        head += ["[[faults]]", f'part = "{fault.part.value}"', f'kind = "{fault.kind.value}"']
        head += [f"start_s = {float(fault.start_s)!r}", f"value = {list(fault.value)}"]
        head += [] if math.isinf(fault.stop_s) else [f"stop_s = {float(fault.stop_s)!r}"]
    columns: dict[str, Array] = {"t [s]": truth.t}
    for name, (field, parts, unit) in _QUANTITIES.items():
        columns |= {f"{name}.{part} [{unit}]": getattr(truth, field)[:, i] for i, part in enumerate(parts)}
    columns |= {f"faulty.{part.value} [-]": truth.faulty[:, i].astype(float) for i, part in enumerate(truth.parts)}
    write_columns(path, MAGIC, head, columns)


def read_truth(path: str | os.PathLike[str]) -> DiagnosisTruth:
    """Return the truth in a file, the same numbers as were written.

    Raises
    ------
    RecordError : no such file, or not one that `write_truth` wrote.
    """
    file = os.fspath(path)
    lines, terminated = read_lines(file)
    if not lines or lines[0] != MAGIC:
        raise RecordError(f"the first line of a truth file is `{MAGIC}`; is this a log?", file=file, line=1)
    header = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines) - 1)
    names = lines[header].split(",")
    parts = _parts(file, header, names)
    try:
        head = tomllib.loads("\n".join(line.removeprefix("#") for line in lines[1:header]))
        faults = tuple(_fault(entry) for entry in head["faults"]) if "faults" in head else ()
    except (tomllib.TOMLDecodeError, KeyError, TypeError, InputError, ValueError) as error:
        raise RecordError(f"the head cannot be read: {error}.", file=file, line=2) from None
    table, bad = read_table(file, lines, header + 1, names, ",", terminated=terminated)
    if bad:
        raise RecordError(f"{bad[0].reason}.", file=file, line=bad[0].line)
    unsound = np.argwhere(table.empty | table.broken)
    if len(unsound) or not len(table.lines):
        row, column = unsound[0] if len(unsound) else (0, 0)
        line = int(table.lines[row]) if len(table.lines) else header + 1
        raise RecordError("there is no number where there must be one.", file=file, line=line, column=names[column])
    values, first = table.values, 1
    found: dict[str, Any] = {"t": values[:, 0]}
    for field, letters, _ in _QUANTITIES.values():
        found[field] = np.ascontiguousarray(values[:, first : first + len(letters)])
        first += len(letters)
    return DiagnosisTruth(**found, parts=parts, faulty=values[:, first:] != 0.0, faults=faults)


def _parts(file: str, header: int, names: list[str]) -> tuple[Part, ...]:
    wanted = ["t [s]", *(f"{n}.{part} [{unit}]" for n, (_, parts, unit) in _QUANTITIES.items() for part in parts)]
    known = {f"faulty.{part.value} [-]": part for part in Part}
    rest = names[len(wanted) :]
    wrong = [got for got, want in zip(names, wanted, strict=False) if got != want]
    wrong += [name for name in rest if name not in known]
    if len(names) < len(wanted) or wrong:
        found = wrong[0] if wrong else f"{len(names)} columns"
        raise RecordError(f"these are not the columns of a truth file: {found}.", file=file, line=header + 1)
    return tuple(known[name] for name in rest)


def _fault(entry: dict[str, Any]) -> Fault:
    part = Part(entry["part"])
    kinds = ThrusterFaultKind if part.is_thruster else SensorFaultKind
    stop_s = float(entry.get("stop_s", math.inf))
    return Fault(part, kinds(entry["kind"]), float(entry["start_s"]), stop_s, tuple(entry["value"]))
