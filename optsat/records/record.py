"""A measurement record: directions with bounds, rates, and the true attitude where known; SI, one row per epoch."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.errors import InputError, explain_unknown_fields

Mask = NDArray[np.bool_]

WORD = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
RESERVED = ("t", "gyro", "truth")
_UNIT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class BadRow:
    """A cell or row of a log that was refused: where it stands and why."""

    file: str
    line: int
    column: str
    reason: str


@explain_unknown_fields
@dataclass(frozen=True, eq=False, repr=False)
class VectorChannel:
    """One direction sensor over time.

    name : a word such as `sun`; letters, digits, `_`, `-`
    frame : the sensor frame in which the log gave the components; b_B is in B already
    b_B : (T, 3) measured unit directions in B [-]
    r_N : (T, 3) unit reference directions in N [-]
    angle_bound_rad : (T,) bound of the angle between b_B and A(q_BN) r_N, body and reference together [rad]
    valid : (T,) the samples that may be used; all others become NaN, so that none is used by mistake

    Raises
    ------
    InputError : shapes differ, a valid sample is not a pair of unit vectors with a bound in [0, pi).
    """

    name: str
    frame: str
    b_B: Array
    r_N: Array
    angle_bound_rad: Array
    valid: Mask

    def __post_init__(self) -> None:
        if not WORD.fullmatch(self.name) or self.name in RESERVED:
            raise InputError(
                f"`name` of a channel must be a word of letters, digits, _ and - and none of {', '.join(RESERVED)}; "
                f"got {self.name!r}."
            )
        if not WORD.fullmatch(self.frame):
            raise InputError(f"`frame` of channel {self.name} must be a word such as B or S1, got {self.frame!r}.")
        valid = np.array(self.valid)
        if valid.ndim != 1 or valid.dtype != bool:
            raise InputError(f"`valid` of channel {self.name} must be (T,) booleans, got {valid.dtype} {valid.shape}.")
        count = len(valid)
        b_B = _shaped(f"{self.name}.b_B", self.b_B, (count, 3), "-")
        r_N = _shaped(f"{self.name}.r_N", self.r_N, (count, 3), "-")
        bound = _shaped(f"{self.name}.angle_bound_rad", self.angle_bound_rad, (count,), "rad")
        _check_unit_rows(f"{self.name}.b_B", b_B, valid)
        _check_unit_rows(f"{self.name}.r_N", r_N, valid)
        _first_refused(
            valid & ~((bound >= 0) & (bound < np.pi)), f"{self.name}.angle_bound_rad", bound, "a bound in [0, pi) [rad]"
        )
        for array in (b_B, r_N, bound):
            array[~valid] = np.nan
        _freeze(self, b_B=b_B, r_N=r_N, angle_bound_rad=bound, valid=valid)

    def __repr__(self) -> str:
        return f"VectorChannel({self.name!r}, frame={self.frame!r}, {int(self.valid.sum())} of {len(self.valid)} valid)"


@explain_unknown_fields
@dataclass(frozen=True, eq=False, repr=False)
class Record:
    """A log of direction pairs, rates and, where known, the true attitude.

    t : (T,) strictly increasing times [s]
    channels : the direction sensors
    omega_BN_B : (T, 3) measured rate of B relative to N in B [rad/s]; a NaN row where there is none
    gyro_bound_rad_s : (T,) bound of the length of the rate error [rad/s]; NaN where there is no rate
    q_BN_true : (T, 4) true attitude, scalar last, w >= 0; a NaN row where unknown
    epoch : the instant t = 0, ISO 8601, or None
    source : where the data come from, for people
    bad_rows : what the reader refused

    Raises
    ------
    InputError : shapes differ, times not increasing, a half-empty row, a true attitude of another length than 1.
    """

    t: Array
    channels: tuple[VectorChannel, ...] = ()
    omega_BN_B: Array | None = None
    gyro_bound_rad_s: Array | None = None
    q_BN_true: Array | None = None
    epoch: str | None = None
    source: str = ""
    bad_rows: tuple[BadRow, ...] = ()

    def __post_init__(self) -> None:
        t = np.array(self.t, dtype=np.float64)
        if t.ndim != 1 or len(t) == 0:
            raise InputError(f"`t` must be (T,) times [s] with at least one epoch, got shape {t.shape}.")
        _first_refused(~np.isfinite(t), "t", t, "a finite time [s]")
        _first_refused(np.r_[False, np.diff(t) <= 0], "t", t, "later than the row before [s]")
        count = len(t)
        names = [channel.name for channel in self.channels]
        if len(set(names)) < len(names):
            raise InputError(f"`channels` must have different names, got {', '.join(names)}.")
        for channel in self.channels:
            if len(channel.valid) != count:
                raise InputError(f"channel {channel.name} holds {len(channel.valid)} samples, but `t` holds {count}.")
        rate, bound, truth = self.omega_BN_B, self.gyro_bound_rad_s, self.q_BN_true
        if rate is not None:
            rate = _shaped("omega_BN_B", rate, (count, 3), "rad/s")
            _first_refused(_half_empty(rate), "omega_BN_B", rate, "finite, or NaN in all components [rad/s]")
        if bound is not None:
            if rate is None:
                raise InputError("`gyro_bound_rad_s` is given without `omega_BN_B`; a bound needs the rate it bounds.")
            bound = _shaped("gyro_bound_rad_s", bound, (count,), "rad/s")
            measured = _full_rows(rate, count)
            refused = measured & ~((bound >= 0) & np.isfinite(bound))
            _first_refused(refused, "gyro_bound_rad_s", bound, "finite and >= 0 [rad/s]")
            bound[~measured] = np.nan
        if truth is not None:
            truth = _shaped("q_BN_true", truth, (count, 4), "-")
            _first_refused(_half_empty(truth), "q_BN_true", truth, "finite, or NaN in all components")
            _check_unit_rows("q_BN_true", truth, _full_rows(truth, count))
            truth = upper_quaternion(truth)
        _freeze(self, t=t, channels=tuple(self.channels), omega_BN_B=rate, gyro_bound_rad_s=bound, q_BN_true=truth)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        parts = [f"{len(self)} epochs, {self.t[0]:.6g} to {self.t[-1]:.6g} s"]
        parts += [f"{channel.name} {int(channel.valid.sum())} valid" for channel in self.channels]
        parts += ["gyro"] if self.omega_BN_B is not None else []
        parts += [f"truth at {int(self.has_truth.sum())}"] if self.q_BN_true is not None else []
        parts += [f"{len(self.bad_rows)} bad rows"] if self.bad_rows else []
        return f"Record({', '.join(parts)})"

    @property
    def has_rate(self) -> Mask:
        """The epochs (T,) with a measured rate."""
        return _full_rows(self.omega_BN_B, len(self))

    @property
    def has_truth(self) -> Mask:
        """The epochs (T,) with a true attitude."""
        return _full_rows(self.q_BN_true, len(self))

    def channel(self, name: str) -> VectorChannel:
        """Return the channel of that name.

        Raises
        ------
        InputError : there is none.
        """
        for channel in self.channels:
            if channel.name == name:
                return channel
        raise InputError(
            f"the record has no channel {name!r}; it has {', '.join(c.name for c in self.channels) or 'none'}."
        )

    def pairs(self, k: int) -> tuple[Array, Array, Array, tuple[str, ...]]:
        """Return the valid pairs of epoch k: b_B (m, 3), r_N (m, 3), angle_bound_rad (m,), names; m may be 0."""
        use = [channel for channel in self.channels if channel.valid[k]]
        b_B = np.array([channel.b_B[k] for channel in use]).reshape(-1, 3)
        r_N = np.array([channel.r_N[k] for channel in use]).reshape(-1, 3)
        bound = np.array([channel.angle_bound_rad[k] for channel in use], dtype=np.float64)
        return b_B, r_N, bound, tuple(channel.name for channel in use)


def upper_quaternion(q: Array) -> Array:
    """Return (T, 4) quaternions with w >= 0, and with w = 0 the first non-zero component positive; NaN rows stay."""
    leading = q[:, 3].copy()
    for component in q.T[:3]:
        leading = np.where(leading == 0.0, component, leading)
    return np.asarray(np.where(leading[:, None] < 0.0, -q, q))


def _freeze(owner: object, **fields: object) -> None:
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
        object.__setattr__(owner, name, value)


def _shaped(name: str, value: object, shape: tuple[int, ...], unit: str) -> Array:
    array = np.array(value, dtype=np.float64)
    if array.shape != shape:
        raise InputError(f"`{name}` must have shape {shape} [{unit}], one row per epoch; got {array.shape}.")
    return array


def _first_refused(refused: Mask, name: str, array: Array, expected: str) -> None:
    if refused.any():
        row = int(np.argmax(refused))
        raise InputError(f"`{name}` must be {expected}: row {row} holds {array[row]}.")


def _check_unit_rows(name: str, array: Array, rows: Mask) -> None:
    with np.errstate(invalid="ignore", over="ignore"):
        unit = np.abs(np.linalg.norm(array, axis=1) - 1.0) <= _UNIT_TOLERANCE
    _first_refused(rows & ~unit, name, array, "of length 1")


def _half_empty(array: Array) -> Mask:
    return np.asarray(~(np.isfinite(array).all(axis=1) | np.isnan(array).all(axis=1)))


def _full_rows(array: Array | None, count: int) -> Mask:
    return np.zeros(count, dtype=bool) if array is None else np.asarray(np.isfinite(array).all(axis=1))
