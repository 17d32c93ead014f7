"""Packing: arrays as base64 inside a page, in no more digits than a screen shows."""

import base64

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array

LEAST_ANGLE_RAD = 1e-9
"""An angle below is stored as this one."""

_UNIT = 32767
_ANGLE_CODES = 65535


def packed(values: NDArray[np.generic]) -> str:
    """Return the little-endian bytes of an array."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes()).decode()


def packed_components(values: Array) -> str:
    """Return numbers of [-1, 1] as 16-bit integers, NaN as zero."""
    return packed(np.round(np.nan_to_num(values) * _UNIT).astype(np.int16))


def packed_directions(rows: Array) -> str:
    """Return unit vectors (T, 3) as two 16-bit integers each, exact to 5e-5 rad; NaN as some direction.

    The sphere is folded onto an octahedron and that onto a square.
    """
    v = np.where(np.isfinite(rows), rows, [0.0, 0.0, 1.0])
    v = v / np.sum(np.abs(v), axis=1, keepdims=True)
    square = v[:, :2].copy()
    below = v[:, 2] < 0
    folded = (1 - np.abs(square[:, ::-1])) * np.where(square >= 0, 1.0, -1.0)
    square[below] = folded[below]
    return packed_components(square)


def packed_angles(angles: Array) -> str:
    """Return angles up to pi [rad] as 16-bit integers on a logarithmic scale, exact to 2e-4 of themselves; NaN as 0."""
    span = np.log(np.pi / LEAST_ANGLE_RAD)
    with np.errstate(invalid="ignore", divide="ignore"):
        place = np.log(np.maximum(angles, LEAST_ANGLE_RAD) / LEAST_ANGLE_RAD) / span
    codes = 1 + np.round(np.clip(place, 0, 1) * (_ANGLE_CODES - 1))
    return packed(np.where(np.isfinite(angles), np.nan_to_num(codes), 0).astype(np.uint16))
