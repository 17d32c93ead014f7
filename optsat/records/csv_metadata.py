"""The `# ` lines of a CSV log: TOML that names frames, bounds given once, and the epoch."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Any

import numpy as np

from optsat.arrays import Array, finite_array, unit_quaternion
from optsat.errors import InputError, RecordError, nearest_name
from optsat.records.record import WORD

BODY = "B"
_DCM_TOLERANCE = 1e-6
_TOP_KEYS = ["epoch", "source", "frames", "vectors", "gyro"]


@dataclass(frozen=True)
class Mounting:
    """Where a sensor sits and how good it is: its frame, the matrix from B to it, and a bound given once (SI)."""

    frame: str = BODY
    dcm_SB: Array = field(default_factory=lambda: np.eye(3))
    bound: float | None = None


@dataclass(frozen=True)
class Metadata:
    """What the metadata lines say, checked."""

    epoch: str | None
    source: str | None
    vectors: Mapping[str, Mounting]
    gyro: Mounting | None


def parse_metadata(file: str, lines: list[str]) -> Metadata:
    """Read the metadata from the comment lines that follow line 1.

    Raises
    ------
    RecordError : not TOML, an unknown key or frame, a matrix that is not a rotation, a bound that cannot be one.
    """
    return _MetadataReader(file, lines).read()


class _MetadataReader:
    def __init__(self, file: str, lines: list[str]) -> None:
        self.file, self.lines = file, lines

    def read(self) -> Metadata:
        try:
            table = tomllib.loads("\n".join(line.removeprefix("#") for line in self.lines))
        except tomllib.TOMLDecodeError as error:
            found = re.search(r"at line (\d+)", str(error))
            line = 1 + int(found.group(1)) if found else 1 + len(self.lines)
            cure = "metadata lines are TOML; start a remark with '##'"
            raise RecordError(f"the metadata cannot be read: {error}; {cure}.", file=self.file, line=line) from None
        self.check_keys(table, _TOP_KEYS, "the metadata")
        frames = {name: self.rotation(name, entry) for name, entry in self.tables(table, "frames").items()}
        frames = {BODY: np.eye(3), **frames}
        vectors = {
            name: self.mounting(name, entry, "bound_deg", frames)
            for name, entry in self.tables(table, "vectors").items()
        }
        gyro = (
            self.mounting("gyro", self.table(table["gyro"], "gyro"), "bound_deg_s", frames) if "gyro" in table else None
        )
        return Metadata(self.epoch(table.get("epoch")), self.text(table.get("source"), "source"), vectors, gyro)

    def fail(self, message: str, word: str) -> RecordError:
        line = next((i for i, text in enumerate(self.lines, start=2) if word in text), None)
        return RecordError(message, file=self.file, line=line, column=word)

    def check_keys(self, table: Mapping[str, Any], known: list[str], where: str) -> None:
        for key in table:
            if key not in known:
                raise self.fail(f"{where} has no entry `{key}`.{nearest_name(key, known)}", key)

    def table(self, value: object, name: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self.fail(f"`{name}` must be a table, such as [{name}] with entries on the lines below it.", name)
        return value

    def tables(self, top: Mapping[str, Any], name: str) -> dict[str, dict[str, Any]]:
        return {key: self.table(entry, f"{name}.{key}") for key, entry in self.table(top.get(name, {}), name).items()}

    def text(self, value: object, name: str) -> str | None:
        if value is not None and not isinstance(value, str):
            raise self.fail(f"`{name}` must be a text in quotes, got {value!r}.", name)
        return value

    def epoch(self, value: object) -> str | None:
        if isinstance(value, datetime | date):
            return value.isoformat()
        text = self.text(value, "epoch")
        try:
            if text is not None:
                datetime.fromisoformat(text)
        except ValueError:
            raise self.fail(
                f'`epoch` must be ISO 8601, such as "2026-03-01T12:00:00Z"; got {text!r}.', "epoch"
            ) from None
        return text

    def rotation(self, name: str, entry: Mapping[str, Any]) -> Array:
        self.check_keys(entry, ["dcm_SB", "q_SB"], f"[frames.{name}]")
        if name == BODY or not WORD.fullmatch(name):
            raise self.fail(f"[frames.{name}]: a sensor frame is a word such as S1, and not B itself.", name)
        if len(entry) != 1:
            raise self.fail(f"[frames.{name}] needs one entry, either dcm_SB or q_SB (scalar last).", name)
        try:
            if "q_SB" in entry:
                return _dcm(unit_quaternion("q_SB", entry["q_SB"]))
            dcm_SB = finite_array("dcm_SB", entry["dcm_SB"], (3, 3))
        except InputError as error:
            raise self.fail(f"[frames.{name}]: {error}", name) from None
        if np.abs(dcm_SB @ dcm_SB.T - np.eye(3)).max() > _DCM_TOLERANCE or np.linalg.det(dcm_SB) < 0:
            raise self.fail(f"[frames.{name}]: `dcm_SB` must be a rotation (orthogonal, determinant +1).", name)
        return dcm_SB

    def mounting(self, name: str, entry: Mapping[str, Any], bound_key: str, frames: Mapping[str, Array]) -> Mounting:
        self.check_keys(entry, ["frame", bound_key], f"the metadata of {name}")
        frame = self.text(entry.get("frame", BODY), "frame") or BODY
        if frame not in frames:
            cure = f"add a table [frames.{frame}] with dcm_SB."
            raise self.fail(f"{name}: unknown frame `{frame}`.{nearest_name(frame, list(frames))} Or {cure}", frame)
        bound = entry.get(bound_key)
        if bound is not None and not (_is_number(bound) and 0 <= bound < 180):
            raise self.fail(f"{name}: `{bound_key}` must be a number in [0, 180), got {bound!r}.", bound_key)
        return Mounting(frame, frames[frame], None if bound is None else float(np.deg2rad(bound)))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _dcm(q: Array) -> Array:
    """A(q) = (s^2 - v.v) I + 2 v v^T - 2 s [v x], scalar last."""
    (x, y, z), s = q[:3], q[3]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    v = q[:3]
    return np.asarray((s * s - v @ v) * np.eye(3) + 2 * np.outer(v, v) - 2 * s * cross)
