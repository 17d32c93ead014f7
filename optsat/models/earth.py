"""Earth: its constants and its rotation."""

import math

from optsat.attitude.backend import Value
from optsat.models.epoch import J2000_DAY, SECONDS_PER_DAY, Epoch

GRAVITATIONAL_PARAMETER = 398600.4418e9
"""mu [m^3/s^2], WGS 84."""

EQUATORIAL_RADIUS = 6378137.0
"""R_e [m], WGS 84."""

_SIDEREAL_DEG_AT_J2000 = 280.46061837
_SIDEREAL_DEG_PER_DAY_BEYOND_A_TURN = 0.98564736629


def sidereal_angle(epoch: Epoch, t: Value) -> Value:
    """Return Greenwich mean sidereal time [rad], not wrapped: 280.46061837 + 360.98564736629 (JD - 2451545) deg.

    Whole turns are taken out before anything is multiplied.
    Source: Meeus, Astronomical Algorithms, eq. (12.4), linear part.
    """
    turn = math.fmod(epoch.day - J2000_DAY, 1.0) + epoch.fraction
    at_epoch_deg = math.fmod(
        _SIDEREAL_DEG_AT_J2000 + _SIDEREAL_DEG_PER_DAY_BEYOND_A_TURN * epoch.days_since_j2000 + 360.0 * turn, 360.0
    )
    rate = math.radians(360.0 + _SIDEREAL_DEG_PER_DAY_BEYOND_A_TURN) / SECONDS_PER_DAY
    return math.radians(at_epoch_deg) + rate * t
