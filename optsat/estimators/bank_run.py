"""Bank run: a bank of hypotheses over logs of samples, one run or many side by side, whole or part after part."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from optsat.arrays import Array, Mask
from optsat.errors import InputError, OptsatError
from optsat.estimators.bank_input import Samples
from optsat.estimators.bank_model import BankModel
from optsat.estimators.bank_result import BankResult, statuses
from optsat.kernels.kernel import Kernel
from optsat.kernels.status import Status

GAP = 5.0
"""Sample times without a row, from which on what was known before is widened."""

_CLOCK_ROUNDING = 1e-6
_MOST_SUBSTEPS = 1000


class BankFailedError(OptsatError):
    """A bank met numbers that it cannot go on from; the message says in which run and row."""


def run_bank(
    model: BankModel,
    kernel: Kernel,
    state: Mapping[str, Array],
    t: Array,
    held: Mapping[str, Array],
    samples: Samples,
    keep_modes: bool = True,
    after: BankResult | None = None,
    held_on: Mapping[str, Array] | None = None,
) -> BankResult:
    """Return what the bank finds in N logs.

    state : by port of the kernel (N, ...), at the first row before its samples
    t : (N, T), increasing [s]; held : by port (N, T, k), constant from the row before to each row
    after : result of the rows before these, which `state` belongs to
    held_on : what the result says of inputs that hold from the last row on

    A step is at most one sample time long; longer intervals are gone through in several, as many as the longest of the
    runs needs. After more than five sample times without a row the covariance is widened as at the start, and the
    result says so.

    Raises
    ------
    InputError : times do not increase. BankFailedError : the bank met numbers that are too large.
    """
    steps = np.diff(t, axis=1, prepend=t[:, :1] if after is None else after.t[:, -1:])
    _check_times(t, steps, is_first=after is None)
    after_gap = np.asarray(steps > (GAP + _CLOCK_ROUNDING) * model.sample_time)
    widening = _widening(model)
    series = {name: _by_row(value) for name, value in {**held, **samples.values}.items()}
    received, nothing = _by_row(samples.received), np.zeros(samples.received[:, 0].shape)
    stepper = _Stepper(kernel, state)
    kept = _Kept(model, kernel, t.shape, keep_modes)
    for k in range(t.shape[1]):
        longest = float(steps[:, k].max()) / model.sample_time
        count = min(max(1, math.ceil(longest - _CLOCK_ROUNDING)), _MOST_SUBSTEPS)
        inputs = {name: value[k] for name, value in series.items()}
        inputs["dt"] = np.ascontiguousarray(steps[:, k] / count)
        inputs["received"] = nothing
        for _ in range(count - 1):
            stepper.step(inputs, k)
        if after_gap[:, k].any():
            stepper.widen(after_gap[:, k, None, None] * widening[None, :, None])
        inputs["received"] = received[k]
        kept.keep(k, stepper.step(inputs, k))
    return kept.result(t, samples, after_gap, stepper.state(), after, dict(held_on or {}))


def _check_times(t: Array, steps: Array, is_first: bool) -> None:
    late = np.argwhere(np.asarray(steps[:, int(is_first) :] <= 0.0))
    if len(late):
        run, row = int(late[0, 0]), int(late[0, 1]) + int(is_first)
        raise InputError(f"`t` must increase: row {row} of run {run} holds {t[run, row]}, not after the row before.")


def _by_row(values: Array | Mask) -> Array:
    """Return values (N, T, k) as (T, N, k), each row in one piece."""
    return np.ascontiguousarray(np.moveaxis(values, 1, 0), dtype=np.float64)


def _widening(model: BankModel) -> Array:
    """What the packed covariance gains by a long gap."""
    gained = np.zeros(model.structure.packed)
    for e, deviation in enumerate(model.spread):
        gained[e * (e + 1) // 2 + e] = deviation**2
    return gained


class _Stepper:
    """The kernel with its state from step to step; one run takes the call, which is faster than a batch."""

    def __init__(self, kernel: Kernel, state: Mapping[str, Array]) -> None:
        self.kernel = kernel
        self.inputs = [port.name for port in kernel.record.inputs]
        self.outputs = [port.name for port in kernel.record.outputs]
        self.is_alone = len(state["probability"]) == 1
        self.current = {name: np.ascontiguousarray(value, dtype=np.float64) for name, value in state.items()}
        if self.is_alone:
            self.current = {name: value[0] for name, value in self.current.items()}

    def step(self, inputs: Mapping[str, Array], row: int) -> dict[str, Array]:
        if self.is_alone:
            *results, code = self.kernel(*(self._argument(name, inputs) for name in self.inputs))
            status = np.array([code])
        else:
            *results, status = self.kernel.batch(*(self._argument(name, inputs) for name in self.inputs))
        if status.any():
            run = int(np.argmax(status != Status.OK))
            raise BankFailedError(
                f"{self.kernel.record.name}: row {row} of run {run} ends with {Status(int(status[run])).name}; look "
                "for a reading, a command or a time step there that is beyond all measure."
            )
        found = dict(zip(self.outputs, results, strict=True))
        self.current = {name: found[name] for name in self.current}
        return found

    def widen(self, gained: Array) -> None:
        self.current["covariance"] = self.current["covariance"] + (gained[0] if self.is_alone else gained)

    def state(self) -> dict[str, Array]:
        return {name: value[None] for name, value in self.current.items()} if self.is_alone else self.current

    def _argument(self, name: str, inputs: Mapping[str, Array]) -> Array:
        if name in self.current:
            return self.current[name]
        return np.asarray(inputs[name][0]) if self.is_alone else inputs[name]


class _Kept:
    """Arrays over time of what a step gives."""

    def __init__(self, model: BankModel, kernel: Kernel, shape: tuple[int, ...], keep_modes: bool) -> None:
        self.model = model
        wanted = [*(port.name for port in model.reference), "fault_probability", "merged_covariance", "log_evidence"]
        wanted += ["deviation", "deviation_variance"] if model.structure.actuated else []
        wanted += ["probability"] if keep_modes else []
        self.arrays = {
            port.name: np.empty((*shape[:2], *port.shape)) for port in kernel.record.outputs if port.name in wanted
        }

    def keep(self, k: int, found: Mapping[str, Array]) -> None:
        for name, array in self.arrays.items():
            array[:, k] = found[name]

    def result(
        self,
        t: Array,
        samples: Samples,
        after_gap: Mask,
        state: dict[str, Array],
        after: BankResult | None,
        held_on: dict[str, Array],
    ) -> BankResult:
        model, arrays, none = self.model, self.arrays, np.zeros((*t.shape, 0))
        before = np.zeros_like(samples.received[:, 0], dtype=np.int64) if after is None else after.lost_in_a_row
        status, lost = statuses(samples.received, samples.invalid, before)
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
            status=status,
            not_finite=samples.not_finite,
            rescaled=samples.rescaled,
            after_gap=after_gap,
            state=state,
            lost_in_a_row=lost,
            held_on=held_on,
        )


def joined(parts: Sequence[BankResult]) -> BankResult:
    """Return the results of one log after the other as that of the whole.

    Raises
    ------
    InputError : there are none, or some kept the probabilities of their modes and others did not.
    """
    if not parts or len({part.mode_probability is None for part in parts}) != 1:
        raise InputError("Results to be joined must be one at least, with the probabilities of all modes or of none.")
    last = parts[-1]

    def whole(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts], axis=1)

    return BankResult(
        t=whole("t"),
        faults=last.faults,
        channels=last.channels,
        states=last.states,
        fault_probability=whole("fault_probability"),
        mode_probability=None if last.mode_probability is None else whole("mode_probability"),
        reference={name: np.concatenate([part.reference[name] for part in parts], axis=1) for name in last.reference},
        deviation=whole("deviation"),
        deviation_variance=whole("deviation_variance"),
        covariance=whole("covariance"),
        log_evidence=whole("log_evidence"),
        status=np.concatenate([part.status for part in parts], axis=1),
        not_finite=np.sum([part.not_finite for part in parts], axis=0),
        rescaled=np.sum([part.rescaled for part in parts], axis=0),
        after_gap=np.concatenate([part.after_gap for part in parts], axis=1),
        state=last.state,
        lost_in_a_row=last.lost_in_a_row,
        held_on=last.held_on,
    )
