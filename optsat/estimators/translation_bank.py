"""Translation bank: faults of GPS receiver and accelerometer as joint hypotheses about one orbit."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from optsat.estimators.bank_model import Fault, check_chances, checked_faults
from optsat.models.accelerometer import Axes, Sensed
from optsat.models.earth import GRAVITATIONAL_PARAMETER
from optsat.models.parameters import check_scalar
from optsat.models.parts import ACCELEROMETER, Part

_ALL = (*ACCELEROMETER, Part.GPS)


@dataclass(frozen=True)
class TranslationBank:
    """Parameters of a bank over 2^n hypotheses, n the number of `faults`; frozen, checked, in SI.

    faults : parts that may fail, each by itself; by default all four
    sample_time : that noises and chances per step belong to [s]
    gravitational_parameter [m^3/s^2]; j2 : second zonal harmonic of the Earth [-], 0 for a point mass
    sensed, axes : what the accelerometer reads, and along which axes; a real one reads specific force in B. Of free
        fall that is about zero, whether it works or is dead: a dead one shows by its vanished noise only
    gps_deviation [m], accelerometer_deviation [m/s^2] : of the noise of a healthy sensor
    pointing_deviation : of the attitude by which gravity is turned into B [rad]
    velocity_noise : deviation of what the velocity changes by, unmodelled, per step [m/s]
    chance : per step to fail and to recover
    gps_error [m], accelerometer_error [m/s^2] : what an erratic sensor errs by
    exactness : deviation of a dead or frozen reading as a part of that of a healthy one
    position_prior [m], velocity_prior [m/s] : deviations at the start; fault_prior : probability of each fault there

    Raises
    ------
    InputError : names the field.
    Source: fault-diagnosis specification, section 8, translation bank.
    """

    faults: Sequence[Part] = _ALL
    sample_time: float = 0.1
    gravitational_parameter: float = GRAVITATIONAL_PARAMETER
    j2: float = 0.0
    sensed: Sensed = Sensed.TOTAL
    axes: Axes = Axes.BODY
    gps_deviation: float = 10.0
    accelerometer_deviation: float = 1e-3**0.5
    pointing_deviation: float = 1e-3
    velocity_noise: float = 0.01
    chance: tuple[float, float] = (2e-4, 5e-3)
    gps_error: float = 3e3
    accelerometer_error: float = 2.0
    exactness: float = 1e-3
    position_prior: float = 100.0
    velocity_prior: float = 1.0
    fault_prior: float = 1e-3
    bits: tuple[Fault, ...] = field(init=False)

    def __post_init__(self) -> None:
        for name, unit in _POSITIVE.items():
            check_scalar(name, getattr(self, name), unit, low=0.0, low_open=True)
        for name, unit in (("pointing_deviation", "rad"), ("velocity_noise", "m/s"), ("j2", "-")):
            check_scalar(name, getattr(self, name), unit, low=0.0)
        check_scalar("fault_prior", self.fault_prior, "-", low=0.0, high=1.0, low_open=True, high_open=True)
        check_chances("chance", self.chance)
        object.__setattr__(self, "bits", checked_faults(self.faults, _ALL))

    def bit_of(self, part: Part) -> int | None:
        """Return the bit that says whether this part has failed, or None where it never does."""
        return next((bit for bit, fault in enumerate(self.bits) if part in fault), None)


_POSITIVE = {
    "sample_time": "s",
    "gravitational_parameter": "m^3/s^2",
    "gps_deviation": "m",
    "accelerometer_deviation": "m/s^2",
    "gps_error": "m",
    "accelerometer_error": "m/s^2",
    "exactness": "-",
    "position_prior": "m",
    "velocity_prior": "m/s",
}
