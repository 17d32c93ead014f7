"""Every engine on every min-max problem of the suite from many starts: which engine to take for what.

The problems are those of the literature with known optima and the three interval-Wahba forms; start 0 is the usual one,
the others are spread by a Sobol sequence. Solved means: stationary, feasible, and within 1e-6 of the best known optimum
(1e-7 where that is 0). Honest means: nothing better than the optimum is reported, nothing worse is called global.
`auto` is `goal_attain` with one start, `auto_8` with eight, the usual one first. Times are of a
second run, when derivatives and solvers are there, over that of the fastest engine on the same start: load on the
machine changes them. The figure is the performance profile: for each engine the share of runs that it solved in at
most tau times the best time.

Which engine for what. `auto` unless you have a reason: 94 % of the problems from their usual starts, all of them with
eight starts, so give `starts` whenever a problem is not convex. Convex quadratics and norms: `conic_minmax`, without a
start, which `auto` takes by itself. The same smooth problem again and again with other numbers: `compiled_minmax`, the
fastest engine of all after a second or two of compilation, or `("sqp_daqp", "auto")` without a compiler, seven times as
fast as `auto` where it solves. Single engines from arbitrary starts: `slsqp` (with exact derivatives here) and `ipopt`
are the most dependable, and fail on different problems, so `auto` runs both. `sqp_osqp` and `sqp_ipqp` seldom solve
what the others do not. Functions known only by their values: `slsqp` is the only one.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attain_runs import best_attainment
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.multistart import sobol_starts
from optsat.plots.svg_file import write_svg
from optsat.problems.attainment import Attainment
from optsat.problems.multi_objective import MultiObjective
from optsat.solution import Proof, Solution
from optsat.solve import solve
from optsat.solvers import SOLVERS
from optsat.studies._solver_suite import Task, tasks
from optsat.studies.minmax_honesty import honest, weight_sum

STARTS = 3
_MOST_STARTS = 64
SINGLE = ("conic_minmax", "ipopt", "sqp_daqp", "sqp_osqp", "sqp_ipqp", "slsqp", "compiled_minmax")
TOGETHER = {"auto": 1, "auto_8": 8}
ENGINES = (*SINGLE, *TOGETHER)
_COLOURS = ("#882255", "#0072B2", "#D55E00", "#E69F00", "#CC79A7", "#666666", "#009E73", "#000000")
_PROVEN = (Proof.STATIONARY, Proof.GLOBAL)


def cases(count: int) -> list[Case]:
    """Return all problems from their usual starts, then from the next start, and so on."""
    suite = tasks()
    return [{"problem": suite[k % len(suite)].name, "start": k // len(suite) % _MOST_STARTS} for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return for each engine whether it solved the problem, was honest, and its effort."""
    task = next(each for each in tasks() if each.name == case["problem"])
    problem = task.pose(None)
    if case["start"]:
        problem = task.pose(_defined_start(problem, int(case["start"])))
    row: dict[str, Any] = {"problem": task.name, "start": int(case["start"]), "convex": task.convex}
    row["usual_start"] = case["start"] == 0
    for name in ENGINES:
        row |= {
            f"{key}_{name}": value
            for key, value in _judged(task, problem, _engine(name, problem, row["usual_start"])).items()
        }
    fastest = min((row[f"seconds_{name}"] for name in SINGLE if row[f"solved_{name}"]), default=float("inf"))
    for name in ENGINES:
        seconds = row.pop(f"seconds_{name}")
        row[f"time_ratio_{name}"] = (
            seconds / fastest if row[f"solved_{name}"] and np.isfinite(fastest) else float("inf")
        )
    return row


def _defined_start(problem: MultiObjective, number: int) -> Array:
    """Return a point of the Sobol sequence, moved towards the usual start until all functions are finite."""
    form = problem.form
    x = sobol_starts(form.start, form.lower, form.upper, _MOST_STARTS, 1)[number]
    for _ in range(60):
        values = np.concatenate((form.objectives.values(x), form.constraints.values(x)))
        if np.all(np.isfinite(values)) and np.all(np.isfinite(form.objectives.jacobian(x))):
            break
        x = 0.5 * (x + form.start)
    return np.array(x)


def _engine(name: str, problem: MultiObjective, usual_start: bool) -> Callable[[], Solution[Attainment]] | None:
    """Return what solves the problem by that name, None where the engine does not take it."""
    if TOGETHER.get(name, 1) > 1 and not usual_start:
        return None
    if name in TOGETHER:
        return lambda: best_attainment(problem, None, TOGETHER[name], 0, "auto")
    engine = next(each for each in SOLVERS if each.name == name)
    return (lambda: solve(problem, engine)) if engine.accepts(problem.form) else None


def _judged(task: Task, problem: MultiObjective, engine: Callable[[], Solution[Attainment]] | None) -> dict[str, Any]:
    nothing = {"takes": False, "solved": False, "honest": True, "hard_violation": 0.0, "weight_sum_error": 0.0}
    if engine is None:
        return {**nothing, "iterations": 0, "evaluations": 0, "seconds": float("inf")}
    engine()
    began = perf_counter()
    found = engine()
    seconds = perf_counter() - began
    proven = found.proof in _PROVEN
    runs = found.stats.get("runs", ())
    return {
        "takes": True,
        "solved": proven and found.answer.factor <= task.optimum + task.tolerance,
        # what is called global is the optimum of a problem that is convex indeed
        "honest": honest(problem.form, found, task.optimum) and (task.convex or found.proof is not Proof.GLOBAL),
        "hard_violation": found.residuals.get("hard_goal_violation", 0.0) if proven else 0.0,
        "weight_sum_error": abs(weight_sum(problem.form, found.answer) - 1.0) if proven else 0.0,
        "iterations": sum(each.iterations for each in runs) or int(found.stats["iterations"]),
        "evaluations": int(found.stats.get("evaluations", 0)),
        "seconds": seconds,
    }


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return for each engine the shares solved and honest, and medians of its effort where it solved."""
    figures: dict[str, float] = {
        "problems": float(len({row["problem"] for row in rows})),
        "starts": float(max(row["start"] for row in rows) + 1),
    }
    for name in ENGINES:
        taken = [row for row in rows if row[f"takes_{name}"]]
        solved = [row for row in taken if row[f"solved_{name}"]]
        figures |= {
            f"takes_{name}": len(taken) / len(rows),
            f"solved_{name}": _mean([row[f"solved_{name}"] for row in taken]),
            f"solved_usual_start_{name}": _mean([row[f"solved_{name}"] for row in taken if row["usual_start"]]),
            f"solved_convex_{name}": _mean([row[f"solved_{name}"] for row in taken if row["convex"]]),
            f"honest_{name}": _mean([row[f"honest_{name}"] for row in taken]),
            f"iterations_{name}": _median([row[f"iterations_{name}"] for row in solved]),
            f"time_ratio_{name}": _median([row[f"time_ratio_{name}"] for row in solved]),
        }
        # some engines do not count them
        if any(row[f"evaluations_{name}"] for row in solved):
            figures[f"evaluations_{name}"] = _median([row[f"evaluations_{name}"] for row in solved])
    conic = [row for row in rows if row["solved_conic_minmax"]]
    figures["ipopt_over_conic_minmax"] = _median(
        [row["time_ratio_ipopt"] / row["time_ratio_conic_minmax"] for row in conic if row["solved_ipopt"]]
    )
    figures["unsolved_problems_auto_8"] = float(len(_unsolved(rows, "auto_8")))
    for key in ("hard_violation", "weight_sum_error"):
        figures[key] = float(max(row[f"{key}_{name}"] for row in rows for name in ENGINES))
    return figures


def _unsolved(rows: Sequence[Row], name: str) -> set[str]:
    """Return the problems that were not solved from their usual start."""
    return {row["problem"] for row in rows if row["usual_start"] and not row[f"solved_{name}"]}


def _mean(values: Sequence[Any]) -> float:
    return float(np.mean(values)) if len(values) else 0.0


def _median(values: Sequence[Any]) -> float:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.median(finite)) if finite else 0.0


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars."""
    usual, unsolved = figures["solved_usual_start_auto"], figures["unsolved_problems_auto_8"]
    honesty = min(figures[f"honest_{name}"] for name in ENGINES if figures[f"takes_{name}"])
    weights, hard = figures["weight_sum_error"], figures["hard_violation"]
    return [
        judge_bar(
            "usual-starts",
            "share of problems that `auto` solves from the usual start, to 1e-6 relative (1e-7 at 0), at least 0.85",
            measured=usual,
            holds=usual >= 0.85,
        ),
        judge_bar(
            "multistart",
            "problems that `auto` does not solve with eight starts, the usual one first: none",
            measured=unsolved,
            holds=unsolved == 0,
        ),
        judge_bar(
            "honesty",
            "share of honest answers, of the engine with the fewest: 1",
            measured=honesty,
            holds=honesty == 1.0,
        ),
        judge_bar(
            "weight-sum",
            "largest |sum w mu - 1| of a stationary answer, at most 1e-6",
            measured=weights,
            holds=weights <= 1e-6,
        ),
        judge_bar(
            "hard-goals",
            "largest violation of a hard goal by a stationary answer, at most 1e-8",
            measured=hard,
            holds=hard <= 1e-8,
        ),
        *_advice(figures),
    ]


def _advice(figures: Mapping[str, float]) -> list[Claim]:
    """Return which engine to take for what, as claims that fail where the advice does not hold."""
    together, alone = (
        figures["solved_usual_start_auto_8"],
        max(figures[f"solved_usual_start_{name}"] for name in SINGLE),
    )
    conic = figures["ipopt_over_conic_minmax"]
    smooth = [name for name in SINGLE if name not in ("conic_minmax", "compiled_minmax")]
    quick = min(smooth, key=lambda name: figures[f"time_ratio_{name}"] or np.inf)
    dependable = max(smooth, key=lambda name: figures[f"solved_{name}"])
    compiled = figures["time_ratio_compiled_minmax"]
    return [
        judge_bar(
            "take-auto",
            "for a problem that may have several optima take `auto` with several starts: no single engine solves more",
            measured=together,
            holds=together >= alone,
        ),
        judge_bar(
            "take-conic",
            "for convex quadratics and norms take `conic_minmax`, as `auto` does: time of `ipopt` over its own, > 1",
            measured=conic,
            holds=conic > 1.0,
        ),
        judge_bar(
            "take-compiled",
            "for the same problem again with other numbers take `compiled_minmax`: median time over the fastest, 1",
            measured=compiled,
            holds=compiled == 1.0,
        ),
        judge_bar(
            "take-without-compiler",
            'without a compiler take `("sqp_daqp", "auto")` for that: the quickest of the other engines',
            measured=quick,
            holds=quick == "sqp_daqp",
        ),
        judge_bar(
            "take-single",
            "for one engine alone from any start take `slsqp` or `ipopt`: that which solves most",
            measured=dependable,
            holds=dependable in ("slsqp", "ipopt"),
        ),
    ]


def profile(ratios: Array, factors: Array) -> Array:
    """Return the share of runs (m,) of which the time ratio is at most each factor, inf counting as unsolved.

    Source: Dolan & More, Math. Program. 91 (2002).
    """
    return np.asarray(np.sum(ratios[:, None] <= factors, axis=0) / max(1, len(ratios)))


def figure(rows: Sequence[Row], path: Path) -> None:
    """Draw the performance profiles by time, of all runs and of the problems that are not convex."""
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(10.0, 4.6), layout="constrained")
    axes = canvas.subplots(1, 2, sharey=True)
    factors = np.geomspace(1.0, 1000.0, 200)
    for panel, own, says in (
        (axes[0], list(rows), "all problems"),
        (axes[1], [row for row in rows if not row["convex"]], "problems that are not convex"),
    ):
        for name, colour in zip((*SINGLE, "auto"), _COLOURS, strict=True):
            ratios = np.array([row[f"time_ratio_{name}"] for row in own])
            style = "--" if name in TOGETHER else "-"
            panel.semilogx(factors, profile(ratios, factors), style, color=colour, linewidth=1.6, label=name)
        panel.set_title(f"{says} ({len(own)} runs)")
        panel.set_xlabel("tau: time over the fastest engine's")
        panel.grid(visible=True, color="#DDDDDD", linewidth=0.7)
        panel.set_ylim(0, 1.02)
    axes[0].set_ylabel("share of runs solved within tau")
    canvas.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
    write_svg(canvas, path)


study = Study(
    name="compare-solvers",
    title="Every min-max engine on every problem of the suite, from many starts",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=STARTS * 47,
    figure=figure,
)
