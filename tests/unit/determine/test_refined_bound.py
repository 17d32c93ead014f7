"""Refined bounds against an independent random search for the admissible attitude that is farthest away."""

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.determine import Refinement

SEEDS = range(5)


def problem(seed: int) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(seed)
    m = 3 + seed % 3
    q_BN = rng.standard_normal(4)
    q_BN /= np.linalg.norm(q_BN)
    r_N = rng.standard_normal((m, 3))
    r_N /= np.linalg.norm(r_N, axis=1, keepdims=True)
    bound = 10 ** rng.uniform(-2.5, -1, m)
    b_B = r_N @ dcm.from_quaternion(q_BN).T + 0.4 * bound[:, None] * rng.standard_normal((m, 3)) / np.sqrt(3)
    return b_B / np.linalg.norm(b_B, axis=1, keepdims=True), r_N, bound


def slack(data: AdmissibleSet, q_BN: Array) -> Array:
    """Return bound less angle of every pair (..., m) [rad], written down once more."""
    y = np.einsum("...ij,mj->...mi", dcm.from_quaternion(q_BN), data.r_N)
    return np.asarray(data.angle_bound_rad - 2 * np.arcsin(np.minimum(np.linalg.norm(data.b_B - y, axis=-1) / 2, 1)))


def farthest_admissible(data: AdmissibleSet, q_BN: Array, reach: float, seed: int) -> Array:
    """Return admissible attitudes (24, 4) that 24 random walks pushed as far from q_BN as they could."""
    rng = np.random.default_rng(seed)
    walkers = np.tile(q_BN, (24, 1))
    best = np.minimum(slack(data, walkers).min(axis=-1), 0.0)
    for k in range(400):
        step = reach * 0.5 * 0.985**k * rng.standard_normal((24, 3))
        moved = quaternion.compose(quaternion.exponential(step), walkers)
        # first into the set, then outwards within it
        value = np.minimum(slack(data, moved).min(axis=-1), 0.0)
        value = np.where(value < 0, value, quaternion.error_angle(moved, q_BN))
        better = value > best
        walkers, best = np.where(better[:, None], moved, walkers), np.where(better, value, best)
    return np.asarray(walkers[best > 0])


@pytest.mark.parametrize("refine", ["cells", "subpaving"])
def test_refined_bound_between_search_and_first_bound(refine: Refinement) -> None:
    ratios, gains = [], []
    for seed in SEEDS:
        b_B, r_N, bound = problem(seed)
        first = optsat.certify_attitude(b_B, r_N, bound)
        refined = optsat.certify_attitude(b_B, r_N, bound, refine=refine)
        data = refined.certificate.admissible
        found = farthest_admissible(data, refined.q_BN, first.bound_rad, seed)
        assert len(found)
        inner = float(quaternion.error_angle(found, refined.q_BN).max())
        assert inner <= refined.bound_rad <= first.bound_rad
        # no ball can be smaller than half the largest distance between two admissible attitudes
        apart = quaternion.error_angle(found[:, None, :], found[None, :, :]).max()
        assert apart / 2 <= refined.bound_rad
        ratios.append(refined.bound_rad / inner)
        gains.append(refined.bound_rad / first.bound_rad)
    assert np.mean(ratios) <= 1.15
    assert np.min(gains) < 0.95


def test_first_bound_of_two_vectors_is_exact() -> None:
    for seed in SEEDS[:3]:
        b_B, r_N, bound = (part[:2] for part in problem(seed))
        attitude = optsat.certify_attitude(b_B, r_N, bound)
        found = farthest_admissible(attitude.certificate.admissible, attitude.q_BN, attitude.bound_rad, seed)
        inner = quaternion.error_angle(found, attitude.q_BN).max()
        assert 0.97 * attitude.bound_rad <= inner <= attitude.bound_rad
        for refine in ("cells", "subpaving"):
            refined = optsat.certify_attitude(b_B, r_N, bound, refine=refine)
            assert inner * 0.99 <= refined.bound_rad <= attitude.bound_rad
