"""Diagnosis truth: how a simulated spacecraft really moved and what had failed, apart from all that it sent."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.models.faults import Fault
from optsat.models.parts import Part
from optsat.records.record import Mask


@dataclass(frozen=True, eq=False)
class DiagnosisTruth:
    """The truth of one run, one row per row of its telemetry.

    t : (T,) [s]; q_BN : (T, 4), w >= 0 [-]; omega_BN_B : (T, 3) [rad/s]; r_N, v_N : (T, 3) [m], [m/s]
    acceleration_N : (T, 3) total, gravity included [m/s^2]
    torque_B : (T, 3) of the thrusters, from t[k] to the next row [N m]
    gyro_bias : (T, 3) [rad/s]
    parts : of the columns of `faulty`; faulty : (T, P) which parts had failed at t[k], a thruster from t[k] on
    faults : with their kinds and windows
    """

    t: Array
    q_BN: Array
    omega_BN_B: Array
    r_N: Array
    v_N: Array
    acceleration_N: Array
    torque_B: Array
    gyro_bias: Array
    parts: tuple[Part, ...]
    faulty: Mask
    faults: tuple[Fault, ...] = ()

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def failed(self, part: Part) -> Mask:
        """Return at which rows (T,) a part had failed.

        Raises
        ------
        InputError : the spacecraft has no such part.
        """
        if part not in self.parts:
            known = ", ".join(each.value for each in self.parts)
            raise InputError(f"the spacecraft has no part {part.value}; it has {known}.")
        return np.asarray(self.faulty[:, self.parts.index(part)])
