"""Bank run: a bank of hypotheses over logs of samples, one run or many side by side."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array, Mask
from optsat.errors import InputError, OptsatError
from optsat.estimators.bank_model import BankModel
from optsat.estimators.bank_result import BankResult, statuses
from optsat.kernels.kernel import Kernel
from optsat.kernels.status import Status
from optsat.records.telemetry import Telemetry

GAP = 5.0
"""Sample times without a row, from which on what was known before is widened."""

_CLOCK_ROUNDING = 1e-6
_MOST_SUBSTEPS = 1000
_LENGTH_SLACK = 0.1
_RESCALED = 1e-6


class BankFailedError(OptsatError):
    """A bank met numbers that it cannot go on from; the message says in which run and row."""


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


def run_bank(
    model: BankModel,
    kernel: Kernel,
    state: Mapping[str, Array],
    t: Array,
    held: Mapping[str, Array],
    samples: Samples,
    keep_modes: bool = True,
) -> BankResult:
    """Return what the bank finds in N logs.

    state : by port of the kernel (N, ...), at the first row before its samples
    t : (N, T), increasing [s]; held : by port (N, T, k), constant from the row before to each row

    A step is at most one sample time long, longer intervals are gone through in several. After more than five sample
    times without a row the covariance is widened as at the start, and the result says so.

    Raises
    ------
    InputError : times do not increase. BankFailedError : the bank met numbers that are too large.
    """
    steps = np.diff(t, axis=1, prepend=t[:, :1])
    late = np.argwhere(np.asarray(steps[:, 1:] <= 0.0))
    if len(late):
        run, row = (int(k) for k in late[0])
        raise InputError(
            f"`t` must increase: row {row + 1} of run {run} holds {t[run, row + 1]}, not after the row before."
        )
    names = [port.name for port in kernel.record.inputs]
    after_gap = np.asarray(steps > (GAP + _CLOCK_ROUNDING) * model.sample_time)
    widening = _widening(model)
    current = {name: np.ascontiguousarray(value, dtype=np.float64) for name, value in state.items()}
    nothing = np.zeros(samples.received[:, 0].shape)
    kept = _Kept(model, kernel, t.shape, keep_modes)
    for k in range(t.shape[1]):
        longest = float(steps[:, k].max()) / model.sample_time
        count = min(max(1, math.ceil(longest - _CLOCK_ROUNDING)), _MOST_SUBSTEPS)
        inputs = {name: np.ascontiguousarray(value[:, k]) for name, value in {**held, **samples.values}.items()}
        inputs["dt"] = np.ascontiguousarray(steps[:, k] / count)
        for _ in range(count - 1):
            current = _stepped(kernel, names, current, {**inputs, "received": nothing}, k)[0]
        if after_gap[:, k].any():
            current["covariance"] = current["covariance"] + after_gap[:, k, None, None] * widening[None, :, None]
        inputs["received"] = samples.received[:, k].astype(np.float64)
        current, found = _stepped(kernel, names, current, inputs, k)
        kept.keep(k, found)
    return kept.result(t, samples, after_gap)


def _stepped(
    kernel: Kernel, names: list[str], state: Mapping[str, Array], inputs: Mapping[str, Array], row: int
) -> tuple[dict[str, Array], dict[str, Array]]:
    *results, status = kernel.batch(*((state if name in state else inputs)[name] for name in names))
    if status.any():
        run = int(np.argmax(status != Status.OK))
        raise BankFailedError(
            f"{kernel.record.name}: row {row} of run {run} ends with {Status(int(status[run])).name}; look for a "
            "reading, a command or a time step there that is beyond all measure."
        )
    found = dict(zip((port.name for port in kernel.record.outputs), results, strict=True))
    return {name: found[name] for name in state}, found


def _widening(model: BankModel) -> Array:
    """What the packed covariance gains by a long gap."""
    gained = np.zeros(model.structure.packed)
    for e, deviation in enumerate(model.spread):
        gained[e * (e + 1) // 2 + e] = deviation**2
    return gained


class _Kept:
    """Arrays over time of what a step gives."""

    def __init__(self, model: BankModel, kernel: Kernel, shape: tuple[int, ...], keep_modes: bool) -> None:
        self.model = model
        wanted = [*(port.name for port in model.reference), "fault_probability", "merged_covariance", "log_evidence"]
        wanted += [*(["deviation", "deviation_variance"] if model.structure.actuated else [])]
        wanted += ["probability"] if keep_modes else []
        self.arrays = {
            port.name: np.empty((*shape[:2], *port.shape)) for port in kernel.record.outputs if port.name in wanted
        }

    def keep(self, k: int, found: Mapping[str, Array]) -> None:
        for name, array in self.arrays.items():
            array[:, k] = found[name]

    def result(self, t: Array, samples: Samples, after_gap: Mask) -> BankResult:
        model, arrays, none = self.model, self.arrays, np.zeros((*t.shape, 0))
        return BankResult(
            t=t,
            faults=model.faults,
            channels=model.samples.channels,
            states=model.states,
            fault_probability=arrays["fault_probability"],
            mode_probability=arrays.get("probability"),
            reference={port.name: arrays[port.name] for port in model.reference},
            deviation=arrays.get("deviation", none),
            deviation_variance=arrays.get("deviation_variance", none),
            covariance=arrays["merged_covariance"],
            log_evidence=arrays["log_evidence"],
            status=statuses(samples.received, samples.invalid),
            not_finite=samples.not_finite,
            rescaled=samples.rescaled,
            after_gap=after_gap,
        )
