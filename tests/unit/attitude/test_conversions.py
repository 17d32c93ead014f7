"""Conversions between attitude representations: worked numbers, SciPy, edges and singular places."""

from collections.abc import Callable
from types import ModuleType

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from optsat.arrays import Array
from optsat.attitude import dcm, euler321, frames, mrp, quaternion, rotation_vector
from optsat.attitude.backend import Value
from optsat.errors import InputError

MODULES = [dcm, euler321, mrp, rotation_vector]
HALF = np.sqrt(0.5)
AWKWARD = np.array(
    [
        [0, 0, 0, 1],
        [1, 0, 0, 0],
        [0, 1, 0, 0],
        [0, 0, 1, 0],
        [HALF, HALF, 0, 0],
        [0, HALF, -HALF, 0],
        [0, HALF, 0, HALF],
        [0, -HALF, 0, HALF],
        [0.5, 0.5, 0.5, 0.5],
        [0.5, -0.5, 0.5, 0.5],
        [1e-9, 0, 0, 1],
        [1e-170, 1e-170, 0, 1],
        [0.6, 0.8, 0, 1e-17],
    ]
)


def some(count: int) -> Array:
    return quaternion.from_scipy(Rotation.random(count, rng=np.random.default_rng(5)))


def test_worked_matrix() -> None:
    expected = [[2 / 15, 14 / 15, -1 / 3], [-2 / 3, 1 / 3, 2 / 3], [11 / 15, 2 / 15, 2 / 3]]
    np.testing.assert_allclose(dcm.from_quaternion(np.array([1, 2, 3, 4]) / np.sqrt(30)), expected, atol=1e-15)


def test_against_scipy() -> None:
    q = some(500)
    R = quaternion.to_scipy(q)
    np.testing.assert_allclose(dcm.from_quaternion(q), np.swapaxes(R.as_matrix(), -1, -2), atol=1e-14)
    np.testing.assert_allclose(rotation_vector.from_quaternion(q), R.as_rotvec(), atol=1e-14)
    np.testing.assert_allclose(mrp.from_quaternion(q), R.as_mrp(), atol=1e-14)
    # SciPy's intrinsic "ZYX" turns the axes as 3-2-1 does
    np.testing.assert_allclose(euler321.from_quaternion(q), R.as_euler("ZYX"), atol=1e-12)
    angles = euler321.from_quaternion(q)
    np.testing.assert_allclose(
        euler321.to_quaternion(angles), quaternion.from_scipy(Rotation.from_euler("ZYX", angles)), atol=1e-14
    )


@pytest.mark.parametrize("module", MODULES, ids=lambda m: m.__name__.rpartition(".")[2])
def test_round_trip_everywhere(module: ModuleType) -> None:
    q = np.vstack((some(500), AWKWARD))
    back = module.to_quaternion(module.from_quaternion(q))
    assert np.max(quaternion.error_angle(back, q)) < 2e-15
    assert np.all(back[:, 3] >= 0)
    np.testing.assert_array_equal(quaternion.canonical(back), back)


@pytest.mark.parametrize("module", MODULES, ids=lambda m: m.__name__.rpartition(".")[2])
def test_casadi_gives_the_numbers_of_numpy(module: ModuleType) -> None:
    q = np.vstack((some(50), AWKWARD))
    symbol = ca.SX.sym("q", 4)
    converted = module.from_quaternion(symbol)
    there = ca.Function("there", [symbol], [converted])
    back = ca.Function("back", [symbol], [module.to_quaternion(converted)])
    expected = module.from_quaternion(q)
    for row, value in zip(q, expected, strict=True):
        got = there(row).full()
        np.testing.assert_allclose(got if got.shape[1] > 1 else got[:, 0], value, rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(
            back(row).full()[:, 0], module.to_quaternion(module.from_quaternion(row)), rtol=1e-14, atol=1e-15
        )


@pytest.mark.parametrize("convert", [mrp.from_quaternion, rotation_vector.from_quaternion, dcm.from_quaternion])
def test_jacobians_exist_at_the_identity(convert: Callable[[Value], Value]) -> None:
    symbol = ca.SX.sym("q", 4)
    jacobian = ca.Function("J", [symbol], [ca.jacobian(convert(symbol), symbol)])(quaternion.identity()).full()
    assert np.all(np.isfinite(jacobian))
    if convert is rotation_vector.from_quaternion:
        np.testing.assert_allclose(jacobian[:, :3], 2 * np.eye(3))


def test_exponential_jacobian_at_zero() -> None:
    phi = ca.SX.sym("phi", 3)
    jacobian = ca.Function("J", [phi], [ca.jacobian(quaternion.exponential(phi), phi)])(np.zeros(3)).full()
    np.testing.assert_allclose(jacobian, np.vstack((np.eye(3) / 2, np.zeros(3))))


@pytest.mark.parametrize("angle", [np.pi, 3.5, 2 * np.pi - 1e-9, 2 * np.pi, 2 * np.pi + 1e-9, 9.0])
def test_rotation_vectors_beyond_pi(angle: float) -> None:
    axis = np.array([2, -1, 2]) / 3
    phi = rotation_vector.from_quaternion(rotation_vector.to_quaternion(angle * axis))
    expected = angle - 2 * np.pi * np.round(angle / (2 * np.pi)) if angle != np.pi else np.pi
    np.testing.assert_allclose(phi, expected * axis, atol=4e-15)
    assert np.linalg.norm(phi) <= np.pi * (1 + 1e-15)


def test_small_rotation_vectors_keep_relative_accuracy() -> None:
    for size in (1e-150, 1e-12, 1e-4, 0.0199, 0.02, 0.0201):
        phi = size * np.array([2, -1, 2]) / 3
        np.testing.assert_allclose(rotation_vector.from_quaternion(rotation_vector.to_quaternion(phi)), phi, rtol=4e-15)


def test_matrix_refuses_what_is_no_rotation() -> None:
    with pytest.raises(InputError, match=r"`dcm_BN` .*a reflection"):
        dcm.to_quaternion(np.diag([1, 1, -1]))
    with pytest.raises(InputError, match=r"row 1 \|A A\^T - I\| was 3"):
        dcm.to_quaternion(np.stack((np.eye(3), 2 * np.eye(3))))
    with pytest.raises(InputError, match=r"\(..., 3, 3\)"):
        dcm.to_quaternion(np.eye(4))


def test_mrp_shadow() -> None:
    sigma = mrp.from_quaternion(some(20))
    assert np.max(np.linalg.norm(sigma, axis=-1)) <= 1
    other = mrp.shadow(sigma)
    np.testing.assert_allclose(mrp.to_quaternion(other), mrp.to_quaternion(sigma), atol=1e-15)
    np.testing.assert_allclose(mrp.canonical(other), sigma, atol=1e-15)
    assert np.array_equal(mrp.canonical(sigma), sigma)
    with pytest.raises(InputError, match="`sigma_BN` must not be the zero vector: row 1 is"):
        mrp.shadow([[1, 0, 0], [0, 0, 0]])


def test_mrp_composition_and_inverse() -> None:
    p, q = mrp.from_quaternion(some(40)[:20]), mrp.from_quaternion(some(40)[20:])
    expected = dcm.from_quaternion(mrp.to_quaternion(p)) @ dcm.from_quaternion(mrp.to_quaternion(q))
    np.testing.assert_allclose(dcm.from_quaternion(mrp.to_quaternion(mrp.compose(p, q))), expected, atol=2e-15)
    np.testing.assert_allclose(mrp.compose(p, mrp.inverse(p)), np.zeros((20, 3)), atol=1e-15)


def test_mrp_kinematics_follows_the_quaternion() -> None:
    q, omega, h = some(30), np.array([0.3, -0.2, 0.5]), 1e-6
    # away from the shadow switch, where the differences would jump
    q = q[np.linalg.norm(mrp.from_quaternion(q), axis=-1) < 0.9]
    ahead, behind = (mrp.from_quaternion(quaternion.propagate(q, omega, s * h)) for s in (1, -1))
    rate = mrp.derivative(mrp.from_quaternion(q), omega)
    np.testing.assert_allclose(rate, (ahead - behind) / (2 * h), atol=1e-9)


def test_euler_angles_are_the_three_elementary_rotations() -> None:
    yaw, pitch, roll = np.random.default_rng(2).uniform(-1.5, 1.5, (3, 40))
    expected = frames.rotation_x(roll) @ frames.rotation_y(pitch) @ frames.rotation_z(yaw)
    q = euler321.to_quaternion(np.stack((yaw, pitch, roll), axis=-1))
    np.testing.assert_allclose(dcm.from_quaternion(q), expected, atol=1e-15)


@pytest.mark.parametrize("side", [1, -1])
def test_gimbal_lock_gives_all_to_yaw(side: int) -> None:
    q = euler321.to_quaternion([0.3, side * np.pi / 2, 0.5])
    yaw, pitch, roll = euler321.from_quaternion(q)
    assert roll == 0
    assert pitch == pytest.approx(side * np.pi / 2, abs=1e-15)
    assert yaw == pytest.approx(0.3 - side * 0.5, abs=1e-15)
    for distance in 10.0 ** -np.arange(3, 17):
        near = euler321.to_quaternion([0.3, side * (np.pi / 2 - distance), 0.5])
        assert quaternion.error_angle(euler321.to_quaternion(euler321.from_quaternion(near)), near) < 1e-12


def test_euler_angles_stay_in_their_ranges() -> None:
    angles = euler321.from_quaternion(np.vstack((some(500), AWKWARD, -some(10))))
    assert np.all((angles[:, [0, 2]] > -np.pi) & (angles[:, [0, 2]] <= np.pi))
    assert np.all(np.abs(angles[:, 1]) <= np.pi / 2)
    assert euler321.from_quaternion([0, 0, 1, 0]).tolist() == [np.pi, 0, 0]
    assert euler321.from_quaternion([0, 0, -1, 0]).tolist() == [np.pi, 0, 0]


def test_orbital_frame() -> None:
    r, v = np.array([7e6, 0, 0]), np.array([100.0, 0, 7.5e3])
    A = frames.orbital_dcm(r, v)
    np.testing.assert_allclose(A @ r, [0, 0, -7e6], atol=1e-9)
    np.testing.assert_allclose(A @ np.cross(r, v), [0, -7e6 * 7.5e3, 0], atol=1e-4)
    assert (A @ v)[0] == pytest.approx(7.5e3)
    assert np.linalg.det(A) == pytest.approx(1)
    np.testing.assert_allclose(frames.orbital_rate(r, v), [0, -7.5e3 / 7e6, 0])
    with pytest.raises(InputError, match="parallel in row 1"):
        frames.orbital_dcm(np.stack((r, r)), np.stack((v, 1e-4 * r)))
    with pytest.raises(InputError, match="`v_N` must not be the zero vector"):
        frames.orbital_dcm(r, [0, 0, 0])


def test_orbital_rate_turns_the_orbital_frame() -> None:
    from optsat.models.orbit import KeplerOrbit

    motion = KeplerOrbit(8e6, 0.1, 1.0, 0.4, 0.3, 0.2).motion()
    A, ahead, behind = (frames.orbital_dcm(*motion(t)) for t in (100.0, 100.01, 99.99))
    x, y, z = frames.orbital_rate(*motion(100.0))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    np.testing.assert_allclose((ahead - behind) / 0.02, -cross @ A, atol=1e-11)


def test_numpy_arrays_of_samples_are_rows_of_single_ones() -> None:
    q = some(12).reshape(3, 4, 4)
    for module in MODULES:
        whole = module.from_quaternion(q)
        single = module.from_quaternion(q[2, 1])
        np.testing.assert_array_equal(whole[2, 1], single)
        assert module.to_quaternion(whole).shape == (3, 4, 4)
