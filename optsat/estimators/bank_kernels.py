"""Bank kernels: banks of fault hypotheses as they are offered by name."""

from collections.abc import Sequence

from optsat.arrays import Array
from optsat.estimators.attitude_bank import SEED_INERTIA, SEED_STAR, AttitudeBank
from optsat.estimators.attitude_bank_model import attitude_bank_model
from optsat.kernels.source import KernelSource
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
