"""Faults: how a sensor channel or an axis of thrusters fails, and when."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array, finite_array
from optsat.errors import InputError, nearest_name
from optsat.models.parameters import check_scalar
from optsat.models.parts import Part

_CLOCK_ROUNDING = 1e-9
"""Sample times such as 3 * 0.1 s miss the number in a file by less than this [s]."""


class SensorFaultKind(Enum):
    """What a faulty sensor sends; `value` is the number, or are the numbers, of its fault."""

    DEAD = "dead"
    """zero in all components"""
    STUCK = "stuck"
    """the constant `value`"""
    FREEZE = "freeze"
    """the last reading before the fault, again and again"""
    BIAS = "bias"
    """the reading plus `value`; the star tracker's attitude turned in B by the rotation vector `value` [rad]"""
    DRIFT = "drift"
    """as a bias that grows by `value` per second from zero at the start"""
    SCALE = "scale"
    """`value` times the reading"""
    NOISE = "noise"
    """the reading with further noise of standard deviation `value`; of the star tracker a rotation [rad]"""
    DEAD_NOISY = "dead_noisy"
    """noise of standard deviation `value` about zero"""
    MISSING = "missing"
    """no sample"""


class ThrusterFaultKind(Enum):
    """What a faulty axis of thrusters does with the commanded torque."""

    REDUCED = "reduced"
    """`value` in (0, 1) times the command"""
    LOCKED = "locked"
    """the constant torque `value` [N m]"""
    OPEN = "open"
    """the largest torque"""
    CLOSED = "closed"
    """no torque"""


Window = NDArray[np.bool_]

_WITHOUT_VALUE = frozenset(
    {
        SensorFaultKind.DEAD,
        SensorFaultKind.FREEZE,
        SensorFaultKind.MISSING,
        ThrusterFaultKind.OPEN,
        ThrusterFaultKind.CLOSED,
    }
)
_NOT_NEGATIVE = frozenset({SensorFaultKind.NOISE, SensorFaultKind.DEAD_NOISY})
_COMPONENTS = {"gps": (3, 3), "star": (4, 3)}
"""Of sensors with several components: how many a reading has, and how many a bias."""


@dataclass(frozen=True)
class Fault:
    """A fault of one part for start_s <= t < stop_s [s].

    value : the numbers that its kind asks for, none, one or several, in SI; of a stuck star tracker q_BN, scalar last,
        of any length

    Raises
    ------
    InputError : the kind does not belong to the part, the window is empty, or `value` does not fit the kind.
    """

    part: Part
    kind: SensorFaultKind | ThrusterFaultKind
    start_s: float
    stop_s: float = math.inf
    value: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        kinds = ThrusterFaultKind if self.part.is_thruster else SensorFaultKind
        if not isinstance(self.kind, kinds):
            name = str(getattr(self.kind, "value", self.kind))
            near = nearest_name(name, [kind.value for kind in kinds])
            raise InputError(f"`kind` of a fault of {self.part.value} is {name!r}.{near}")
        check_scalar("start_s", self.start_s, "s")
        if self.stop_s != math.inf:
            check_scalar("stop_s", self.stop_s, "s", low=self.start_s, low_open=True)
        value = tuple(finite_array("value", self.value, (None,), "SI").tolist())
        object.__setattr__(self, "value", value)
        wanted = value_count(self.part, self.kind)
        if len(value) != wanted:
            raise InputError(
                f"`value` of the fault {self.kind.value} of {self.part.value} must hold {_count(wanted)}, "
                f"got {_count(len(value))}."
            )
        if self.kind in _NOT_NEGATIVE:
            check_scalar("value", value[0], "SI", low=0.0)
        if self.kind is ThrusterFaultKind.REDUCED:
            check_scalar("value", value[0], "-", low=0.0, high=1.0, low_open=True, high_open=True)

    def active(self, t: Array) -> Window:
        """Return at which of the times t (...) [s] the fault is there."""
        return np.asarray((t >= self.start_s - _CLOCK_ROUNDING) & (t < self.stop_s - _CLOCK_ROUNDING))


def value_count(part: Part, kind: SensorFaultKind | ThrusterFaultKind) -> int:
    """Return how many numbers a fault of this kind needs for this part."""
    if kind in _WITHOUT_VALUE:
        return 0
    reading, shift = _COMPONENTS.get(part.device, (1, 1))
    if kind is SensorFaultKind.STUCK:
        return reading
    return shift if kind in (SensorFaultKind.BIAS, SensorFaultKind.DRIFT) else 1


def _count(number: int) -> str:
    return "no number" if number == 0 else "1 number" if number == 1 else f"{number} numbers"
