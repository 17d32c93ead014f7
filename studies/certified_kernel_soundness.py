"""Soundness of the compiled certified attitude over a campaign of single poses: 100,000 cases in seconds.

A case is one pose of 2 to 6 vectors with bounds of 0.005 to 5 deg, half of them with every error on the boundary of its
cone. Whole chunks go to the compiled kernels; each chunk's first pose also runs alone, and must give the same bits.
"""

import functools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from optsat.arrays import Array, cross_rows
from optsat.attitude import quaternion
from optsat.attitude.davenport import rotation_matrix
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.designs import Grid
from optsat.campaign.draws import Draws
from optsat.campaign.rates import largest_rate_of_none
from optsat.campaign.study import Case, Columns, Row, Study
from optsat.export.catalogue import build
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import make_kernel

VECTORS = (2, 3, 4, 6)
BOUNDS_DEG = (5.0, 0.5, 0.05, 0.005)
_MOST = max(VECTORS)
_OK, _INCONSISTENT = 0, 2


@functools.cache
def kernel(vectors: int) -> Kernel:
    """Return the compiled kernel of so many vectors; workers find it in the cache by its key."""
    return make_kernel(build("certified_two_vector" if vectors == 2 else f"certified_attitude_{vectors}"))


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return error, bound and status of one pose by one call of its kernel."""
    m = case["vectors"]
    q_BN, b_B, r_N, eps = (part[0] for part in poses(Draws.of_case(rng), np.deg2rad([case["bound_deg"]])))
    found, bound, _, status = kernel(m)(b_B[:m].copy(), r_N[:m].copy(), eps[:m].copy())[:4]
    return {"answer": int(status), **_judged(found, q_BN, np.asarray(bound))}


def run_batch(cases: Columns, draws: Draws) -> Columns:
    """Return the same of many poses, those of one number of vectors together."""
    q_BN, b_B, r_N, eps = poses(draws, np.deg2rad(cases["bound_deg"]))
    found, bound = np.empty((draws.cases, 4)), np.empty(draws.cases)
    status = np.empty(draws.cases, dtype=np.int64)
    for m in np.unique(cases["vectors"]):
        own = np.flatnonzero(cases["vectors"] == m)
        results = kernel(int(m)).batch(*(np.ascontiguousarray(part[own, :m]) for part in (b_B, r_N, eps)))
        found[own], bound[own], status[own] = results[0], results[1], results[3]
    return {"answer": status, **_judged(found, q_BN, bound)}


def poses(draws: Draws, eps: Array) -> tuple[Array, Array, Array, Array]:
    """Return true attitudes (n, 4), measured and reference directions (n, 6, 3) and bounds (n, 6) [rad].

    eps : (n,) [rad]. Elementwise only, so that a pose is the same alone and among others.
    """
    q_BN = _unit(draws.normals(4))
    r_N = _unit(draws.normals(_MOST, 3))
    across, share = draws.normals(_MOST, 3), draws.uniforms(_MOST)
    share = np.where(draws.uniforms(1) < 0.5, 1.0, share)
    bounds = np.repeat(eps[:, None], _MOST, axis=1)
    A = rotation_matrix(q_BN)
    y_B = np.stack([_dot(A[:, None, i, :], r_N) for i in range(3)], axis=-1)
    across = _unit(cross_rows(y_B, across))
    angle = 2 * np.arcsin(np.sqrt(share) * np.sin(bounds / 2))[..., None]
    return np.where(q_BN[:, 3:] < 0, -q_BN, q_BN), _unit(np.cos(angle) * y_B + np.sin(angle) * across), r_N, bounds


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def _unit(v: Array) -> Array:
    square = v * v
    total = square[..., 0]
    for k in range(1, v.shape[-1]):
        total = total + square[..., k]
    return np.asarray(v / np.sqrt(total)[..., None])


def _judged(found: Array, q_BN: Array, bound: Array) -> dict[str, Array]:
    error = quaternion.error_angle(found, q_BN)
    return {"error_deg": np.degrees(error), "bound_deg": np.degrees(bound), "ratio": np.asarray(error / bound)}


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return counts, the largest share of the bound that an error takes, and the mean share, in one pass."""
    answered = refused = violations = 0
    largest = total = 0.0
    for row in rows:
        if row["answer"] != _OK:
            refused += row["answer"] == _INCONSISTENT
            continue
        answered += 1
        violations += row["ratio"] > 1.0
        largest = max(largest, row["ratio"])
        total += row["ratio"]
    return {
        "poses": float(len(rows)),
        "answered": float(answered),
        "called_inconsistent": float(refused),
        "violations": float(violations),
        "largest_ratio": largest,
        "mean_ratio": total / answered if answered else math.nan,
    }


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the soundness bars."""
    answered, poses = figures["answered"], figures["poses"]
    below = f"; none means a rate below {largest_rate_of_none(int(answered)):.2g}" if answered else ""
    return [
        judge_bar(
            "no-violation",
            f"errors above the guaranteed bound in {answered:.0f} answers of the compiled kernels{below}",
            measured=figures["violations"],
            holds=figures["violations"] == 0 and answered > 0,
        ),
        judge_bar(
            "no-false-alarm",
            f"admissible poses called inconsistent, of {poses:.0f}",
            measured=figures["called_inconsistent"],
            holds=figures["called_inconsistent"] == 0,
        ),
        judge_bar(
            "answered",
            "share of poses that get a bound >= 0.95; the others are two or three vectors close to one line [-]",
            measured=answered / poses,
            holds=answered >= 0.95 * poses,
        ),
    ]


study = Study(
    name="certified-kernel-soundness",
    title="Soundness of the compiled certified attitude, one pose a case",
    cases=Grid({"vectors": VECTORS, "bound_deg": BOUNDS_DEG}),
    run=run,
    run_batch=run_batch,
    metrics=metrics,
    claims=claims,
    default_cases=16_000,
)
