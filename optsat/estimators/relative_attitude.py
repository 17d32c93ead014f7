"""Relative attitude between epochs from gyro samples, with a bound on its error."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.davenport import rotation_matrix
from optsat.attitude.edges import unchecked
from optsat.errors import InputError
from optsat.records.record import Record

_compose = unchecked(quaternion.compose)


@dataclass(frozen=True)
class RelativeAttitude:
    """Attitude of every epoch relative to the first, and how far its error may have grown.

    q_BkB0 (T, 4) : the product of the steps; growth_rad (T,) : accumulated bound [rad]; segment (T,) : epochs that
    an unbroken gyro connects share a number
    """

    q_BkB0: Array
    growth_rad: Array
    segment: NDArray[np.int64]

    @staticmethod
    def of(record: Record) -> "RelativeAttitude":
        """Return the relative attitudes of a record, the rate taken as linear between samples.

        The growth of a step dt is dt times the larger rate bound plus twice the leading integration error
        dt^3 (|omega''| / 12 + |omega| |omega'| / 12), its derivatives from differences of the samples: the rate is
        taken to be smooth between samples, which no log can prove.

        Raises
        ------
        InputError : the record holds no gyro or no bound for it.
        """
        omega, gyro_bound = record.omega_BN_B, record.gyro_bound_rad_s
        if omega is None or gyro_bound is None:
            missing = "gyro rate" if omega is None else "bound of the gyro error"
            raise InputError(f"A window needs the {missing} in the record; leave out `window` for single frames.")
        t = record.t
        dt = np.diff(t)
        known = np.all(np.isfinite(omega), axis=1) & np.isfinite(gyro_bound)
        joined = known[:-1] & known[1:]
        rate = np.where(known[:, None], omega, 0.0)
        error = np.where(known, gyro_bound, 0.0)
        step = quaternion.exponential(0.5 * (rate[:-1] + rate[1:]) * dt[:, None])
        slope = np.linalg.norm(np.diff(rate, axis=0), axis=1) / dt
        size = np.linalg.norm(rate, axis=1)
        curve = _second_derivative(rate, t, joined)
        integration = dt**3 / 12 * (np.maximum(curve[:-1], curve[1:]) + np.maximum(size[:-1], size[1:]) * slope)
        growth = dt * np.maximum(error[:-1], error[1:]) + 2 * integration
        total = prefix_products(np.concatenate((np.array([[0.0, 0.0, 0.0, 1.0]]), step)))
        return RelativeAttitude(
            total, np.concatenate(([0.0], np.cumsum(growth))), np.concatenate(([0], np.cumsum(~joined)))
        )

    def connected(self, j: int, k: int) -> bool:
        """Return whether the gyro is unbroken between epochs j and k."""
        return bool(self.segment[j] == self.segment[k])

    def rotation(self, j: int, k: int) -> tuple[Array, float]:
        """Return the rotation (3, 3) from B at epoch j to B at epoch k, and the bound [rad] of its error."""
        turn = rotation_matrix(self.q_BkB0[k]) @ rotation_matrix(self.q_BkB0[j]).T
        return turn, float(abs(self.growth_rad[k] - self.growth_rad[j]))


def _second_derivative(rate: Array, t: Array, joined: NDArray[np.bool_]) -> Array:
    """Return |omega''| (T,) by divided differences over unbroken samples; the ends of each run repeat their neighbours.

    joined (T - 1,) : steps whose two samples are both known
    """
    curve = np.zeros(len(t))
    if len(t) < 3:
        return curve
    slope = np.diff(rate, axis=0) / np.diff(t)[:, None]
    inside = np.flatnonzero(joined[:-1] & joined[1:]) + 1
    curve[inside] = np.linalg.norm(slope[inside] - slope[inside - 1], axis=1) / (0.5 * (t[inside + 1] - t[inside - 1]))
    interior = np.zeros(len(t), dtype=bool)
    interior[inside] = True
    first = np.flatnonzero(~interior[:-1] & joined & interior[1:])
    last = np.flatnonzero(interior[:-1] & joined & ~interior[1:]) + 1
    curve[first], curve[last] = curve[first + 1], curve[last - 1]
    # a run of two samples shows no curvature: it is taken to be as large as anywhere in the record
    curve[~interior & ~np.isin(np.arange(len(t)), np.concatenate((first, last)))] = curve.max()
    return curve


def prefix_products(steps: Array) -> Array:
    """Return the products steps[k] (x) ... (x) steps[0] (T, 4) in log2 T array passes."""
    total = np.array(steps)
    reach = 1
    while reach < len(total):
        total[reach:] = _compose(total[reach:], total[:-reach])
        total /= np.linalg.norm(total, axis=1, keepdims=True)
        reach *= 2
    return total
