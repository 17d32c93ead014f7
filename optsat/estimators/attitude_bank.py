"""Attitude bank: faults of gyro, star tracker and thrusters as joint hypotheses about one rigid body."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.errors import InputError
from optsat.estimators.bank_model import Fault, check_chances, checked_faults
from optsat.models.parameters import check_scalar
from optsat.models.parts import GYRO, PRESSURE, THRUSTERS, Part
from optsat.models.rigid_body import RigidBody

SEED_INERTIA = ((300.0, 0.0, 0.0), (0.0, 280.0, 0.0), (0.0, 0.0, 350.0))
"""Inertia [kg m^2] of the satellite of the fault scenarios."""

SEED_STAR = tuple(2.0 * math.sqrt(variance * 1e-7) for variance in (2.29, 1.95, 3.85))
"""Deviations [rad] of the small rotation that the star tracker of the fault scenarios errs by, about the axes of B."""

_ALL = (*GYRO, Part.STAR, *THRUSTERS)


@dataclass(frozen=True, eq=False)
class AttitudeBank:
    """Parameters of a bank over 2^n hypotheses, n the number of `faults`; frozen, checked, in SI.

    inertia_B : (3, 3) about the centre of mass [kg m^2]
    faults : parts that may fail, each by itself, or a tuple of thruster axes that fail together; by default 7 of them
    sample_time : that noises and chances per step belong to [s]
    gyro_deviation one or (3,) [rad/s], star_deviation (3,) of the small rotation in B [rad] : of the noise of a healthy
        sensor
    rate_noise : deviation of what the angular velocity changes by, unmodelled, per step [rad/s]
    torque_prior, torque_noise : deviation of a failed axis' torque from its command when it fails, and what it changes
        by per step [N m]
    sensor_chance, thruster_chance : chances per step to fail and to recover
    gyro_error [rad/s], star_error [rad] : what an erratic sensor errs by
    exactness : deviation of a dead or frozen reading as a part of that of a healthy one
    gyro_resolution : step of the gyro's numbers [rad/s]
    gyro_bias_noise : deviation of what the gyro's bias changes by per step [rad/s]; None, it has none
    skewed_gyro_axis_B : unit vector of one more gyro
    skewed_gyro_deviation : of its noise [rad/s]
    pressure_deviation : of torques measured by chamber pressure [N m]; None, they are not
    greatest_torque : of a pair of thrusters fully open, which no command exceeds [N m]
    signed : whether commands may be negative
    attitude_prior [rad], rate_prior [rad/s], bias_prior [rad/s] : deviations at the start
    fault_prior : probability of each fault at the start

    Raises
    ------
    InputError : names the field.
    Source: fault-diagnosis specification, sections 1 and 8.
    """

    inertia_B: Array | Sequence[Sequence[float]] = SEED_INERTIA
    faults: Sequence[Part | Sequence[Part]] = _ALL
    sample_time: float = 0.1
    gyro_deviation: float | Sequence[float] = 0.01
    star_deviation: Sequence[float] = SEED_STAR
    rate_noise: float = 1e-3
    torque_prior: float = 6.0
    torque_noise: float = 0.1
    sensor_chance: tuple[float, float] = (2e-4, 5e-3)
    thruster_chance: tuple[float, float] = (1e-3, 1e-2)
    gyro_error: float = 0.3
    star_error: float = 0.3
    exactness: float = 1e-3
    gyro_resolution: float = 0.0
    gyro_bias_noise: float | None = None
    skewed_gyro_axis_B: Array | Sequence[float] | None = None
    skewed_gyro_deviation: float = 0.01
    pressure_deviation: float | None = None
    greatest_torque: float = 12.0
    signed: bool = False
    attitude_prior: float = 0.01
    rate_prior: float = 0.02
    bias_prior: float = 0.01
    fault_prior: float = 1e-3
    bits: tuple[Fault, ...] = field(init=False)
    body: RigidBody = field(init=False)

    def __post_init__(self) -> None:
        for name, unit in _POSITIVE.items():
            check_scalar(name, getattr(self, name), unit, low=0.0, low_open=True)
        for name, unit in _NOT_NEGATIVE.items():
            check_scalar(name, getattr(self, name), unit, low=0.0)
        for name, unit in (("gyro_bias_noise", "rad/s"), ("pressure_deviation", "N m")):
            if getattr(self, name) is not None:
                check_scalar(name, getattr(self, name), unit, low=0.0, low_open=name == "pressure_deviation")
        check_scalar("fault_prior", self.fault_prior, "-", low=0.0, high=1.0, low_open=True, high_open=True)
        for name in ("sensor_chance", "thruster_chance"):
            check_chances(name, getattr(self, name))
        gyro = finite_array("gyro_deviation", self.gyro_deviation, unit="rad/s")
        if gyro.shape not in ((), (3,)):
            raise InputError(f"`gyro_deviation` must be one number or three [rad/s], got shape {gyro.shape}.")
        gyro = np.broadcast_to(gyro, (3,))
        star = finite_array("star_deviation", self.star_deviation, (3,), "rad")
        for name, deviation, unit in (("gyro_deviation", gyro, "rad/s"), ("star_deviation", star, "rad")):
            if deviation.min() <= 0.0:
                worst = int(deviation.argmin())
                raise InputError(f"`{name}` must be positive [{unit}]: axis {worst} is {deviation[worst]:.6g}.")
            object.__setattr__(self, name, tuple(deviation.tolist()))
        if self.skewed_gyro_axis_B is not None:
            axis = finite_array("skewed_gyro_axis_B", self.skewed_gyro_axis_B, (3,), "-")
            if abs(np.linalg.norm(axis) - 1.0) > 1e-6:
                raise InputError(f"`skewed_gyro_axis_B` must have length 1, got {np.linalg.norm(axis):.6g}.")
        object.__setattr__(self, "body", RigidBody(self.inertia_B))
        object.__setattr__(self, "bits", checked_faults(self.faults, self._known()))
        if self.pressure_deviation is not None and not self.thruster_axes:
            raise InputError("`pressure_deviation`: no thruster may fail, so a measured torque tells nothing.")

    @property
    def gyro_deviations(self) -> tuple[float, float, float]:
        """Deviation of the noise of each gyro axis [rad/s]."""
        x, y, z = np.broadcast_to(self.gyro_deviation, (3,)).tolist()
        return x, y, z

    @property
    def skewed_axis(self) -> tuple[float, ...]:
        """Axis of the skewed gyro in B, or () where there is none."""
        return () if self.skewed_gyro_axis_B is None else tuple(float(each) for each in self.skewed_gyro_axis_B)

    @property
    def thruster_axes(self) -> tuple[int, ...]:
        """Axes whose thrusters may fail; each has a torque deviation among the states."""
        return tuple(part.axis for part in THRUSTERS if part.axis is not None and self.bit_of(part) is not None)

    @property
    def channels(self) -> tuple[Part, ...]:
        """Sensor channels in the order in which they are used."""
        skewed = (Part.SKEWED_GYRO,) if self.skewed_axis else ()
        pressure = () if self.pressure_deviation is None else tuple(PRESSURE[axis] for axis in self.thruster_axes)
        return (Part.STAR, *GYRO, *skewed, *pressure)

    def bit_of(self, part: Part) -> int | None:
        """Return the bit that says whether this part has failed, or None where it never does."""
        return next((bit for bit, fault in enumerate(self.bits) if part in fault), None)

    def _known(self) -> tuple[Part, ...]:
        skewed = (Part.SKEWED_GYRO,) if self.skewed_axis else ()
        return (*_ALL, *skewed, *(() if self.pressure_deviation is None else PRESSURE))


_POSITIVE = {
    "sample_time": "s",
    "skewed_gyro_deviation": "rad/s",
    "greatest_torque": "N m",
    "torque_prior": "N m",
    "gyro_error": "rad/s",
    "star_error": "rad",
    "exactness": "-",
    "attitude_prior": "rad",
    "rate_prior": "rad/s",
}
_NOT_NEGATIVE = {"rate_noise": "rad/s", "torque_noise": "N m", "gyro_resolution": "rad/s", "bias_prior": "rad/s"}
