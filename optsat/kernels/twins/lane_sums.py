"""Lane sums: sums along a vector as the templates form them, and the matrix that a lower triangle stands for."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.sizes import LANES


def dot(a: Array, b: Array) -> float:
    """Return the sum of products of two vectors whose length is a multiple of `LANES`."""
    lanes = np.zeros(LANES)
    for begin in range(0, len(a), LANES):
        lanes = lanes + a[begin : begin + LANES] * b[begin : begin + LANES]
    s0, s1, s2, s3, s4, s5, s6, s7 = lanes
    return float(((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7)))


def largest(a: Array) -> float:
    """Return the largest absolute value of a vector, 0 of none; a NaN counts for nothing."""
    return float(np.fmax.reduce(np.abs(a), initial=0.0))


def symmetric(lower: Array) -> Array:
    """Return the symmetric matrix that has the lower triangle of this one."""
    return np.where(np.tri(len(lower), dtype=bool), lower, lower.T)
