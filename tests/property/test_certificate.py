"""Certified attitudes: the truth is always inside, the answer turns with the data, no tampered certificate passes."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from bounded_draws import Pose, drawn_pose, poses
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import optsat
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.attitude.status import AttitudeStatus
from optsat.certificates.attitude_certificate import AttitudeCertificate
from optsat.problems.certified_attitude import CertifiedAttitude

many = settings(derandomize=True, max_examples=100)
some = settings(derandomize=True, max_examples=40)

seeds = st.integers(0, 2**32 - 1)


@st.composite
def plain_poses(draw: st.DrawFn, least: int = 2) -> Pose:
    """Poses with errors uniform in their cones and bounds within a factor 10: there the optimum is well determined."""
    middle = draw(st.floats(-5, -1))
    decades = draw(st.lists(st.floats(middle - 0.5, middle + 0.5), min_size=least, max_size=6))
    return drawn_pose(draw(seeds), tuple(decades), False)


long_enough = st.tuples(*[st.floats(-1, 1)] * 4).map(np.array).filter(lambda q: bool(np.linalg.norm(q) > 0.1))
unit_quaternions = long_enough.map(lambda q: q / np.linalg.norm(q))


def certified(pose: Pose, weights: Array | None = None) -> CertifiedAttitude:
    return optsat.certify_attitude(pose.b_B, pose.r_N, pose.angle_bound_rad, weights=weights)


def bounded(pose: Pose, weights: Array | None = None) -> CertifiedAttitude:
    attitude = certified(pose, weights)
    assume(attitude.status is AttitudeStatus.OK)
    return attitude


@many
@given(poses())
def test_truth_is_within_the_bound(pose: Pose) -> None:
    attitude = certified(pose)
    assert attitude.status is not AttitudeStatus.INCONSISTENT
    assert quaternion.error_angle(attitude.q_BN, pose.q_BN) <= attitude.bound_rad
    assert attitude.certificate.verify()
    assert attitude.certificate.margin() >= 0


@many
@given(poses(smallest=1e-9, largest=1e-6))
def test_truth_is_within_the_bound_of_tiny_errors(pose: Pose) -> None:
    attitude = certified(pose)
    assert attitude.status is not AttitudeStatus.INCONSISTENT
    assert quaternion.error_angle(attitude.q_BN, pose.q_BN) <= attitude.bound_rad


@many
@given(poses(least=2), seeds)
def test_truth_is_within_the_bound_of_any_weights(pose: Pose, seed: int) -> None:
    weights = np.random.default_rng(seed).random(len(pose.b_B)) ** 4
    attitude = certified(pose, weights)
    assert attitude.status is not AttitudeStatus.INCONSISTENT
    assert quaternion.error_angle(attitude.q_BN, pose.q_BN) <= attitude.bound_rad


@many
@given(poses(least=2))
def test_truth_is_inside_the_ellipsoid(pose: Pose) -> None:
    attitude = bounded(pose)
    error = quaternion.compose(pose.q_BN, quaternion.inverse(attitude.q_BN))
    gibbs = error[:3] / error[3]
    E = attitude.ellipsoid_B()
    assert gibbs @ E @ gibbs <= 1 + 1e-9
    # the ball is the smallest one around the ellipsoid
    longest = 1 / np.sqrt(np.linalg.eigvalsh(E)[0])
    assert 2 * np.arctan(longest) == pytest.approx(attitude.bound_rad, rel=1e-6)


@many
@given(poses(least=2))
def test_best_weights_are_no_worse_than_simple_ones(pose: Pose) -> None:
    best = bounded(pose)
    for weights in (np.ones(len(pose.b_B)), 1 / pose.angle_bound_rad, 1 / (1 - np.cos(pose.angle_bound_rad) + 1e-30)):
        simple = certified(pose, weights)
        if simple.bound_rad < 3 * pose.angle_bound_rad.max() and len(pose.b_B) == 2:
            assert best.bound_rad <= simple.bound_rad * (1 + 1e-5)
        assert quaternion.error_angle(best.q_BN, simple.q_BN) <= best.bound_rad + simple.bound_rad


@some
@given(plain_poses(), unit_quaternions, unit_quaternions, seeds)
def test_bound_does_not_depend_on_axes_order_or_lengths(pose: Pose, p: Array, t: Array, seed: int) -> None:
    """With new axes B' = p B and N' = t N the attitude is p (x) q (x) t^-1, and the bound is the same."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(pose.b_B))
    lengths = 10.0 ** rng.uniform(-100, 100, (2, len(order), 1))
    b_B = (pose.b_B @ dcm.from_quaternion(p).T)[order] * lengths[0]
    r_N = (pose.r_N @ dcm.from_quaternion(t).T)[order] * lengths[1]
    first = bounded(pose)
    second = optsat.certify_attitude(b_B, r_N, pose.angle_bound_rad[order], norm_policy="silent")
    expected = quaternion.compose(quaternion.compose(p, first.q_BN), quaternion.inverse(t))
    assert second.bound_rad == pytest.approx(first.bound_rad, rel=3e-9)
    # the best weights, and with them the centre, are known to half the digits of the bound
    assert quaternion.error_angle(second.q_BN, expected) <= 1e-4 * first.bound_rad


@some
@given(plain_poses(), unit_quaternions, unit_quaternions, seeds)
def test_given_weights_are_equivariant_to_rounding(pose: Pose, p: Array, t: Array, seed: int) -> None:
    rng = np.random.default_rng(seed)
    order, weights = rng.permutation(len(pose.b_B)), 0.1 + rng.random(len(pose.b_B))
    first = bounded(pose, weights)
    second = optsat.certify_attitude(
        (pose.b_B @ dcm.from_quaternion(p).T)[order],
        (pose.r_N @ dcm.from_quaternion(t).T)[order],
        pose.angle_bound_rad[order],
        weights=weights[order] * 1e9,
    )
    expected = quaternion.compose(quaternion.compose(p, first.q_BN), quaternion.inverse(t))
    assert second.bound_rad == pytest.approx(first.bound_rad, rel=1e-9)
    assert quaternion.error_angle(second.q_BN, expected) <= 1e-11


@some
@given(plain_poses(), seeds)
def test_wahba_is_equivariant_and_blind_to_scales(pose: Pose, seed: int) -> None:
    rng = np.random.default_rng(seed)
    weights = 0.1 + rng.random(len(pose.b_B))
    turn = rng.standard_normal(4)
    turn /= np.linalg.norm(turn)
    first = optsat.wahba(pose.b_B, pose.r_N, weights).answer
    b_B = pose.b_B @ dcm.from_quaternion(turn).T * 10.0 ** rng.uniform(-50, 50)
    second = optsat.wahba(b_B, pose.r_N, weights * 1e-200, norm_policy="silent").answer
    assert quaternion.error_angle(second.q_BN, quaternion.compose(turn, first.q_BN)) <= 1e-11
    assert second.loss == pytest.approx(first.loss, rel=1e-6, abs=1e-28)


@some
@given(plain_poses(), seeds)
def test_pair_of_weight_zero_is_absent(pose: Pose, seed: int) -> None:
    weights = 0.1 + np.random.default_rng(seed).random(len(pose.b_B))
    b_B, r_N = np.vstack((pose.b_B, -pose.b_B[:1])), np.vstack((pose.r_N, pose.r_N[:1]))
    padded = np.append(weights, 0.0)
    # so wide a bound that the reversed pair contradicts nothing
    bound = np.append(pose.angle_bound_rad, np.nextafter(np.pi, 0))
    first = bounded(pose, weights)
    second = optsat.certify_attitude(b_B, r_N, bound, weights=padded)
    assert second.bound_rad == pytest.approx(first.bound_rad, rel=1e-9)
    assert quaternion.error_angle(second.q_BN, first.q_BN) <= 1e-12
    plain, with_absent = optsat.wahba(pose.b_B, pose.r_N, weights), optsat.wahba(b_B, r_N, padded)
    assert quaternion.error_angle(plain.answer.q_BN, with_absent.answer.q_BN) <= 1e-12


@some
@given(poses(least=2))
def test_q_and_minus_q_are_the_same_claim(pose: Pose) -> None:
    certificate = bounded(pose).certificate
    assert certificate.q_BN[3] >= 0
    other = replace(certificate, q_BN=-certificate.q_BN)
    assert other.verify()
    assert other.margin() == pytest.approx(certificate.margin(), abs=1e-15)


@some
@given(poses(), seeds)
def test_json_round_trip_is_exact(pose: Pose, seed: int) -> None:
    certificate = certified(pose).certificate
    again = AttitudeCertificate.from_json(certificate.to_json())
    assert again.to_json() == certificate.to_json()
    np.testing.assert_array_equal(again.weights, certificate.weights)
    np.testing.assert_array_equal(again.admissible.b_B, certificate.admissible.b_B)
    assert again.bound_rad == certificate.bound_rad
    assert again.verify() == certificate.verify()


def tampered(certificate: AttitudeCertificate, seed: int) -> dict[str, AttitudeCertificate]:
    """Return certificates of which each claims a little more than its data prove."""
    rng = np.random.default_rng(seed)
    data, heavy = certificate.admissible, int(np.argmax(certificate.weights))
    axis = rng.standard_normal(3)
    axis *= np.tan(5e-4 * certificate.bound_rad) / np.linalg.norm(axis)
    turn = np.append(axis, 1.0) / np.sqrt(1 + axis @ axis)

    def changed(values: Array, place: int, value: float) -> Array:
        copy = values.copy()
        copy[place] = value
        return copy

    # the cone whose width the bound rests on most
    widest = int(np.argmax(certificate.weights * data.cone_versine))
    wider = changed(data.angle_bound_rad, widest, data.angle_bound_rad[widest] * 1.01)
    longer = data.b_B.copy()
    longer[heavy] *= 1 + 1e-9
    return {
        "negative weight": replace(certificate, weights=changed(certificate.weights, heavy, -0.1)),
        "NaN weight": replace(certificate, weights=changed(certificate.weights, heavy, np.nan)),
        "no weight": replace(certificate, weights=np.zeros_like(certificate.weights)),
        "turned": replace(certificate, q_BN=quaternion.compose(turn, certificate.q_BN)),
        "not a unit quaternion": replace(certificate, q_BN=certificate.q_BN * (1 - 1e-12)),
        "lowered": replace(certificate, bound_rad=certificate.bound_rad * (1 - 1e-6)),
        "NaN bound": replace(certificate, bound_rad=np.nan),
        "wider cone": replace(certificate, admissible=replace(data, angle_bound_rad=wider)),
        "stretched direction": replace(certificate, admissible=replace(data, b_B=longer)),
        "no attitude at all": replace(certificate, status=AttitudeStatus.INCONSISTENT, bound_rad=0.0),
        "contradiction": replace(certificate, status=AttitudeStatus.INCONSISTENT, bound_rad=0.0, pair=(0, 1)),
        "unbounded with a bound": replace(certificate, status=AttitudeStatus.UNBOUNDED),
    }


@some
@given(plain_poses(), seeds)
def test_tampered_certificates_are_rejected(pose: Pose, seed: int) -> None:
    certificate = bounded(pose).certificate
    for name, forgery in tampered(certificate, seed).items():
        verdict = forgery.verify()
        assert not verdict, name
        assert verdict.reason


@many
@given(poses(least=2), seeds)
def test_a_moved_direction_is_rejected_when_the_bound_grows(pose: Pose, seed: int) -> None:
    certificate = bounded(pose).certificate
    data = certificate.admissible
    rng = np.random.default_rng(seed)
    row = int(rng.integers(len(data.b_B)))
    b_B = data.b_B.copy()
    b_B[row] += 0.3 * data.angle_bound_rad[row] * rng.standard_normal(3)
    b_B[row] /= np.linalg.norm(b_B[row])
    moved = replace(certificate, admissible=replace(data, b_B=b_B))
    recomputed = float(moved.ball().bound_rad)
    if recomputed > certificate.bound_rad * (1 + 1e-9):
        assert not moved.verify()
    elif recomputed < certificate.bound_rad * (1 - 1e-9):
        assert moved.verify()


@many
@given(poses(least=2), st.floats(1.0, 2.0))
def test_a_wider_claim_stands(pose: Pose, factor: float) -> None:
    certificate = bounded(pose).certificate
    wider = replace(certificate, bound_rad=min(certificate.bound_rad * factor, np.pi))
    assert wider.verify()
    assert wider.margin() >= 0


@many
@given(poses(least=2, most=5), st.floats(1e-9, 1.0))
def test_contradicting_pairs_are_proven(pose: Pose, share: float) -> None:
    """Bounds too small for the first two directions: the contradiction is proven, named, and verified."""
    r_N, bound = pose.r_N, pose.angle_bound_rad.copy()
    first, second = quaternion.transform(pose.q_BN, r_N[0]), quaternion.transform(pose.q_BN, r_N[1])
    # the second direction is turned within their plane by more than both bounds together
    normal = np.cross(first, second)
    sine = float(np.linalg.norm(normal))
    excess = share * 0.1
    angle = bound[0] + bound[1] + 1e-10 + excess
    assume(np.arctan2(sine, first @ second) + angle < np.pi)
    normal /= sine
    b_B = pose.b_B.copy()
    b_B[0] = first
    b_B[1] = np.cos(angle) * second + np.sin(angle) * np.cross(normal, second)
    attitude = optsat.certify_attitude(b_B, r_N, bound)
    assert attitude.status is AttitudeStatus.INCONSISTENT
    assert (0, 1) in attitude.inconsistent_pairs
    assert np.isnan(attitude.bound_rad)
    assert attitude.certificate.verify()
    assert attitude.certificate.margin() > 0
    assert set(itertools.chain(*attitude.inconsistent_pairs)) == set(attitude.suspects)
    enough = replace(attitude.certificate.admissible, angle_bound_rad=bound + excess + 1e-9)
    assert not replace(attitude.certificate, admissible=enough, pair=(0, 1)).verify()
