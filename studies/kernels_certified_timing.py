"""Time and tightness of the certified attitude as a compiled kernel, against SciPy, and Clarabel called directly.

Two vectors: one pose of a batch against one `align_vectors`, which proves nothing. Three to six: the complete call of
the kernel against the complete call of our own Python path, whose weights come from Clarabel's interface; and the
bound of the kernel over the best of Clarabel's, on problems with bounds from 0.003 to 10 deg.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.davenport import rotation_matrix
from optsat.attitude.quaternion import error_angle
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.determine import certify_attitude
from optsat.export.catalogue import build
from optsat.forms import EnclosureForm
from optsat.kernels.open_kernel import make_kernel
from optsat.models.draws import directions, rotations, tilted
from optsat.solvers.scaled_semidefinite import ScaledSemidefinite

BATCH = 8192
PROBLEMS = 50
_BOUNDS_DEG = (0.003, 10.0)


def cases(count: int) -> list[Case]:
    """Return rounds of 3 to 6 vectors."""
    return [{"vectors": 3 + k % 4} for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round, and how tight the kernel's bounds were over its problems."""
    from scipy.spatial.transform import Rotation

    m = case["vectors"]
    two, many = make_kernel(build("certified_two_vector")), make_kernel(build(f"certified_attitude_{m}"))
    _, b2, r2, eps2 = _poses(rng, BATCH, 2)
    q_BN, b, r, eps = _poses(rng, PROBLEMS, m)
    solver = ScaledSemidefinite()
    form = EnclosureForm(AdmissibleSet(b[0], r[0], eps[0]))
    times = time_interleaved(
        {
            "align_vectors": lambda: Rotation.align_vectors(b2[0], r2[0]),
            "two": lambda: two.batch(b2, r2, eps2),
            "many": lambda: many(b[0], r[0], eps[0]),
            "clarabel": lambda: solver.run(form),
            "certify": lambda: certify_attitude(b[0], r[0], eps[0], norm_policy="silent"),
        },
        rounds=5,
    )
    found, bound, _, status, failed = many.batch(b, r, eps)
    best = np.array([certify_attitude(*each, norm_policy="silent").bound_rad for each in zip(b, r, eps, strict=True)])
    ok = (status == 0) & (failed == 0)
    looser = bound[ok] / best[ok]
    return {
        "vectors": m,
        "align_vectors_over_two": times.ratio("align_vectors", "two") * BATCH,
        "clarabel_over_many": times.ratio("clarabel", "many"),
        "certify_over_many": times.ratio("certify", "many"),
        "problems": PROBLEMS,
        "answered": int(ok.sum()),
        "within_1_001": int((looser <= 1.001).sum()),
        "largest_over_best": float(looser.max()),
        "violations": int((error_angle(found[ok], q_BN[ok]) > bound[ok]).sum()),
        "form": many.form,
    }


def _poses(rng: np.random.Generator, poses: int, m: int) -> tuple[Array, Array, Array, Array]:
    q_BN, r_N = rotations(rng, poses), directions(rng, poses, m)
    low, high = np.log(_BOUNDS_DEG)
    eps = np.deg2rad(np.exp(rng.uniform(low, high, (poses, m))))
    return q_BN, tilted(rng, np.einsum("pij,pmj->pmi", rotation_matrix(q_BN), r_N), eps, "cap"), r_N, eps


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each ratio over the rounds, sums of the counts, and the loosest bound."""
    figures = {name: float(np.median([row[name] for row in rows])) for name in rows[0] if "_over_" in name}
    figures |= {
        name: float(sum(row[name] for row in rows)) for name in ("problems", "answered", "within_1_001", "violations")
    }
    figures["largest_over_best"] = max(row["largest_over_best"] for row in rows)
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars on time and on tightness."""
    share = figures["within_1_001"] / figures["problems"]
    two, many = figures["align_vectors_over_two"], figures["clarabel_over_many"]
    loosest = figures["largest_over_best"]
    return [
        judge_bar("two-vectors", "50 times as fast as align_vectors, ratio >= 50", measured=two, holds=two >= 50),
        judge_bar(
            "against-clarabel",
            "three to six vectors: the complete call is 8 times as fast as Clarabel's direct solution, ratio >= 8",
            measured=many,
            holds=many >= 8,
        ),
        judge_bar("tight", "bound within 1.001 of the best in >= 97 %", measured=share, holds=share >= 0.97),
        judge_bar("loosest", "bound never above 1.05 of the best", measured=loosest, holds=loosest <= 1.05),
        judge_bar(
            "no-violation",
            "errors above the bound",
            measured=figures["violations"],
            holds=figures["violations"] == 0,
        ),
    ]


study = Study(
    name="kernels-certified-timing",
    title="Certified attitude: compiled kernels against SciPy's align_vectors and Clarabel",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=20,
)
