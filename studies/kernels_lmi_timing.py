"""Time of the compiled semidefinite programme against cvxpy and against Clarabel called directly; ratios only.

Lyapunov's inequality for a stable A of four rows: least t with A'P + PA + I <= 0 and I <= P <= tI, eleven unknowns in
three blocks. cvxpy builds the programme and solves it by Clarabel, as one writes it; Clarabel alone gets its matrices
ready made. Every optimum is compared with Clarabel's, and every P is checked by its eigenvalues.
"""

import importlib
from collections.abc import Callable, Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.forms import ConeKind, ConicForm, symmetric_vector
from optsat.kernels.lmi import lmi
from optsat.kernels.open_kernel import make_kernel
from optsat.solvers.clarabel import Clarabel

SIDE = 4
INSTANCES = 50
"""Programmes in each round."""

_UPPER = tuple((row, column) for column in range(SIDE) for row in range(column + 1))
_COST = np.eye(len(_UPPER) + 1)[-1]


def cases(count: int) -> list[Case]:
    """Return rounds, each with programmes of its own."""
    return [{} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round, and how the answers compare."""
    matrices = [_stable(rng) for _ in range(INSTANCES)]
    blocks = np.array([_blocks(A) for A in matrices])
    kernel = make_kernel(lmi(len(_COST), (SIDE,) * 3))
    rows = np.ascontiguousarray(np.concatenate([_packed(blocks[:, :, k]) for k in range(3)], axis=-1))
    forms = [_form(each) for each in blocks]
    solver = Clarabel(tolerance=1e-8)
    for_kernel, for_clarabel, for_cvxpy = cycle(rows), cycle(forms), cycle(matrices)
    solve = _by_cvxpy()
    times = time_interleaved(
        {
            "cvxpy": lambda: solve(next(for_cvxpy)),
            "clarabel": lambda: solver.run(next(for_clarabel)),
            "call": lambda: kernel(_COST, next(for_kernel)),
            "batch": lambda: kernel.batch(_COST, rows),
        },
        rounds=7,
        least_s=0.1,
    )
    x, objective, _, _, status = kernel.batch(_COST, rows)
    best = np.array([_COST @ solver.run(form).x for form in forms])
    inside = np.einsum("pj,pjkrc->pkrc", np.concatenate((np.ones((INSTANCES, 1)), x), axis=1), blocks)
    return {
        "cvxpy_over_call": times.ratio("cvxpy", "call"),
        "clarabel_over_call": times.ratio("clarabel", "call"),
        "cvxpy_over_batch": times.ratio("cvxpy", "batch") * INSTANCES,
        "clarabel_over_batch": times.ratio("clarabel", "batch") * INSTANCES,
        "unsolved": int(np.sum(status != 0)),
        "outside": int(np.sum(np.linalg.eigvalsh(inside)[..., 0] <= 0.0)),
        "apart": float(np.max(np.abs(objective / best - 1.0))),
        "form": kernel.form,
    }


def _stable(rng: np.random.Generator) -> Array:
    A = rng.normal(size=(SIDE, SIDE))
    return np.asarray(A - (np.linalg.eigvals(A).real.max() + 0.5) * np.eye(SIDE))


def _blocks(A: Array) -> Array:
    """Return F_0, a matrix for each entry of P, and that of t: (unknowns + 1, 3, n, n)."""
    zero, one = np.zeros((SIDE, SIDE)), np.eye(SIDE)
    rows = [(-one, -one, zero)]
    for row, column in _UPPER:
        E = np.zeros((SIDE, SIDE))
        E[row, column] = E[column, row] = 1.0
        rows.append((-(A.T @ E + E @ A), E, -E))
    return np.array([*rows, (zero, zero, one)])


def _packed(m: Array) -> Array:
    return np.stack([m[..., row, column] for row, column in _UPPER], axis=-1)


def _form(blocks: Array) -> ConicForm:
    vectors = symmetric_vector(blocks).reshape(len(blocks), -1)
    cone: tuple[ConeKind, int] = ("psd_triangle", SIDE)
    return ConicForm(_COST, -vectors[1:].T, vectors[0], (cone,) * 3)


def _by_cvxpy() -> Callable[[Array], float]:
    cp: Any = importlib.import_module("cvxpy")

    def solve(A: Array) -> float:
        P, t = cp.Variable((SIDE, SIDE), symmetric=True), cp.Variable()
        one = np.eye(SIDE)
        problem = cp.Problem(cp.Minimize(t), [A.T @ P + P @ A + one << 0, P >> one, t * one >> P])
        problem.solve(solver="CLARABEL")
        return float(problem.value)

    return solve


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each ratio over the rounds, the counts summed, and the largest distance."""
    figures = {name: float(np.median([row[name] for row in rows])) for name in rows[0] if "_over_" in name}
    figures |= {name: float(sum(row[name] for row in rows)) for name in ("unsolved", "outside")}
    return {**figures, "apart": max(row["apart"] for row in rows), "programmes": float(INSTANCES * len(rows))}


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars."""
    cvxpy, clarabel, apart = figures["cvxpy_over_call"], figures["clarabel_over_call"], figures["apart"]
    astray = figures["unsolved"] + figures["outside"]
    return [
        judge_bar("against-cvxpy", "200 times as fast as cvxpy, ratio >= 200", measured=cvxpy, holds=cvxpy >= 200),
        judge_bar(
            "against-clarabel",
            "5 times as fast as Clarabel called directly, ratio >= 5",
            measured=clarabel,
            holds=clarabel >= 5,
        ),
        judge_bar("answers", "relative distance to Clarabel's optimum <= 1e-6", measured=apart, holds=apart <= 1e-6),
        judge_bar(
            "inside",
            "programmes unsolved, or whose answer breaks an inequality: none",
            measured=astray,
            holds=astray == 0,
        ),
    ]


study = Study(
    name="kernels-lmi-timing",
    title="Semidefinite programme of eleven unknowns against cvxpy and Clarabel, answers compared",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=5,
)
