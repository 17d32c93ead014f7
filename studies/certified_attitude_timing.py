"""Time of the certified attitude against SciPy's align_vectors and against the same programme in cvxpy; ratios only.

Every figure is a ratio of two things run in turn within one process, so that a slow machine slows both.
"""

import importlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.davenport import pair_matrices, rotation_matrix
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.determine import certify_attitude, certify_attitude_batch
from optsat.models.draws import directions, rotations, tilted
from optsat.solvers.scaled_semidefinite import pivot_chart, pivot_weights

BATCH = 8192


def cases(count: int) -> list[Case]:
    """Return rounds of 3 to 6 vectors."""
    return [{"vectors": 3 + k % 4} for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round."""
    from scipy.spatial.transform import Rotation

    m = case["vectors"]
    b2, r2, eps2 = _poses(rng, BATCH, 2)
    b, r, eps = (part[0] for part in _poses(rng, 1, m))
    programme = _cvxpy_programme(m)
    times = time_interleaved(
        {
            "align_vectors": lambda: Rotation.align_vectors(b2[0], r2[0]),
            "batch": lambda: certify_attitude_batch(b2, r2, eps2),
            "certify": lambda: certify_attitude(b, r, eps, norm_policy="silent"),
            "certify_two": lambda: certify_attitude(b2[0], r2[0], eps2[0], norm_policy="silent"),
            "cvxpy": lambda: _cvxpy_as_written(b, r, eps),
            "cvxpy_unscaled": lambda: _cvxpy_unscaled(b, r, eps),
            "cvxpy_unscaled_parametrised": lambda: programme(b, r, eps),
        },
        rounds=5,
    )
    return {
        "vectors": m,
        "batch_pose_over_align_vectors": times.ratio("batch", "align_vectors") / BATCH,
        "certify_two_over_align_vectors": times.ratio("certify_two", "align_vectors"),
        "certify_over_align_vectors": times.ratio("certify", "align_vectors"),
        "cvxpy_over_certify": times.ratio("cvxpy", "certify"),
        "cvxpy_unscaled_over_certify": times.ratio("cvxpy_unscaled", "certify"),
        "cvxpy_unscaled_parametrised_over_certify": times.ratio("cvxpy_unscaled_parametrised", "certify"),
    }


def _poses(rng: np.random.Generator, poses: int, m: int) -> tuple[Array, Array, Array]:
    q_BN, r_N = rotations(rng, poses), directions(rng, poses, m)
    eps = np.deg2rad(rng.uniform(0.5, 5.0, (poses, m)))
    return tilted(rng, np.einsum("pij,pmj->pmi", rotation_matrix(q_BN), r_N), eps, "cap"), r_N, eps


def _cvxpy() -> Any:
    # typed in parts only, and differently by each checker
    return importlib.import_module("cvxpy")


def _cvxpy_as_written(b_B: Array, r_N: Array, eps: Array) -> Any:
    """Solve the scaled programme of `solvers/scaled_semidefinite.py`, one pass, as one would write it in cvxpy."""
    cp = _cvxpy()

    known = AdmissibleSet(b_B, r_N, eps)
    chart = pivot_chart(known, pivot_weights(known))
    s2 = chart.scale**2
    G, h, tau = cp.Variable((3, 3), symmetric=True), cp.Variable((3, 1)), cp.Variable((1, 1))
    spread = cp.reshape(cp.trace(G), (1, 1), order="C")
    Y = cp.bmat([[1 - s2 * spread, h.T], [h, G]])
    ceiling = cp.bmat([[spread - tau, -h.T], [-h, np.eye(3) - s2 * tau[0, 0] * np.eye(3) - s2 * G]])
    bounds = [cp.trace(Q @ Y) >= 0 for Q in chart.matrices()]
    cp.Problem(cp.Maximize(tau[0, 0]), [*bounds, Y >> 0, ceiling >> 0]).solve(solver=cp.CLARABEL)
    return [bound.dual_value for bound in bounds]


def _cvxpy_unscaled(b_B: Array, r_N: Array, eps: Array) -> Any:
    """Solve min t, t I >= X >= 0, tr X = 1, tr(M_j X) >= 0: shorter to write, useless at small bounds."""
    cp = _cvxpy()

    X, t = cp.Variable((4, 4), symmetric=True), cp.Variable()
    M = pair_matrices(b_B, r_N) - np.cos(eps)[:, None, None] * np.eye(4)
    bounds = [cp.trace(Mj @ X) >= 0 for Mj in M]
    cp.Problem(cp.Minimize(t), [*bounds, X >> 0, t * np.eye(4) - X >> 0, cp.trace(X) == 1]).solve(solver=cp.CLARABEL)
    return [bound.dual_value for bound in bounds]


def _cvxpy_programme(m: int) -> Callable[[Array, Array, Array], Any]:
    """Return the unscaled programme with parameters, built once: cvxpy at its fastest."""
    cp = _cvxpy()

    X, t = cp.Variable((4, 4), symmetric=True), cp.Variable()
    M = [cp.Parameter((4, 4), symmetric=True) for _ in range(m)]
    bounds = [cp.trace(Mj @ X) >= 0 for Mj in M]
    problem = cp.Problem(cp.Minimize(t), [*bounds, X >> 0, t * np.eye(4) - X >> 0, cp.trace(X) == 1])

    def solve(b_B: Array, r_N: Array, eps: Array) -> Any:
        values = pair_matrices(b_B, r_N) - np.cos(eps)[:, None, None] * np.eye(4)
        for parameter, value in zip(M, values, strict=True):
            parameter.value = value
        problem.solve(solver=cp.CLARABEL)
        return [bound.dual_value for bound in bounds]

    return solve


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each ratio over the rounds, and the least favourable one."""
    figures: dict[str, float] = {}
    for name in rows[0]:
        if "_over_" in name:
            figures[name] = float(np.median([row[name] for row in rows]))
    figures["batch_pose_over_align_vectors_worst"] = max(row["batch_pose_over_align_vectors"] for row in rows)
    figures["cvxpy_over_certify_worst"] = min(row["cvxpy_over_certify"] for row in rows)
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars on time."""
    batch, ratio = figures["batch_pose_over_align_vectors"], figures["cvxpy_over_certify"]
    return [
        judge_bar(
            "batch",
            "two vectors, batch: time a pose over one align_vectors call <= 0.1",
            measured=batch,
            holds=batch <= 0.1,
        ),
        judge_bar(
            "against-cvxpy",
            "three to six vectors: the same programme written in cvxpy takes at least 10 times our complete call",
            measured=ratio,
            holds=ratio >= 10,
        ),
    ]


study = Study(
    name="certified-attitude-timing",
    title="Time of the certified attitude against its peers, as ratios of interleaved runs",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=8,
)
