"""Gaussian errors: covariances that are checked where they enter, and draws from them."""

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.errors import InputError

_ASYMMETRY = 1e-9


def covariance(name: str, value: ArrayLike, size: int, unit: str) -> Array:
    """Return a covariance (size, size) [unit], read-only and symmetric to the bit.

    Raises
    ------
    InputError : not (size, size) and finite, asymmetric by more than 1e-9 of its largest entry, not positive definite.
    """
    given = finite_array(name, value, (size, size), unit)
    P = np.asarray((given + given.T) / 2)
    if np.abs(given - given.T).max() > _ASYMMETRY * np.abs(given).max():
        i, j = map(int, np.argwhere(np.abs(given - given.T) == np.abs(given - given.T).max())[0])
        raise InputError(
            f"`{name}` must be symmetric [{unit}]: entry ({i}, {j}) is {given[i, j]:.6g}, "
            f"entry ({j}, {i}) is {given[j, i]:.6g}."
        )
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        raise InputError(
            f"`{name}` must be positive definite [{unit}]; its least eigenvalue is {np.linalg.eigvalsh(P)[0]:.6g}."
        ) from None
    P.setflags(write=False)
    return P


def gaussian(rng: np.random.Generator, count: int, P: Array) -> Array:
    """Return errors (count, n) of mean zero and covariance P (n, n), through its Cholesky factor."""
    return np.asarray(rng.standard_normal((count, len(P))) @ np.linalg.cholesky(P).T)
