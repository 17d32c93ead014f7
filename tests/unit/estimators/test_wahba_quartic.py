"""Wahba by the quartic: worked numbers, an eigenvalue routine, SciPy, half turns, vectors that leave a turn free."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation
from single_precision import SinglePrecision

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.davenport import davenport_matrix
from optsat.errors import InputError
from optsat.estimators.wahba_quartic import wahba_quartic
from optsat.export.catalogue import build
from optsat.symbolic.generated_function import GeneratedFunction

SIZES = (2, 3, 4, 10)
ROUNDING = 2.0**-52


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def drawn(
    rng: np.random.Generator, count: int, vectors: int, sigma: float, half_turn: bool = False, spread: float = 0.0
) -> tuple[Array, Array, Array]:
    """Vectors b_B, r_N with errors of `sigma`, within `spread` of each other unless that is 0, and weights."""
    q = rng.normal(size=(count, 4))
    q[:, 3] *= not half_turn
    r = rng.normal(size=(count, vectors, 3))
    r = unit(unit(r[:, :1]) + spread * r if spread else r)
    # SciPy's matrix is the transpose of A(q)
    b = r @ Rotation.from_quat(unit(q)).as_matrix()
    return unit(b + sigma * rng.normal(size=b.shape)), r, rng.uniform(0.1, 1.0, size=(count, vectors))


def reference(b: Array, r: Array, weights: Array) -> tuple[Array, Array, Array]:
    """Optimal quaternions, largest eigenvalues and gaps by LAPACK."""
    values, columns = np.linalg.eigh(davenport_matrix(b, r, weights))
    return columns[..., -1], values[..., -1], values[..., -1] - values[..., -2]


def test_worked_numbers_of_the_paper_vectors() -> None:
    r = np.array([[-0.54, -0.326, 0.775], [-0.673, 0.000133, 0.74]])
    b = np.array([[-0.776, -0.46, 0.43], [-0.927, 0.01, 0.374]])
    q, value, gap, determined = wahba_quartic(2)(b, r, [0.5, 0.5])
    np.testing.assert_allclose(q, [-0.07072628, 0.21221665, 0.01255887, 0.97457897], atol=5e-9)
    assert value == pytest.approx(0.99657533, abs=5e-9)
    # the eigenvalues are +-0.99657533 and +-0.90865114
    assert gap == pytest.approx(1 / (1 / (0.99657533 - 0.90865114) + 1 / 1.90522647 + 1 / 1.99315066), rel=1e-6)
    assert determined == 1
    q, value, _, _ = wahba_quartic(2)(unit(b), unit(r), [0.5, 0.5])
    np.testing.assert_allclose(q, [-0.07073959, 0.21220963, 0.01253971, 0.97457978], atol=5e-9)
    assert value == pytest.approx(0.99732066, abs=5e-9)


def test_worked_numbers_of_two_pairs() -> None:
    b = [[1, 0, 0], [0.28, 0.96, 0]]
    r = [[0, 0.6, 0.8], [0.936, 0, 0.352]]
    _, value, _, determined = wahba_quartic(2)(b, r, [0.5, 0.5])
    assert value == pytest.approx(0.99999965261, abs=1e-11)
    assert determined == 1


@pytest.mark.parametrize("sigma", [0.0, 1e-4, 1e-2, 0.1])
@pytest.mark.parametrize("vectors", SIZES)
def test_as_good_as_an_eigenvalue_routine(vectors: int, sigma: float) -> None:
    b, r, weights = drawn(np.random.default_rng(vectors), 4000, vectors, sigma)
    q, value, gap, determined = wahba_quartic(vectors).batch(b, r, weights)
    best, largest, distance = reference(b, r, weights)
    # rounding over the relative gap is what the attitude is determined to, whatever the method
    assert np.max(quaternion.error_angle(q, best) * distance / largest) < 20 * ROUNDING
    np.testing.assert_allclose(value, largest, rtol=4e-15 / np.min(distance / largest))
    assert np.all(determined == 1)
    assert np.all(gap <= distance * (1 + 1e-6))
    assert np.all(gap >= distance / 3 * (1 - 1e-6))
    np.testing.assert_array_equal(q, quaternion.canonical(q))
    if vectors == 10:
        assert np.max(quaternion.error_angle(q, best)) < 1e-14


@pytest.mark.parametrize("vectors", SIZES)
def test_half_turns_are_no_special_case(vectors: int) -> None:
    b, r, weights = drawn(np.random.default_rng(1), 2000, vectors, 1e-3, half_turn=True)
    q, _, _, determined = wahba_quartic(vectors).batch(b, r, weights)
    best, largest, distance = reference(b, r, weights)
    assert np.max(quaternion.error_angle(q, best) * distance / largest) < 20 * ROUNDING
    assert np.all(determined == 1)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, -0.8, 0], [0, 0.6, -0.8]])
def test_exact_half_turns(axis: list[float]) -> None:
    e = np.array(axis)
    b = (2 * np.outer(e, e) - np.eye(3)).T
    q, _, _, determined = wahba_quartic(3)(b, np.eye(3), [1, 1, 1])
    np.testing.assert_allclose(q, [*(e * np.sign(e[np.flatnonzero(e)[0]])), 0], atol=1e-15)
    assert determined == 1


def test_against_scipy() -> None:
    b, r, weights = drawn(np.random.default_rng(3), 50, 4, 1e-2)
    q, value, _, _ = wahba_quartic(4).batch(b, r, weights)
    for k in range(50):
        rotation, loss = Rotation.align_vectors(b[k], r[k], weights[k])
        # SciPy turns r into b; its quaternion is the conjugate
        assert quaternion.error_angle(q[k], quaternion.inverse(rotation.as_quat())) < 1e-13
        # SciPy's loss is sqrt(sum w |b - A r|^2)
        assert 2 * (weights[k].sum() - value[k]) == pytest.approx(loss**2, abs=1e-13)


def test_lengths_count_as_weights() -> None:
    b, r, weights = drawn(np.random.default_rng(4), 200, 3, 1e-2)
    lengths = np.random.default_rng(5).uniform(0.01, 100.0, size=(200, 3))
    plain, scaled = (
        wahba_quartic(3).batch(*args) for args in ((b, r, weights * lengths), (b * lengths[..., None], r, weights))
    )
    assert np.max(quaternion.error_angle(plain[0], scaled[0])) < 1e-11
    np.testing.assert_allclose(plain[2], scaled[2], rtol=1e-9)


@pytest.mark.parametrize("spread", [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-9])
@pytest.mark.parametrize("vectors", SIZES)
def test_what_is_called_determined_is(vectors: int, spread: float) -> None:
    b, r, weights = drawn(np.random.default_rng(6), 2000, vectors, 1e-3 * spread, spread=spread)
    q, _, _, determined = wahba_quartic(vectors).batch(b, r, weights)
    best, largest, distance = reference(b, r, weights)
    relative, sure = distance / largest, determined == 1
    assert np.max(quaternion.error_angle(q, best)[sure] * relative[sure], initial=0.0) < 1e-11
    assert np.all(sure[relative > 1e-6])
    assert not np.any(sure[relative < 1e-8])
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1, atol=4e-16)


@pytest.mark.parametrize("sigma", [0.3, 1.0, 3.0])
def test_gross_contradictions_are_solved_or_not_called_determined(sigma: float) -> None:
    b, r, weights = drawn(np.random.default_rng(7), 4000, 4, sigma)
    q, _, gap, determined = wahba_quartic(4).batch(b, r, weights)
    best, largest, distance = reference(b, r, weights)
    sure = determined == 1
    assert np.mean(sure) > 0.95
    assert np.max((quaternion.error_angle(q, best) * distance / largest)[sure]) < 1e-11
    assert np.all(gap[sure] <= distance[sure] * (1 + 1e-6))


@pytest.mark.parametrize(
    ("b", "r", "weights"),
    [
        ([[1, 0, 0], [1, 0, 0]], [[0, 0, 1], [0, 0, 1]], [1, 1]),
        ([[1, 0, 0], [-1, 0, 0]], [[0, 0, 1], [0, 0, -1]], [1, 1]),
        ([[0.6, 0.8, 0], [0.6, 0.8, 0]], [[0, 0.28, 0.96], [0, 0.28, 0.96]], [0.3, 0.7]),
        ([[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [0, 1, 0]], [1, 0]),
    ],
    ids=["parallel", "antiparallel", "oblique", "one weight zero"],
)
def test_one_direction_leaves_a_turn_free(b: list[list[float]], r: list[list[float]], weights: list[float]) -> None:
    q, value, gap, determined = wahba_quartic(2)(b, r, weights)
    assert determined == 0
    assert gap < 1e-7 * sum(weights)
    assert value == pytest.approx(sum(weights), rel=1e-7)
    # one of the attitudes that fit, all the same
    heavy = int(np.argmax(weights))
    np.testing.assert_allclose(quaternion.transform(q, np.array(r[heavy])), b[heavy], atol=0.2)


def test_no_weight_at_all_gives_the_identity() -> None:
    q, value, gap, determined = wahba_quartic(2)(np.eye(3)[:2], np.eye(3)[:2], [0, 0])
    np.testing.assert_array_equal(q, [0, 0, 0, 1])
    assert (value, gap, determined) == (pytest.approx(0, abs=1e-149), 0, 0)


def test_a_mirror_image_has_three_equal_eigenvalues() -> None:
    q, _, _, determined = wahba_quartic(3)(np.diag([1.0, 1, -1]), np.eye(3), [1, 1, 1])
    assert np.linalg.norm(q) == pytest.approx(1)
    assert determined == 0


NUMBERS = st.floats(-1e6, 1e6) | st.sampled_from([0.0, 1.0, -1.0, 1e-160, 1e60])


@pytest.mark.parametrize("kernel", [wahba_quartic(2), wahba_quartic(4)], ids=["2", "4"])
@given(data=st.data())
def test_any_numbers_give_a_unit_quaternion(kernel: GeneratedFunction, data: st.DataObject) -> None:
    n = kernel.inputs[0].shape[0]
    b, r = (data.draw(arrays(np.float64, (n, 3), elements=NUMBERS)) for _ in range(2))
    weights = data.draw(arrays(np.float64, n, elements=st.floats(0, 1e6)))
    q, value, gap, determined = kernel(b, r, weights)
    assert np.all(np.isfinite([*q, value, gap, determined]))
    assert np.linalg.norm(q) == pytest.approx(1, abs=1e-14)
    assert q[3] >= 0
    assert value >= 0
    assert gap >= 0


@pytest.mark.parametrize("vectors", SIZES)
def test_in_single_precision(vectors: int) -> None:
    kernel = build(f"wahba_{vectors}", "float")
    assert isinstance(kernel, GeneratedFunction)
    for sigma, spread in ((1e-3, 0.0), (1e-3, 0.1), (0.0, 1e-3), (0.0, 1e-6)):
        exact = drawn(np.random.default_rng(8), 2000, vectors, sigma, spread=spread)
        b, r, weights = (np.asarray(np.float32(value), np.float64) for value in exact)
        q, value, gap, determined = SinglePrecision(kernel).batch(b, r, weights)
        best, largest, distance = reference(b, r, weights)
        relative, sure = distance / largest, determined == 1
        assert np.all(np.isfinite(np.column_stack((q, value, gap))))
        np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1, atol=3e-7)
        error = quaternion.error_angle(unit(q), best)
        assert np.max(error[sure] * relative[sure], initial=0.0) < 256 * 2.0**-23
        assert np.all(sure[relative > 2e-3])


def test_jacobian_by_the_vectors_against_differences() -> None:
    b, r, weights = (value[0] for value in drawn(np.random.default_rng(9), 1, 3, 1e-2))
    kernel = wahba_quartic(3)
    exact = kernel.jacobian("q_BN", "b_B")(b, r, weights)
    columns = []
    for k in range(9):
        nudge = 1e-6 * np.eye(9)[k].reshape(3, 3)
        columns.append((kernel(b + nudge, r, weights)[0] - kernel(b - nudge, r, weights)[0]) / 2e-6)
    np.testing.assert_allclose(exact, np.stack(columns, axis=1), atol=1e-7)


def test_nothing_of_libm_and_no_more_vectors_than_offered() -> None:
    from optsat.kernels.lowering import lower

    assert lower(wahba_quartic(4).casadi).libm == ()
    for bad in (1, 11, 2.5):
        with pytest.raises(InputError, match="`vectors` must be a whole number from 2 to 10"):
            wahba_quartic(bad)  # type: ignore[arg-type]
