"""Component boxes: exact support, boxes that surely hold the truth, certificates that hold sampled truth."""

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.attitude.status import AttitudeStatus


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def test_support_against_brute_force() -> None:
    rng = np.random.default_rng(0)
    sphere = unit(rng.standard_normal((200_000, 3)))
    for _ in range(30):
        centre, half = unit(rng.standard_normal(3)), rng.uniform(0.1, 0.6, 3)
        box = optsat.ComponentBox.from_half_width(centre[None], half)
        patch = sphere[np.all(np.abs(sphere - centre) <= half, axis=1)]
        for u in (*unit(rng.standard_normal((4, 3))), *np.eye(3), *-np.eye(3)):
            reached = float(np.max(patch @ u))
            assert reached - 1e-12 <= box.support(0, u) <= reached + 0.03


def test_support_of_a_single_direction_and_of_everything() -> None:
    direction = np.array([0.6, 0.0, 0.8])
    point = optsat.ComponentBox([direction], [direction])
    whole = optsat.ComponentBox([(-1, -1, -1)], [(1, 1, 1)])
    for u in unit(np.random.default_rng(1).standard_normal((20, 3))):
        assert point.support(0, u) == pytest.approx(direction @ u, abs=1e-12)
        assert whole.support(0, 3 * u) == pytest.approx(3.0, abs=1e-12)
    assert (len(point), len(whole)) == (1, 1)


def test_cones_and_faces_hold_the_patch() -> None:
    rng = np.random.default_rng(2)
    centre, half = unit(rng.standard_normal((20, 3))), rng.uniform(0.01, 0.4, (20, 3))
    box = optsat.ComponentBox.from_half_width(centre, half)
    sphere = unit(rng.standard_normal((20_000, 3)))
    middle, cones, faces = box.midpoint_directions(), box.cone_angles(), box.face_limits()
    for row in range(20):
        patch = sphere[np.all(np.abs(sphere - centre[row]) <= half[row], axis=1)]
        off = np.arccos(np.clip(patch @ middle[row], -1, 1))
        assert np.all(off <= cones[row] + 1e-12)
        assert np.all(patch <= faces[row, ::2] + 1e-12)
        assert np.all(-patch <= faces[row, 1::2] + 1e-12)


@pytest.mark.parametrize("fraction", [0.0, 0.02, 0.2, 0.5])
def test_safe_relative_boxes_hold_the_truth(fraction: float) -> None:
    rng = np.random.default_rng(3)
    truth = unit(rng.standard_normal((2000, 3)))
    measured = truth * (1 + fraction * rng.uniform(-1, 1, truth.shape))
    measured[::5] = truth[::5] * (1 + fraction * rng.choice((-1, 1), truth[::5].shape))
    box = optsat.ComponentBox.from_relative(measured, fraction)
    for axis in range(3):
        reach = np.sort(np.stack((measured[:, axis] / (1 - fraction), measured[:, axis] / (1 + fraction))), axis=0)
        assert np.all((truth[:, axis] >= reach[0] - 1e-15) & (truth[:, axis] <= reach[1] + 1e-15))
    np.testing.assert_array_equal(box.low, np.minimum(measured / (1 - fraction), measured / (1 + fraction)))
    np.testing.assert_array_equal(box.high, np.maximum(measured / (1 - fraction), measured / (1 + fraction)))


def test_paper_boxes_miss_the_truth_in_about_a_quarter_of_draws() -> None:
    rng = np.random.default_rng(4)
    truth = unit(rng.standard_normal((4000, 3)))
    measured = truth * (1 + 0.2 * rng.uniform(-1, 1, truth.shape))
    missed = np.any(np.abs(truth - measured) > 0.2 * np.abs(measured), axis=1)
    assert 0.20 < missed.mean() < 0.26
    some = optsat.ComponentBox.from_relative(measured[:1], 0.2, mode="paper")
    np.testing.assert_allclose(np.asarray(some.high), measured[:1] + 0.2 * np.abs(measured[:1]), atol=1e-16)


def drawn_box(rng: np.random.Generator, truth: Array, half: Array) -> optsat.ComponentBox:
    """Return boxes that hold the unit vectors of `truth` anywhere inside, corners included."""
    share = np.where(rng.random(truth.shape) < 0.3, rng.choice((-1, 1), truth.shape), rng.uniform(-1, 1, truth.shape))
    return optsat.ComponentBox.from_half_width(truth + share * half, half * (1 + 1e-12))


@pytest.mark.parametrize("boxed", ["measured", "reference", "both"])
def test_certificates_of_boxes_hold_the_truth(boxed: str) -> None:
    rng = np.random.default_rng(5)
    for _ in range(25):
        m = int(rng.integers(1, 5))
        q_BN = unit(rng.standard_normal(4))
        r_N = unit(rng.standard_normal((m, 3)))
        b_B = r_N @ dcm.from_quaternion(q_BN).T
        half = 10 ** rng.uniform(-3, -0.7, (m, 3))
        left = b_B if boxed == "reference" else drawn_box(rng, b_B, half)
        right = r_N if boxed == "measured" else drawn_box(rng, r_N, half)
        attitude = optsat.certify_attitude(left, right)
        assert attitude.status is not AttitudeStatus.INCONSISTENT
        assert quaternion.error_angle(attitude.q_BN, q_BN) <= attitude.bound_rad
        assert attitude.certificate.verify()
        # an angle bound comes on top of the box
        wider = optsat.certify_attitude(left, right, 0.01)
        assert wider.bound_rad >= attitude.bound_rad * (1 - 1e-6)


def test_face_cuts_are_never_worse_than_the_cones_alone() -> None:
    """At 20 % of each component the cones alone are coarse; the faces of the boxes cut some of that off."""
    rng = np.random.default_rng(6)
    ratios = []
    for _ in range(12):
        r_N = unit(rng.standard_normal((3, 3)))
        box = optsat.ComponentBox.from_relative(r_N * (1 + 0.2 * rng.uniform(-1, 1, (3, 3))), 0.2)
        cones = optsat.certify_attitude(box.midpoint_directions(), r_N, box.cone_angles())
        cut = optsat.certify_attitude(box, r_N)
        assert len(cut.certificate.admissible.cut_level)
        assert cut.bound_rad <= cones.bound_rad * (1 + 1e-6)
        ratios.append(cut.bound_rad / cones.bound_rad)
    assert np.mean(ratios) < 0.97


def test_a_box_around_the_origin_of_two_axes_says_little_but_nothing_false() -> None:
    ring = optsat.ComponentBox([(-1, -1, 0.5), (0.9, -0.3, -0.3)], [(1, 1, 0.9), (1, 0.3, 0.3)])
    attitude = optsat.certify_attitude(ring, np.array([(0.6, 0.0, 0.8), (1, 0, 0)]))
    assert quaternion.error_angle(attitude.q_BN, quaternion.identity()) <= attitude.bound_rad


def test_boxes_that_contradict_their_references() -> None:
    box = optsat.ComponentBox.from_half_width([(1, 0, 0), (0.6, 0.8, 0)], 0.05)
    attitude = optsat.certify_attitude(box, np.eye(3)[:2])
    assert attitude.status is AttitudeStatus.INCONSISTENT
    assert attitude.certificate.verify()
