"""Diagnosis file: a diagnosis scenario as a TOML text with the unit in every name; `diagnosis_example()` shows all."""

import math
import os
from importlib import resources
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from optsat.errors import InputError
from optsat.models.accelerometer import Accelerometer, Axes, Sensed
from optsat.models.additive_sensors import PositionReceiver, PressureSensor, RateGyro, SkewedGyro
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.parts import Part
from optsat.models.schedule import Schedule
from optsat.models.spacecraft import SEED_GRAVITATIONAL_PARAMETER, Spacecraft
from optsat.models.star_tracker import StarTracker
from optsat.models.thrusters import ThrusterPairs
from optsat.simulation.diagnosis_scenario import AttitudeTruth, DiagnosisScenario, OrbitTruth, Sampling
from optsat.simulation.scenario_file import read_text, validated

_SENSORS = ("gyro", "star", "gps", "accelerometer", "skewed_gyro", "pressure")
_KINDS: dict[str, SensorFaultKind | ThrusterFaultKind] = {
    kind.value: kind for kinds in (SensorFaultKind, ThrusterFaultKind) for kind in kinds
}

_ENTRIES = {
    "q_BN": "motion.q_BN",
    "omega_BN_B": "motion.omega_BN_B_rad_s",
    "r_N": "motion.r_N_m",
    "v_N": "motion.v_N_m_s",
    "specific_force_B": "forces.acceleration_m_s2",
    "command_torque_B": "commands.torque_N_m",
    "inertia_B": "body.inertia_kg_m2",
    "greatest_torque": "greatest_torque_N_m",
    "axis_B": "axis",
    "orbit": "motion.orbit",
}
"""What the file calls the arguments that a scenario refuses."""

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Four = Annotated[list[float], Field(min_length=4, max_length=4)]


def _listed(value: object) -> object:
    """Return a number as a list of one, anything else as it is."""
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class _Motion(_Table):
    q_BN: Four = [0.0, 0.0, 0.0, 1.0]
    omega_BN_B_rad_s: Vector = [0.05, 0.06, 0.02]
    r_N_m: Vector = [6.58e6, 0.9327e6, 1.3321e6]
    v_N_m_s: Vector = [-1800.0, 4300.0, 6100.0]
    orbit: Literal["two_body", "oblate", "nine_state"] = "two_body"
    attitude: Literal["runge_kutta", "euler"] = "runge_kutta"
    rate_noise_rad_s: float = Field(default=1e-3, ge=0)
    acceleration_noise_m_s2: float = Field(default=1e-2, ge=0)
    disturbance_torque_N_m: Vector = [0.0, 0.0, 0.0]
    gravitational_parameter_m3_s2: float = Field(default=SEED_GRAVITATIONAL_PARAMETER, gt=0)


class _Body(_Table):
    inertia_kg_m2: list[list[float]] = [[300.0, 0.0, 0.0], [0.0, 280.0, 0.0], [0.0, 0.0, 350.0]]


class _Thrusters(_Table):
    force_N: float = Field(default=5.0, gt=0)
    arm_m: float = Field(default=0.5, gt=0)
    greatest_torque_N_m: float = Field(default=12.0, gt=0)
    signed: bool = False


class _Commands(_Table):
    start_s: list[float] = [0.0]
    torque_N_m: list[Vector] = [[0.0, 0.0, 5.0]]
    period_s: float | None = Field(default=None, gt=0)


class _Forces(_Table):
    start_s: list[float] = []
    acceleration_m_s2: list[Vector] = []
    period_s: float | None = Field(default=None, gt=0)


class _Sensor(_Table):
    present: bool = True
    every: int = Field(default=1, ge=1)
    dropout: float = Field(default=0.0, ge=0, le=1)


class _Gyro(_Sensor):
    sigma_rad_s: float = Field(default=0.01, gt=0)
    bias_rad_s: Vector = [0.0, 0.0, 0.0]
    bias_walk_rad_s: float = Field(default=0.0, ge=0)

    def sensor(self) -> RateGyro:
        x, y, z = self.bias_rad_s
        return RateGyro(self.sigma_rad_s**2 * np.eye(3), (x, y, z), self.bias_walk_rad_s)


class _Star(_Sensor):
    variance: Four = [2.29e-7, 1.95e-7, 3.85e-7, 1.98e-7]

    def sensor(self) -> StarTracker:
        if min(self.variance) <= 0:
            raise InputError(f"`variance` must be > 0 in all components, got {self.variance}.")
        return StarTracker(np.diag(self.variance))


class _Gps(_Sensor):
    sigma_m: float = Field(default=10.0, gt=0)

    def sensor(self) -> PositionReceiver:
        return PositionReceiver(self.sigma_m**2 * np.eye(3))


class _Accelerometer(_Sensor):
    sigma_m_s2: float = Field(default=math.sqrt(1e-3), gt=0)
    sensed: Literal["total", "specific_force"] = "total"
    axes: Literal["inertial", "body"] = "inertial"

    def sensor(self) -> Accelerometer:
        return Accelerometer(self.sigma_m_s2**2 * np.eye(3), Sensed(self.sensed), Axes(self.axes))


class _SkewedGyro(_Sensor):
    present: bool = False
    axis: Vector = [1.0, 1.0, 1.0]
    sigma_rad_s: float = Field(default=0.01, gt=0)

    def sensor(self) -> SkewedGyro:
        x, y, z = self.axis
        return SkewedGyro((x, y, z), self.sigma_rad_s)


class _Pressure(_Sensor):
    present: bool = False
    sigma_N_m: float = Field(default=0.5, gt=0)

    def sensor(self) -> PressureSensor:
        return PressureSensor(self.sigma_N_m)


class _Fault(_Table):
    part: Literal[tuple(part.value for part in Part)]  # type: ignore[valid-type]
    kind: Literal[tuple(_KINDS)]  # type: ignore[valid-type]
    start_s: float
    stop_s: float | None = None
    value: Annotated[list[float], BeforeValidator(_listed)] = []

    def fault(self) -> Fault:
        stop_s = math.inf if self.stop_s is None else self.stop_s
        return Fault(Part(self.part), _KINDS[self.kind], self.start_s, stop_s, tuple(self.value))


class _Scenario(_Table):
    kind: Literal["diagnosis"]
    name: str = "S0"
    duration_s: float = Field(default=60.0, ge=0, le=1e7)
    dt_s: float = Field(default=0.1, gt=0, le=3600)
    time_jitter_s: float = Field(default=0.0, ge=0)
    gaps_s: list[Annotated[list[float], Field(min_length=2, max_length=2)]] = []
    motion: _Motion = _Motion()
    body: _Body = _Body()
    thrusters: _Thrusters = _Thrusters()
    commands: _Commands = _Commands()
    forces: _Forces = _Forces()
    gyro: _Gyro = _Gyro()
    star: _Star = _Star()
    gps: _Gps = _Gps()
    accelerometer: _Accelerometer = _Accelerometer()
    skewed_gyro: _SkewedGyro = _SkewedGyro()
    pressure: _Pressure = _Pressure()
    faults: list[_Fault] = []

    def scenario(self) -> DiagnosisScenario:
        motion, commands, forces = self.motion, self.commands, self.forces
        sensors = {name: getattr(self, name) for name in _SENSORS}
        return DiagnosisScenario(
            name=self.name,
            spacecraft=self.spacecraft(),
            duration=self.duration_s,
            dt=self.dt_s,
            q_BN=tuple(motion.q_BN),
            omega_BN_B=tuple(motion.omega_BN_B_rad_s),
            r_N=tuple(motion.r_N_m),
            v_N=tuple(motion.v_N_m_s),
            orbit=OrbitTruth(motion.orbit),
            attitude=AttitudeTruth(motion.attitude),
            rate_variance=motion.rate_noise_rad_s**2,
            acceleration_variance=motion.acceleration_noise_m_s2**2,
            command_torque_B=_schedule("commands", commands.start_s, commands.torque_N_m, commands.period_s),
            specific_force_B=_schedule("forces", forces.start_s, forces.acceleration_m_s2, forces.period_s),
            disturbance_torque_B=tuple(motion.disturbance_torque_N_m),
            faults=tuple(_placed(f"faults[{i}]", fault.fault) for i, fault in enumerate(self.faults)),
            sampling={
                name: Sampling(sensor.every, sensor.dropout) for name, sensor in sensors.items() if sensor.present
            },
            time_jitter_s=self.time_jitter_s,
            gaps_s=tuple((start, stop) for start, stop in self.gaps_s),
        )

    def spacecraft(self) -> Spacecraft:
        thrusters = self.thrusters
        fitted = {name: getattr(self, name) for name in _SENSORS}
        return Spacecraft(
            inertia_B=self.body.inertia_kg_m2,
            thrusters=_placed(
                "thrusters",
                lambda: ThrusterPairs(
                    thrusters.force_N, thrusters.arm_m, thrusters.greatest_torque_N_m, thrusters.signed
                ),
            ),
            gravitational_parameter=self.motion.gravitational_parameter_m3_s2,
            **{name: _placed(name, table.sensor) if table.present else None for name, table in fitted.items()},
        )


def diagnosis_example() -> str:
    """Return the scenario S1 as a complete file with a remark at every entry."""
    return resources.files("optsat.simulation").joinpath("diagnosis_scenario.toml").read_text(encoding="utf-8")


def read_diagnosis_scenario(path: str | os.PathLike[str]) -> DiagnosisScenario:
    """Return the diagnosis scenario of a file.

    Raises
    ------
    InputError : no such file, not TOML, an unknown entry (the nearest is offered), a value outside its range.
    """
    return parse_diagnosis_scenario(read_text(path), os.fspath(path))


def parse_diagnosis_scenario(text: str, file: str = "scenario") -> DiagnosisScenario:
    """Return the diagnosis scenario of a TOML text; `file` is what messages call it.

    Raises
    ------
    InputError : as for `read_diagnosis_scenario`.
    """
    try:
        return validated(_Scenario, text, file).scenario()
    except InputError as refused:
        said = str(refused)
        for name, entry in _ENTRIES.items():
            said = said.replace(f"`{name}`", f"`{entry}`")
        raise InputError(said if said.startswith(f"{file}: ") else f"{file}: {said}") from None


def _schedule(table: str, start_s: list[float], values: list[list[float]], period_s: float | None) -> Schedule:
    schedule: Schedule = _placed(table, lambda: Schedule(start_s, values, math.inf if period_s is None else period_s))
    return schedule


def _placed(where: str, make: Any) -> Any:
    """Return what `make` makes, a refusal with the table of the file in front."""
    try:
        return make()
    except InputError as refused:
        raise InputError(f"[{where}] {refused}") from None
