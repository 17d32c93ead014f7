"""Attitude functions: the virtual machine against SciPy, half turns, rounded and hostile quaternions."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.symbolic import attitude_functions as functions
from optsat.symbolic.generated_function import GeneratedFunction

HALF = np.sqrt(0.5)
HALF_TURNS = np.array(
    [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0.6, 0.8, 0, 0], [0, 0.6, -0.8, 0], [-0.6, 0, 0.8, 0]]
)
GIMBAL_LOCK = np.array([[0, HALF, 0, HALF], [0, -HALF, 0, HALF], [0.5, 0.5, -0.5, 0.5], [0.5, -0.5, 0.5, 0.5]])


def some(count: int) -> Array:
    q = np.random.default_rng(11).normal(size=(count, 4))
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def canonical(q: Array) -> Array:
    return np.asarray(quaternion.canonical(q))


def rotations(q: Array) -> Rotation:
    """SciPy's rotation from N to B components."""
    return Rotation.from_quat(q).inv()


@pytest.fixture(scope="module")
def attitudes() -> Array:
    return np.vstack((some(500), HALF_TURNS, GIMBAL_LOCK, [[0, 0, 0, 1], [0, 0, 0, -1], [1e-9, 0, 0, 1]]))


def test_matrix_both_ways(attitudes: Array) -> None:
    A = functions.dcm_from_quaternion().batch(attitudes)
    np.testing.assert_allclose(A, rotations(attitudes).as_matrix(), atol=1e-15)
    back = functions.quaternion_from_dcm().batch(A)
    assert np.all(quaternion.error_angle(back, attitudes) < 2e-15)
    np.testing.assert_array_equal(back, canonical(back))


def test_modified_rodrigues_parameters_both_ways_and_the_switch(attitudes: Array) -> None:
    sigma = functions.mrp_from_quaternion().batch(attitudes)
    np.testing.assert_allclose(sigma, Rotation.from_quat(canonical(attitudes)).as_mrp(), atol=1e-15)
    assert np.all(np.linalg.norm(sigma, axis=1) <= 1 + 1e-15)
    outer = -sigma / np.maximum(np.sum(sigma**2, axis=1, keepdims=True), 1e-12)
    for either in (sigma, outer[:-3]):
        back = functions.quaternion_from_mrp().batch(either)
        assert np.all(quaternion.error_angle(back, attitudes[: len(either)]) < 4e-15)
    switch = functions.mrp_switch()
    np.testing.assert_array_equal(switch.batch(sigma[:500]), sigma[:500])
    np.testing.assert_allclose(switch.batch(outer[:500]), sigma[:500], atol=1e-15)
    np.testing.assert_array_equal(switch([0, 1, 0]), [0, 1, 0])


def test_rotation_vector_both_ways(attitudes: Array) -> None:
    phi = functions.rotation_vector_from_quaternion().batch(attitudes)
    np.testing.assert_allclose(phi, Rotation.from_quat(canonical(attitudes)).as_rotvec(), atol=2e-15)
    back = functions.quaternion_from_rotation_vector().batch(phi)
    assert np.all(quaternion.error_angle(back, attitudes) < 2e-15)
    np.testing.assert_array_equal(back[:500], canonical(back[:500]))


def test_euler_angles_both_ways(attitudes: Array) -> None:
    angles = functions.euler321_from_quaternion().batch(attitudes)
    np.testing.assert_allclose(angles[:500], Rotation.from_quat(attitudes[:500]).as_euler("ZYX"), atol=1e-12)
    back = functions.quaternion_from_euler321().batch(angles)
    assert np.all(quaternion.error_angle(back, attitudes) < 4e-15)
    locked = functions.euler321_from_quaternion().batch(GIMBAL_LOCK)
    np.testing.assert_array_equal(locked[:, 2], 0)
    np.testing.assert_allclose(np.abs(locked[:, 1]), np.pi / 2, atol=1e-15)


def test_composition_and_error_angle(attitudes: Array) -> None:
    other = np.roll(attitudes, 1, axis=0)
    product = functions.quaternion_compose().batch(attitudes, other)
    expected = rotations(attitudes) * rotations(other)
    np.testing.assert_allclose(functions.dcm_from_quaternion().batch(product), expected.as_matrix(), atol=2e-15)
    np.testing.assert_array_equal(product, canonical(product))
    angle = functions.quaternion_error_angle().batch(attitudes, other)
    # SciPy's magnitude is good to 1e-8 near a half turn only
    relative = rotations(attitudes) * rotations(other).inv()
    np.testing.assert_allclose(angle, relative.magnitude(), atol=1e-7)


@pytest.mark.parametrize("angle", [0.0, 1e-160, 1e-12, 1e-4, 1.0, np.pi - 1e-9, np.pi])
def test_error_angle_keeps_relative_accuracy(angle: float) -> None:
    q = np.array([0.1, -0.3, 0.2, np.sqrt(0.86)])
    turned = quaternion.compose(quaternion.exponential(angle * np.array([2, -1, 2]) / 3), q)
    measured = functions.quaternion_error_angle()(turned, q)
    assert measured == pytest.approx(angle, rel=1e-12 if angle > 1 else 1e-3, abs=2e-16)


TAKES_A_QUATERNION = [
    functions.dcm_from_quaternion,
    functions.mrp_from_quaternion,
    functions.rotation_vector_from_quaternion,
    functions.euler321_from_quaternion,
]


@pytest.mark.parametrize("make", TAKES_A_QUATERNION)
def test_length_plays_no_part(make: Callable[[], GeneratedFunction]) -> None:
    function = make()
    for q in some(20):
        np.testing.assert_allclose(function(1.01 * q), function(q), atol=1e-14)


@pytest.mark.parametrize("make", TAKES_A_QUATERNION)
@given(q=arrays(np.float64, 4, elements=st.floats(-1, 1)))
def test_finite_for_any_quaternion(make: Callable[[], GeneratedFunction], q: Array) -> None:
    assert np.all(np.isfinite(make()(q)))


@pytest.mark.parametrize("make", TAKES_A_QUATERNION)
def test_jacobians_at_the_identity_are_finite(make: Callable[[], GeneratedFunction]) -> None:
    function = make()
    jacobian = function.jacobian(function.outputs[0].name, "q_BN")
    for q in ([0, 0, 0, 1], [0.1, -0.3, 0.2, np.sqrt(0.86)]):
        assert np.all(np.isfinite(jacobian(q)))


def test_jacobian_of_the_matrix_against_complex_step() -> None:
    q = np.array([0.1, -0.3, 0.2, np.sqrt(0.86)])
    exact = functions.dcm_from_quaternion().jacobian("dcm_BN", "q_BN")(q)
    columns = []
    for k in range(4):
        x, y, z, w = (q + 1e-40j * np.eye(4)[k]) / np.sqrt(np.sum((q + 1e-40j * np.eye(4)[k]) ** 2))
        A = np.array(
            [
                [w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)],
                [2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)],
                [2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z],
            ]
        )
        columns.append(np.imag(A).ravel() / 1e-40)
    np.testing.assert_allclose(exact, np.stack(columns, axis=1), atol=1e-15)
