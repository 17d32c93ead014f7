"""Numerics: a print of this machine's arithmetic; runs with the same print give the same bytes."""

import functools
import hashlib

import numpy as np

from optsat.errors import OptsatError


@functools.cache
def numerics_print() -> str:
    """Return a hash over the results of linear algebra and elementary functions, to the last bit.

    It differs with the processor, the linear-algebra library, its number of threads, and the vector instructions
    that NumPy uses.
    """
    rng = np.random.Generator(np.random.Philox(key=1))
    digest = hashlib.sha256()
    for n in (40, 300):
        a = rng.standard_normal((n, n))
        symmetric = a + a.T
        for result in (a @ a, np.linalg.solve(a, a[0]), np.linalg.eigvalsh(symmetric)):
            digest.update(np.ascontiguousarray(result).tobytes())
    x = 1.0 + rng.random(20_000)
    for function in (np.sin, np.exp, np.log, np.tanh, np.arctan):
        digest.update(function(x).tobytes())
    return digest.hexdigest()[:16]


def check_same(expected: str, found: str, where: str) -> None:
    """Refuse results of another arithmetic.

    Raises
    ------
    OptsatError : the prints differ.
    """
    if found != expected:
        raise OptsatError(
            f"{where} computes with other last bits than this run (numerics {found}, not {expected}): another "
            "processor, library or number of threads. Use machines of one kind, or allow the mixture with "
            "--mixed-machines; then results are compared by tolerance, not by bytes."
        )
