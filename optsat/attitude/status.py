"""Attitude status: what the data say about the attitude, apart from how the solver stopped."""

import enum


class AttitudeStatus(enum.Enum):
    """OK: determined. UNBOUNDED: a rotation stays free. INCONSISTENT: no attitude satisfies the bounds."""

    OK = "ok"
    UNBOUNDED = "unbounded"
    INCONSISTENT = "inconsistent"
