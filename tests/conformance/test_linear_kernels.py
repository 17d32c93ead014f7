"""Dense linear algebra of fixed size: against NumPy, bits against the twins, and what is said of bad matrices."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from kernel_source_harness import assert_twin_agrees, compiled

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.kernels.linear import cholesky_solve, gmres, ldl_solve, recursive_least_squares
from optsat.kernels.source import KernelSource
from optsat.kernels.status import Status

SIZES = (1, 2, 5, 8, 12)


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
def test_ldl_solves_indefinite_equations(n: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(200 + n)
    call, call_float = compiled(ldl_solve(n), tmp_path), compiled(ldl_solve(n), tmp_path, real=np.float32)
    solved = 0
    for _ in range(40):
        square = rng.normal(size=(n, n))
        A, b = square + square.T, rng.normal(size=n)
        x = np.concatenate([np.triu(A).ravel(), b])
        status, y = call(x)
        scale = np.abs(A).sum(axis=1).max() * np.abs(y[:n]).max() + np.abs(b).max()
        assert status in (Status.OK, Status.NOT_CONVERGED)
        assert y[n] == pytest.approx(np.abs(b - A @ y[:n]).max() / scale, abs=2e-15)
        assert y[n + 1] == np.sum(np.linalg.eigvalsh(A) < 0.0)
        if status == Status.OK:
            solved += 1
            np.testing.assert_allclose(
                y[:n], np.linalg.solve(A, b), rtol=0, atol=2e-14 * np.linalg.cond(A) * np.abs(y[:n]).max()
            )
        status_float, y_float = call_float(x)
        if status_float == Status.OK:
            error = np.abs(y_float[:n] - y[:n]).max()
            assert error <= 1e-5 * np.linalg.cond(A) * np.abs(y[:n]).max()
    assert solved >= 35


def test_ldl_says_when_it_cannot(tmp_path: Path) -> None:
    call = compiled(ldl_solve(2), tmp_path)
    # regular, but not without interchanges
    status, y = call(np.array([0.0, 1.0, 1.0, 0.0, 1.0, 2.0]))
    assert status == Status.RANGE
    assert np.isnan(y).all()
    status, _ = call(np.array([1.0, 2.0, 2.0, 4.0, 1.0, 1.0]))
    assert status == Status.RANGE
    status, _ = call(np.array([1.0, np.inf, 0.0, 1.0, 1.0, 1.0]))
    assert status == Status.NOT_FINITE
    status, y = call(np.array([1e-9, 1.0, 1.0, 1.0, 1.0, 2.0]))
    assert status == Status.OK
    np.testing.assert_allclose(y[:2], np.linalg.solve([[1e-9, 1.0], [1.0, 1.0]], [1.0, 2.0]), rtol=1e-15)


@pytest.mark.parametrize("n", SIZES)
def test_recursive_least_squares_is_least_squares(n: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(300 + n)
    source = recursive_least_squares(n)
    call, call_float = compiled(source, tmp_path), compiled(source, tmp_path, real=np.float32)
    rows, z, variance = rng.normal(size=(30, n)), rng.normal(size=30), rng.uniform(0.5, 2.0, 30)
    prior, forgetting = rng.normal(size=n), 0.97
    for kernel, tolerance in ((call, 1e-11), (call_float, 1e-3)):
        theta, P = prior, 10.0 * np.eye(n)
        for h, value, r in zip(rows, z, variance, strict=True):
            predicted, spread = h @ theta, r + h @ P @ h / forgetting
            status, y = kernel(np.concatenate([theta, np.ravel(P), h, [value, r, forgetting]]))
            assert status == Status.OK
            theta, P = y[:n], y[n : n + n * n].reshape(n, n)
            np.testing.assert_array_equal(P, P.T)
            np.testing.assert_allclose(y[-2:], [value - predicted, spread], rtol=tolerance, atol=tolerance)
        # all measurements at once, each with the weight that is left of it
        age = forgetting ** np.arange(len(rows), 0.0, -1.0) / forgetting
        weight = age / variance
        information = forgetting ** len(rows) * np.eye(n) / 10.0 + rows.T @ (weight[:, None] * rows)
        best = np.linalg.solve(information, forgetting ** len(rows) * prior / 10.0 + rows.T @ (weight * z))
        np.testing.assert_allclose(theta, best, rtol=0, atol=tolerance * 10)
        np.testing.assert_allclose(P, np.linalg.inv(information), rtol=0, atol=tolerance * 10)


def test_recursive_least_squares_refuses_bad_arguments(tmp_path: Path) -> None:
    call = compiled(recursive_least_squares(2), tmp_path)
    good = np.concatenate([[1.0, 2.0], np.eye(2).ravel(), [1.0, 1.0], [0.5, 0.1, 1.0]])
    assert call(good)[0] == Status.OK
    for place, value, expected in (
        (9, 0.0, Status.RANGE),
        (10, 0.0, Status.RANGE),
        (10, 1.1, Status.RANGE),
        (2, -9.0, Status.STATE),
        (0, np.nan, Status.NOT_FINITE),
        (3, np.inf, Status.NOT_FINITE),
        (8, 1e308, Status.OK),
        (6, 1e200, Status.OUTPUT),
    ):
        x = good.copy()
        x[place] = value
        status, y = call(x)
        assert status == expected, (place, value)
        assert np.isfinite(y).all() == (status == Status.OK)


@pytest.mark.parametrize("n", SIZES)
def test_gmres_reports_the_residual_of_its_answer(n: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(400 + n)
    source = gmres(n)
    call, call_float = compiled(source, tmp_path), compiled(source, tmp_path, real=np.float32)
    for _ in range(20):
        A, b = rng.normal(size=(n, n)), rng.normal(size=n)
        status, y = call(np.concatenate([A.ravel(), b, [1e-10]]))
        assert status == Status.OK
        assert y[n] <= 1e-10
        assert y[n] == pytest.approx(np.linalg.norm(b - A @ y[:n]) / np.linalg.norm(b), rel=1e-2, abs=1e-12)
        assert 1 <= y[n + 1] <= 4 * n
        np.testing.assert_allclose(
            y[:n], np.linalg.solve(A, b), rtol=0, atol=1e-9 * np.linalg.cond(A) * np.abs(y[:n]).max()
        )
        status, y_float = call_float(np.concatenate([A.ravel(), b, [1e-4]]))
        residual = np.linalg.norm(b - A @ y_float[:n]) / np.linalg.norm(b)
        assert (status == Status.OK) == (y_float[n] <= 1e-4)
        assert residual == pytest.approx(y_float[n], abs=1e-5 * np.linalg.cond(A))


def test_gmres_is_never_content_with_a_residual_above_its_tolerance(tmp_path: Path) -> None:
    n = 6
    call = compiled(gmres(n, restart=3, cycles=2), tmp_path)
    cyclic = np.roll(np.eye(n), 1, axis=0)
    first = np.eye(n)[0]
    # a cyclic shift: no progress before iteration n
    status, y = call(np.concatenate([cyclic.ravel(), first, [1e-10]]))
    assert status == Status.NOT_CONVERGED
    assert y[n] == 1.0
    assert (y[:n] == 0.0).all()
    rng = np.random.default_rng(1)
    singular = rng.normal(size=(n, n - 1)) @ rng.normal(size=(n - 1, n))
    outside = np.linalg.svd(singular)[0][:, -1]
    status, y = compiled(gmres(n), tmp_path)(np.concatenate([singular.ravel(), outside, [1e-10]]))
    assert status == Status.NOT_CONVERGED
    assert y[n] == pytest.approx(1.0)
    for bad, expected in ((0.0, Status.RANGE), (-1.0, Status.RANGE), (np.nan, Status.NOT_FINITE)):
        assert call(np.concatenate([np.eye(n).ravel(), first, [bad]]))[0] == expected
    status, y = call(np.concatenate([np.eye(n).ravel(), np.zeros(n), [1e-10]]))
    assert (status, *y) == (Status.OK, *np.zeros(n + 2))
    # lengths whose squares overflow or vanish
    for scale in (1e-200, 1e200):
        status, y = call(np.concatenate([np.eye(n).ravel(), scale * first, [1e-10]]))
        assert status == Status.OK
        np.testing.assert_allclose(y[:n], scale * first, rtol=1e-15)


def _definite_samples(rng: np.random.Generator, n: int) -> list[Array]:
    return [np.concatenate([positive_definite(rng, n).ravel(), rng.normal(size=n)]) for _ in range(15)]


def _samples(rng: np.random.Generator, kernel: str, n: int) -> list[Array]:
    if kernel == "recursive_least_squares":
        return [
            np.concatenate(
                [
                    rng.normal(size=n),
                    positive_definite(rng, n).ravel(),
                    rng.normal(size=n + 1),
                    rng.uniform(0.1, 1.0, 2),
                ]
            )
            for _ in range(15)
        ]
    samples = _definite_samples(rng, n)
    if kernel == "cholesky_solve":
        return samples
    square = rng.normal(size=(15, n, n))
    samples += [np.concatenate([(each + each.T).ravel(), rng.normal(size=n)]) for each in square]
    return [np.append(x, 1e-10) for x in samples] if kernel == "gmres" else samples


@pytest.mark.parametrize("n", [1, 8, 11])
@pytest.mark.parametrize("make", [cholesky_solve, ldl_solve, recursive_least_squares, gmres])
def test_every_form_has_the_bits_of_the_twin(make: Callable[[int], KernelSource], n: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(500 + n)
    source = make(n)
    samples = _samples(rng, source.name, n)
    singular = [np.where(np.arange(len(x)) < n, 0.0, x) for x in samples[:3]]
    hostile = [spoilt(x, rng) for x in samples for _ in range(2)]
    assert_twin_agrees(source, np.array([*samples, *singular, *hostile, np.zeros_like(samples[0])]), tmp_path)


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
