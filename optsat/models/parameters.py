"""Parameters: the check that every model makes of its numbers."""

import math

from optsat.arrays import finite_array
from optsat.errors import InputError


def check_scalar(
    name: str,
    value: float,
    unit: str,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    low_open: bool = False,
    high_open: bool = False,
) -> None:
    """Accept a finite number in the interval from `low` to `high`, ends included unless said open.

    Raises
    ------
    InputError : not a finite number, or outside; the message names the interval.
    """
    number = float(finite_array(name, value, (), unit))
    below = number <= low if low_open else number < low
    above = number >= high if high_open else number > high
    if below or above:
        left = "" if low == -math.inf else f" {'>' if low_open else '>='} {low:.6g}"
        right = "" if high == math.inf else f" {'<' if high_open else '<='} {high:.6g}"
        joint = " and" if left and right else ""
        raise InputError(f"`{name}` must be{left}{joint}{right} [{unit}], got {number:.6g}.")
