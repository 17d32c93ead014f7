"""Leak audit of Table 1: the same min-max with and without knowledge of the true attitude, side by side.

A row whose name begins with LEAK is given the true attitude, or vectors free of error, which no sensor provides. Such
rows are no methods: they live in this file alone, and nothing that the package exports takes them. All rows see the
same draws. The genetic algorithm takes DL with its sign, since |DL| leaves nothing to trade. That the paper's program
leaked in this way is an inference from the figures, not a proof: of the variants tried, only those that leak come near
them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.campaign.claim import Claim, judge_bar, judge_paper
from optsat.campaign.study import Case, Row, Study
from optsat.plots.svg_file import write_svg
from optsat.problems.interval_wahba import IntervalWahba
from optsat.problems.interval_wahba_front import IntervalWahbaFront
from optsat.solution import Proof
from optsat.solve import solve
from optsat.solvers.ipopt import Ipopt
from optsat.solvers.nsga2 import Nsga2, pymoo_is_installed
from optsat.studies import _interval_scenario as scenario

SEARCH_DRAWS = 8

ROWS = {
    "q_method": "q-method",
    "honest_range": "min-max, q within 10 % of TRIAD of the measured data",
    "honest_range_raw": "the same, raw middles",
    "LEAK_range": "LEAK: min-max, q within 10 % of the true attitude",
    "LEAK_range_raw": "LEAK: the same, raw middles",
    "LEAK_range_triad": "LEAK: min-max, q within 10 % of TRIAD of the error-free vectors",
    "LEAK_start_raw": "LEAK: min-max, raw middles, started at the true attitude, no range",
    "LEAK_random": "LEAK: a random attitude of the range about the true one, no method at all",
    "LEAK_middles": "LEAK: q-method of the error-free vectors",
    "honest_nsga2": "NSGA-II (signed, 100 x 150), q within 10 % of TRIAD, least larger objective",
    "LEAK_nsga2_choice": "LEAK: the same front, its member nearest to the true attitude",
    "LEAK_nsga2_double": "LEAK: NSGA-II about the true attitude, its nearest member",
}


def cases(count: int) -> list[Case]:
    """Return the draws."""
    return [{"search": k < SEARCH_DRAWS} for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the error of each row on one draw [deg], NaN where it was not run or had no feasible point."""
    exact = scenario.exact_attitude()
    b_B, r_N = scenario.perturbed(rng, scenario.PRINTED_B_B, scenario.PRINTED_R_N)
    unit, raw = scenario.unit_boxes(b_B, r_N), scenario.raw_boxes(b_B, r_N)
    error_free = scenario.unit_boxes(scenario.PRINTED_B_B, scenario.PRINTED_R_N)
    triad = IntervalWahba(error_free.b_B, error_free.r_N).pairs.triad()
    random = exact + scenario.RANGE * np.abs(exact) * rng.uniform(-1, 1, 4)
    found: dict[str, list[Array]] = {
        "q_method": [scenario.q_method(b_B, r_N)],
        "honest_range": _listed(scenario.min_max(unit, search_fraction=scenario.RANGE)),
        "honest_range_raw": _listed(scenario.min_max(raw, search_fraction=scenario.RANGE)),
        "LEAK_range": _listed(_min_max_about(exact, scenario.RANGE, unit)),
        "LEAK_range_raw": _listed(_min_max_about(exact, scenario.RANGE, raw)),
        "LEAK_range_triad": _listed(_min_max_about(triad, scenario.RANGE, unit)),
        "LEAK_start_raw": _listed(_min_max_about(exact, None, raw)),
        "LEAK_random": [random / np.linalg.norm(random)],
        "LEAK_middles": [scenario.q_method(scenario.PRINTED_B_B, scenario.PRINTED_R_N)],
    }
    if case["search"] and pymoo_is_installed():
        front = IntervalWahbaFront(unit.b_B, unit.r_N, absolute=False, search_fraction=scenario.RANGE)
        solver = Nsga2(seed=int(rng.integers(2**31)))
        honest = solve(front, solver)
        if honest.proof is Proof.FEASIBLE:
            found["honest_nsga2"] = [honest.answer.q_BN[honest.answer.compromise]]
            found["LEAK_nsga2_choice"] = list(honest.answer.q_BN)
        form = front.lower()
        reach = scenario.RANGE * np.abs(exact)
        about_truth = replace(
            form, lower=np.append(exact - reach, form.lower[4:]), upper=np.append(exact + reach, form.upper[4:])
        )
        found["LEAK_nsga2_double"] = list(front.interpret(solver.run(about_truth), solver.name).answer.q_BN)
    return {f"{name}_deg": _nearest_deg(found.get(name, []), exact) for name in ROWS}


def _listed(q_BN: Array | None) -> list[Array]:
    return [] if q_BN is None else [q_BN]


def _min_max_about(q_BN: Array, fraction: float | None, boxes: scenario.Boxes | None) -> Array | None:
    """Return the min-max attitude started at q_BN and kept within a fraction of its components, where one is given."""
    if boxes is None:
        return None
    honest = IntervalWahba(boxes.b_B, boxes.r_N).minimax
    form = honest.lower()
    reach = np.full(4, 2.0) if fraction is None else fraction * np.abs(q_BN)
    leaking = replace(
        form,
        lower=np.append(q_BN - reach, form.lower[4:]),
        upper=np.append(q_BN + reach, form.upper[4:]),
        start=np.append(q_BN, form.start[4:]),
    )
    point = Ipopt().run(leaking)
    solution = honest.interpret(point, "ipopt")
    if solution.proof not in (Proof.FEASIBLE, Proof.STATIONARY, Proof.GLOBAL):
        return None
    return np.asarray(point.x[:4] / np.linalg.norm(point.x[:4]))


def _nearest_deg(attitudes: Sequence[Array], exact_BN: Array) -> float:
    errors = [float(np.degrees(quaternion.error_angle(q_BN, exact_BN))) for q_BN in attitudes]
    return min(errors, default=float("nan"))


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return count, mean and population variance of each row's error."""
    figures: dict[str, float] = {}
    for name in ROWS:
        error = np.array([row[f"{name}_deg"] for row in rows])
        error = error[np.isfinite(error)]
        figures[f"{name}_draws"] = float(len(error))
        if len(error):
            figures[f"{name}_mean_deg"] = float(np.mean(error))
            figures[f"{name}_variance_deg2"] = float(np.var(error))
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the printed figures against the rows that leak and those that do not, then our bars side by side."""
    judged = [
        judge_paper(
            f"{'LEAK-' if leak else 'honest-'}min-max-{what}",
            f"min-max, {says}, q within 10 % of {'the true attitude (LEAK)' if leak else 'TRIAD of the measured data'}",
            paper=paper,
            measured=figures[f"{'LEAK' if leak else 'honest'}_range_{what}{unit}"],
            tolerance=tolerance,
        )
        for what, unit, says, paper, tolerance in (
            ("mean", "_deg", "mean error [deg]", 2.2025, 0.3),
            ("variance", "_deg2", "variance of the error [deg^2]", 0.4409, 0.2),
        )
        for leak in (False, True)
    ]
    if figures["honest_nsga2_draws"]:
        judged += [
            judge_paper(
                f"{name.replace('_', '-')}-mean",
                f"{ROWS[name]}, mean error [deg]",
                paper=0.5699,
                measured=figures[f"{name}_mean_deg"],
                tolerance=0.2,
            )
            for name in ("honest_nsga2", "LEAK_nsga2_choice", "LEAK_nsga2_double")
        ]
    leak, honest = figures["LEAK_range_mean_deg"], figures["honest_range_mean_deg"]
    return [
        *judged,
        judge_bar(
            "with-the-leak",
            "LEAK, range about the true attitude: mean 1.8 to 2.8 deg",
            measured=leak,
            holds=1.8 <= leak <= 2.8,
        ),
        judge_bar(
            "without-the-leak",
            "the same range about TRIAD of the measured data: mean 15 to 20 deg",
            measured=honest,
            holds=15 <= honest <= 20,
        ),
        judge_bar(
            "range-alone",
            "LEAK: a random attitude of that range is as good as the min-max in it: mean <= 2.8 deg",
            measured=figures["LEAK_random_mean_deg"],
            holds=figures["LEAK_random_mean_deg"] <= 2.8,
        ),
    ]


def figure(rows: Sequence[Row], path: Path) -> None:
    """Draw mean and standard deviation of each row, those that leak in another colour."""
    from matplotlib.figure import Figure

    shown = metrics(rows)
    names = [name for name in ROWS if shown[f"{name}_draws"] > 0]
    canvas = Figure(figsize=(9, 4.8), layout="constrained")
    axes = canvas.subplots()
    for place, name in enumerate(names):
        colour = "#D55E00" if name.startswith("LEAK") else "#0072B2"
        mean, spread = shown[f"{name}_mean_deg"], np.sqrt(shown[f"{name}_variance_deg2"])
        axes.barh(place, mean, 0.7, color=colour)
        axes.plot([max(mean - spread, 0), mean + spread], [place, place], color="#444444", linewidth=1)
        axes.annotate(f"{mean:.2f}", (mean + spread, place), xytext=(4, 0), textcoords="offset points", va="center")
    axes.axvline(2.2025, color="#009E73", linestyle="--", label="the paper's min-max")
    axes.barh(0, 0, color="#0072B2", label="sees measured data alone")
    axes.barh(0, 0, color="#D55E00", label="LEAK: sees the true attitude")
    axes.set_yticks(range(len(names)), [ROWS[name] for name in names], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.15 * axes.get_xlim()[1])
    axes.set_xlabel("attitude error [deg]: mean and standard deviation")
    axes.set_title("Who sees the answer, and what it is worth")
    canvas.legend(frameon=False, loc="outside lower center", ncols=3)
    write_svg(canvas, path)


study = Study(
    name="interval-wahba-leak-audit",
    title="Leak audit of the interval-Wahba paper: the same min-max with and without the true attitude",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=200,
    figure=figure,
    paper="interval-robust Wahba",
)
