"""Edge cases of the robust Wahba specification, section 12, each by its name."""

import itertools

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.attitude.status import AttitudeStatus
from optsat.solution import Proof

AXES = np.eye(3)
PAIR = np.array([(1.0, 0.0, 0.0), (0.6, 0.8, 0.0)])
Q = np.array([0.1, -0.7, 0.5, 0.5])


def body(r_N: Array, q_BN: Array = Q) -> Array:
    return np.asarray(r_N @ dcm.from_quaternion(q_BN).T)


def planar(angle_rad: float) -> Array:
    return np.array([(1, 0, 0), (np.cos(angle_rad), np.sin(angle_rad), 0)])


@pytest.mark.parametrize(
    "r_N",
    [AXES[:1], AXES[[0, 0]], AXES[[0, 0, 0]] * [[1], [-1], [1]]],
    ids=["one vector", "collinear", "anti-parallel"],
)
def test_a_free_rotation_is_named_with_its_axis(r_N: Array) -> None:
    attitude = optsat.certify_attitude(body(r_N), r_N, 0.1)
    assert (attitude.status, attitude.proof) == (AttitudeStatus.UNBOUNDED, Proof.UNDECIDED)
    assert attitude.bound_rad == np.pi
    assert attitude.unobservable_axis_B is not None
    np.testing.assert_allclose(np.abs(attitude.unobservable_axis_B @ body(AXES[:1])[0]), 1, atol=1e-12)
    assert "Attitude not observable: the rotation about [" in attitude.message()
    assert "Add a direction off that axis" in attitude.message()
    assert attitude.certificate.verify()
    # the smallest of all rotations that bring the directions together
    smallest = quaternion.error_angle(attitude.q_BN, quaternion.identity())
    cosine = float(AXES[0] @ body(AXES[:1])[0])
    assert smallest == pytest.approx(np.arccos(cosine), abs=1e-9)
    np.testing.assert_allclose(r_N @ attitude.dcm_BN.T, body(r_N), atol=1e-9)


def test_wahba_of_a_free_rotation_is_the_smallest_one() -> None:
    answer = optsat.wahba(body(AXES[:1]), AXES[:1]).answer
    assert answer.status is AttitudeStatus.UNBOUNDED
    axis = np.cross(body(AXES[:1])[0], AXES[0])
    axis /= np.linalg.norm(axis)
    # A turns components by minus the angle about the axis, hence the axis b x r
    half = np.arccos(AXES[0] @ body(AXES[:1])[0]) / 2
    assert quaternion.error_angle(answer.q_BN, np.append(np.sin(half) * axis, np.cos(half))) <= 1e-12
    np.testing.assert_allclose(np.abs(answer.free_axes_B @ body(AXES[:1])[0]), 1, atol=1e-12)


@pytest.mark.parametrize("bound", [0.0, 1e-9, 1e-7, 1e-3, 0.1])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_nearly_collinear(bound: float, sense: float) -> None:
    r_N = planar(1e-6) * [[1], [sense]]
    attitude = optsat.certify_attitude(body(r_N), r_N, bound)
    assert attitude.status in (AttitudeStatus.OK, AttitudeStatus.UNBOUNDED)
    assert np.all(np.isfinite(attitude.q_BN))
    assert quaternion.error_angle(attitude.q_BN, Q) <= attitude.bound_rad
    assert (attitude.status is AttitudeStatus.UNBOUNDED) == (bound > 1e-6)


@pytest.mark.parametrize("axis", [*AXES, (0.6, 0.8, 0.0), (0.0, -0.6, 0.8)])
def test_half_turn(axis: Array) -> None:
    q_BN = np.append(axis, 0.0)
    attitude = optsat.certify_attitude(body(PAIR, q_BN), PAIR, 0.01)
    assert quaternion.error_angle(attitude.q_BN, q_BN) <= 1e-12
    assert attitude.q_BN[3] >= 0
    assert optsat.wahba(body(AXES, q_BN), AXES).answer.q_BN[3] >= 0


@pytest.mark.parametrize("r_N", [PAIR, AXES, np.vstack((AXES, PAIR))], ids=["two", "three", "five"])
def test_no_error_at_all(r_N: Array) -> None:
    attitude = optsat.certify_attitude(body(r_N), r_N, 0.0)
    assert attitude.status is AttitudeStatus.OK
    assert attitude.bound_rad <= 1e-6
    assert quaternion.error_angle(attitude.q_BN, Q) <= min(1e-7, attitude.bound_rad)


def test_no_error_allowed_but_some_present() -> None:
    attitude = optsat.certify_attitude(planar(1.0), planar(1.0 + 1e-9), 0.0)
    assert attitude.status is AttitudeStatus.INCONSISTENT
    assert attitude.certificate.verify()


@pytest.mark.parametrize("tiny", [0.0, 1e-300, 1e-15, 1e-12, 1e-9])
@pytest.mark.parametrize("first", [0, 1])
def test_one_pair_without_error_is_the_limit_of_a_tiny_bound(tiny: float, first: int) -> None:
    r_N = AXES[:2]
    bound = np.roll((tiny, 0.01), first)
    attitude = optsat.certify_attitude(body(r_N), r_N, bound)
    assert attitude.bound_rad == pytest.approx(0.01, rel=1e-6)
    np.testing.assert_allclose(attitude.dcm_BN @ r_N[first], body(r_N)[first], atol=1e-9)


@pytest.mark.parametrize("bound", [np.pi / 2, 2.0, 3.0, np.nextafter(np.pi, 0)])
@pytest.mark.parametrize("r_N", [AXES[:2], AXES], ids=["two", "three"])
def test_huge_bounds(bound: float, r_N: Array) -> None:
    rng = np.random.default_rng(1)
    attitude = optsat.certify_attitude(body(r_N), r_N, bound)
    assert attitude.status in (AttitudeStatus.OK, AttitudeStatus.UNBOUNDED)
    turns = rng.standard_normal((2000, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    inside = turns[np.all(attitude.certificate.admissible.values(turns) >= 0, axis=1)]
    assert len(inside)
    assert np.all(quaternion.error_angle(inside, attitude.q_BN) <= attitude.bound_rad)


@pytest.mark.parametrize(("bound", "most"), [((0.02, 0.01), 5e-7), ((0.3, 0.1), 2e-6)])
@pytest.mark.parametrize("slack", [0.0, 1e-12, 1e-11])
def test_touching_cones_leave_one_attitude(bound: tuple[float, float], most: float, slack: float) -> None:
    b_B, r_N = planar(1.0 + sum(bound) - slack), planar(1.0)
    attitude = optsat.certify_attitude(b_B, r_N, bound)
    assert attitude.status is AttitudeStatus.OK
    # about the square root of slack and rounding together
    assert attitude.bound_rad <= most + 2 * np.sqrt(sum(bound) * slack)
    assert attitude.certificate.verify()


@pytest.mark.parametrize("bound", [(0.02, 0.01), (0.3, 0.1), (1e-6, 1e-3)])
def test_rounding_is_granted_up_to_1e_12_and_no_further(bound: tuple[float, float]) -> None:
    granted = optsat.certify_attitude(planar(1.0 + sum(bound) + 5e-13), planar(1.0), bound)
    assert granted.status is AttitudeStatus.OK
    assert granted.stats["inflation_rad"] == 1e-12
    np.testing.assert_array_equal(granted.certificate.admissible.angle_bound_rad, np.array(bound) + 1e-12)
    refused = optsat.certify_attitude(planar(1.0 + sum(bound) + 2e-12), planar(1.0), bound)
    assert refused.status is AttitudeStatus.INCONSISTENT
    assert refused.inconsistent_pairs == ((0, 1),)
    assert "(pairs 0 and 1 contradict each other)" in refused.message()


def test_pairs_beyond_their_bounds_are_flagged_and_no_others() -> None:
    rng = np.random.default_rng(2)
    for _ in range(2000):
        bound = 10.0 ** rng.uniform(-6, -0.7, 2)
        separation = rng.uniform(0.1, np.pi - 0.1)
        direction = rng.choice((-1, 1))
        beyond = rng.choice((-1, 1)) * 10 ** rng.uniform(-11, -1)
        angle = separation + direction * (bound.sum() + beyond)
        if not 0.01 < angle < np.pi - 0.01 or bound.sum() + beyond < 0:
            continue
        attitude = optsat.certify_attitude(planar(angle), planar(separation), bound)
        assert (attitude.status is AttitudeStatus.INCONSISTENT) == (beyond > 0), (bound, separation, beyond)


def test_a_thousand_directions() -> None:
    rng = np.random.default_rng(3)
    r_N = rng.standard_normal((1000, 3))
    r_N /= np.linalg.norm(r_N, axis=1, keepdims=True)
    b_B = body(r_N) + 0.001 * rng.uniform(-1, 1, (1000, 3))
    b_B /= np.linalg.norm(b_B, axis=1, keepdims=True)
    attitude = optsat.certify_attitude(b_B, r_N, 0.002)
    assert quaternion.error_angle(attitude.q_BN, Q) <= attitude.bound_rad <= 0.002 * np.sqrt(2)


def test_a_set_that_is_a_single_point() -> None:
    """Four errors on the rims of their cones, all pulling different ways: no attitude but the true one is left."""
    r_N = np.array([(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
    tilt = 0.05 * np.array([(0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0)])
    b_B = np.cos(0.05) * r_N + np.sin(0.05) * tilt / 0.05
    attitude = optsat.certify_attitude(body(b_B), r_N, 0.05 + 1e-15)
    assert attitude.status is AttitudeStatus.OK
    assert quaternion.error_angle(attitude.q_BN, Q) <= attitude.bound_rad
    assert attitude.certificate.verify()


@pytest.mark.parametrize("bound_deg", [70, 80, 88])
def test_bound_between_90_and_180_deg_is_theorem_1(bound_deg: float) -> None:
    bound = np.deg2rad(bound_deg)
    attitude = optsat.certify_attitude(AXES[:2], AXES[:2], bound)
    # two orthogonal directions at equal weights: eigenvalues 1 and 0 of K
    theorem = 2 * np.arcsin(np.sqrt(1 - np.cos(bound)))
    assert np.pi / 2 < theorem < np.pi
    assert attitude.bound_rad == pytest.approx(theorem, rel=1e-9)


def test_measured_opposite_to_the_truth() -> None:
    rng = np.random.default_rng(4)
    r_N = rng.standard_normal((5, 3))
    r_N /= np.linalg.norm(r_N, axis=1, keepdims=True)
    b_B = body(r_N)
    b_B[2] *= -1
    attitude = optsat.certify_attitude(b_B, r_N, 0.01)
    assert (attitude.status, attitude.proof) == (AttitudeStatus.INCONSISTENT, Proof.INFEASIBLE)
    assert 2 in set(itertools.chain(*attitude.inconsistent_pairs))
    assert optsat.isolate(b_B, r_N, 0.01).candidates == ((2,),)


def test_inconsistency_without_a_contradicting_pair() -> None:
    """A mirrored triad agrees pair by pair; only the weighted sum of all three proves that no rotation fits."""
    b_B = body(AXES) * [[1], [1], [-1]]
    attitude = optsat.certify_attitude(b_B, AXES, 0.1)
    assert attitude.status is AttitudeStatus.INCONSISTENT
    assert attitude.inconsistent_pairs == ()
    assert attitude.suspects == (0, 1, 2)
    assert attitude.certificate.pair is None
    assert attitude.certificate.verify()
    assert attitude.certificate.margin() > 0
    assert attitude.message() == "No attitude satisfies all 3 bounds."
    assert attitude.certificate.error_bound == 0.0


def test_cuts_shrink_the_set_and_can_empty_it() -> None:
    plain = optsat.certify_attitude(body(AXES), AXES, 0.1)
    cut = optsat.certify_attitude(body(AXES), AXES, 0.1, cuts=(body(AXES), AXES, np.full(3, np.cos(0.02))))
    assert cut.bound_rad < plain.bound_rad
    assert quaternion.error_angle(cut.q_BN, Q) <= cut.bound_rad
    assert cut.bound_rad == pytest.approx(optsat.certify_attitude(body(AXES), AXES, 0.02).bound_rad, rel=1e-5)
    assert cut.certificate.verify()
    # at the truth a cone has its whole versine to spare, and a cut 1 - c
    slack = cut.certificate.admissible.values(np.stack((Q, -Q)))
    np.testing.assert_allclose(slack, [np.repeat((1 - np.cos(0.1), 1 - np.cos(0.02)), 3)] * 2, atol=1e-15)
    empty = optsat.certify_attitude(body(AXES), AXES, 0.1, cuts=(body(AXES), AXES, (1.5, 0, 0)))
    assert empty.status is AttitudeStatus.INCONSISTENT
    assert empty.certificate.verify()


def test_results_read_well() -> None:
    attitude = optsat.certify_attitude(body(AXES), AXES, 0.01)
    assert attitude.bound_deg == pytest.approx(np.rad2deg(attitude.bound_rad))
    assert "Every attitude that satisfies all 3 bounds lies within" in attitude.message()
    assert attitude.certificate.error_bound == attitude.bound_rad
    assert attitude.eigen_gap > 0
    unbounded = optsat.certify_attitude(AXES, AXES, 2.0)
    assert unbounded.certificate.claim == "The data and their bounds leave the attitude undetermined."
    assert unbounded.certificate.margin() == 0.0
    with pytest.raises(optsat.InputError, match="only an attitude that is ok has an error ellipsoid"):
        unbounded.ellipsoid_B()


def test_refinement_needs_a_bound_to_refine() -> None:
    free = optsat.certify_attitude(AXES[:1], AXES[:1], 0.1, refine="cells")
    assert free.status is AttitudeStatus.UNBOUNDED
    wide = optsat.certify_attitude(AXES[:2], AXES[:2], 1.5, refine="subpaving")
    assert wide.certificate.refinement is None
