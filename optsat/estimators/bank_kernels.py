"""Bank kernels: banks of fault hypotheses as they are offered by name."""

from collections.abc import Sequence

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.estimators.attitude_bank import SEED_INERTIA, SEED_STAR, AttitudeBank
from optsat.estimators.attitude_bank_model import attitude_bank_model
from optsat.estimators.translation_bank import TranslationBank
from optsat.estimators.translation_bank_model import translation_bank_model
from optsat.kernels.source import KernelSource
from optsat.models.accelerometer import Axes, Sensed
from optsat.models.earth import GRAVITATIONAL_PARAMETER
from optsat.models.parts import GYRO, THRUSTERS, Part

_SENSORS = (*GYRO, Part.STAR)
_FAULTS = {128: (*_SENSORS, *THRUSTERS), 32: (*_SENSORS, THRUSTERS), 16: _SENSORS}


def attitude_bank(
    modes: int = 128,
    inertia_B: Array | Sequence[Sequence[float]] = SEED_INERTIA,
    sample_time: float = 0.1,
    gyro_deviation: float | Sequence[float] = 0.01,
    star_deviation: Sequence[float] = SEED_STAR,
    rate_noise: float = 1e-3,
    torque_prior: float = 6.0,
    floor: float = 1e-60,
) -> KernelSource:
    """Return `attitude_bank_128`, `_32` or `_16`: one step of the bank of joint faults.

    128 modes: three gyro axes, the star tracker and three thruster axes, each by itself; 32: the thrusters together;
    16: the sensors alone.
    modes : 128, 32 or 16
    inertia_B : inertia matrix (3, 3) about the centre of mass [kg m^2]
    sample_time : that noises and chances per step belong to [s]
    gyro_deviation : of a healthy gyro's noise, one or three [rad/s]
    star_deviation : of a healthy star tracker's noise about the axes of B [rad]
    rate_noise : what the angular velocity changes by, unmodelled, per step [rad/s]
    torque_prior : deviation of a failed axis' torque from its command [N m]
    floor : of a mode's probability; single precision holds none below 1e-30

    Raises
    ------
    InputError : a number is out of range, or no body has this inertia.
    """
    bank = AttitudeBank(
        inertia_B,
        _FAULTS[modes],
        sample_time,
        gyro_deviation,
        star_deviation,
        rate_noise,
        torque_prior,
    )
    return attitude_bank_model(bank).kernel_source(f"attitude_bank_{modes}", floor)


def translation_bank_16(
    sample_time: float = 0.1,
    gravitational_parameter: float = GRAVITATIONAL_PARAMETER,
    sensed: str = "total",
    axes: str = "body",
    gps_deviation: float = 10.0,
    accelerometer_deviation: float = 1e-3**0.5,
    floor: float = 1e-60,
) -> KernelSource:
    """Return `translation_bank_16`: one step of the bank of joint faults of GPS receiver and accelerometer axes.

    sample_time : that noises and chances per step belong to [s]
    gravitational_parameter : of the Earth [m^3/s^2]
    sensed : what the accelerometer reads, "total" acceleration or "specific_force"
    axes : along which it reads, "body" or "inertial"
    gps_deviation : of a healthy receiver's noise [m]
    accelerometer_deviation : of a healthy accelerometer's noise [m/s^2]
    floor : of a mode's probability

    Raises
    ------
    InputError : a number is out of range, or a choice is none of those.
    """
    for name, value, choices in (("sensed", sensed, Sensed), ("axes", axes, Axes)):
        if value not in [each.value for each in choices]:
            raise InputError(f"`{name}` must be one of {', '.join(each.value for each in choices)}, got {value!r}.")
    bank = TranslationBank(
        sample_time=sample_time,
        gravitational_parameter=gravitational_parameter,
        sensed=Sensed(sensed),
        axes=Axes(axes),
        gps_deviation=gps_deviation,
        accelerometer_deviation=accelerometer_deviation,
    )
    return translation_bank_model(bank).kernel_source("translation_bank_16", floor)
