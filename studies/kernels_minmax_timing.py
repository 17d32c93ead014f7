"""Time of the compiled min-max interior point against SLSQP and IPOPT on interval attitude problems; ratios only.

Ten unknowns, seven objectives, twenty bounds: seven directions whose components are wrong by up to 20 %, as in the
study of Table 1. SLSQP takes the losses in NumPy and finite differences, its tolerance such that its answers are as
good as ours; IPOPT the CasADi expressions with exact derivatives, built once. Every answer is compared with IPOPT's.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attitude.davenport import davenport_matrix, dominant_quaternion, rotation_matrix
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.estimators.minmax_attitude import interval_losses, minmax_attitude
from optsat.kernels.open_kernel import make_kernel
from optsat.models.draws import directions, rotations

VECTORS = 7
ERROR = 0.2
"""Largest error of a component, as a share of it."""

INSTANCES = 200
"""Problems in each round."""

# tan of half of the largest turn from the start, and the ends of the boxes
_UPPER = np.array([0.5] * 3 + [1.0] * VECTORS)
_FREE = 100.0


def cases(count: int) -> list[Case]:
    """Return rounds, each with problems of its own."""
    return [{} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round, and how the answers compare."""
    problems = draw_problems(rng, INSTANCES)
    kernel = make_kernel(minmax_attitude(VECTORS))
    arguments = [np.ascontiguousarray(each) for each in kernel_arguments(problems)]
    x, gamma, _, _, residual, iterations, status = kernel.batch(*arguments)
    by_ipopt = ipopt()
    best = np.array([by_ipopt(problem) for problem in problems])
    ours = cycle([[each[k] if len(each) == INSTANCES else each for each in arguments] for k in range(INSTANCES)])
    for_ipopt, for_slsqp = cycle(problems), cycle(problems)
    times = time_interleaved(
        {
            "slsqp": lambda: by_slsqp(next(for_slsqp)),
            "ipopt": lambda: by_ipopt(next(for_ipopt)),
            "call": lambda: kernel(*next(ours)),
            "batch": lambda: kernel.batch(*arguments),
        },
        rounds=7,
        least_s=0.1,
    )
    slsqp = np.array([by_slsqp(problem) for problem in problems[:20]])
    return {
        "slsqp_over_call": times.ratio("slsqp", "call"),
        "ipopt_over_call": times.ratio("ipopt", "call"),
        "slsqp_over_batch": times.ratio("slsqp", "batch") * INSTANCES,
        "ipopt_over_batch": times.ratio("ipopt", "batch") * INSTANCES,
        "not_converged": int(np.sum(status != 0)),
        "above_ipopt": float(np.max(gamma - best)),
        "below_ipopt": float(np.max(best - gamma)),
        "slsqp_above_ipopt": float(np.max(slsqp - best[:20])),
        "largest_residual": float(np.max(residual)),
        "median_iterations": float(np.median(iterations)),
        "most_iterations": float(np.max(iterations)),
        "largest_turn": float(np.max(np.abs(x[:, :3]))),
        "form": kernel.form,
    }


def draw_problems(rng: np.random.Generator, count: int) -> Array:
    """Return (count, 3, m, 3): b_B, radius_B and y_B of the pairs, about the attitude of the plain q-method."""
    r_N = directions(rng, count, VECTORS)
    truth = np.einsum("pij,pmj->pmi", rotation_matrix(rotations(rng, count)), r_N)
    measured = truth * (1.0 + ERROR * rng.uniform(-1.0, 1.0, truth.shape))
    b_B = measured / np.linalg.norm(measured, axis=-1, keepdims=True)
    start = dominant_quaternion(davenport_matrix(b_B, r_N, np.full((count, VECTORS), 1.0 / VECTORS)))
    y_B = np.einsum("pij,pmj->pmi", rotation_matrix(start), r_N)
    return np.stack([b_B, ERROR * np.abs(measured), y_B], axis=1)


def limits() -> Array:
    """Return the upper bounds (3 + m,) of the unknowns; the lower ones are their negatives."""
    return _UPPER.copy()


def kernel_arguments(problems: Array) -> list[Array]:
    """Return the arguments of `minmax_attitude` for problems (..., 3, m, 3), losses in units of the squared error."""
    b_B, radius_B, y_B = np.moveaxis(problems, -3, 0)
    weights = np.full(VECTORS, ERROR**2)
    return [np.zeros(3 + VECTORS), b_B, radius_B, y_B, np.zeros(VECTORS), weights, -_UPPER, _UPPER]


def by_slsqp(problem: Array) -> float:
    """Return the factor that SciPy finds with finite differences."""
    from scipy import optimize

    def slack(v: Array) -> Array:
        return np.asarray(v[-1] * ERROR**2 - _losses(v[:-1], *problem))

    bounds = [*zip(-_UPPER, _UPPER, strict=True), (-_FREE, _FREE)]
    solve: Any = optimize.minimize
    found = solve(
        lambda v: v[-1],
        np.append(np.zeros(3 + VECTORS), 1.0),
        method="SLSQP",
        bounds=bounds,
        constraints=[{"type": "ineq", "fun": slack}],
        options={"ftol": 1e-10, "maxiter": 200},
    )
    return float(np.max(_losses(found.x[:-1], *problem)) / ERROR**2)


def _losses(x: Array, b_B: Array, radius_B: Array, y_B: Array) -> Array:
    g = x[:3]
    cross = np.array([[0.0, -g[2], g[1]], [g[2], 0.0, -g[0]], [-g[1], g[0], 0.0]])
    A = ((1.0 - g @ g) * np.eye(3) + 2.0 * np.outer(g, g) - 2.0 * cross) / (1.0 + g @ g)
    error = b_B + x[3:, None] * radius_B - y_B @ A.T
    return np.asarray(0.5 * np.einsum("ij,ij->i", error, error))


def ipopt() -> Callable[[Array], float]:
    """Return the problem in IPOPT, built once: (3, m, 3) to the factor, re-evaluated."""
    import casadi as ca

    v, p = ca.SX.sym("v", 4 + VECTORS), ca.SX.sym("p", 9 * VECTORS)
    parts = [ca.reshape(part, 3, VECTORS).T for part in ca.vertsplit(p, 3 * VECTORS)]
    losses = interval_losses(v[:-1], *parts) / ERROR**2
    options: Any = {"print_time": 0, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.bound_relax_factor": 0.0}
    epigraph: Any = {"x": v, "p": p, "f": v[-1], "g": losses - v[-1]}
    solver = ca.nlpsol("interval", "ipopt", epigraph, options)
    start, upper = np.append(np.zeros(3 + VECTORS), 1.0), np.append(_UPPER, _FREE)

    def solve(problem: Array) -> float:
        found: Any = solver(x0=start, p=problem.ravel(), lbx=-upper, ubx=upper, lbg=-np.inf, ubg=0.0)
        return float(np.max(_losses(found["x"].full()[:-1, 0], *problem)) / ERROR**2)

    return solve


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each ratio over the rounds, and the worst of what must hold in all."""
    medians = {name: float(np.median([row[name] for row in rows])) for name in rows[0] if "_over_" in name}
    worst = ("above_ipopt", "below_ipopt", "slsqp_above_ipopt", "largest_residual", "most_iterations", "largest_turn")
    return {
        **medians,
        **{name: float(np.max([row[name] for row in rows])) for name in worst},
        "median_iterations": float(np.median([row["median_iterations"] for row in rows])),
        "instances": float(INSTANCES * len(rows)),
        "not_converged": float(np.sum([row["not_converged"] for row in rows])),
    }


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars."""
    apart = max(figures["above_ipopt"], figures["below_ipopt"])
    return [
        judge_bar(
            "converged",
            "problems that did not reach a proven stationary point: none",
            measured=figures["not_converged"],
            holds=figures["not_converged"] == 0,
        ),
        judge_bar("answers", "largest distance to IPOPT's factor <= 1e-8", measured=apart, holds=apart <= 1e-8),
        judge_bar(
            "against-slsqp",
            "a problem of a batch is solved 1000 times as fast as by SLSQP with finite differences, ratio >= 1000",
            measured=figures["slsqp_over_batch"],
            holds=figures["slsqp_over_batch"] >= 1000,
        ),
        judge_bar(
            "against-ipopt",
            "and 150 times as fast as by IPOPT, ratio >= 150",
            measured=figures["ipopt_over_batch"],
            holds=figures["ipopt_over_batch"] >= 150,
        ),
    ]


study = Study(
    name="kernels-minmax-timing",
    title="Min-max interior point on ten unknowns against SLSQP and IPOPT, answers compared",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=5,
)
