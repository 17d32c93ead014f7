"""Group laws of every attitude representation, over attitudes that hypothesis picks to hurt."""

from types import ModuleType

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optsat.arrays import Array
from optsat.attitude import dcm, euler321, mrp, quaternion, rotation_vector

component = st.sampled_from([0.0, 1.0, -1.0, 1e-9, -1e-5, 1e-3]) | st.floats(-1, 1)
raw = st.tuples(component, component, component, component).map(np.array)
unit = raw.filter(lambda q: np.linalg.norm(q) > 1e-4).map(lambda q: q / np.linalg.norm(q))
rate = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)

REPRESENTATIONS = pytest.mark.parametrize(
    "module", [dcm, euler321, mrp, rotation_vector], ids=lambda m: m.__name__.rpartition(".")[2]
)


def same(p: Array, q: Array, tolerance: float = 2e-15) -> bool:
    return bool(quaternion.error_angle(p / np.linalg.norm(p), q / np.linalg.norm(q)) <= tolerance)


@given(unit, unit, unit)
def test_composition_is_associative(p: Array, q: Array, r: Array) -> None:
    left = quaternion.compose(quaternion.compose(p, q), r)
    np.testing.assert_allclose(left, quaternion.compose(p, quaternion.compose(q, r)), atol=2e-15)


@given(unit)
def test_identity_and_inverse(q: Array) -> None:
    one = quaternion.identity()
    np.testing.assert_array_equal(quaternion.compose(one, q), quaternion.compose(q, one))
    assert same(quaternion.compose(q, one), q)
    np.testing.assert_allclose(quaternion.compose(q, quaternion.inverse(q)), one, atol=1e-15)


@given(unit, unit)
def test_matrices_multiply_as_quaternions_compose(p: Array, q: Array) -> None:
    product = dcm.from_quaternion(p) @ dcm.from_quaternion(q)
    np.testing.assert_allclose(dcm.from_quaternion(quaternion.compose(p, q)), product, atol=3e-15)
    np.testing.assert_allclose(dcm.from_quaternion(quaternion.inverse(q)), dcm.from_quaternion(q).T, atol=0)


@given(unit, rate)
def test_transform_keeps_lengths_and_inverts(q: Array, r_N: Array) -> None:
    b_B = quaternion.transform(q, r_N)
    assert np.linalg.norm(b_B) == pytest.approx(np.linalg.norm(r_N), rel=1e-14, abs=1e-300)
    np.testing.assert_allclose(quaternion.transform(quaternion.inverse(q), b_B), r_N, atol=1e-14)


@given(unit)
def test_canonical_is_one_of_the_two_and_idempotent(q: Array) -> None:
    c = quaternion.canonical(q)
    assert c[3] >= 0
    assert same(c, q)
    np.testing.assert_array_equal(quaternion.canonical(c), c)
    np.testing.assert_array_equal(quaternion.canonical(-q), c)


@given(unit, unit, unit)
def test_error_angle_is_an_invariant_metric(p: Array, q: Array, r: Array) -> None:
    pq, qr, pr = (quaternion.error_angle(*pair) for pair in ((p, q), (q, r), (p, r)))
    assert pr <= pq + qr + 1e-14
    assert 0 <= pq <= np.pi
    assert quaternion.error_angle(q, p) == pytest.approx(pq, abs=1e-15)
    turned = quaternion.error_angle(quaternion.compose(p, r), quaternion.compose(q, r))
    assert turned == pytest.approx(pq, abs=1e-14)


@given(unit, rate, st.floats(-2, 2), st.floats(-2, 2))
def test_propagation_adds_up(q: Array, omega: Array, first: float, second: float) -> None:
    twice = quaternion.propagate(quaternion.propagate(q, omega, first), omega, second)
    np.testing.assert_allclose(twice, quaternion.propagate(q, omega, first + second), atol=1e-14)


@REPRESENTATIONS
@given(q=unit)
def test_round_trip(module: ModuleType, q: Array) -> None:
    back = module.to_quaternion(module.from_quaternion(q))
    assert same(back, q)
    np.testing.assert_array_equal(back, quaternion.canonical(back))


@REPRESENTATIONS
@given(q=unit)
def test_both_signs_of_a_quaternion_convert_alike(module: ModuleType, q: Array) -> None:
    plus, minus = module.from_quaternion(q), module.from_quaternion(-q)
    assert same(module.to_quaternion(plus), module.to_quaternion(minus))


@given(unit, unit)
def test_casadi_and_numpy_compose_alike(p: Array, q: Array) -> None:
    left, right = ca.SX.sym("p", 4), ca.SX.sym("q", 4)
    function = ca.Function("f", [left, right], [quaternion.compose(left, right)])
    np.testing.assert_allclose(function(p, q).full()[:, 0], quaternion.compose(p, q), rtol=1e-15, atol=2e-16)


@given(unit, unit)
def test_mrp_composition_follows_the_quaternions(p: Array, q: Array) -> None:
    sigma = mrp.compose(mrp.from_quaternion(p), mrp.from_quaternion(q))
    assert np.linalg.norm(sigma) <= 1 + 1e-15
    assert same(mrp.to_quaternion(sigma), quaternion.compose(p, q), 1e-14)
