"""Isolability: how well the sensors of a linear model tell its faults apart, before anything is built or run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array, Mask, finite_array
from optsat.errors import InputError, explain_unknown_fields, explain_unknown_options
from optsat.estimators.windowed_outputs import windowed_outputs
from optsat.models.linear_discrete import LinearDiscreteModel

MOST_ROWS = 4000
DECISION_NATS = 3.0
# part of a fault's own square in the outputs: exact zeros end near 1e-30, weak gyroscopic coupling near 1e-6
_ZERO = 1e-13


@explain_unknown_fields
@dataclass(frozen=True)
class AdditiveFault:
    """A step that a part adds to inputs or sensors from `onset` on.

    name : of the part
    sizes : size of the step by name of input or sensor, in that channel's unit
    onset : time in the window [s]

    Raises
    ------
    InputError : no channel, a size that is not finite, all sizes zero, a negative onset.
    """

    name: str
    sizes: Mapping[str, float]
    onset: float = 1.0

    def __post_init__(self) -> None:
        sizes = finite_array(f"sizes of fault {self.name}", list(self.sizes.values()), (None,))
        if not np.any(sizes):
            raise InputError(
                f"fault `{self.name}` changes nothing: give `sizes` at least one channel with a size, not 0."
            )
        if not float(finite_array(f"onset of fault {self.name}", self.onset, (), "s")) >= 0.0:
            raise InputError(f"fault `{self.name}`: `onset` must not be negative, got {self.onset:g} s.")


@dataclass(frozen=True, eq=False)
class Isolability:
    """What a window of the sensors says about each fault [nats], the mean log-likelihood ratio.

    A single fault shows against noise; a pair is told apart when the other part, with any signal in its channels,
    cannot do the same to the outputs. Larger is easier; 4 to 7 overcome a prior of 1e-3 a sample.

    faults, sensors : names, in the order of rows and columns
    window : [s]
    detection : (f,) fault against no fault
    distinguishability : (f, f) fault of the row against that of the column; the diagonal is 0
    against_others : (f,) fault against all others at once, each with any signal
    undetectable : (f,) exact zeros of `detection`
    indistinguishable : (f, f) exact zeros of `distinguishability`, the diagonal left out
    masked : (f,) exact zeros of `against_others`
    clear : whether every exact zero is clear of rounding; if not, take a shorter window
    """

    faults: tuple[str, ...]
    sensors: tuple[str, ...]
    window: float
    detection: Array
    distinguishability: Array
    against_others: Array
    undetectable: Mask
    indistinguishable: Mask
    masked: Mask
    clear: bool

    def groups(self, least: float = DECISION_NATS) -> tuple[tuple[str, ...], ...]:
        """Return the ambiguity groups: faults joined by exact zeros, or seen but less than `least` [nats] apart."""
        # a fault too small to be seen is mistaken for none rather than for another
        weak = (self.distinguishability < least) & (self.detection >= least)[:, None]
        close = self.indistinguishable | (weak & ~np.eye(len(self.faults), dtype=bool))
        close = close | close.T
        left, found = list(range(len(self.faults))), []
        while left:
            group, grown = {left[0]}, {left[0]}
            while grown:
                grown = {j for i in grown for j in left if close[i, j]} - group
                group |= grown
            left = [j for j in left if j not in group]
            if len(group) > 1:
                found.append(tuple(self.faults[j] for j in sorted(group)))
        return tuple(found)

    @property
    def says(self) -> tuple[str, ...]:
        """What cannot be told, or hardly with faults of this size, a sentence each; empty when everything is told."""
        sensors, span = ", ".join(self.sensors), f"{self.window:g} s"
        lines = [
            f"A fault of {name} cannot be seen at all with {sensors}: in {span} it changes nothing that an unknown "
            "first state does not change alike."
            for name, blind in zip(self.faults, self.undetectable, strict=True)
            if blind
        ]
        for i, j in np.argwhere(self.indistinguishable & ~self.undetectable[:, None]):
            if not self.indistinguishable[j, i] or self.undetectable[j]:
                lines.append(
                    f"A fault of {self.faults[i]} cannot be told from one of {self.faults[j]} with {sensors}: what "
                    f"it does to the measurements in {span}, {self.faults[j]} can do the same."
                )
            elif i < j:
                lines.append(
                    f"Faults of {self.faults[i]} and {self.faults[j]} cannot be told apart with {sensors}: what the "
                    f"one does to the measurements in {span}, the other can do as well."
                )
        alone = ~np.any(self.indistinguishable, axis=1) & ~self.undetectable
        for i in np.flatnonzero(self.masked & alone):
            others = " and ".join(name for name in self.faults if name != self.faults[i])
            lines.append(
                f"A fault of {self.faults[i]} is told from each other fault, but not from {others} failing together."
            )
        lines += [
            f"A fault of {self.faults[i]} of this size is hardly {told}: {nats:.2g} nats in {span}, a decision needs "
            f"{DECISION_NATS:g}."
            for i, told, nats in self._weak()
        ]
        if not self.clear:
            lines.append(
                "Rounding hides whether some zeros are exact: the window is too long for the model. Take a shorter one."
            )
        return tuple(lines)

    def _weak(self) -> list[tuple[int, str, float]]:
        """Faults that are told by too few nats, from what, and the nats; exact zeros and what follows left out."""
        found = []
        for i, seen in enumerate(self.detection):
            if seen < DECISION_NATS:
                found += [] if self.undetectable[i] else [(i, "seen", float(seen))]
                continue
            for j, nats in enumerate(self.distinguishability[i]):
                if i != j and nats < DECISION_NATS and not self.indistinguishable[i, j]:
                    found.append((i, f"told from one of {self.faults[j]}", float(nats)))
        return found


@explain_unknown_options
def isolability(model: LinearDiscreteModel, faults: Sequence[AdditiveFault], window: float) -> Isolability:
    """Return how well each fault is detected and told from the others over a window.

    D_ij = 1/2 |(I - Pi_[O, T_j]) Sigma^-1/2 T_i theta|^2, O and T_j multiplied by Sigma^-1/2 as well: the first state
    is unknown, fault j may be any signal, Sigma holds sensor noise and process noise. The linear model holds near its
    operating point; noise is Gaussian and white. A fault that is known by its shape, such as a sensor that reads
    exactly 0, can be told apart even where this says zero.

    Parameters
    ----------
    model : with its sensors; make one with `optsat.models.linear_discrete.linear_model` or `single_axis`
    faults : at least one, each with its own name
    window : length [s], a whole number of samples

    Raises
    ------
    InputError : a fault acts on no channel of the model, two have one name, an onset is outside the window, or the
        window is no whole number of samples or has more than 4000 outputs.
    Source: distinguishability of faults in windows of linear models; the values of the table re-derived in
    tests/unit/estimators/test_isolability.py by least squares with the noise of the steps as unknowns.
    """
    samples = _samples(model, window)
    faults = tuple(faults)
    _check_faults(faults, window)
    outputs = windowed_outputs(model, samples)
    maps = [outputs.toeplitz(tuple(fault.sizes)) for fault in faults]
    changes = [T @ _step(fault, samples, model.dt) for fault, T in zip(faults, maps, strict=True)]
    count = len(faults)
    pairs, zeros = np.zeros((count, count)), np.zeros((count, count), dtype=bool)
    detection, undetectable = np.zeros(count), np.zeros(count, dtype=bool)
    alone, masked = np.zeros(count), np.zeros(count, dtype=bool)
    clear = []

    def nats(change: Array, *causes: Array) -> tuple[float, bool]:
        rest, rank_is_clear = outputs.unexplained(change, *causes)
        clear.append(rank_is_clear)
        square = float(rest @ rest)
        return square / 2, square <= _ZERO * float(change @ change)

    for i, change in enumerate(changes):
        detection[i], undetectable[i] = nats(change)
        for j in (j for j in range(count) if j != i):
            pairs[i, j], zeros[i, j] = nats(change, maps[j])
        alone[i], masked[i] = nats(change, *(T for j, T in enumerate(maps) if j != i))
    return Isolability(
        faults=tuple(fault.name for fault in faults),
        sensors=tuple(sensor.name for sensor in model.sensors),
        window=window,
        detection=detection,
        distinguishability=pairs,
        against_others=alone,
        undetectable=undetectable,
        indistinguishable=zeros,
        masked=masked,
        clear=all(clear),
    )


def _step(fault: AdditiveFault, samples: int, dt: float) -> Array:
    # an onset between two samples acts from the later one on; the slack is the rounding of onset / dt
    on = np.arange(samples) >= fault.onset / dt - 1e-9
    return np.outer(on, list(fault.sizes.values())).ravel()


def _samples(model: LinearDiscreteModel, window: float) -> int:
    length = float(finite_array("window", window, (), "s"))
    samples = round(length / model.dt)
    if samples < 1 or abs(samples * model.dt - length) > 1e-6 * model.dt:
        raise InputError(f"`window` must be a whole number of samples of {model.dt:g} s, got {length:g} s.")
    if samples * len(model.sensors) > MOST_ROWS:
        raise InputError(
            f"`window` of {samples} samples of {len(model.sensors)} sensors has more than {MOST_ROWS} outputs. "
            "Take a shorter window or a larger sample time."
        )
    return samples


def _check_faults(faults: tuple[AdditiveFault, ...], window: float) -> None:
    if not faults:
        raise InputError("`faults` is empty. Give at least one fault.")
    names = [fault.name for fault in faults]
    for fault in faults:
        if names.count(fault.name) > 1:
            raise InputError(f"`faults`: {names.count(fault.name)} are called `{fault.name}`. Give each its own name.")
        if fault.onset >= window:
            raise InputError(f"fault `{fault.name}` sets in at {fault.onset:g} s, after the window of {window:g} s.")
