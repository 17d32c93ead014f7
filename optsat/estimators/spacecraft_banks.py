"""Spacecraft banks: the banks of fault hypotheses that suit a spacecraft and its sensors."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optsat.errors import InputError
from optsat.estimators.attitude_bank import AttitudeBank
from optsat.estimators.translation_bank import TranslationBank
from optsat.models.parts import GYRO, THRUSTERS, Part
from optsat.models.spacecraft import Spacecraft

_CORRELATION = 1e-9


def attitude_bank_of(spacecraft: Spacecraft, **changes: Any) -> AttitudeBank:
    """Return the attitude bank of a spacecraft: its inertia, thrusters, and the noise of its sensors.

    Gyro axes, star tracker and thruster axes may fail, and what there is of skewed gyro and chamber pressures; a gyro
    whose bias walks gets a bias among the states.
    changes : fields of `AttitudeBank` that are to be otherwise

    Raises
    ------
    InputError : gyro or star tracker are missing, noise is correlated between axes, or a field is out of range.
    """
    gyro, star, skewed, pressure = spacecraft.gyro, spacecraft.star, spacecraft.skewed_gyro, spacecraft.pressure
    if gyro is None or star is None:
        raise InputError("An attitude bank needs gyro and star tracker; the spacecraft has not both.")
    walks = gyro.bias_walk > 0.0 or any(each != 0.0 for each in gyro.bias)
    sample_time = float(changes.get("sample_time", AttitudeBank.sample_time))
    fields: dict[str, Any] = {
        "inertia_B": spacecraft.inertia_B,
        "faults": (*GYRO, Part.STAR, *THRUSTERS),
        "gyro_deviation": _deviations("gyro.R", gyro.R),
        "star_deviation": _deviations("star.R", star.rotation_covariance),
        "gyro_bias_noise": gyro.bias_walk * sample_time**0.5 if walks else None,
        "greatest_torque": spacecraft.thrusters.greatest_torque,
        "torque_prior": spacecraft.thrusters.greatest_torque / 2.0,
        "signed": spacecraft.thrusters.signed,
    }
    if skewed is not None:
        fields |= {"skewed_gyro_axis_B": skewed.axis_B, "skewed_gyro_deviation": skewed.sigma}
        fields["faults"] = (*fields["faults"], Part.SKEWED_GYRO)
    if pressure is not None:
        fields["pressure_deviation"] = pressure.sigma
    return AttitudeBank(**(fields | changes))


def translation_bank_of(spacecraft: Spacecraft, **changes: Any) -> TranslationBank:
    """Return the translation bank of a spacecraft: its gravity and the noise of its sensors.

    changes : fields of `TranslationBank` that are to be otherwise

    Raises
    ------
    InputError : GPS receiver or accelerometer are missing, noise is correlated or differs between axes, or a field is
        out of range.
    """
    gps, accelerometer = spacecraft.gps, spacecraft.accelerometer
    if gps is None or accelerometer is None:
        raise InputError("A translation bank needs GPS receiver and accelerometer; the spacecraft has not both.")
    fields: dict[str, Any] = {
        "gravitational_parameter": spacecraft.gravitational_parameter,
        "sensed": accelerometer.sensed,
        "axes": accelerometer.axes,
        "gps_deviation": _one_deviation("gps.R", gps.R),
        "accelerometer_deviation": _one_deviation("accelerometer.R", accelerometer.R),
    }
    return TranslationBank(**(fields | changes))


def _deviations(name: str, covariance: ArrayLike) -> tuple[float, ...]:
    R = np.asarray(covariance, dtype=np.float64)
    deviations = np.sqrt(np.diag(R))
    across = np.abs(R / np.outer(deviations, deviations) - np.eye(len(R))).max()
    if across > _CORRELATION:
        raise InputError(
            f"`{name}` correlates axes by up to {across:.3g}; the bank takes their samples one by one and needs a "
            "diagonal covariance."
        )
    return tuple(deviations.tolist())


def _one_deviation(name: str, covariance: ArrayLike) -> float:
    x, *others = _deviations(name, covariance)
    if any(abs(each - x) > _CORRELATION * x for each in others):
        raise InputError(f"`{name}` differs between axes; the bank takes one deviation for all three.")
    return x
