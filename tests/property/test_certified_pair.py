"""Certified attitude of two vectors as straight-line code: its bound holds the truth, and is that of the solver."""

import numpy as np
import pytest
from bounded_draws import directions, tilted
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from optsat import certify_attitude_batch
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.determine import CertifiedBatch
from optsat.estimators.certified_pair import certified_two_vector
from optsat.export.catalogue import build
from optsat.kernels.lowering import lower
from optsat.symbolic.generated_function import GeneratedFunction

KERNEL = certified_two_vector()
OK, UNBOUNDED, INCONSISTENT = 0.0, 1.0, 2.0
B = np.array([[1, 0, 0], [0.28, 0.96, 0]])
R = np.array([[0, 0.6, 0.8], [0.936, 0, 0.352]])


def drawn(
    seed: int, count: int, decades: tuple[float, float], boundary: bool, spread: float = 0.0
) -> tuple[Array, Array, Array, Array]:
    """True attitudes, b_B, r_N (count, 2, 3) and bounds whose errors they keep; directions `spread` apart unless 0."""
    rng = np.random.default_rng(seed)
    q = rng.standard_normal((count, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    bound = 10.0 ** rng.uniform(*decades, size=(count, 2))
    r = directions(rng, count, 2)
    if spread:
        r[:, 1] = r[:, 0] + spread * r[:, 1]
        r /= np.linalg.norm(r, axis=2, keepdims=True)
    y = np.einsum("nij,nkj->nki", dcm.from_quaternion(q), r)
    return q, tilted(rng, y, bound, boundary), r, bound


def test_worked_numbers() -> None:
    q, bound, weights, status = KERNEL(B, R, [0.02, 0.05])
    assert bound == pytest.approx(0.06128948345, abs=1e-11)
    np.testing.assert_allclose(q, [-0.6633877527, -0.5937671156, -0.3843981676, 0.2441215899], atol=2e-8)
    assert weights[0] == pytest.approx(0.60479512, abs=1e-7)
    assert weights.sum() == pytest.approx(1)
    assert status == OK


@pytest.mark.parametrize("spread", [0.0, 1e-1, 1e-3])
@pytest.mark.parametrize("boundary", [True, False], ids=["boundary", "inside"])
@pytest.mark.parametrize("decades", [(-13, -12), (-11, -10), (-9, -8), (-9, -0.46), (-4, -1), (-1.5, -0.46)])
def test_the_truth_is_within_the_bound(decades: tuple[float, float], boundary: bool, spread: float) -> None:
    truth, b, r, eps = drawn(1, 3000, decades, boundary, spread)
    q, bound, _, status = KERNEL.batch(b, r, eps)
    assert np.all(quaternion.error_angle(q, truth) <= bound)
    assert np.all(status != INCONSISTENT)
    assert np.all((bound == np.pi) == (status == UNBOUNDED))
    np.testing.assert_array_equal(q, quaternion.canonical(q))


@pytest.mark.parametrize(("decades", "loosest"), [((-9, -8), 2e-3), ((-6, -4), 1e-6), ((-3, -0.46), 1e-8)])
def test_the_bound_is_that_of_the_solver(decades: tuple[float, float], loosest: float) -> None:
    _, b, r, eps = drawn(2, 2000, decades, boundary=True)
    q, bound, weights, status = KERNEL.batch(b, r, eps)
    solved = certify_attitude_batch(b, r, eps)
    np.testing.assert_array_equal(status, solved.status_index)
    both = status == OK
    # the solver's proof holds for any weights and allows for more rounding, which shows where the bounds are tiny
    assert np.all(bound[both] <= solved.bound_rad[both] * (1 + 1e-9))
    assert np.all(bound[both] >= solved.bound_rad[both] * (1 - loosest))
    assert np.max(quaternion.error_angle(q, solved.q_BN)[both] / bound[both]) < 1e-3
    np.testing.assert_allclose(weights[both], solved.weights[both], atol=1e-3)


def test_status_numbers_are_those_of_the_batch() -> None:
    assert [status.value for status in CertifiedBatch.statuses] == ["ok", "unbounded", "inconsistent"]


@pytest.mark.parametrize("excess", [-1e-9, -1e-12, 0.0, 5e-13])
def test_touching_cones_leave_one_attitude(excess: float) -> None:
    angle = 1.0 + 0.03 + excess
    b = [[1, 0, 0], [np.cos(angle), np.sin(angle), 0]]
    q, bound, _, status = KERNEL(b, [[1, 0, 0], [np.cos(1.0), np.sin(1.0), 0]], [0.02, 0.01])
    assert status == OK
    assert bound < 2e-5
    # the first error takes two thirds of the mismatch
    turned = quaternion.error_angle(q, [0, 0, np.sin(-0.01), np.cos(-0.01)])
    assert min(turned, quaternion.error_angle(q, [0, 0, np.sin(0.01), np.cos(0.01)])) <= bound + 1e-9


def test_inconsistent_exactly_where_the_mismatch_exceeds_the_bounds() -> None:
    rng = np.random.default_rng(3)
    count = 2000
    eps = 10.0 ** rng.uniform(-6, -1, size=(count, 2))
    angle = rng.uniform(0.3, 2.0, count)
    for excess, expected in ((1e-3, INCONSISTENT), (3e-12, INCONSISTENT), (-3e-12, OK), (-1e-8, OK)):
        apart = (
            angle + eps.sum(axis=1) * (1 + (excess if excess == 1e-3 else 0)) + (excess if excess != 1e-3 else 3e-12)
        )
        b, r = (
            np.stack([np.broadcast_to([1.0, 0, 0], (count, 3)), np.stack([np.cos(a), np.sin(a), 0 * a], 1)], axis=1)
            for a in (apart, angle)
        )
        _, bound, _, status = KERNEL.batch(b, r, eps)
        decided = status != UNBOUNDED
        np.testing.assert_array_equal(status[decided], expected)
        assert np.mean(decided) > 0.98
        assert np.all(bound[status == INCONSISTENT] == np.pi)


@pytest.mark.parametrize("bounds", [(0.0, 0.01), (0.01, 0.0), (0.0, 0.0), (1e-12, 0.3)])
def test_a_pair_without_error_is_matched(bounds: tuple[float, float]) -> None:
    truth = np.array([0.1, -0.3, 0.2, np.sqrt(0.86)])
    b = R @ dcm.from_quaternion(truth).T
    q, bound, weights, status = KERNEL(b, R, bounds)
    assert status == OK
    assert quaternion.error_angle(q, truth) <= bound
    sharp = int(np.argmin(bounds))
    np.testing.assert_allclose(quaternion.transform(q, R[sharp]), b[sharp], atol=1e-7)
    if bounds == (0.0, 0.0):
        assert bound < 1e-11
    else:
        assert weights[sharp] > 0.99


@pytest.mark.parametrize("half_turn", [[1, 0, 0, 0], [0, 1, 0, 0], [0.6, 0, 0.8, 0]])
def test_half_turns(half_turn: list[float]) -> None:
    b = R @ dcm.from_quaternion(np.array(half_turn, dtype=float)).T
    q, bound, _, status = KERNEL(b, R, [1e-9, 1e-9])
    assert status == OK
    assert quaternion.error_angle(q, half_turn) <= bound < 1e-8


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["parallel", "antiparallel"])
@pytest.mark.parametrize(
    ("b", "r"),
    [
        ([1, 0, 0], [0, 0.6, 0.8]),
        ([0.6, 0.8, 0], [0.6, 0.8, 0]),
        ([1, 0, 0], [-1, 0, 0]),
        ([0, 0.6, -0.8], [0, -0.6, 0.8]),
    ],
)
def test_collinear_vectors_give_the_smallest_rotation(b: list[float], r: list[float], sign: float) -> None:
    first_B, first_N = np.array(b, dtype=float), np.array(r, dtype=float)
    q, bound, _, status = KERNEL([first_B, sign * first_B], [first_N, sign * first_N], [0.02, 0.01])
    assert (status, bound) == (UNBOUNDED, np.pi)
    np.testing.assert_allclose(quaternion.transform(q, first_N), first_B, atol=1e-15)
    assert quaternion.error_angle(q, [0, 0, 0, 1]) == pytest.approx(np.arccos(first_B @ first_N), abs=1e-12)


def test_wide_bounds_determine_nothing() -> None:
    for bounds in ((2.0, 2.0), (np.pi, 0.1), (np.pi, np.pi)):
        _, bound, _, status = KERNEL(B, R, bounds)
        assert (status, bound) == (UNBOUNDED, np.pi)


NUMBERS = st.floats(-1e6, 1e6) | st.sampled_from([0.0, 1.0, -1.0, 1e-100, 1e100])
ROWS = arrays(np.float64, (2, 3), elements=NUMBERS)


@given(b=ROWS, r=ROWS, eps=arrays(np.float64, 2, elements=st.floats(0, 3.14) | st.sampled_from([0.0, 1e-300, 1e-12])))
def test_any_numbers_give_a_unit_quaternion_and_a_bound(b: Array, r: Array, eps: Array) -> None:
    q, bound, weights, status = KERNEL(b, r, eps)
    assert np.all(np.isfinite([*q, bound, *weights, status]))
    assert np.linalg.norm(q) == pytest.approx(1, abs=1e-14)
    assert q[3] >= 0
    assert 0 <= bound <= np.pi
    assert status in (OK, UNBOUNDED, INCONSISTENT)


@given(seed=st.integers(0, 2**32 - 1), order=st.booleans(), lengths=arrays(np.float64, 4, elements=st.floats(0.1, 10)))
def test_pairs_may_be_exchanged_and_vectors_of_any_length(seed: int, order: bool, lengths: Array) -> None:
    _, b, r, eps = (array[0] for array in drawn(seed, 1, (-6, -1), boundary=True))
    q, bound, weights, status = KERNEL(b, r, eps)
    step = -1 if order else 1
    other = KERNEL((lengths[:2, None] * b)[::step], (lengths[2:, None] * r)[::step], eps[::step])
    assert status == other[3]
    assert bound == pytest.approx(other[1], rel=1e-6)
    if status == OK:
        assert quaternion.error_angle(q, other[0]) <= 1e-4 * bound
        np.testing.assert_allclose(weights, other[2][::step], atol=1e-4)


def test_size_and_libm() -> None:
    program = lower(KERNEL.casadi)
    assert program.libm == ("atan2", "sin")


def test_float_kernel_is_built_for_its_rounding() -> None:
    kernel = build("certified_two_vector", "float")
    assert isinstance(kernel, GeneratedFunction)
    _, narrow, _, _ = KERNEL(R, R, [1e-7, 1e-7])
    _, wide, _, _ = kernel(R, R, [1e-7, 1e-7])
    # eight roundings of float on each bound: 1e-6 rad
    assert 5 * narrow < wide < 50 * narrow
