"""Scenario file: an orbit scenario as a TOML text with the unit in every name; `example_text()` shows all of it."""

import datetime
import math
import os
import tomllib
from enum import Enum
from importlib import resources
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from optsat.errors import InputError, nearest_name
from optsat.models.draws import ConeLaw
from optsat.models.epoch import Epoch
from optsat.simulation.orbit_scenario import GyroError, OrbitScenario, Rate
from optsat.simulation.sensor_fault import FaultKind, SensorFault
from optsat.simulation.validation_messages import sentences

Table = TypeVar("Table", bound=BaseModel)


class ScenarioKind(Enum):
    """What a scenario file may describe."""

    ORBIT = "orbit"
    DIAGNOSIS = "diagnosis"


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class _Orbit(_Table):
    altitude_km: float = Field(default=800.0, ge=100, le=100_000)
    inclination_deg: float = Field(default=75.0, ge=0, le=180)
    raan_deg: float = Field(default=0.0, ge=-360, le=360)
    argument_of_latitude_deg: float = Field(default=0.0, ge=-360, le=360)


class _Body(_Table):
    inertia_kg_m2: list[list[float]] = Field(default=[[80.0, 0.0, 0.0], [0.0, 80.0, 0.0], [0.0, 0.0, 4.0]])
    yaw_deg: float = Field(default=5.0, ge=-360, le=360)
    pitch_deg: float = Field(default=0.0, ge=-90, le=90)
    roll_deg: float = Field(default=0.0, ge=-360, le=360)
    rate: Rate = "lvlh"


class _Sun(_Table):
    bound_deg: float = Field(default=0.005, ge=0, lt=180)
    eclipse: bool = False


class _Magnetometer(_Table):
    bound_deg: float = Field(default=0.5, ge=0, lt=180)


class _Gyro(_Table):
    bound_deg_s: float = Field(ge=0, le=1000)
    error: GyroError = "constant"


class _Fault(_Table):
    channel: Literal["sun", "magnetometer"]
    kind: FaultKind = "offset"
    start_s: float
    stop_s: float
    angle_deg: float = Field(default=0.0, ge=0, le=180)

    def fault(self) -> SensorFault:
        return SensorFault(self.channel, self.start_s, self.stop_s, self.kind, math.radians(self.angle_deg))


class _Scenario(_Table):
    kind: Literal["orbit"] = "orbit"
    epoch: str | datetime.datetime = "2021-03-20T12:00:00Z"
    duration_s: float = Field(default=1200.0, ge=0, le=1e7)
    dt_s: float = Field(default=1.0, gt=0, le=3600)
    noise: ConeLaw = "cap"
    orbit: _Orbit = _Orbit()
    body: _Body = _Body()
    sun: _Sun = _Sun()
    magnetometer: _Magnetometer = _Magnetometer()
    gyro: _Gyro | None = None
    faults: list[_Fault] = Field(default=[])

    def scenario(self) -> OrbitScenario:
        orbit, body = self.orbit, self.body
        return OrbitScenario(
            altitude=1e3 * orbit.altitude_km,
            inclination=math.radians(orbit.inclination_deg),
            raan=math.radians(orbit.raan_deg),
            argument_of_latitude=math.radians(orbit.argument_of_latitude_deg),
            epoch=Epoch.from_utc(self.epoch if isinstance(self.epoch, str) else self.epoch.isoformat()),
            inertia_B=tuple(tuple(row) for row in body.inertia_kg_m2),
            yaw_pitch_roll=(math.radians(body.yaw_deg), math.radians(body.pitch_deg), math.radians(body.roll_deg)),
            rate=body.rate,
            duration=self.duration_s,
            dt=self.dt_s,
            sun_bound_rad=math.radians(self.sun.bound_deg),
            magnetometer_bound_rad=math.radians(self.magnetometer.bound_deg),
            noise=self.noise,
            eclipse=self.sun.eclipse,
            gyro_bound_rad_s=math.radians(self.gyro.bound_deg_s) if self.gyro else None,
            gyro_error=self.gyro.error if self.gyro else "constant",
            faults=tuple(fault.fault() for fault in self.faults),
        )


def example_text() -> str:
    """Return a complete scenario file with a remark at every entry."""
    return resources.files("optsat.simulation").joinpath("example_scenario.toml").read_text(encoding="utf-8")


def read_scenario(path: str | os.PathLike[str]) -> OrbitScenario:
    """Return the scenario of a file.

    Raises
    ------
    InputError : no such file, not TOML, an unknown entry (the nearest is offered), a value outside its range.
    """
    return parse_scenario(read_text(path), os.fspath(path))


def read_text(path: str | os.PathLike[str]) -> str:
    """Return the text of a scenario file.

    Raises
    ------
    InputError : no such file, not UTF-8.
    """
    file = os.fspath(path)
    try:
        with open(file, encoding="utf-8-sig") as stream:
            return stream.read()
    except OSError as error:
        raise InputError(f"{file}: the scenario cannot be opened: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"{file}: this is not text; save the scenario as UTF-8.") from None


def parse_scenario(text: str, file: str = "scenario") -> OrbitScenario:
    """Return the scenario of a TOML text; `file` is what messages call it.

    Raises
    ------
    InputError : as for `read_scenario`.
    """
    content = validated(_Scenario, text, file)
    try:
        return content.scenario()
    except InputError as refused:
        raise InputError(f"{file}: {refused}") from None


def kind_of_scenario(text: str, file: str = "scenario") -> ScenarioKind:
    """Return what kind of scenario a TOML text is; one that does not say is an orbit scenario.

    Raises
    ------
    InputError : not TOML, or an unknown kind.
    """
    kind = _toml(text, file).get("kind", ScenarioKind.ORBIT.value)
    known = [each.value for each in ScenarioKind]
    if kind not in known:
        raise InputError(f"{file}: `kind` is {kind!r}.{nearest_name(str(kind), known)}")
    return ScenarioKind(kind)


def validated(model: type[Table], text: str, file: str) -> Table:
    """Return the entries of a TOML text as its model has them; `file` is what messages call it.

    Raises
    ------
    InputError : not TOML, or entries that do not fit the model, one line for each.
    """
    try:
        return model.model_validate(_toml(text, file))
    except ValidationError as refused:
        raise InputError("\n".join(f"{file}: {fault}" for fault in sentences(model, refused))) from None


def _toml(text: str, file: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{file}: this is not TOML: {error}.") from None
