"""Batch certification: the same answers as one by one, whatever the mixture of poses."""

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.attitude.status import AttitudeStatus


def mixed_poses(m: int, count: int) -> tuple[Array, Array, Array]:
    """Return poses of which some are inconsistent, some collinear, some hopelessly wide."""
    rng = np.random.default_rng(m)
    r_N = rng.standard_normal((count, m, 3))
    r_N /= np.linalg.norm(r_N, axis=-1, keepdims=True)
    q_BN = rng.standard_normal((count, 4))
    q_BN /= np.linalg.norm(q_BN, axis=-1, keepdims=True)
    bound = 10 ** rng.uniform(-3, -0.5, (count, m))
    b_B = np.einsum("nij,nmj->nmi", dcm.from_quaternion(q_BN), r_N)
    b_B += 0.3 * bound[..., None] * rng.standard_normal(b_B.shape)
    r_N[1::7, 1] = r_N[1::7, 0]
    b_B[1::7, 1] = b_B[1::7, 0]
    b_B[3::7, 0] *= -1
    bound[5::7] = 2.5
    return b_B / np.linalg.norm(b_B, axis=-1, keepdims=True), r_N, bound


@pytest.mark.parametrize(("m", "count"), [(2, 210), (3, 42), (1, 7)])
def test_batch_equals_single(m: int, count: int) -> None:
    b_B, r_N, bound = mixed_poses(max(m, 2), count)
    b_B, r_N, bound = b_B[:, :m], r_N[:, :m], bound[:, :m]
    batch = optsat.certify_attitude_batch(b_B, r_N, bound)
    assert len(batch) == count
    for k in range(count):
        one = optsat.certify_attitude(b_B[k], r_N[k], bound[k])
        assert batch.statuses[batch.status_index[k]] is one.status
        assert batch.bound_rad[k] == pytest.approx(one.bound_rad, rel=1e-9, nan_ok=True)
        if m == 2:
            # the optimum over the weights of three and more is flat
            np.testing.assert_allclose(batch.weights[k], one.weights, rtol=0, atol=1e-8)
        if one.status is AttitudeStatus.OK:
            assert quaternion.error_angle(batch.q_BN[k], one.q_BN) <= 1e-5 * one.bound_rad
    if m > 1:
        assert all(part.any() for part in (batch.ok, batch.inconsistent, batch.unbounded))
    assert np.all(batch.ok.astype(int) + batch.inconsistent + batch.unbounded == 1)
    assert np.all(np.isnan(batch.bound_rad) == batch.inconsistent)
    assert np.all((batch.bound_rad == np.pi) == batch.unbounded)
    assert np.all(batch.q_BN[:, 3] >= 0)
    assert np.all(batch.weights >= 0)
    np.testing.assert_allclose(batch.weights.sum(axis=1), 1, atol=1e-12)


def test_two_vectors_across_the_block_size() -> None:
    b_B, r_N, bound = mixed_poses(2, 2100)
    whole = optsat.certify_attitude_batch(b_B, r_N, bound)
    tail = optsat.certify_attitude_batch(b_B[2000:], r_N[2000:], bound[2000:])
    for name in ("q_BN", "bound_rad", "weights", "status_index"):
        np.testing.assert_array_equal(getattr(whole, name)[2000:], getattr(tail, name))


def test_touching_poses_take_the_careful_path() -> None:
    angles = np.array([1.0, 1.03, 1.03 + 5e-13, 1.03 + 2e-12])
    b_B = np.stack(
        [np.stack([np.ones(4), 0 * angles, 0 * angles], 1), np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1)],
        1,
    )
    r_N = np.broadcast_to(b_B[0], b_B.shape)
    batch = optsat.certify_attitude_batch(b_B, r_N, (0.02, 0.01))
    assert batch.inconsistent.tolist() == [False, False, False, True]
    assert np.all(batch.bound_rad[1:3] < 1e-6)


def test_bounds_broadcast() -> None:
    b_B, r_N, _ = mixed_poses(2, 14)
    scalar = optsat.certify_attitude_batch(b_B, r_N, 0.1)
    for bound in ((0.1, 0.1), np.full((14, 2), 0.1)):
        np.testing.assert_array_equal(optsat.certify_attitude_batch(b_B, r_N, bound).bound_rad, scalar.bound_rad)


def test_no_poses() -> None:
    batch = optsat.certify_attitude_batch(np.zeros((0, 2, 3)), np.zeros((0, 2, 3)), 0.1)
    assert len(batch) == 0
    assert batch.q_BN.shape == (0, 4)
