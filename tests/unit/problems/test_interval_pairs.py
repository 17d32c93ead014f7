"""Interval pairs: the split of Davenport's matrix, the loss identity on the unit sphere, the TRIAD seed."""

import numpy as np
import pytest
from interval_draws import boxes, general_pairs, perturbed, unit

from optsat.attitude import quaternion
from optsat.attitude.alignment import loss
from optsat.attitude.davenport import davenport_matrix, rotation_matrix
from optsat.errors import InputError
from optsat.models.draws import rotations
from optsat.problems.component_box import ComponentBox
from optsat.problems.interval_pairs import IntervalPairs


def test_the_four_parts_sum_to_the_matrix_of_the_directions() -> None:
    rng = np.random.default_rng(1)
    pairs = IntervalPairs(*boxes(*perturbed(rng)), weights=[1.0, 3.0])
    alpha, beta = rng.uniform(-1, 1, (2, 5, 2, 3))
    b, r = pairs.directions(alpha, beta)
    np.testing.assert_allclose(sum(pairs.matrices(alpha, beta)), davenport_matrix(b, r, pairs.share), atol=1e-15)


def test_mid_and_change_sum_to_the_loss_on_the_unit_sphere_only() -> None:
    rng = np.random.default_rng(2)
    b_mid, r_mid = general_pairs(rng, 4)
    wide = ComponentBox.from_half_width(b_mid, 0.4), ComponentBox.from_half_width(r_mid, 0.4)
    pairs, q = IntervalPairs(*wide), rotations(rng, 1)[0]
    b, r = unit(b_mid + rng.uniform(-0.1, 0.1, (4, 3))), unit(r_mid + rng.uniform(-0.1, 0.1, (4, 3)))
    parts = pairs.losses(q, (b - b_mid) / 0.4, (r - r_mid) / 0.4)
    assert float(parts.mid + parts.change) == pytest.approx(loss(b, r, pairs.share, q), abs=1e-12)
    off = pairs.losses(q, np.full((4, 3), 0.5), np.zeros((4, 3)))
    assert abs(float(off.mid + off.change) - loss(b_mid + 0.2, r_mid, pairs.share, q)) > 1e-3


def test_triad_matches_the_first_pair_and_passes_over_parallel_ones() -> None:
    rng = np.random.default_rng(3)
    b, r = general_pairs(rng, 3)
    b[1], r[1] = -b[0], -r[0]
    pairs = IntervalPairs(ComponentBox.from_half_width(b, 0.01), ComponentBox.from_half_width(r, 0.01))
    A = rotation_matrix(pairs.triad())
    np.testing.assert_allclose(A @ r[0], b[0], atol=1e-12)
    np.testing.assert_allclose(unit(np.cross(A @ r[0], A @ r[2])), unit(np.cross(b[0], b[2])), atol=1e-12)


def test_triad_of_one_direction_still_matches_it() -> None:
    b, r = np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 0.6, 0.8]])
    pairs = IntervalPairs(ComponentBox.from_half_width(b, 0.1), ComponentBox.from_half_width(r, 0.1))
    np.testing.assert_allclose(quaternion.transform(pairs.triad(), r[0]), b[0], atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"b_B": np.eye(3)[:2]}, "`b_B` must be a ComponentBox"),
        ({"r_N": ComponentBox.from_half_width(np.eye(3), 0.1)}, "same number of boxes, at least one, got 2 and 3"),
        ({"weights": [1.0]}, "`weights` must hold one weight per vector pair"),
        ({"weights": [0.0, 0.0]}, "`weights` are all zero"),
        ({"weights": [1.0, -1.0]}, "`weights` must be >= 0: index 1"),
        ({"weights": [1.0, np.nan]}, "`weights` must be finite"),
    ],
)
def test_bad_pairs_are_refused(change: dict[str, object], message: str) -> None:
    b, r = boxes(*perturbed(np.random.default_rng(4)))
    with pytest.raises(InputError, match=message):
        IntervalPairs(**{"b_B": b, "r_N": r, **change})  # type: ignore[arg-type]
