"""Sizes: whole numbers that templates are built with, checked."""

from optsat.errors import InputError

LANES = 8
"""Accumulators of every sum along a vector, whatever the width of the machine, so that its bits do not depend on it."""

GROUP = 4
"""Rows that are subtracted in one pass, a divisor of `LANES`."""


def check_size(kernel: str, name: str, value: int, low: int, high: int) -> int:
    """Return `value`.

    Raises
    ------
    InputError : not a whole number from `low` to `high`.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InputError(f"{kernel}: `{name}` must be a whole number from {low} to {high}, got {value!r}.")
    return value


def padded(length: int) -> int:
    """Return the least multiple of `LANES` that holds `length` numbers."""
    return -(-length // LANES) * LANES
