"""Schedule: a vector that is constant from one instant to the next, once or over and over."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.errors import InputError
from optsat.models.parameters import check_scalar

_CLOCK_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Schedule:
    """values[i] (3,) from start_s[i] until start_s[i + 1] [s], zero before the first.

    period_s : after so long it begins again at t = 0; infinite = once

    Raises
    ------
    InputError : shapes differ, starts do not increase from 0 on, or the period ends before the last of them.
    """

    start_s: Sequence[float]
    values: Sequence[Sequence[float]] | Array
    period_s: float = math.inf

    def __post_init__(self) -> None:
        start = finite_array("start_s", self.start_s, (None,), "s")
        values = finite_array("values", self.values, (None, 3), "SI") if len(start) else np.zeros((0, 3))
        if len(values) != len(start):
            raise InputError(f"there must be one vector for each of the {len(start)} starts, got {len(values)}.")
        if np.any(start < 0) or np.any(np.diff(start) <= 0):
            raise InputError(f"`start_s` must increase from 0 s on, got {start.tolist()}.")
        if self.period_s != math.inf:
            last = float(start[-1]) if len(start) else 0.0
            check_scalar("period_s", self.period_s, "s", low=last, low_open=True)
        object.__setattr__(self, "start_s", tuple(start.tolist()))
        object.__setattr__(self, "values", values)

    def at(self, t: Array) -> Array:
        """Return the vectors (..., 3) at times t (...) [s]."""
        phase = np.asarray(t) + _CLOCK_ROUNDING
        if self.period_s != math.inf:
            phase = np.mod(phase, self.period_s)
        index = np.searchsorted(np.array(self.start_s), phase, side="right")
        return np.asarray(np.concatenate((np.zeros((1, 3)), np.asarray(self.values)))[index])


def constant(x: float, y: float, z: float) -> Schedule:
    """Return a vector that never changes."""
    return Schedule((0.0,), ((x, y, z),))
