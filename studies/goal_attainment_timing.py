"""Time of `optsat.goal_attain` against SLSQP with finite differences on the interval attitude benchmark; ratios only.

Ten unknowns, seven objectives, twenty bounds, as in `kernels-minmax-timing`, here through the Python interface: every
call checks its arguments, solves, and re-evaluates the answer with its multipliers and residuals. A user has one
symbolic model: SLSQP evaluates the same CasADi functions and differences them; beside it the losses written in NumPy by
hand, the fastest way we know to give them to SLSQP. Calls use the model again with other data, as in a campaign; the
first call, which derives and builds, is told apart. The compiled interior point is timed too where it can be compiled.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attain import goal_attain
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.estimators.minmax_attitude import interval_losses, minmax_attitude
from optsat.kernels.open_kernel import make_kernel
from optsat.solution import Proof
from optsat.studies.kernels_minmax_timing import ERROR, VECTORS, by_slsqp, draw_problems, kernel_arguments, limits

INSTANCES = 60
"""Problems in each round."""

ENGINES: Mapping[str, str | tuple[str, ...]] = {
    "auto": "auto",
    "sqp_then_auto": ("sqp_daqp", "auto"),
    "compiled": "compiled_minmax",
}
_WEIGHTS = np.full(VECTORS, ERROR**2)
# answers are compared where both found the same optimum; others are counted
_SAME = 1e-6


def cases(count: int) -> list[Case]:
    """Return rounds, each with problems of its own."""
    return [{} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round, and how the answers compare."""
    problems = draw_problems(rng, INSTANCES)
    solve, slsqp = _by_goal_attain(), _by_slsqp_on_the_model()
    alternatives: dict[str, Callable[[], object]] = {
        name: partial(_next, cycle(problems), partial(solve, engine)) for name, engine in ENGINES.items()
    }
    alternatives["slsqp"] = partial(_next, cycle(problems), slsqp)
    alternatives["slsqp_numpy"] = partial(_next, cycle(problems), by_slsqp)
    kernel = make_kernel(minmax_attitude(VECTORS))
    arguments = [np.ascontiguousarray(each) for each in kernel_arguments(problems)]
    alternatives["batch"] = lambda: kernel.batch(*arguments)
    times = time_interleaved(alternatives, rounds=7, least_s=0.2)
    peer = np.array([slsqp(problem) for problem in problems])
    row: dict[str, Any] = {
        "slsqp_over_batch": times.ratio("slsqp", "batch") * INSTANCES,
        "slsqp_numpy_over_batch": times.ratio("slsqp_numpy", "batch") * INSTANCES,
    }
    for name, engine in ENGINES.items():
        found = [solve(engine, problem) for problem in problems]
        factors = np.array([each.answer.factor for each in found])
        row |= {
            f"slsqp_over_{name}": times.ratio("slsqp", name),
            f"slsqp_numpy_over_{name}": times.ratio("slsqp_numpy", name),
            f"unproven_{name}": sum(each.proof not in (Proof.STATIONARY, Proof.GLOBAL) for each in found),
            f"worse_{name}": int(np.sum(factors > peer + _SAME)),
            f"better_{name}": int(np.sum(factors < peer - _SAME)),
        }
    return row


def _next(problems: "cycle[Array]", solve: Callable[[Array], object]) -> object:
    return solve(next(problems))


def _model() -> tuple[Any, Any, Any]:
    """Return unknowns, data and losses as symbols."""
    import casadi as ca

    x, p = ca.SX.sym("x", 3 + VECTORS), ca.SX.sym("p", 9 * VECTORS)
    parts = [ca.reshape(part, 3, VECTORS).T for part in ca.vertsplit(p, 3 * VECTORS)]
    return x, p, interval_losses(x, *parts)


def _by_goal_attain() -> Callable[[str | tuple[str, ...], Array], Any]:
    x, p, losses = _model()
    upper = limits()

    def solve(engine: str | tuple[str, ...], problem: Array) -> Any:
        return goal_attain(
            x, losses, 0.0, _WEIGHTS, lb=-upper, ub=upper, parameters=p, parameter_values=problem.ravel(),
            start=np.zeros(len(upper)), engine=engine,
        )  # fmt: skip

    return solve


def _by_slsqp_on_the_model() -> Callable[[Array], float]:
    """Return the problem in SciPy's SLSQP: the model called as a function, derivatives by differences."""
    import casadi as ca
    from scipy import optimize

    x, p, losses = _model()
    function = ca.Function("losses", [x, p], [losses])
    upper, minimize = limits(), getattr(optimize, "minimize")  # noqa: B009
    bounds = [*zip(-upper, upper, strict=True), (None, None)]

    def solve(problem: Array) -> float:
        data = ca.DM(problem.ravel())

        def values(unknowns: Array) -> Array:
            return np.asarray(function(unknowns, data).full()).reshape(-1) / ERROR**2

        found = minimize(
            lambda v: v[-1],
            np.append(np.zeros(len(upper)), 1.0),
            method="SLSQP",
            bounds=bounds,
            constraints=[{"type": "ineq", "fun": lambda v: v[-1] - values(v[:-1])}],
            options={"ftol": 1e-10, "maxiter": 200},
        )
        return float(np.max(values(found.x[:-1])))

    return solve


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each ratio over the rounds, and sums of counts."""
    figures = {
        name: float(np.median([row[name] for row in rows]) if "_over_" in name else np.sum([row[name] for row in rows]))
        for name in rows[0]
        if name != "case"
    }
    return {**figures, "instances": float(INSTANCES * len(rows))}


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars."""
    missed = sum(figures[f"{kind}_{name}"] for name in ENGINES for kind in ("unproven", "worse"))
    generic = max(figures["slsqp_over_auto"], figures["slsqp_over_sqp_then_auto"])
    batch = figures["slsqp_over_batch"]
    return [
        judge_bar(
            "answers",
            "answers that are not proven stationary, or worse than SLSQP's by 1e-6: none",
            measured=missed,
            holds=missed == 0,
        ),
        judge_bar(
            "generic",
            'goal_attain on generic engines, engine=("sqp_daqp", "auto"), is 5 times as fast as SLSQP with finite '
            "differences, ratio >= 5",
            measured=generic,
            holds=generic >= 5,
        ),
        judge_bar(
            "compiled",
            "and 5 times on the compiled interior point, checks and proof included, ratio >= 5",
            measured=figures["slsqp_over_compiled"],
            holds=figures["slsqp_over_compiled"] >= 5,
        ),
        judge_bar(
            "compiled-batch",
            "a problem of a batch on the compiled interior point alone: 1000 times, ratio >= 1000",
            measured=batch,
            holds=batch >= 1000,
        ),
    ]


study = Study(
    name="goal-attainment-timing",
    title="Goal attainment through the Python interface against SLSQP with finite differences, answers compared",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=5,
)
