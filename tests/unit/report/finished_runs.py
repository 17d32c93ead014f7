"""Complete runs to be reported: one that was run, and large ones that nobody had to run."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optsat.campaign.claim import Claim, Verdict, judge_bar, judge_paper
from optsat.campaign.finished_run import FinishedRun, read_run
from optsat.campaign.run_folder import Identity
from optsat.campaign.runner import run_study
from optsat.campaign.study import Case, Row, Study
from optsat.plots.svg_file import write_svg

UNLUCKY = 7
SPITEFUL = '<script>alert("&")</script> | [x](y)'


def _run(case: Case, rng: np.random.Generator) -> Row:
    if case["number"] % 50 == UNLUCKY:
        raise ValueError(SPITEFUL)
    angle = float(rng.random())
    return {
        "angle_deg": angle,
        "ratio": float("inf") if case["number"] == 3 else float("nan") if case["number"] == 4 else -1e-9 * angle,
        "steps": int(rng.integers(5)),
        "within": angle < 0.5,
        "word": ("one", "two", SPITEFUL)[case["number"] % 3],
    }


def _claims(figures: Mapping[str, float]) -> list[Claim]:
    mean = figures["mean_deg"]
    return [
        judge_paper("mean", f"mean angle {SPITEFUL} [deg]", paper=0.5, measured=mean, tolerance=0.2),
        judge_paper("better", "mean angle [deg]", paper=5.0, measured=mean, tolerance=0.1, better="lower"),
        judge_paper("worse", "mean angle [deg]", paper=5.0, measured=mean, tolerance=0.1),
        judge_bar("holds", "mean below one", measured=mean, holds=mean < 1),
        judge_bar("fails", "mean below zero", measured=mean, holds=mean < 0),
    ]


def figure(rows: Sequence[Row], path: Path) -> None:
    """Draw what trips a page: text, dashes, a hatch, greys, a cloud that becomes an image, a legend."""
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(7, 4), layout="constrained")
    axes = canvas.subplots()
    axes.plot([0, 1], [0, 1], "--", color="#333333", label="dashed")
    axes.axvspan(0.2, 0.4, facecolor="#FBF3D0", edgecolor="#B8860B", hatch="///")
    grid = np.linspace(0, 1, 3000)
    axes.plot(grid, 0.5 + 0.3 * np.sin(40 * grid), "o", ms=2, label="cloud")
    axes.set(xlabel="angle [deg]", ylabel="share [-]", title=f"{len(rows)} rows")
    axes.legend()
    write_svg(canvas, path)


study = Study(
    name="spiteful",
    title=f"Angles {SPITEFUL}",
    cases=lambda count: [{"number": number} for number in range(count)],
    run=_run,
    metrics=lambda rows: {"mean_deg": float(np.mean([row["angle_deg"] for row in rows])), "worst": float("nan")},
    claims=_claims,
    default_cases=260,
    figure=figure,
)


def finished(folder: Path, drawn: bool = True, cases: int = 260) -> FinishedRun:
    """Return the run of the study above in the folder, with its own figure or without."""
    chosen = study if drawn else Study(**{**vars(study), "figure": None})
    run_study(chosen, cases, seed=1, out=folder)
    return read_run(folder)


def large(cases: int, columns: int = 5) -> FinishedRun:
    """Return a run of many cases with columns of random numbers, without a folder."""
    generator = np.random.default_rng(5)
    table: dict[str, NDArray[Any]] = {"case": np.arange(cases)}
    table |= {f"column_{k}": generator.normal(size=cases) * 10.0**k for k in range(columns - 1)}
    table["word"] = np.array(["good", "bad"])[generator.integers(2, size=cases)]
    identity = Identity("large", 1, 0, cases, "0.1.0", "0" * 64)
    claim = Claim("mean", "mean", 0.0, 0.0, Verdict.REPRODUCED)
    return FinishedRun(Path("large"), identity, "Large", {"mean": 0.0}, (claim,), (), table, {}, ("0" * 16,), {}, "0")
