"""Time of Wahba's problem with four vectors as a compiled kernel against SciPy and batched NumPy; ratios only.

One call and one pose of a batch stand against `Rotation.align_vectors` of the same pose, which has no batch. The work
of the resident form is also given as a share of the processor's measured peak without fused products.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from optsat.arrays import Array
from optsat.attitude.davenport import rotation_matrix
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.export.catalogue import build
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.peak import measured_peak
from optsat.models.draws import directions, rotations, tilted

VECTORS = 4
BATCH = 8192
NOISE_RAD = 0.01


def cases(count: int) -> list[Case]:
    """Return rounds, each with poses of its own."""
    return [{} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round, and how far the two answers are apart."""
    from scipy.spatial.transform import Rotation

    kernel = make_kernel(build(f"wahba_{VECTORS}"))
    b_B, r_N = _poses(rng)
    weights = np.full(VECTORS, 1.0 / VECTORS)
    b, r = np.ascontiguousarray(b_B[0]), np.ascontiguousarray(r_N[0])
    tiles = kernel.to_tiles(b_B, r_N, weights)
    resident = kernel.batch(*tiles, layout="tiles")
    q_BN = kernel.batch(b_B, r_N, weights)[0]
    out = [np.empty_like(result) for result in resident]
    times = time_interleaved(
        {
            "align_vectors": lambda: Rotation.align_vectors(b, r),
            "call": lambda: kernel(b, r, weights),
            "batch": lambda: kernel.batch(b_B, r_N, weights),
            "resident": lambda: kernel.batch(*tiles, layout="tiles", out=out),
            "eigh": lambda: _by_eigenvectors(b_B, r_N, weights),
        }
    )
    return {
        "align_vectors_over_call": times.ratio("align_vectors", "call"),
        "align_vectors_over_batch": times.ratio("align_vectors", "batch") * BATCH,
        "align_vectors_over_resident": times.ratio("align_vectors", "resident") * BATCH,
        "eigh_over_batch": times.ratio("eigh", "batch"),
        "eigh_over_resident": times.ratio("eigh", "resident"),
        "share_of_peak": times.per_second("resident") * BATCH * kernel.record.operations / measured_peak(),
        "difference_from_eigh": float(np.max(1.0 - np.abs(np.sum(q_BN * _by_eigenvectors(b_B, r_N, weights), axis=1)))),
        "form": kernel.form,
        "width": kernel.record.width,
    }


def _poses(rng: np.random.Generator) -> tuple[Array, Array]:
    r_N = directions(rng, BATCH, VECTORS)
    b_B = np.einsum("pij,pmj->pmi", rotation_matrix(rotations(rng, BATCH)), r_N)
    return tilted(rng, b_B, np.full((BATCH, VECTORS), NOISE_RAD), "cap"), r_N


def _by_eigenvectors(b_B: Array, r_N: Array, weights: Array) -> Array:
    """Return q_BN (N, 4) by Davenport's matrix and LAPACK, as one writes it in NumPy for speed."""
    B = np.einsum("m,pmi,pmj->pij", weights, b_B, r_N, optimize=True)
    K = np.empty((len(b_B), 4, 4))
    trace = np.trace(B, axis1=1, axis2=2)
    K[:, :3, :3] = B + np.swapaxes(B, 1, 2) - trace[:, None, None] * np.eye(3)
    K[:, :3, 3] = K[:, 3, :3] = np.stack(
        (B[:, 1, 2] - B[:, 2, 1], B[:, 2, 0] - B[:, 0, 2], B[:, 0, 1] - B[:, 1, 0]), axis=1
    )
    K[:, 3, 3] = trace
    return np.linalg.eigh(K)[1][:, :, -1]


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each figure over the rounds."""
    names = [name for name, value in rows[0].items() if name != "case" and not isinstance(value, str)]
    return {name: float(np.median([row[name] for row in rows])) for name in names}


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars on time."""
    bars = [
        ("call", "align_vectors_over_call", 100, "one Python call with fresh results is 100 times as fast"),
        ("batch", "align_vectors_over_batch", 2500, "a pose of a batch of plain arrays is 2500 times as fast"),
        ("resident", "align_vectors_over_resident", 5000, "a pose of a resident batch is 5000 times as fast"),
        ("against-eigh", "eigh_over_batch", 100, "the batch is 100 times as fast as a batched NumPy eigh"),
    ]
    return [
        judge_bar(id, f"{says}, ratio >= {least}", measured=figures[name], holds=figures[name] >= least)
        for id, name, least, says in bars
    ]


study = Study(
    name="kernels-wahba-timing",
    title="Wahba's problem, four vectors: compiled kernel against SciPy's align_vectors and batched NumPy",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=5,
)
