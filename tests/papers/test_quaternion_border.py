"""The border between the fault-diagnosis paper's quaternions (scalar first, Hamilton, body to inertial) and q_BN."""

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.models.draws import rotations
from optsat.models.star_tracker import StarTracker

RNG = np.random.default_rng(20)
COUNT = 50


def hamilton(a: Array, b: Array) -> Array:
    """The product as the paper writes it: scalar a0 b0 - av.bv, vector a0 bv + b0 av + av x bv."""
    scalar = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    vector = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate((scalar, vector), axis=-1)


def body_to_inertial(q: Array, v_B: Array) -> Array:
    """v_W = q (x) v_B (x) q*."""
    pure = np.concatenate((np.zeros((*v_B.shape[:-1], 1)), v_B), axis=-1)
    return hamilton(hamilton(q, pure), q * [1.0, -1.0, -1.0, -1.0])[..., 1:]


def S(q: Array) -> Array:
    q0, q1, q2, q3 = q
    return np.array([[-q1, -q2, -q3], [q0, -q3, q2], [q3, q0, -q1], [-q2, q1, q0]])


def Omega(w: Array) -> Array:
    x, y, z = w
    return np.array([[0, -x, -y, -z], [x, 0, z, -y], [y, -z, 0, x], [z, y, -x, 0]])


def scalar_first(count: int) -> Array:
    return np.asarray(quaternion.to_scalar_first(rotations(RNG, count)))


def test_the_four_numbers_reordered_are_the_attitude_from_inertial_to_body() -> None:
    q, v_B = scalar_first(COUNT), RNG.standard_normal((COUNT, 3))
    q_BN = quaternion.from_scalar_first(q)
    v_N = body_to_inertial(q, v_B)
    np.testing.assert_allclose(quaternion.transform(q_BN, v_N), v_B, atol=2e-15)
    np.testing.assert_allclose(dcm.from_quaternion(q_BN).swapaxes(-1, -2) @ v_B[..., None], v_N[..., None], atol=2e-15)


def test_the_product_runs_the_other_way() -> None:
    p, q = scalar_first(COUNT), scalar_first(COUNT)
    ours = quaternion.compose(quaternion.from_scalar_first(q), quaternion.from_scalar_first(p))
    np.testing.assert_allclose(quaternion.from_scalar_first(hamilton(p, q)), quaternion.canonical(ours), atol=4e-16)
    A = [dcm.from_quaternion(quaternion.from_scalar_first(each)) for each in (hamilton(p, q), q, p)]
    np.testing.assert_allclose(A[0], A[1] @ A[2], atol=2e-15)


def test_both_forms_of_the_kinematics_are_ours() -> None:
    for q, w in zip(scalar_first(COUNT), RNG.standard_normal((COUNT, 3)), strict=True):
        np.testing.assert_allclose(S(q) @ w, Omega(w) @ q, atol=1e-15)
        q_BN = np.roll(q, -1)
        np.testing.assert_allclose(np.roll(0.5 * S(q) @ w, -1), quaternion.derivative(q_BN, w), atol=1e-15)
        np.testing.assert_allclose(
            Omega(w) @ q, hamilton(q, np.r_[0.0, w]), atol=1e-15, err_msg="Omega(w) q is q (x) [0, w]"
        )


def test_star_tracker_noise_stands_on_the_body_side() -> None:
    q, noise = scalar_first(COUNT), 0.1 * RNG.standard_normal((COUNT, 4))
    nu = noise + np.array([1.0, 0.0, 0.0, 0.0])
    nu /= np.linalg.norm(nu, axis=-1, keepdims=True)
    measured = StarTracker().measurement().batch(quaternion.from_scalar_first(q), np.roll(noise, -1, axis=-1))
    np.testing.assert_allclose(measured, quaternion.from_scalar_first(hamilton(q, nu)), atol=4e-16)


def test_star_tracker_error_is_twice_the_vector_part() -> None:
    tracker = StarTracker()
    noise = tracker.draw(RNG, 2000)
    q_BN = rotations(RNG, 2000)
    turn = quaternion.compose(tracker.measurement().batch(q_BN, noise), quaternion.inverse(q_BN))
    error = 2 * turn[:, :3] * np.sign(turn[:, 3:])
    # the length of 1 + noise enters in second order: 3e-3 of the error at most
    np.testing.assert_allclose(error, 2 * noise[:, :3], atol=1e-5)
    sigma_deg = np.degrees(np.sqrt(np.diag(tracker.rotation_covariance)))
    assert sigma_deg == pytest.approx([0.0548, 0.0506, 0.0711], abs=1e-4)


def test_the_additive_covariance_of_the_paper_is_an_approximation() -> None:
    """L(q) R L(q)^T less its radial part is neither diagonal nor invertible; R as printed is off by up to two."""
    q = scalar_first(1)[0]
    L = np.stack([hamilton(q, unit) for unit in np.eye(4)], axis=-1)
    R = 1e-7 * np.diag([1.98, 2.29, 1.95, 3.85])
    radial = np.eye(4) - np.outer(q, q)
    covariance = radial @ L @ R @ L.T @ radial
    noise = np.roll(StarTracker().draw(RNG, 200_000), 1, axis=-1) + np.array([1.0, 0.0, 0.0, 0.0])
    noise /= np.linalg.norm(noise, axis=-1, keepdims=True)
    sampled = np.cov((hamilton(np.broadcast_to(q, noise.shape), noise)).T)
    np.testing.assert_allclose(sampled, covariance, atol=0.02 * R.max())
    assert np.linalg.eigvalsh(covariance)[0] < 1e-9 * R.max()
