"""Epoch: the instant at which t = 0, as a Julian date split in two so that no digits are lost.

Models take seconds since their epoch as `t`. One float64 Julian date resolves 40 microseconds only; a whole day and a
fraction resolve below a nanosecond, and so does `t` for weeks. The scale is UTC, used as UT1 (|UT1 - UTC| < 0.9 s,
which turns the Earth by at most 0.004 deg) and without leap seconds inside a run.
"""

import datetime
import math
from dataclasses import dataclass

from optsat.arrays import finite_array
from optsat.errors import InputError

J2000_DAY = 2451545.0
SECONDS_PER_DAY = 86400.0
DAYS_PER_CENTURY = 36525.0
_ORDINAL_TO_JULIAN = 1721424.5


@dataclass(frozen=True)
class Epoch:
    """Julian date `day` + `fraction` (UTC) [d]; `day` a whole or half number.

    Raises
    ------
    InputError : not finite, or `day` is neither whole nor half.
    """

    day: float
    fraction: float = 0.0

    def __post_init__(self) -> None:
        finite_array("fraction", self.fraction, (), "d")
        if not float(2 * finite_array("day", self.day, (), "d")).is_integer():
            raise InputError(f"`day` must be a whole or half number [d], got {self.day!r}; use Epoch.from_julian_date.")

    @staticmethod
    def from_julian_date(julian_date: float) -> "Epoch":
        """Return the epoch of one Julian date (UTC) [d], good to 40 microseconds."""
        number = float(finite_array("julian_date", julian_date, (), "d"))
        day = float(math.floor(number))
        return Epoch(day, number - day)

    @staticmethod
    def from_utc(text: str) -> "Epoch":
        """Return the epoch of an ISO 8601 date and time, such as "2021-03-20T12:00:00"; UTC unless an offset is given.

        Raises
        ------
        InputError : the text is no such date.
        """
        try:
            instant = datetime.datetime.fromisoformat(text)
        except ValueError:
            raise InputError(f"`text` must be an ISO 8601 date such as '2021-03-20T12:00:00', got {text!r}.") from None
        if instant.tzinfo is not None:
            instant = instant.astimezone(datetime.UTC)
        midnight = instant.replace(hour=0, minute=0, second=0, microsecond=0)
        return Epoch(instant.toordinal() + _ORDINAL_TO_JULIAN, (instant - midnight) / datetime.timedelta(days=1))

    @property
    def days_since_j2000(self) -> float:
        """Days since 2000-01-01 12:00 [d]."""
        return self.day - J2000_DAY + self.fraction
