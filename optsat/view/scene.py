"""Scene: what the page draws, from a record and the attitudes that were determined of it."""

import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.errors import InputError
from optsat.estimators.attitude_series import AttitudeSeries
from optsat.estimators.series_report import violations
from optsat.records.record import Record, VectorChannel
from optsat.view.packing import LEAST_ANGLE_RAD, packed, packed_angles, packed_components, packed_directions
from optsat.view.positions import slider_positions

MOST_POSITIONS = 2000
_MOST_BYTES = 118_000
_BYTES, _BYTES_OF_TRUTH, _BYTES_A_CHANNEL = 20.1, 13.4, 17.4
_SEEN_RAD = math.radians(4.0)
_LARGEST_MAGNIFICATION = 1000
_MISSING, _USED, _REJECTED = range(3)


def scene(record: Record, series: AttitudeSeries, every: int = 1) -> dict[str, Any]:
    """Return the document for the script of the page.

    every : the series holds every n-th epoch of the record

    Raises
    ------
    InputError : the series is not of this record.
    """
    t = record.t[::every]
    if len(t) != len(series.t) or np.any(t != series.t) or tuple(c.name for c in record.channels) != series.channels:
        raise InputError("`series` is not of this record: its times or its channels differ.")
    truth = None if record.q_BN_true is None else record.q_BN_true[::every]
    error = np.full(len(t), np.nan) if truth is None else series.error_rad(truth)
    broken = np.zeros(len(t), dtype=bool) if truth is None else violations(series, truth)
    state = _states(record, series, every)
    marked = (series.status_index != series.statuses.index(series.statuses[0])) | np.any(state == _REJECTED, axis=1)
    told_apart = np.column_stack((series.status_index, state, broken)).astype(np.int8)
    size = _BYTES + (_BYTES_OF_TRUTH if truth is not None else 0.0) + _BYTES_A_CHANNEL * len(record.channels)
    chosen = slider_positions(told_apart, marked | broken, min(MOST_POSITIONS, int(_MOST_BYTES / size)))
    return {
        "epochs": len(t),
        "count": len(chosen),
        "start": float(t[0]),
        "t": packed((t[chosen] - t[0]).astype(np.float32)),
        "least": LEAST_ANGLE_RAD,
        "q": packed_components(series.q_BN[chosen]),
        "bound": packed_angles(series.bound_rad[chosen]),
        "status": packed(series.status_index[chosen]),
        "statuses": [status.value for status in series.statuses],
        "truth": None if truth is None else packed_components(truth[chosen]),
        "known": None if truth is None else packed(np.all(np.isfinite(truth[chosen]), axis=1).astype(np.int8)),
        "error": None if truth is None else packed_angles(error[chosen]),
        "broken": packed(broken[chosen].astype(np.int8)),
        "magnify": _magnification(series),
        "channels": [
            _channel(channel, series, state[chosen, k], chosen, every) for k, channel in enumerate(record.channels)
        ],
    }


def scene_text(document: dict[str, Any]) -> str:
    """Return the document as JSON."""
    return json.dumps(document, separators=(",", ":"), allow_nan=False)


def _states(record: Record, series: AttitudeSeries, every: int) -> NDArray[np.int8]:
    valid = np.zeros(series.rejected.shape, dtype=bool)
    for k, channel in enumerate(record.channels):
        valid[:, k] = channel.valid[::every]
    return np.where(series.rejected, _REJECTED, np.where(valid, _USED, _MISSING)).astype(np.int8)


def _channel(
    channel: VectorChannel, series: AttitudeSeries, state: NDArray[np.int8], chosen: NDArray[np.int64], every: int
) -> dict[str, Any]:
    b_B, r_N = channel.b_B[::every][chosen], channel.r_N[::every][chosen]
    return {
        "name": channel.name,
        "b": packed_directions(b_B),
        "r": packed_directions(r_N),
        "cone": packed_angles(channel.angle_bound_rad[::every][chosen]),
        "residual": packed_angles(_residual(series.q_BN[chosen], b_B, r_N)),
        "state": packed(state),
    }


def _residual(q_BN: Array, b_B: Array, r_N: Array) -> Array:
    """Return the angle between b_B and A(q_BN) r_N (T,) [rad], NaN where one is missing."""
    known = np.all(np.isfinite(q_BN), axis=1) & np.all(np.isfinite(b_B), axis=1)
    angle = np.full(len(q_BN), np.nan)
    expected = np.asarray(quaternion.transform(q_BN[known], r_N[known]))
    sine = np.linalg.norm(np.cross(b_B[known], expected), axis=1)
    angle[known] = np.arctan2(sine, np.sum(b_B[known] * expected, axis=1))
    return angle


def _magnification(series: AttitudeSeries) -> int:
    """Return the power of ten that makes the median bound large enough to be seen."""
    bounds = series.bound_rad[series.ok]
    if len(bounds) == 0:
        return 1
    power = round(math.log10(_SEEN_RAD / max(float(np.median(bounds)), LEAST_ANGLE_RAD)))
    return min(int(10 ** max(power, 0)), _LARGEST_MAGNIFICATION)
