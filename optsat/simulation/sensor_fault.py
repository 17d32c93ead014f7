"""Sensor fault: one direction sensor that breaks its bound for a while."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.errors import InputError, nearest_name
from optsat.models.parameters import check_scalar
from optsat.records.record import VectorChannel

FaultKind = Literal["offset", "dead", "frozen"]
KINDS: tuple[FaultKind, ...] = ("offset", "dead", "frozen")


@dataclass(frozen=True)
class SensorFault:
    """A fault of `channel` for start_s <= t < stop_s [s].

    kind : "offset", turned by `angle_rad` about an axis fixed in B, across the first direction that is turned;
        "dead", no measurement; "frozen", the last direction before the fault again and again

    Raises
    ------
    InputError : unknown kind, an empty time window, an offset without an angle in (0, pi].
    """

    channel: str
    start_s: float
    stop_s: float
    kind: FaultKind = "offset"
    angle_rad: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"`kind` of a sensor fault is {self.kind!r}.{nearest_name(str(self.kind), list(KINDS))}")
        check_scalar("start_s", self.start_s, "s")
        check_scalar("stop_s", self.stop_s, "s", low=self.start_s, low_open=True)
        if self.kind == "offset":
            check_scalar("angle_rad", self.angle_rad, "rad", low=0.0, high=math.pi, low_open=True)

    def spoil(self, t: Array, channel: VectorChannel, rng: np.random.Generator) -> VectorChannel:
        """Return the channel as the faulty sensor reports it; the reference and the claimed bound stay."""
        b_B, valid = channel.b_B.copy(), channel.valid.copy()
        faulty = (t >= self.start_s) & (t < self.stop_s)
        turned = faulty & valid
        if self.kind == "dead":
            valid[faulty] = False
        elif self.kind == "frozen":
            before = np.flatnonzero(valid & (t < self.start_s))
            source = before[-1:] if len(before) else np.flatnonzero(turned)[:1]
            b_B[turned] = b_B[source]
        elif turned.any():
            axis_B = _across(b_B[int(np.argmax(turned))], rng)
            b_B[turned] = quaternion.transform(quaternion.exponential(self.angle_rad * axis_B), b_B[turned])
        return VectorChannel(channel.name, channel.frame, b_B, channel.r_N, channel.angle_bound_rad, valid)


def _across(direction: Array, rng: np.random.Generator) -> Array:
    """Return a random unit vector perpendicular to a direction."""
    axis = np.cross(direction, rng.standard_normal(3))
    return np.asarray(axis / np.linalg.norm(axis))
