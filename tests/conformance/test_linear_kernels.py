"""Dense linear algebra of fixed size: against NumPy, bits against the twins, and what is said of bad matrices."""

from pathlib import Path

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.kernels.cholesky import cholesky_solve
from optsat.kernels.status import Status
from tests.conformance.kernel_source_harness import assert_twin_agrees, compiled

SIZES = (1, 2, 3, 5, 7, 8, 9, 12)


def positive_definite(rng: np.random.Generator, n: int) -> Array:
    square = rng.normal(size=(n, n + 2))
    return np.asarray(square @ square.T)


def spoilt(x: Array, rng: np.random.Generator) -> Array:
    """The sample with one entry replaced by something hostile."""
    bad = x.copy()
    bad[rng.integers(len(x))] = rng.choice([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e308, -1e308, 5e-324])
    return bad


@pytest.mark.parametrize("n", SIZES)
def test_cholesky_solves_as_numpy_does(n: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(n)
    source = cholesky_solve(n)
    call, call_float = compiled(source, tmp_path), compiled(source, tmp_path, real=np.float32)
    for _ in range(20):
        A, b = positive_definite(rng, n), rng.normal(size=n)
        x = np.concatenate([np.triu(A).ravel(), b])
        status, y = call(x)
        assert status == Status.OK
        condition = np.linalg.cond(A)
        np.testing.assert_allclose(y[:n], np.linalg.solve(A, b), rtol=0, atol=1e-14 * condition * np.abs(y[:n]).max())
        pivots = np.diag(np.linalg.cholesky(A)) ** 2
        assert y[n] == pytest.approx(min(pivots / np.diag(A)), rel=1e-9)
        status, y_float = call_float(x)
        assert status == Status.OK
        np.testing.assert_allclose(y_float[:n], y[:n], rtol=0, atol=5e-6 * condition * np.abs(y[:n]).max())


@pytest.mark.parametrize("n", SIZES)
def test_cholesky_has_the_bits_of_its_twin(n: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(100 + n)
    samples = [np.concatenate([positive_definite(rng, n).ravel(), rng.normal(size=n)]) for _ in range(30)]
    assert_twin_agrees(cholesky_solve(n), np.array(samples + [spoilt(x, rng) for x in samples]), tmp_path)


def test_cholesky_refuses_what_is_not_positive_definite(tmp_path: Path) -> None:
    call = compiled(cholesky_solve(3), tmp_path)
    singular = np.outer([1.0, 2.0, 3.0], [1.0, 2.0, 3.0])
    for A, expected in (
        (singular, Status.RANGE),
        (-np.eye(3), Status.RANGE),
        (np.zeros((3, 3)), Status.RANGE),
        (np.diag([1.0, np.nan, 1.0]), Status.NOT_FINITE),
        (np.diag([1.0, 1.0, np.inf]), Status.NOT_FINITE),
    ):
        status, y = call(np.concatenate([A.ravel(), np.ones(3)]))
        assert status == expected
        assert np.isnan(y[:3]).all()
        assert y[3] == 0.0
    status, y = call(np.concatenate([1e-300 * np.eye(3).ravel(), 1e300 * np.ones(3)]))
    assert status == Status.OUTPUT
    assert np.isnan(y[:3]).all()


@pytest.mark.parametrize("n", [0, 65, 2.0, True])
def test_cholesky_says_which_sizes_it_takes(n: int) -> None:
    with pytest.raises(InputError, match=r"cholesky_solve: `n` must be a whole number from 1 to 64, got"):
        cholesky_solve(n)
