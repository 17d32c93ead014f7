"""Telemetry: raw samples of sensors and commands as they were received, for fault diagnosis; nothing is repaired."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError, explain_unknown_fields
from optsat.records.record import BadRow, Mask


@explain_unknown_fields
@dataclass(frozen=True, eq=False, repr=False)
class Telemetry:
    """A log of sensors and commands, one row per epoch; NaN is a missing sample, None a sensor that is not there.

    A reading is what the sensor sent: a quaternion of length zero or a reading of a million sigma is evidence of a
    fault, so it is neither refused nor changed. Only times and commands must be sound.

    t : (T,) strictly increasing times [s], of any spacing
    command_torque_B : (T, 3) torque commanded to the thrusters [N m]; row k holds from t[k] until t[k + 1]
    gyro_omega_BN_B : (T, 3) rate of B relative to N in B [rad/s]; axes may be missing one by one
    star_q_BN : (T, 4) attitude from the star tracker, scalar last, of either sign [-]
    gps_r_N : (T, 3) position [m]
    accelerometer : (T, 3) acceleration [m/s^2]; the spacecraft says of what and along which axes
    skewed_gyro_rate : (T,) rate about the axis of a redundant single-axis gyro [rad/s]
    pressure_torque_B : (T, 3) torque told from the chamber pressures, of the thrust just before t[k] [N m]
    epoch : the instant t = 0, ISO 8601, or None
    source : where the data come from, for people
    bad_rows : what the reader refused

    Raises
    ------
    InputError : shapes differ, times are not finite and increasing, or a command is not finite.
    """

    t: Array
    command_torque_B: Array
    gyro_omega_BN_B: Array | None = None
    star_q_BN: Array | None = None
    gps_r_N: Array | None = None
    accelerometer: Array | None = None
    skewed_gyro_rate: Array | None = None
    pressure_torque_B: Array | None = None
    epoch: str | None = None
    source: str = ""
    bad_rows: tuple[BadRow, ...] = ()

    def __post_init__(self) -> None:
        t = np.array(self.t, dtype=np.float64)
        if t.ndim != 1 or len(t) == 0:
            raise InputError(f"`t` must be (T,) times [s] with at least one epoch, got shape {t.shape}.")
        _refuse(~np.isfinite(t), "t", t, "a finite time [s]")
        _refuse(np.concatenate(([False], np.diff(t) <= 0)), "t", t, "later than the row before [s]")
        _freeze(self, "t", t)
        for name, (width, unit) in CHANNELS.items():
            value = getattr(self, name)
            if value is None:
                if name == "command_torque_B":
                    raise InputError("`command_torque_B` must be (T, 3) [N m]; zeros where the thrusters are not used.")
                continue
            array = np.array(value, dtype=np.float64)
            shape = (len(t), width) if width > 1 else (len(t),)
            if array.shape != shape:
                hint = " Did you pass columns? Use `.T`." if array.shape == shape[::-1] != shape else ""
                raise InputError(
                    f"`{name}` must have shape {shape} [{unit}], one row per epoch; got {array.shape}.{hint}"
                )
            _freeze(self, name, array)
        unsound = np.asarray(~np.isfinite(self.command_torque_B).all(axis=1))
        _refuse(unsound, "command_torque_B", self.command_torque_B, "finite [N m]; a log without commands has zeros")

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        parts = [f"{len(self)} epochs, {self.t[0]:.6g} to {self.t[-1]:.6g} s"]
        parts += [f"{name} {int(self.received(name).sum())} received" for name in self.sensors]
        parts += [f"{len(self.bad_rows)} bad rows"] if self.bad_rows else []
        return f"Telemetry({', '.join(parts)})"

    @property
    def sensors(self) -> tuple[str, ...]:
        """The names of the sensors in the log, such as "star_q_BN"."""
        return tuple(name for name in CHANNELS if name != "command_torque_B" and getattr(self, name) is not None)

    def received(self, name: str) -> Mask:
        """Return which samples (T,) of a sensor have all components.

        Raises
        ------
        InputError : the log has no such sensor.
        """
        if name not in self.sensors:
            raise InputError(f"the log has no sensor {name!r}; it has {', '.join(self.sensors) or 'none'}.")
        rows: Array = getattr(self, name).reshape(len(self), -1)
        return np.asarray(~np.isnan(rows).any(axis=1))

    def equals(self, other: "Telemetry") -> bool:
        """Return whether all times, commands and readings are the same to the bit."""
        for name in ("t", *CHANNELS):
            mine, theirs = getattr(self, name), getattr(other, name)
            if (mine is None) != (theirs is None):
                return False
            if mine is not None and not np.array_equal(mine, theirs, equal_nan=True):
                return False
        return True


CHANNELS: dict[str, tuple[int, str]] = {
    "command_torque_B": (3, "N m"),
    "gyro_omega_BN_B": (3, "rad/s"),
    "star_q_BN": (4, "-"),
    "gps_r_N": (3, "m"),
    "accelerometer": (3, "m/s^2"),
    "skewed_gyro_rate": (1, "rad/s"),
    "pressure_torque_B": (3, "N m"),
}
"""Of every array of a log but its times: how many components it has, and their unit."""


def _refuse(refused: Mask, name: str, array: Array, expected: str) -> None:
    if refused.any():
        row = int(np.argmax(refused))
        raise InputError(f"`{name}` must be {expected}: row {row} holds {array[row]}.")


def _freeze(owner: Telemetry, name: str, array: Array) -> None:
    array.setflags(write=False)
    object.__setattr__(owner, name, array)
