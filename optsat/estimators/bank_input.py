"""Bank input: logs as arrays of samples, finite throughout, with what is known of each channel's samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array, Mask
from optsat.errors import InputError
from optsat.estimators.bank_model import BankModel
from optsat.records.telemetry import Telemetry

_LENGTH_SLACK = 0.1
_RESCALED = 1e-6


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of all devices, finite, by the names of their ports, and what is known of each channel's.

    values : (N, T, k) by port, zero where nothing came; received, invalid : (N, T, C)
    """

    values: dict[str, Array]
    received: Mask
    invalid: Mask
    not_finite: NDArray[np.int64]
    rescaled: NDArray[np.int64]


def sorted_samples(model: BankModel, given: Mapping[str, Array]) -> Samples:
    """Return what arrays (N, T, k) by port hold.

    NaN is a missing sample of its channel, infinity too, and counted; a quaternion off by more than 0.1 is invalid.

    Raises
    ------
    InputError : an array has another shape.
    """
    shape = next(iter(given.values())).shape[:2]
    values, received, invalid = {}, [], []
    not_finite, rescaled = np.zeros(shape[0], np.int64), np.zeros(shape[0], np.int64)
    for device in model.samples.devices:
        wanted = (*shape, device.port.size)
        array = np.asarray(given[device.port.name], dtype=np.float64)
        if array.shape != wanted:
            raise InputError(f"`{device.port.name}` must have shape {wanted} [{device.port.unit}], got {array.shape}.")
        not_finite += np.isinf(array).sum(axis=(1, 2))
        there = np.asarray(np.isfinite(array).reshape(*shape, len(device.parts), device.rows).all(axis=-1))
        bad = np.zeros_like(there)
        if device.port.shape == (4,):
            with np.errstate(invalid="ignore", over="ignore"):
                off = np.where(there[..., 0], np.abs(np.linalg.norm(array, axis=-1) - 1.0), 0.0)
            bad[..., 0] = off > _LENGTH_SLACK
            rescaled += ((off > _RESCALED) & ~bad[..., 0]).sum(axis=1)
        values[device.port.name] = np.where(np.repeat(there, device.rows, axis=-1), array, 0.0)
        received.append(there)
        invalid.append(bad)
    return Samples(values, np.concatenate(received, -1), np.concatenate(invalid, -1), not_finite, rescaled)


def logs_together(telemetry: Telemetry | Sequence[Telemetry]) -> list[Telemetry]:
    """Return one log or several of equally many rows as a list.

    Raises
    ------
    InputError : none, or their lengths differ.
    """
    logs = [telemetry] if isinstance(telemetry, Telemetry) else list(telemetry)
    if not logs or len({len(log) for log in logs}) != 1:
        raise InputError(f"Logs that run together must have equally many rows, got {[len(log) for log in logs]}.")
    return logs


def stacked(logs: Sequence[Telemetry], name: str) -> Array:
    """Return an array of the telemetry of all logs, (N, T, k).

    Raises
    ------
    InputError : a log has no such sensor.
    """
    for number, log in enumerate(logs):
        if getattr(log, name) is None:
            raise InputError(
                f"Log {number} has no `{name}`, which the bank needs. Give it rows of NaN, or leave that sensor "
                "out of the bank."
            )
    return np.stack([np.asarray(getattr(log, name)).reshape(len(log), -1) for log in logs])
