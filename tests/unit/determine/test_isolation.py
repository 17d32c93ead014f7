"""Isolation: the faulty measurement is named, ambiguity is admitted, and the union bound holds the truth."""

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion


def scene(seed: int, m: int) -> tuple[Array, Array, Array]:
    """Return true attitude and m directions with errors well inside 0.01 rad."""
    rng = np.random.default_rng(seed)
    q_BN = rng.standard_normal(4)
    q_BN /= np.linalg.norm(q_BN)
    r_N = rng.standard_normal((m, 3))
    r_N /= np.linalg.norm(r_N, axis=1, keepdims=True)
    b_B = r_N @ dcm.from_quaternion(q_BN).T + 0.002 * rng.standard_normal((m, 3))
    return q_BN, b_B / np.linalg.norm(b_B, axis=1, keepdims=True), r_N


@pytest.mark.parametrize("faulty", range(5))
def test_a_reversed_vector_of_five_is_found(faulty: int) -> None:
    q_BN, b_B, r_N = scene(faulty, 5)
    b_B[faulty] *= -1
    isolation = optsat.isolate(b_B, r_N, 0.01)
    assert isolation.candidates == ((faulty,),)
    assert isolation.isolated
    assert isolation.centre is isolation.attitudes[0]
    assert quaternion.error_angle(isolation.attitudes[0].q_BN, q_BN) <= isolation.bound_rad
    assert isolation.bound_rad == isolation.attitudes[0].bound_rad


def test_two_faults_of_seven() -> None:
    _, b_B, r_N = scene(11, 7)
    b_B[[1, 4]] *= -1
    assert optsat.isolate(b_B, r_N, 0.01).candidates == ((1, 4),)
    assert optsat.isolate(b_B, r_N, 0.01, most=1).candidates == ()


def test_consistent_data_need_no_removal() -> None:
    _, b_B, r_N = scene(12, 4)
    isolation = optsat.isolate(b_B, r_N, 0.01)
    assert isolation.candidates == ((),)
    assert isolation.bound_rad == optsat.certify_attitude(b_B, r_N, 0.01).bound_rad


def test_when_no_removal_helps() -> None:
    _, b_B, r_N = scene(13, 3)
    b_B[0] *= -1
    isolation = optsat.isolate(b_B, r_N, 0.01, most=0)
    assert (isolation.candidates, isolation.attitudes, isolation.centre) == ((), (), None)
    assert np.isnan(isolation.bound_rad)
    assert not isolation.isolated


def test_two_directions_cannot_tell_which_is_wrong() -> None:
    _, b_B, r_N = scene(14, 2)
    b_B[0] *= -1
    isolation = optsat.isolate(b_B, r_N, 0.01)
    assert isolation.candidates == ((0,), (1,))
    assert isolation.bound_rad == np.pi


@pytest.mark.parametrize("seed", range(20))
def test_the_union_bound_holds_the_truth(seed: int) -> None:
    """Three directions and one small fault: often several removals help, and the truth is in the union of all."""
    q_BN, b_B, r_N = scene(seed, 4)
    rng = np.random.default_rng(seed)
    b_B[0] += 0.06 * rng.standard_normal(3)
    b_B[0] /= np.linalg.norm(b_B[0])
    isolation = optsat.isolate(b_B, r_N, 0.01)
    if (0,) in isolation.candidates:
        assert isolation.centre is not None
        assert quaternion.error_angle(isolation.centre.q_BN, q_BN) <= isolation.bound_rad
        for attitude in isolation.attitudes:
            apart = quaternion.error_angle(isolation.centre.q_BN, attitude.q_BN)
            assert apart + attitude.bound_rad <= isolation.bound_rad * (1 + 1e-12)
