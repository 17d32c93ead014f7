"""Multistart: deterministic starting points that fill a region evenly."""

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError

# where a side has no bound, points spread this far from the start in units of 1 + |start|, near and far in turn
_REACH = (1.0, 10.0)


def sobol_starts(start: Array, lower: Array, upper: Array, count: int, seed: int) -> Array:
    """Return `count` points (count, n): the start itself, then a scrambled Sobol sequence over the bounds.

    start (n,); lower, upper (n,) may be infinite

    Raises
    ------
    InputError : count < 1.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InputError(f"`starts` must be a whole number >= 1, got {count!r}.")
    if count == 1:
        return start[None, :].copy()
    from scipy.stats import qmc

    exponent = int(np.ceil(np.log2(count)))
    unit = qmc.Sobol(len(start), scramble=True, rng=np.random.default_rng(seed)).random_base2(exponent)[: count - 1]
    reach = np.array(_REACH)[np.arange(count - 1) % len(_REACH), None] * (1 + np.abs(start))
    low = np.where(np.isfinite(lower), lower, np.minimum(start, np.where(np.isfinite(upper), upper, start)) - reach)
    high = np.where(np.isfinite(upper), upper, np.maximum(start, np.where(np.isfinite(lower), lower, start)) + reach)
    return np.vstack((start, low + unit * (high - low)))
