"""Recursive least squares: the twin of `recursive_least_squares.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.sizes import padded
from optsat.kernels.source import Twin
from optsat.kernels.status import Status
from optsat.kernels.twins.lane_sums import dot

_LARGEST = float(np.finfo(float).max)


def twin(n: int) -> Twin:
    """Return theta and P after a measurement, the innovation and its variance."""

    def run(x: Array) -> tuple[int, Array]:
        theta, row, gain = np.zeros((3, padded(n)))
        theta[:n], P, row[:n] = x[:n], x[n : n + n * n].reshape(n, n), x[n + n * n : -3]
        z, variance, forgetting = (float(value) for value in x[-3:])
        allowed = variance > 0.0 and 0.0 < forgetting <= 1.0
        with np.errstate(all="ignore"):
            for k in range(n):
                gain[:n] += P[k] * row[k]
            innovation = z - dot(row, theta)
            spread = forgetting * variance + dot(row, gain)
            usable = allowed and 0.0 < spread <= _LARGEST
            scale = 1.0 / np.sqrt(spread if usable else 1.0)
            inflation = 1.0 / (forgetting if usable else 1.0)
            gain *= scale
            theta += gain * (innovation * scale)
            covariance = (P - gain[:n, None] * gain[None, :n]) * inflation
            total = np.zeros(n)
            for each in covariance:
                total = total + each
            finite = bool(np.isfinite(theta[:n]).all() and np.isfinite(total).all())
            positive = bool((np.diag(covariance) > 0.0).all())
            y = np.concatenate([theta[:n], covariance.ravel(), [innovation, spread * inflation]])
        if usable and finite and positive:
            return Status.OK, y
        y[:] = np.nan
        if not np.isfinite(x).all():
            return Status.NOT_FINITE, y
        if not allowed:
            return Status.RANGE, y
        return (Status.STATE if finite and spread <= _LARGEST else Status.OUTPUT), y

    return run
