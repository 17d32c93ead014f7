"""From the columns of a CSV log to SI measurements in B and N; a faulty cell takes out its own measurement only."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.records.csv_gate import Gate, in_time_order
from optsat.records.csv_layout import Layout, SensorLayout
from optsat.records.csv_table import Table
from optsat.records.record import BadRow, Mask, VectorChannel
from optsat.units import implausible_reason, is_implausible

_UNIT_QUATERNION_TOLERANCE = 1e-4  # logs often carry no more than six digits
_ROUNDING = 4 * np.finfo(np.float64).eps


@dataclass(frozen=True)
class Body:
    """The measurements of a log, as `Record` wants them, except that there may be no epoch at all."""

    t: Array
    channels: tuple[VectorChannel, ...]
    omega_BN_B: Array | None
    gyro_bound_rad_s: Array | None
    q_BN_true: Array | None


def read_body(file: str, layout: Layout, table: Table) -> tuple[Body, list[BadRow]]:
    """Return the measurements, and the rows and cells that were refused."""
    bad: list[BadRow] = []
    table, t = in_time_order(Gate(file, layout.names, table, bad), layout.time, layout.time_factor)
    channels = tuple(_channel(Gate(file, layout.names, table, bad), vector) for vector in layout.vectors)
    rate = bound = truth = None
    if layout.gyro is not None:
        rate, bound = _gyro(Gate(file, layout.names, table, bad), layout.gyro)
    if layout.truth:
        truth = _truth(Gate(file, layout.names, table, bad), layout.truth)
    return Body(t, channels, rate, bound, truth), bad


def _channel(gate: Gate, vector: SensorLayout) -> VectorChannel:
    values = gate.table.values
    present = gate.filled(vector.measured)
    gate.refuse_unfit(present, vector.columns)
    for columns in (vector.measured, vector.reference):
        zero = (values[:, columns] == 0.0).all(axis=1)
        gate.refuse(zero, columns[0], "the vector is zero, which has no direction")
    bound = _bound(gate, vector)
    if vector.bound is not None:
        reason = "the bound {value:.6g} rad is not in [0, pi); degrees must be labelled [deg]"
        gate.refuse((bound < 0) | (bound >= np.pi), vector.bound, reason, bound)
    valid = present & gate.sound
    b_B = _directions(values[:, vector.measured], valid)
    if not np.array_equal(vector.mounting.dcm_SB, np.eye(3)):
        b_B = _directions(b_B @ vector.mounting.dcm_SB, valid)  # rows: b_B = dcm_SB^T b_S
    r_N = _directions(values[:, vector.reference], valid)
    return VectorChannel(vector.name, vector.mounting.frame, b_B, r_N, bound, valid)


def _gyro(gate: Gate, gyro: SensorLayout) -> tuple[Array, Array | None]:
    rate = gate.table.values[:, gyro.measured] * gyro.factor
    present = gate.filled(gyro.measured)
    gate.refuse_unfit(present, gyro.columns)
    for axis, j in enumerate(gyro.measured):
        reason = "the rate {value:.6g} rad/s " + implausible_reason("rate")
        gate.refuse(is_implausible(rate[:, axis], "rate"), j, reason, rate[:, axis])
    bound = _bound(gate, gyro)
    if gyro.bound is not None:
        reason = "the bound {value:.6g} rad/s is negative or " + implausible_reason("rate")
        gate.refuse((bound < 0) | is_implausible(bound, "rate"), gyro.bound, reason, bound)
    if not np.array_equal(gyro.mounting.dcm_SB, np.eye(3)):
        rate = rate @ gyro.mounting.dcm_SB
    rate[~(present & gate.sound)] = np.nan
    return rate, None if gyro.bound is None and gyro.mounting.bound is None else bound


def _truth(gate: Gate, columns: list[int]) -> Array:
    q = gate.table.values[:, columns]
    present = gate.filled(columns)
    gate.refuse_unfit(present, columns)
    with np.errstate(over="ignore"):
        norm = np.linalg.norm(q, axis=1)
    refused = np.abs(norm - 1.0) > _UNIT_QUATERNION_TOLERANCE
    gate.refuse(refused, columns[0], "the quaternion has norm {value:.6g}, not 1", norm)
    return _directions(q, present & gate.sound)


def _bound(gate: Gate, sensor: SensorLayout) -> Array:
    if sensor.bound is None:
        constant = np.nan if sensor.mounting.bound is None else sensor.mounting.bound
        return np.full(len(gate.table.lines), constant)
    return np.asarray(gate.table.values[:, sensor.bound] * sensor.bound_factor)


def _directions(vectors: Array, rows: Mask) -> Array:
    """Return the rows scaled to length 1, NaN elsewhere; what is a unit vector already keeps every digit."""
    out = np.full(vectors.shape, np.nan)
    with np.errstate(over="ignore", under="ignore"):
        unit = rows & (np.abs(np.linalg.norm(vectors, axis=1) - 1.0) <= _ROUNDING)
    out[unit] = vectors[unit]
    rest = rows & ~unit
    if rest.any():
        scaled = vectors[rest] / np.abs(vectors[rest]).max(axis=1, keepdims=True)
        out[rest] = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return out
