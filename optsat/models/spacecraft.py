"""Spacecraft: the body, thrusters and sensors whose faults are simulated and diagnosed."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from optsat.arrays import Array
from optsat.errors import explain_unknown_fields
from optsat.models.accelerometer import Accelerometer
from optsat.models.additive_sensors import PositionReceiver, PressureSensor, RateGyro, SkewedGyro
from optsat.models.parameters import check_scalar
from optsat.models.parts import Part
from optsat.models.rigid_body import RigidBody
from optsat.models.star_tracker import StarTracker
from optsat.models.thrusters import ThrusterPairs

SEED_GRAVITATIONAL_PARAMETER = 6.67384e-11 * 5.97219e24
"""mu of the fault-diagnosis paper [m^3/s^2], 6.5e-5 below the modern value: 0.57 mm/s^2 in a low orbit."""


@explain_unknown_fields
@dataclass(frozen=True, eq=False)
class Spacecraft:
    """A rigid body with thruster pairs and sensors; None is a sensor that is not there.

    inertia_B : (3, 3) about the centre of mass [kg m^2]; its default is ours, the paper gives none
    gravitational_parameter [m^3/s^2]

    Raises
    ------
    InputError : no body has this inertia, a number is negative or not finite.
    Source: fault-diagnosis specification, section 1.
    """

    inertia_B: Array | Sequence[Sequence[float]] = ((300.0, 0.0, 0.0), (0.0, 280.0, 0.0), (0.0, 0.0, 350.0))
    thrusters: ThrusterPairs = field(default_factory=ThrusterPairs)
    gyro: RateGyro | None = field(default_factory=RateGyro)
    star: StarTracker | None = field(default_factory=StarTracker)
    gps: PositionReceiver | None = field(default_factory=PositionReceiver)
    accelerometer: Accelerometer | None = field(default_factory=Accelerometer)
    skewed_gyro: SkewedGyro | None = None
    pressure: PressureSensor | None = None
    gravitational_parameter: float = SEED_GRAVITATIONAL_PARAMETER

    def __post_init__(self) -> None:
        object.__setattr__(self, "inertia_B", np.asarray(RigidBody(self.inertia_B).inertia_B))
        check_scalar("gravitational_parameter", self.gravitational_parameter, "m^3/s^2", low=0.0, low_open=True)

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts that it has, each of which may fail."""
        return tuple(part for part in Part if part.is_thruster or getattr(self, part.device) is not None)
