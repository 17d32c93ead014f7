"""Soundness of the guaranteed bound: random poses with errors up to the boundary of their cones; violations counted.

Each case draws 700 two-vector poses (array path) and 350 poses of 3 to 8 vectors (optimised weights), half of them
with every error on the boundary of its cone, a seventh with bounds of 1e-9 to 1e-6 rad, the rest of 1e-4 to 20 deg.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.davenport import rotation_matrix
from optsat.attitude.status import AttitudeStatus
from optsat.attitude.two_vector import pair_angle
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.determine import certify_attitude, certify_attitude_batch
from optsat.models.draws import directions, rotations, tilted

PAIRS, MANY = 700, 350


def cases(count: int) -> list[Case]:
    """Return equal cases; their draws differ by place."""
    return [{"two_vector_poses": PAIRS, "many_vector_poses": MANY} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return counts of one case."""
    return {
        **_two_vectors(case["two_vector_poses"], rng),
        **_many_vectors(case["many_vector_poses"], rng),
        **_mismatched_pairs(case["two_vector_poses"], rng),
    }


def _bounds(rng: np.random.Generator, poses: int, vectors: int) -> Array:
    small = rng.random(poses) < 1 / 7
    low = np.log(np.where(small, 1e-9, np.deg2rad(1e-4)))
    high = np.log(np.where(small, 1e-6, np.deg2rad(20.0)))
    return np.asarray(np.exp(rng.uniform(low[:, None], high[:, None], (poses, vectors))))


def _poses(rng: np.random.Generator, poses: int, vectors: int) -> tuple[Array, Array, Array, Array]:
    q_BN, r_N, eps = rotations(rng, poses), directions(rng, poses, vectors), _bounds(rng, poses, vectors)
    y_B = np.einsum("pij,pmj->pmi", rotation_matrix(q_BN), r_N)
    half = poses // 2
    b_B = np.concatenate((tilted(rng, y_B[:half], eps[:half], "boundary"), tilted(rng, y_B[half:], eps[half:], "cap")))
    return q_BN, b_B, r_N, eps


def _two_vectors(poses: int, rng: np.random.Generator) -> Row:
    q_BN, b_B, r_N, eps = _poses(rng, poses, 2)
    batch = certify_attitude_batch(b_B, r_N, eps)
    error = quaternion.error_angle(batch.q_BN, q_BN)
    return {
        "two_vector_violations": int(np.sum(batch.ok & (error > batch.bound_rad))),
        "two_vector_inconsistent": int(np.sum(batch.inconsistent)),
        "two_vector_ratio": float(np.max(np.where(batch.ok, error / batch.bound_rad, 0.0))),
        "two_vector_small_bounds": int(np.sum(eps.max(axis=1) <= 1e-6)),
    }


def _many_vectors(poses: int, rng: np.random.Generator) -> Row:
    violations = inconsistent = small = detected = tried = 0
    ratio = 0.0
    for count in rng.integers(3, 9, poses):
        q_BN, b_B, r_N, eps = (part[0] for part in _poses(rng, 1, int(count)))
        if rng.random() < 0.5:
            b_B = tilted(rng, r_N @ rotation_matrix(q_BN).T, eps, "boundary")
        small += int(eps.max() <= 1e-6)
        attitude = certify_attitude(b_B, r_N, eps, norm_policy="silent")
        inconsistent += attitude.status is AttitudeStatus.INCONSISTENT
        if attitude.status is AttitudeStatus.OK:
            error = float(quaternion.error_angle(attitude.q_BN, q_BN))
            violations += error > attitude.bound_rad
            ratio = max(ratio, error / attitude.bound_rad)
        if count == 5:
            tried += 1
            wrong = b_B.copy()
            wrong[0] = tilted(rng, r_N[:1] @ rotation_matrix(q_BN).T, np.minimum(5 * eps[:1], 3.0), "boundary")[0]
            found = certify_attitude(wrong, r_N, eps, norm_policy="silent")
            detected += found.status is AttitudeStatus.INCONSISTENT
    return {
        "many_vector_violations": violations,
        "many_vector_inconsistent": inconsistent,
        "many_vector_ratio": ratio,
        "many_vector_small_bounds": small,
        "outliers_tried": tried,
        "outliers_detected": detected,
    }


def _mismatched_pairs(poses: int, rng: np.random.Generator) -> Row:
    """Two vectors whose mutual angles differ by the sum of their bounds, a little more or a little less."""
    eps = _bounds(rng, poses, 2)
    b_B, r_N = directions(rng, poses, 2), directions(rng, poses, 2)
    mismatch = np.abs(pair_angle(b_B) - pair_angle(r_N))
    # bounds are scaled so that their sum misses the mismatch by 1e-11 rad to 1 % of it, on either side
    gap = np.exp(rng.uniform(np.log(1e-11), np.log(1e-2 * mismatch + 1e-11))) * rng.choice((-1.0, 1.0), poses)
    eps *= ((mismatch - gap) / eps.sum(axis=1))[:, None]
    usable = (gap < mismatch) & (eps.max(axis=1) < np.pi / 2)
    batch = certify_attitude_batch(b_B[usable], r_N[usable], eps[usable])
    excess = mismatch[usable] - eps[usable].sum(axis=1)
    above, below = excess > 1e-12, excess < 0
    return {
        "pairs_above": int(above.sum()),
        "pairs_proven": int(np.sum(above & batch.inconsistent)),
        "pairs_below": int(below.sum()),
        "pairs_false": int(np.sum(below & batch.inconsistent)),
    }


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return sums of the counts and the largest ratios."""
    figures: dict[str, float] = {}
    for name in rows[0]:
        if name != "case":
            values = [row[name] for row in rows]
            figures[name] = float(max(values) if name.endswith("ratio") else sum(values))
    figures["poses"] = float(len(rows) * (PAIRS + MANY))
    figures["many_vector_poses"] = float(len(rows) * MANY)
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the soundness bars."""
    violations = figures["two_vector_violations"] + figures["many_vector_violations"]
    false = figures["two_vector_inconsistent"] + figures["many_vector_inconsistent"] + figures["pairs_false"]
    missed = figures["pairs_above"] - figures["pairs_proven"]
    return [
        judge_bar(
            "no-violation",
            f"errors above the guaranteed bound in {figures['poses']:.0f} poses, "
            f"{figures['many_vector_poses']:.0f} of them "
            "with optimised weights of three to eight vectors",
            measured=violations,
            holds=violations == 0,
        ),
        judge_bar("no-false-alarm", "admissible data called inconsistent", measured=false, holds=false == 0),
        judge_bar(
            "pairs-proven",
            f"pairs beyond the sum of their bounds that were not proven inconsistent, of {figures['pairs_above']:.0f}",
            measured=missed,
            holds=missed == 0 and figures["pairs_above"] > 0,
        ),
    ]


study = Study(
    name="certified-attitude-soundness",
    title="Soundness of the guaranteed attitude bound under errors up to the boundary of their cones",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=100,
)
