"""Bank result: what a bank of hypotheses found at every row of a log, as arrays over runs and time."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array, Mask
from optsat.errors import InputError
from optsat.models.parts import Part


class ChannelStatus(IntEnum):
    """What became of one sample of one channel."""

    USED = 0
    LOST = 1
    """none came, or it was not finite; the one or two before came"""
    MISSING = 2
    """none came for three rows or more"""
    INVALID = 3
    """came, but no healthy sensor can send it: a quaternion of length zero, or off by more than 0.1"""


Statuses = NDArray[np.int8]
Counts = NDArray[np.int64]

IN_A_ROW = 3
"""Lost samples from which on a channel is missing."""


@dataclass(frozen=True, eq=False)
class BankResult:
    """N runs of T rows; n error states, B faults (bits), M = 2^B modes, C channels, A actuated axes.

    t : (N, T) [s]
    faults : the parts of each bit; channels : of each column of `status`; states : names of the error states
    fault_probability : (N, T, B)
    mode_probability : (N, T, M), bit b of a mode's number is fault b; None where it was not kept
    reference : by name, arrays (N, T, ...) of the merged estimate, such as q_BN and omega_BN_B
    deviation, deviation_variance : (N, T, A) of what an axis deviates from its command by, given that it has failed
    covariance : (N, T, n, n) of the merged error state
    log_evidence : (N, T) log density of a row's samples given those before
    status : (N, T, C) of `ChannelStatus`
    not_finite : (N,) samples that were infinite; rescaled : (N,) quaternions whose length was off by 1e-6 to 0.1
    after_gap : (N, T) rows after more than five sample times, where the covariance was widened as at the start
    state : (N, ...) by port of the kernel, of the bank after the last row
    lost_in_a_row : (N, C) samples lost up to the last row
    held_on : (N, k) by port, inputs that hold from the last row on, such as a command
    """

    t: Array
    faults: tuple[tuple[Part, ...], ...]
    channels: tuple[Part, ...]
    states: tuple[str, ...]
    fault_probability: Array
    mode_probability: Array | None
    reference: dict[str, Array]
    deviation: Array
    deviation_variance: Array
    covariance: Array
    log_evidence: Array
    status: Statuses
    not_finite: Counts
    rescaled: Counts
    after_gap: Mask
    state: dict[str, Array]
    lost_in_a_row: Counts
    held_on: dict[str, Array]

    def probability(self, part: Part) -> Array:
        """Return the probability (N, T) that this part has failed.

        Raises
        ------
        InputError : the bank does not ask whether it fails.
        """
        return np.asarray(self.fault_probability[..., self._bit(part)])

    def any_probability(self, parts: Sequence[Part]) -> Array:
        """Return the probability (N, T) that at least one of these parts has failed.

        Raises
        ------
        InputError : the bank has no such fault, or the probabilities of its modes were not kept.
        """
        if self.mode_probability is None:
            raise InputError("The probability of several parts needs those of the modes; run with `keep_modes=True`.")
        bits = sum({1 << self._bit(part) for part in parts})
        failed = np.arange(self.mode_probability.shape[-1]) & bits != 0
        return np.asarray(self.mode_probability[..., failed].sum(axis=-1))

    def channel_status(self, part: Part) -> Statuses:
        """Return the statuses (N, T) of a sensor channel.

        Raises
        ------
        InputError : the bank has no such channel.
        """
        if part not in self.channels:
            known = ", ".join(each.value for each in self.channels)
            raise InputError(f"The bank has no channel {part.value}; it has {known}.")
        return np.asarray(self.status[..., self.channels.index(part)])

    def _bit(self, part: Part) -> int:
        for bit, fault in enumerate(self.faults):
            if part in fault:
                return bit
        known = ", ".join(each.value for fault in self.faults for each in fault)
        raise InputError(f"The bank does not ask whether {part.value} fails; its faults are {known}.")


def statuses(received: Mask, invalid: Mask, lost_before: Counts) -> tuple[Statuses, Counts]:
    """Return the `ChannelStatus` of samples (N, T, C), and how many were lost in a row at the end.

    received : which came; invalid : which of them no healthy sensor can send
    lost_before : (N, C) how many were lost in a row before
    """
    run = lost_before
    found = np.zeros(received.shape, dtype=np.int8)
    for k in range(received.shape[1]):
        run = np.where(received[:, k], 0, run + 1)
        found[:, k] = np.where(run == 0, ChannelStatus.USED, ChannelStatus.LOST)
        found[:, k][run >= IN_A_ROW] = ChannelStatus.MISSING
    found[invalid & received] = ChannelStatus.INVALID
    return found, run
