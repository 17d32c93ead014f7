"""Diagnosis scenario: a spacecraft, its true motion, what it is commanded, and which parts fail when."""

import math
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from optsat.arrays import Array, finite_array, unit_quaternion
from optsat.errors import InputError, explain_unknown_fields
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.orbit_shape import check_orbit
from optsat.models.parameters import check_scalar
from optsat.models.parts import Part
from optsat.models.schedule import Schedule, constant
from optsat.models.spacecraft import Spacecraft

_MOST_SAMPLES = 10_000_000
_DIGITS = 12  # 3 * 0.1 s is 0.3 s in a log
_NO_FORCE = Schedule((), ())


class OrbitTruth(Enum):
    """How the simulated spacecraft really moves."""

    TWO_BODY = "two_body"
    """about a point mass, integrated by Runge-Kutta"""
    OBLATE = "oblate"
    """about the oblate Earth, likewise"""
    NINE_STATE = "nine_state"
    """the paper's model with random forces, by Euler's step"""


class AttitudeTruth(Enum):
    """How the simulated attitude is integrated."""

    RUNGE_KUTTA = "runge_kutta"
    EULER = "euler"
    """the paper's"""


@dataclass(frozen=True)
class Sampling:
    """When the samples of a device arrive: one every `every` rows, of which the share `dropout` is lost at random.

    Raises
    ------
    InputError : `every` is no whole number >= 1, or `dropout` not in [0, 1].
    """

    every: int = 1
    dropout: float = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.every, bool) or not isinstance(self.every, int) or self.every < 1:
            raise InputError(f"`every` must be a whole number >= 1, got {self.every!r}.")
        check_scalar("dropout", self.dropout, "-", low=0.0, high=1.0)


@explain_unknown_fields
@dataclass(frozen=True, eq=False)
class DiagnosisScenario:
    """A run of the simulator; the defaults are scenario S0 of the paper, no fault, tumbling.

    duration, dt [s] : rows at t = 0, dt, ..., up to the duration
    q_BN (4,), omega_BN_B (3,) [rad/s], r_N (3,) [m], v_N (3,) [m/s] : at t = 0; the sign of v_N x is lost in the paper,
        and only this one gives its orbit
    orbit, attitude : the truth
    rate_variance : of what each step of dt adds to each rate at random [(rad/s)^2]; acceleration_variance likewise, of
        NINE_STATE [(m/s^2)^2]. A step of another length, through jitter, adds in proportion to it.
    command_torque_B : commanded to the thrusters [N m]; it changes at rows only
    specific_force_B : of forces other than gravity along B [m/s^2], held between rows
    disturbance_torque_B : (3,) constant, unknown to everybody on board [N m]
    faults : of parts that the spacecraft has; of several on one channel the later works on what the earlier left
    sampling : of a device (gyro, star, gps, accelerometer, skewed_gyro, pressure), every row unless said otherwise
    time_jitter_s : rows after the first are off by up to this, uniformly; less than dt / 2
    gaps_s : windows (start, stop) without rows; a command that changes in one is logged at the row after it

    Raises
    ------
    InputError : a number is out of range, a fault or sampling of a part that is not there, commands beyond the
        thrusters, an orbit that leads into the Earth.
    Source: fault-diagnosis specification, sections 1 and 7.
    """

    name: str = "S0"
    spacecraft: Spacecraft = field(default_factory=Spacecraft)
    duration: float = 60.0
    dt: float = 0.1
    q_BN: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
    omega_BN_B: tuple[float, ...] = (0.05, 0.06, 0.02)
    r_N: tuple[float, ...] = (6.58e6, 0.9327e6, 1.3321e6)
    v_N: tuple[float, ...] = (-1800.0, 4300.0, 6100.0)
    orbit: OrbitTruth = OrbitTruth.TWO_BODY
    attitude: AttitudeTruth = AttitudeTruth.RUNGE_KUTTA
    rate_variance: float = 1e-6
    acceleration_variance: float = 1e-4
    command_torque_B: Schedule = field(default_factory=lambda: constant(0.0, 0.0, 5.0))
    specific_force_B: Schedule = _NO_FORCE
    disturbance_torque_B: tuple[float, ...] = (0.0, 0.0, 0.0)
    faults: tuple[Fault, ...] = ()
    sampling: dict[str, Sampling] = field(default_factory=dict)
    time_jitter_s: float = 0.0
    gaps_s: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        check_scalar("dt", self.dt, "s", low=0.0, low_open=True)
        check_scalar("duration", self.duration, "s", low=0.0, high=self.dt * _MOST_SAMPLES)
        unit_quaternion("q_BN", self.q_BN)
        finite_array("omega_BN_B", self.omega_BN_B, (3,), "rad/s")
        finite_array("disturbance_torque_B", self.disturbance_torque_B, (3,), "N m")
        check_orbit(self.r_N, self.v_N, self.spacecraft.gravitational_parameter)
        check_scalar("rate_variance", self.rate_variance, "(rad/s)^2", low=0.0)
        check_scalar("acceleration_variance", self.acceleration_variance, "(m/s^2)^2", low=0.0)
        check_scalar("time_jitter_s", self.time_jitter_s, "s", low=0.0, high=self.dt / 2, high_open=True)
        self.spacecraft.thrusters.check_command("command_torque_B", self.command_torque_B.values)
        if self.orbit is OrbitTruth.NINE_STATE and len(self.specific_force_B.start_s):
            raise InputError("`specific_force_B` needs `orbit` two_body or oblate: the nine-state model draws its own.")
        self._check_parts()
        for start, stop in self.gaps_s:
            check_scalar("gaps_s (stop)", stop, "s", low=start, low_open=True)
            check_scalar("gaps_s (start)", start, "s", low=0.0, low_open=True)

    def _check_parts(self) -> None:
        parts = self.spacecraft.parts
        for number, fault in enumerate(self.faults):
            if fault.part not in parts:
                raise InputError(
                    f"`faults` entry {number} is of {fault.part.value}, which the spacecraft does not have. It has "
                    f"{', '.join(part.value for part in parts)}."
                )
        devices = list(dict.fromkeys(part.device for part in parts if not part.is_thruster))
        for device in self.sampling:
            if device not in devices:
                raise InputError(
                    f"`sampling` is of {device}, which is no sensor of the spacecraft. It has {', '.join(devices)}."
                )

    def grid(self) -> Array:
        """Return the times (T,) of the rows before jitter and gaps [s]."""
        count = math.floor(self.duration / self.dt * (1 + 1e-12)) + 1
        return np.asarray(np.round(self.dt * np.arange(count), _DIGITS), dtype=np.float64)


def scenario_s0(tumbling: bool = True) -> DiagnosisScenario:
    """Return S0: no fault. Not tumbling starts at rest, as a literal reading of the paper has it."""
    return DiagnosisScenario(name="S0", omega_BN_B=(0.05, 0.06, 0.02) if tumbling else (0.0, 0.0, 0.0))


def scenario_s1(tumbling: bool = True) -> DiagnosisScenario:
    """Return S1: thruster z open at 12 N m, then accelerometer axes, two gyro axes and the star tracker dead."""
    return replace(
        scenario_s0(tumbling),
        name="S1",
        faults=(
            Fault(Part.THRUSTER_Z, ThrusterFaultKind.OPEN, 30, 45),
            _dead(Part.ACCELEROMETER_X, 25, 30),
            _dead(Part.ACCELEROMETER_Y, 30, 40),
            _dead(Part.ACCELEROMETER_Z, 42, 47),
            _dead(Part.GYRO_Y, 25, 30),
            _dead(Part.GYRO_Z, 25, 30),
            _dead(Part.STAR, 20, 30),
        ),
    )


def scenario_s2(tumbling: bool = True) -> DiagnosisScenario:
    """Return S2: thruster z at 0.4 of its command while the star tracker is dead, then the GPS dead."""
    return replace(
        scenario_s0(tumbling),
        name="S2",
        faults=(
            Fault(Part.THRUSTER_Z, ThrusterFaultKind.REDUCED, 20, 30, (0.4,)),
            _dead(Part.STAR, 20, 30),
            _dead(Part.GPS, 35, 45),
        ),
    )


def _dead(part: Part, start_s: float, stop_s: float) -> Fault:
    return Fault(part, SensorFaultKind.DEAD, start_s, stop_s)
