"""One thread for each worker, and for a run in this process: more would change the last bits of BLAS."""

import contextlib
import os
from collections.abc import Iterator

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextlib.contextmanager
def one_thread_each() -> Iterator[None]:
    """Ask for one thread in the environment that workers inherit; once their NumPy is loaded it is too late."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def one_thread_here() -> Iterator[None]:
    """Hold the linear algebra that is loaded in this process to one thread."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        yield
