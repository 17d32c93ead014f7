"""Certified attitude of up to ten vectors as a kernel: its bound holds the truth, whatever errors the bounds allow."""

from functools import cache

import numpy as np
import pytest
from bounded_draws import directions, tilted

from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.kernels.certified_attitude import certified_attitude
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.unit import Real

OK, UNBOUNDED, INCONSISTENT = 0.0, 1.0, 2.0
DECADES = ((-9, -8), (-6, -4), (-4, -0.46), (-9, -0.46))


@cache
def kernel(n: int, real: Real = "double", iterations: int = 40) -> Kernel:
    """The kernel of n vectors; without a compiler its twin, which is too slow for these numbers of poses."""
    made = make_kernel(certified_attitude(n, iterations), real)
    if not made.is_compiled:
        pytest.skip("no C compiler")
    return made


def drawn(seed: int, count: int, n: int, decades: tuple[float, float], kind: str) -> tuple[Array, Array, Array, Array]:
    """True attitudes, b_B, r_N (count, n, 3) and bounds that their errors keep: inside, on the rim, or in one sense."""
    rng = np.random.default_rng(seed)
    q = rng.standard_normal((count, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    bound = 10.0 ** rng.uniform(*decades, size=(count, n))
    r = directions(rng, count, n)
    y = np.einsum("nij,nkj->nki", dcm.from_quaternion(q), r)
    if kind != "turned":
        return q, tilted(rng, y, bound, kind == "rim"), r, bound
    # all errors turn the same way, so that the attitude is as far off as they allow
    axis = directions(rng, count)[:, None, :]
    across = np.cross(axis, y)
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    return q, np.cos(bound)[..., None] * y + np.sin(bound)[..., None] * across, r, bound


def error_angle(q: Array, truth: Array) -> Array:
    """The angle between attitudes, the first as single precision gave it."""
    long = q.astype(np.float64)
    return np.asarray(quaternion.error_angle(long / np.linalg.norm(long, axis=1, keepdims=True), truth))


@pytest.mark.parametrize("kind", ["inside", "rim", "turned"])
@pytest.mark.parametrize("decades", DECADES)
@pytest.mark.parametrize("n", [2, 3, 6, 10])
def test_the_truth_is_within_the_bound(n: int, decades: tuple[float, float], kind: str) -> None:
    truth, b, r, eps = drawn(n, 600, n, decades, kind)
    q, bound, weights, verdict, status = kernel(n).batch(b, r, eps + 1e-15)
    assert not status.any()
    assert np.all(verdict != INCONSISTENT)
    assert np.all(quaternion.error_angle(q, truth) <= bound)
    assert np.all((bound == np.pi) == (verdict == UNBOUNDED))
    assert np.mean(verdict == OK) > 0.97
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=4e-16)
    np.testing.assert_array_equal(q, quaternion.canonical(q))


@pytest.mark.parametrize("kind", ["inside", "rim", "turned"])
@pytest.mark.parametrize("decades", [(-6, -4), (-4, -2), (-2, -0.46)])
@pytest.mark.parametrize("n", [3, 6])
def test_single_precision_holds_the_truth(n: int, decades: tuple[float, float], kind: str) -> None:
    truth, b, r, eps = drawn(50 + n, 600, n, decades, kind)
    # what the rounding of the data to single precision turns them by
    q, bound, _, verdict, status = kernel(n, "float").batch(b, r, eps * (1 + 2e-7) + 2e-7)
    assert not status.any()
    assert np.all(verdict != INCONSISTENT)
    assert np.all(error_angle(q, truth) <= bound)


def test_few_iterations_only_loosen_the_bound() -> None:
    n = 3
    truth, b, r, eps = drawn(7, 300, n, (-4, -0.46), "inside")
    _, best, _, _, _ = kernel(n).batch(b, r, eps)
    for iterations in (1, 3, 5):
        q, bound, *_ = kernel(n, "double", iterations).batch(b, r, eps)
        assert np.all(quaternion.error_angle(q, truth) <= bound)
        assert np.median(bound / best) >= 1.0
    assert np.median(bound / best) < 1.05


@pytest.mark.parametrize("real", ["double", "float"])
def test_no_false_alarm_and_every_gross_error(real: Real) -> None:
    n = 6
    _, b, r, eps = drawn(11, 3000, n, (-2, -1.3), "rim")
    _, _, _, verdict, _ = kernel(n, real).batch(b, r, eps + 2e-7)
    assert np.all(verdict != INCONSISTENT)
    rng = np.random.default_rng(12)
    turned = b.copy()
    turned[:, 0] = tilted(rng, b[:, 0], np.full(len(b), 0.6), boundary=True)
    _, bound, _, verdict, _ = kernel(n, real).batch(turned, r, eps)
    assert np.mean(verdict == INCONSISTENT) > 0.99
    assert np.all(bound[verdict == INCONSISTENT] >= np.pi)


@pytest.mark.parametrize("real", ["double", "float"])
def test_vectors_that_say_nothing_are_not_looked_at(real: Real) -> None:
    truth, b, r, eps = drawn(13, 300, 3, (-3, -1), "inside")
    rng = np.random.default_rng(14)
    full_b, full_r, full_eps = np.zeros((300, 6, 3)), np.zeros((300, 6, 3)), np.full((300, 6), np.pi)
    rows = np.array([rng.permutation(6)[:3] for _ in range(300)])
    index = np.arange(300)[:, None]
    full_b[index, rows], full_r[index, rows], full_eps[index, rows] = b, r, eps
    q, bound, weights, verdict, status = kernel(6, real).batch(full_b, full_r, full_eps)
    assert not status.any()
    assert np.all(verdict == OK)
    assert np.all(error_angle(q, truth) <= bound)
    outside = np.ones((300, 6), dtype=bool)
    outside[index, rows] = False
    assert np.all(weights[outside] == 0)
    _, alone, _, _, _ = kernel(3, real).batch(b, r, eps)
    np.testing.assert_allclose(bound, alone, rtol=1e-4 if real == "double" else 3e-2)
