"""Thruster kind: what a faulty axis of thrusters does, by the evidence of its estimated torque."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optsat.arrays import Array, Mask, finite_array
from optsat.errors import InputError
from optsat.estimators.bank_result import BankResult
from optsat.models.faults import ThrusterFaultKind
from optsat.models.parameters import check_scalar
from optsat.models.parts import THRUSTERS, Part

KINDS = (ThrusterFaultKind.CLOSED, ThrusterFaultKind.OPEN, ThrusterFaultKind.REDUCED, ThrusterFaultKind.LOCKED)
_WEIGHTS = (0.15, 0.15, 0.15, 0.05)
_LOCKED_SPREAD = 0.6
_NO_COMMAND = 1e-9


@dataclass(frozen=True, eq=False)
class ThrusterKinds:
    """Kinds of faults of one axis, given that it has failed, for estimates of shape (...).

    probability : (..., 4) of `KINDS`; NaN for CLOSED and REDUCED where nothing is commanded and they are unobservable
    torque, torque_deviation : (...) estimate of the torque and its standard deviation [N m]
    efficiency, efficiency_deviation : (...) torque by command; NaN where nothing is commanded
    is_commanded : (...) whether anything is commanded; where not, the other two kinds share all probability
    """

    probability: Array
    torque: Array
    torque_deviation: Array
    efficiency: Array
    efficiency_deviation: Array
    is_commanded: Mask

    @property
    def most_probable(self) -> NDArray[np.int64]:
        """Places in `KINDS` (...)."""
        return np.asarray(np.nanargmax(self.probability, axis=-1))


def thruster_kinds(
    torque: ArrayLike, torque_deviation: ArrayLike, command: ArrayLike, greatest_torque: float
) -> ThrusterKinds:
    """Return how probable each kind of fault is, by the evidence of an estimated torque.

    closed N(u; 0, s^2), open N(u; u_max, s^2), reduced the mean of N(u; a u_c, s^2) over a in [0, 1], locked
    N(u; 0, s^2 + (0.6 u_max)^2), with the weights 3 : 3 : 3 : 1. Bands of k deviations would take reduced for closed.

    torque, torque_deviation : (...) estimate given that the axis has failed, the latter > 0 [N m]
    command : (...) torque commanded [N m]; greatest_torque : of a pair stuck open [N m]

    Raises
    ------
    InputError : not finite, a deviation that is not positive, shapes that do not fit together.
    Source: fault-diagnosis specification, section 8, decision.
    """
    from scipy.special import log_ndtr, logsumexp

    check_scalar("greatest_torque", greatest_torque, "N m", low=0.0, low_open=True)
    u, s, c = (
        finite_array(name, value, unit="N m")
        for name, value in (("torque", torque), ("torque_deviation", torque_deviation), ("command", command))
    )
    if (s <= 0.0).any():
        raise InputError(f"`torque_deviation` must be positive [N m], its least is {s.min():.6g}.")
    try:
        u, s, c = np.broadcast_arrays(u, s, c)
    except ValueError:
        raise InputError(
            f"`torque`, `torque_deviation` and `command` have shapes {u.shape}, {s.shape}, {c.shape}."
        ) from None
    is_commanded = np.asarray(np.abs(c) > _NO_COMMAND)
    divisor = np.where(is_commanded, c, 1.0)
    low, high = np.sort([(u - c) / s, u / s], axis=0)
    # from the side where both are small, so that their difference keeps its digits
    flip = low > 0.0
    low, high = np.where(flip, -high, low), np.where(flip, -low, high)
    above, below = log_ndtr(high), log_ndtr(np.where(is_commanded, low, high - 1.0))
    reduced = above + np.log(-np.expm1(below - above)) - np.log(np.abs(divisor))
    wide = np.hypot(s, _LOCKED_SPREAD * greatest_torque)
    nothing = np.full(u.shape, -np.inf)
    logs = np.stack(
        [
            np.where(is_commanded, _log_normal(u, s), nothing),
            _log_normal(u - greatest_torque, s),
            np.where(is_commanded, reduced, nothing),
            _log_normal(u, wide),
        ],
        axis=-1,
    ) + np.log(_WEIGHTS)
    probability = np.exp(logs - logsumexp(logs, axis=-1, keepdims=True))
    probability[..., [0, 2]] = np.where(is_commanded[..., None], probability[..., [0, 2]], np.nan)
    return ThrusterKinds(
        probability=probability,
        torque=u.copy(),
        torque_deviation=s.copy(),
        efficiency=np.where(is_commanded, u / divisor, np.nan),
        efficiency_deviation=np.where(is_commanded, s / np.abs(divisor), np.nan),
        is_commanded=is_commanded,
    )


def kinds_in(result: BankResult, thruster: Part, command_B: ArrayLike, greatest_torque: float) -> ThrusterKinds:
    """Return the kinds of fault of one axis at every row (N, T) of a run, given that it has failed there.

    command_B : (T, 3) or (N, T, 3) torque that acted up to each row [N m]

    Raises
    ------
    InputError : the part is no thruster that may fail in this bank, or the command has another shape.
    """
    axes = [part for part in THRUSTERS if any(part in fault for fault in result.faults)]
    if thruster not in axes:
        known = ", ".join(part.value for part in axes) or "none"
        raise InputError(f"{thruster.value} is no thruster of this bank that may fail; these are {known}.")
    command = finite_array("command_B", command_B, unit="N m")
    if command.shape not in ((*result.t.shape[1:], 3), (*result.t.shape, 3)):
        raise InputError(f"`command_B` must be (T, 3) or (N, T, 3) with (N, T) {result.t.shape}, got {command.shape}.")
    c = np.broadcast_to(command[..., THRUSTERS.index(thruster)], result.t.shape)
    a = axes.index(thruster)
    return thruster_kinds(c + result.deviation[..., a], np.sqrt(result.deviation_variance[..., a]), c, greatest_torque)


def _log_normal(y: Array, s: Array) -> Array:
    return np.asarray(-0.5 * (y / s) ** 2 - np.log(s) - 0.5 * np.log(2.0 * np.pi))
