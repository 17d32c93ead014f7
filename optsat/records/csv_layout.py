"""The head of a CSV log: the first line, the metadata and the header row, checked before any number is read."""

import csv
import re
from dataclasses import dataclass

from optsat.errors import InputError, RecordError, nearest_name
from optsat.records.csv_metadata import Metadata, Mounting, parse_metadata
from optsat.records.record import RESERVED
from optsat.units import Kind, kind_of, si_factor

MAGIC = "# optsat-log 1"
VECTOR_KINDS: tuple[Kind, ...] = ("direction", "flux_density", "acceleration", "length")

_HEADING = re.compile(r"(?P<name>[^\[\]]+?)\s*\[(?P<unit>[^\[\]]*)\]")
_VECTOR_PART = re.compile(r"(?P<vector>[A-Za-z][A-Za-z0-9_-]*)\.(?:(?:measured|reference)\.[xyz]|bound)")
_GYRO = ["gyro.x", "gyro.y", "gyro.z"]
DEVICES: dict[str, tuple[tuple[str, ...], Kind]] = {
    "command": (("x", "y", "z"), "torque"),
    "star": (("x", "y", "z", "w"), "direction"),
    "gps": (("x", "y", "z"), "length"),
    "accelerometer": (("x", "y", "z"), "acceleration"),
    "skewed_gyro": (("rate",), "rate"),
    "pressure": (("x", "y", "z"), "torque"),
}
"""Of each device of telemetry but the gyro: its columns, and what they measure."""
_TRUTH = ["truth.x", "truth.y", "truth.z", "truth.w"]


@dataclass(frozen=True)
class SensorLayout:
    """The columns of one sensor, by number, and the factors to SI.

    bound : None when the bound is `mounting.bound` for every sample (or, for a gyro, not given at all)
    """

    name: str
    mounting: Mounting
    measured: list[int]
    reference: list[int]
    bound: int | None
    factor: float
    bound_factor: float

    @property
    def columns(self) -> list[int]:
        """Every column of the sensor."""
        return self.measured + self.reference + ([] if self.bound is None else [self.bound])


@dataclass(frozen=True)
class Layout:
    """Where everything stands in a log.

    devices : of each device of telemetry in the log, its columns and their factor to SI
    """

    metadata: Metadata
    header_line: int
    delimiter: str
    names: list[str]
    time: int
    time_factor: float
    vectors: list[SensorLayout]
    gyro: SensorLayout | None
    truth: list[int]
    devices: dict[str, tuple[list[int], float]]


def parse_layout(file: str, lines: list[str]) -> Layout:
    """Read first line, metadata and header row.

    Raises
    ------
    RecordError : any of them is not as the format wants it; line, column and cure are named.
    """
    if not lines or lines[0].strip() != MAGIC:
        found = lines[0].strip()[:40] if lines else ""
        raise RecordError(
            f"the first line must be `{MAGIC}`, found {found!r}; write that line first.", file=file, line=1
        )
    header = next((i for i, text in enumerate(lines) if text.strip() and not text.startswith("#")), None)
    if header is None:
        raise RecordError("there is no header row such as `t [s],sun.measured.x [-],...`.", file=file, line=len(lines))
    metadata = parse_metadata(file, lines[1:header])
    return _HeaderReader(file, header + 1, metadata).read(lines[header])


class _HeaderReader:
    def __init__(self, file: str, line: int, metadata: Metadata) -> None:
        self.file, self.line, self.metadata = file, line, metadata
        self.units: dict[str, str] = {}
        self.numbers: dict[str, int] = {}

    def read(self, text: str) -> Layout:
        delimiter = ";" if ";" in text and "," not in text else ","
        try:
            headings = next(csv.reader([text], delimiter=delimiter))
        except csv.Error as error:
            raise RecordError(
                f"the header cannot be split into cells: {error}.", file=self.file, line=self.line
            ) from None
        for heading in headings:
            self.add(heading.strip())
        vectors = self.check_names()
        if "t" not in self.numbers:
            raise self.fail("the column is missing; add `t [s]`, the time of each row.", "t")
        return Layout(
            metadata=self.metadata,
            header_line=self.line,
            delimiter=delimiter,
            names=list(self.numbers),
            time=self.numbers["t"],
            time_factor=self.factor("t", "time"),
            vectors=[self.vector(name) for name in vectors],
            gyro=self.gyro(),
            truth=self.truth(),
            devices=self.devices(),
        )

    def fail(self, message: str, column: str) -> RecordError:
        return RecordError(message, file=self.file, line=self.line, column=column)

    def add(self, heading: str) -> None:
        found = _HEADING.fullmatch(heading)
        unit = found["unit"].strip() if found else ""
        if found is None or not unit:
            cure = "every column is `name [unit]`; a bare number has the unit [-]"
            raise self.fail(f"the heading {heading[:60]!r} has no unit: {cure}.", heading[:60])
        name = found["name"]
        if name in self.units:
            raise self.fail("the column stands twice in the header; keep one.", name)
        self.numbers[name] = len(self.numbers)
        self.units[name] = unit

    def check_names(self) -> list[str]:
        """Return the vectors in their order; refuse every other unknown name with the nearest known one."""
        parts = {name: _VECTOR_PART.fullmatch(name) for name in self.numbers if name.split(".")[0] not in RESERVED}
        vectors = list(dict.fromkeys(part["vector"] for part in parts.values() if part))
        known = ["t", *_GYRO, "gyro.bound", *_TRUTH]
        known += [f"{device}.{part}" for device, (parts, _) in DEVICES.items() for part in parts]
        for vector in vectors or ["NAME"]:
            known += [f"{vector}.{side}.{axis}" for side in ("measured", "reference") for axis in "xyz"]
            known.append(f"{vector}.bound")
        for name in self.numbers:
            if name not in known:
                raise self.fail(f"the column is unknown.{nearest_name(name, known)}", name)
        for name in self.metadata.vectors:
            if name not in vectors:
                near = nearest_name(name, vectors) if vectors else ""
                raise self.fail(f"the metadata describe [vectors.{name}], but no column belongs to it.{near}", name)
        return vectors

    def factor(self, name: str, kind: Kind) -> float:
        try:
            return si_factor(self.units[name], kind, name)
        except InputError as error:
            raise self.fail(str(error), name) from None

    def group(self, names: list[str], kinds: tuple[Kind, ...]) -> tuple[list[int], float]:
        """Return the column numbers of one vector and its factor to SI; all components share one unit."""
        for name in names:
            if name not in self.numbers:
                raise self.fail(f"the column is missing; {', '.join(names)} belong together.", name)
            if self.units[name] != self.units[names[0]]:
                first = f"{names[0]} is in [{self.units[names[0]]}]"
                raise self.fail(f"{name} is in [{self.units[name]}], but {first}; one vector has one unit.", name)
        try:
            kind = kind_of(self.units[names[0]], kinds, names[0])
        except InputError as error:
            raise self.fail(str(error), names[0]) from None
        return [self.numbers[name] for name in names], self.factor(names[0], kind)

    def bound(self, name: str, kind: Kind, mounting: Mounting) -> tuple[int | None, float]:
        if name not in self.numbers:
            return None, 1.0
        if mounting.bound is not None:
            raise self.fail("the bound is given twice, in the metadata and as a column; keep one.", name)
        return self.numbers[name], self.factor(name, kind)

    def vector(self, name: str) -> SensorLayout:
        mounting = self.metadata.vectors.get(name, Mounting())
        measured, _ = self.group([f"{name}.measured.{axis}" for axis in "xyz"], VECTOR_KINDS)
        reference, _ = self.group([f"{name}.reference.{axis}" for axis in "xyz"], VECTOR_KINDS)
        bound, bound_factor = self.bound(f"{name}.bound", "angle", mounting)
        if bound is None and mounting.bound is None:
            cure = f"add the column, or `bound_deg` under [vectors.{name}]"
            raise self.fail(f"the bound of {name} is missing; {cure}.", f"{name}.bound")
        return SensorLayout(name, mounting, measured, reference, bound, 1.0, bound_factor)

    def gyro(self) -> SensorLayout | None:
        if not any(name.startswith("gyro.") for name in self.numbers):
            if self.metadata.gyro is not None:
                raise self.fail(
                    "the metadata describe [gyro], but there are no columns gyro.x, gyro.y, gyro.z.", "gyro.x"
                )
            return None
        mounting = self.metadata.gyro or Mounting()
        measured, factor = self.group(_GYRO, ("rate",))
        bound, bound_factor = self.bound("gyro.bound", "rate", mounting)
        return SensorLayout("gyro", mounting, measured, [], bound, factor, bound_factor)

    def truth(self) -> list[int]:
        if not any(name.startswith("truth.") for name in self.numbers):
            return []
        return self.group(_TRUTH, ("direction",))[0]

    def devices(self) -> dict[str, tuple[list[int], float]]:
        found = {}
        for device, (parts, kind) in DEVICES.items():
            names = [f"{device}.{part}" for part in parts]
            if any(name in self.numbers for name in names):
                found[device] = self.group(names, (kind,))
        return found
