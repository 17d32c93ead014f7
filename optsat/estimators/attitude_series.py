"""Attitude series: certified attitudes along a record, frame by frame or over a window carried by the gyro."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.status import AttitudeStatus
from optsat.determine import certify_attitude, certify_attitude_batch
from optsat.errors import InputError, explain_unknown_fields, explain_unknown_options
from optsat.estimators.relative_attitude import RelativeAttitude
from optsat.records.record import Record

Progress = Callable[[int, int], None]


@explain_unknown_fields
@dataclass(frozen=True)
class Window:
    """How past measurements are used: length_s back in time [s], one epoch every spacing_s [s].

    isolate : drop the fewest measurements of an epoch that contradict the window, and say which
    """

    length_s: float
    spacing_s: float
    isolate: bool = True

    def __post_init__(self) -> None:
        for name, value in (("length_s", self.length_s), ("spacing_s", self.spacing_s)):
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < np.inf:
                raise InputError(f"`{name}` of a window must be a positive time [s], got {value!r}.")
        if self.length_s / self.spacing_s > 1000:
            raise InputError(
                f"`spacing_s` = {self.spacing_s:g} s puts {self.length_s / self.spacing_s:.0f} epochs in the window of "
                f"{self.length_s:g} s; at most 1000. Use a wider spacing."
            )


@dataclass(frozen=True)
class AttitudeSeries:
    """Certified attitudes of T epochs.

    t (T,) [s]; q_BN (T, 4); bound_rad (T,) [rad], pi when unbounded, NaN when inconsistent or without any measurement
    status_index (T,) : place in `statuses`, -1 for an epoch without measurement; used (T,) : number of direction pairs
    rejected (T, channels) : measurements that contradict the others and were left out
    channels : names; windowed : whether past measurements were used
    """

    t: Array
    q_BN: Array
    bound_rad: Array
    status_index: NDArray[np.int8]
    used: NDArray[np.int64]
    rejected: NDArray[np.bool_]
    channels: tuple[str, ...]
    windowed: bool

    statuses = tuple(AttitudeStatus)

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Epochs with a determined attitude (T,)."""
        return np.asarray(self.status_index == self.statuses.index(AttitudeStatus.OK))

    def counts(self) -> dict[str, int]:
        """Return how many epochs ended in which status, and how many had no measurement."""
        counts = {status.value: int(np.sum(self.status_index == k)) for k, status in enumerate(self.statuses)}
        return {**counts, "no measurement": int(np.sum(self.status_index < 0))}

    def error_rad(self, q_BN_true: Array) -> Array:
        """Return the rotation angle (T,) [rad] to a reference attitude (T, 4); NaN where either is missing."""
        known = self.ok & np.all(np.isfinite(q_BN_true), axis=1)
        error = np.full(len(self.t), np.nan)
        error[known] = quaternion.error_angle(self.q_BN[known], q_BN_true[known])
        return error


@explain_unknown_options
def certify_record(
    record: Record, window: Window | None = None, progress: Progress | None = None, *, every: int = 1
) -> AttitudeSeries:
    """Return certified attitudes of every epoch of a record.

    Without a window each epoch stands alone. With one, every accepted past pair is carried to the present by the
    gyro and its bound is widened by what the gyro's own bound allows: |rotation error| <= integral of |rate error|.

    progress : called with (epochs done, epochs in all)
    every : determine every n-th epoch of the record; the gyro samples between them are used all the same

    Raises
    ------
    InputError : a window without gyro or without its bound; `every` below 1.
    Source: robust Wahba specification, section 7.3.
    """
    if not isinstance(record, Record):
        raise InputError(
            f"`record` must be a Record, got {type(record).__name__}; optsat.read_csv_log(path) reads one."
        )
    if window is not None and not isinstance(window, Window):
        raise InputError(
            f"`window` must be an optsat.Window(length_s, spacing_s) or None, got {type(window).__name__}."
        )
    relative = None if window is None else RelativeAttitude.of(record)
    if isinstance(every, bool) or not isinstance(every, int) or every < 1:
        raise InputError(f"`every` must be a whole number >= 1, got {every!r}.")
    epochs = range(0, len(record.t), every)
    count = len(epochs)
    names = tuple(channel.name for channel in record.channels)
    q_BN, bound = np.full((count, 4), np.nan), np.full(count, np.nan)
    status, used = np.full(count, -1, dtype=np.int8), np.zeros(count, dtype=np.int64)
    rejected = np.zeros((count, len(names)), dtype=bool)
    history = History(record, window, relative) if window is not None and relative is not None else None
    done = np.zeros(count, dtype=bool)
    if history is None:
        # epochs of two directions need no history and run as whole arrays
        done = _fill_two_vector_epochs(record, epochs, q_BN, bound, status, used)
    for row, k in enumerate(epochs):
        if done[row]:
            continue
        present = np.array([i for i, channel in enumerate(record.channels) if channel.valid[k]], dtype=np.int64)
        result, left_out, pairs = _epoch(record, k, present, history)
        rejected[row, left_out] = True
        used[row] = pairs
        if result is not None:
            q_BN[row], bound[row], status[row] = result
        if progress is not None:
            progress(row + 1, count)
    if progress is not None:
        progress(count, count)
    return AttitudeSeries(record.t[::every], q_BN, bound, status, used, rejected, names, window is not None)


def _fill_two_vector_epochs(
    record: Record,
    epochs: range,
    q_BN: Array,
    bound: Array,
    status: NDArray[np.int8],
    used: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Write the epochs with exactly two valid directions into the result arrays; return which they are (count,)."""
    if len(record.channels) < 2:
        return np.zeros(len(epochs), dtype=bool)
    rows = np.array(epochs, dtype=np.int64)
    valid = np.stack([channel.valid[rows] for channel in record.channels], axis=1)
    double = valid.sum(axis=1) == 2
    if not double.any():
        return np.asarray(double)
    which = np.argsort(~valid[double], axis=1, kind="stable")[:, :2]
    place = (rows[double][:, None], which)
    b_B, r_N, eps = (
        np.stack([getattr(channel, name) for channel in record.channels], axis=1)[place]
        for name in ("b_B", "r_N", "angle_bound_rad")
    )
    batch = certify_attitude_batch(b_B, r_N, eps)
    q_BN[double], bound[double], status[double], used[double] = batch.q_BN, batch.bound_rad, batch.status_index, 2
    return np.asarray(double)


_Result = tuple[Array, float, int]


def _epoch(
    record: Record, k: int, present: NDArray[np.int64], history: "History | None"
) -> tuple[_Result | None, list[int], int]:
    """Return the result of epoch k, the channels left out and the number of pairs used."""
    past = history.pairs(k) if history is not None else None
    best = _certified(record, k, present, past)
    left_out: list[int] = []
    if (
        history is not None
        and history.window.isolate
        and best is not None
        and best[2] == _INCONSISTENT
        and len(present)
    ):
        best, left_out = _fewest_left_out(record, k, present, past)
        alone = _certified(record, k, present, None)
        agreeing = len(left_out) == len(present) > 1 and alone is not None and alone[2] != _INCONSISTENT
        if best is None or best[2] == _INCONSISTENT or agreeing:
            # the past is contradictory or gone, or stands alone against sensors that agree (a gyro that breaks its
            # bound spoils it): start again from the present frame
            history.forget()
            past, left_out = None, []
            best = _certified(record, k, present, None)
    kept = [int(i) for i in present if int(i) not in left_out]
    if history is not None and (best is None or best[2] != _INCONSISTENT):
        history.accept(k, kept)
    return best, left_out, len(kept) + (0 if past is None else len(past[2]))


def _fewest_left_out(
    record: Record, k: int, present: NDArray[np.int64], past: "tuple[Array, Array, Array] | None"
) -> tuple[_Result | None, list[int]]:
    """Leave out the fewest present channels that restore consistency.

    All of the equally good choices where there are several.
    """
    for size in range(1, len(present) + 1):
        working = []
        for removed in itertools.combinations(present.tolist(), size):
            result = _certified(record, k, np.setdiff1d(present, removed), past)
            if result is None or result[2] != _INCONSISTENT:
                working.append(removed)
        if working:
            union = sorted({channel for removed in working for channel in removed})
            return _certified(record, k, np.setdiff1d(present, union), past), union
    return None, []


def _certified(
    record: Record, k: int, channels: NDArray[np.int64], past: "tuple[Array, Array, Array] | None"
) -> _Result | None:
    b = [record.channels[i].b_B[k] for i in channels]
    r = [record.channels[i].r_N[k] for i in channels]
    eps = [record.channels[i].angle_bound_rad[k] for i in channels]
    if past is not None:
        b, r, eps = [*b, *past[0]], [*r, *past[1]], [*eps, *past[2]]
    if not b:
        return None
    attitude = certify_attitude(np.array(b), np.array(r), np.array(eps), norm_policy="silent")
    return attitude.q_BN, attitude.bound_rad, AttitudeSeries.statuses.index(attitude.status)


_INCONSISTENT = AttitudeSeries.statuses.index(AttitudeStatus.INCONSISTENT)


class History:
    """Accepted measurements of the window, carried to the present epoch."""

    def __init__(self, record: Record, window: Window, relative: RelativeAttitude) -> None:
        self.record, self.window, self.relative = record, window, relative
        self._accepted: dict[int, list[int]] = {}

    def forget(self) -> None:
        """Drop everything."""
        self._accepted.clear()

    def accept(self, k: int, channels: list[int]) -> None:
        """Remember the channels of epoch k, and drop what the window has left behind."""
        t = self.record.t
        if channels:
            self._accepted[k] = channels
        for old in [j for j in self._accepted if t[j] < t[k] - self.window.length_s - self.window.spacing_s]:
            del self._accepted[old]

    def pairs(self, k: int) -> tuple[Array, Array, Array] | None:
        """Return past directions b (n, 3) in the present B, r (n, 3) and widened bounds (n,); None without any."""
        t, length, spacing = self.record.t, self.window.length_s, self.window.spacing_s
        chosen: dict[int, int] = {}
        for j in self._accepted:
            age = t[k] - t[j]
            if 0 < age <= length * (1 + 1e-9) and self.relative.connected(j, k):
                # the newest epoch of each slot of the window
                chosen[int(np.ceil(age / spacing - 1e-9))] = j
        rows: list[tuple[Array, Array, float]] = []
        for j in chosen.values():
            turn, growth = self.relative.rotation(j, k)
            for i in self._accepted[j]:
                channel = self.record.channels[i]
                eps = float(channel.angle_bound_rad[j]) + growth
                if eps < np.pi / 2:
                    rows.append((turn @ channel.b_B[j], channel.r_N[j], eps))
        if not rows:
            return None
        return (
            np.array([row[0] for row in rows]),
            np.array([row[1] for row in rows]),
            np.array([row[2] for row in rows]),
        )
