"""What the campaign engine costs: time a case where cases are trivial, share of time where they are short, memory.

Every campaign runs into a folder that keeps each chunk, in a process of its own, after a small one that loads what is
imported. Time a case is that of the whole campaign: workers started, chunks, final files and metrics. A batch of
trivial cases is done before two workers have started; their figure is given without a bar.
"""

import concurrent.futures
import importlib
import math
import multiprocessing
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.runner import run_study
from optsat.campaign.study import Case, Row, Study
from optsat.errors import OptsatError

TRIVIAL, SHORT_S, FEW, MANY = 100_000, 60.0, 10_000, 1_000_000
MEASURED: tuple[tuple[str, str, int, int], ...] = (
    ("batch", "_trivial_batch", TRIVIAL, 1),
    ("single", "_trivial_cases", TRIVIAL, 1),
    ("batch_2_processes", "_trivial_batch", TRIVIAL, 2),
    ("single_2_processes", "_trivial_cases", TRIVIAL, 2),
    ("few", "_trivial_batch", FEW, 1),
    ("many", "_trivial_batch", MANY, 1),
    ("short", "_short_cases", round(SHORT_S / 0.01), 1),
    ("short_2_processes", "_short_cases", round(2 * SHORT_S / 0.01), 2),
)


def cases(count: int) -> list[Case]:
    """Return the campaigns to measure, in turn."""
    names = ("what", "study", "cases", "workers")
    return [dict(zip(names, MEASURED[k % len(MEASURED)], strict=True)) for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return time a case [us], the share of it that the case itself did not take, and peak memory [MB]."""
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, context) as pool:
        taken, inside, peak = pool.submit(measure, case["study"], case["cases"], case["workers"]).result()
    return {
        "what": case["what"],
        "us_a_case": 1e6 * taken / case["cases"],
        "overhead": taken * case["workers"] / inside - 1.0 if inside else math.nan,
        "peak_mb": peak,
    }


def measure(module: str, count: int, workers: int) -> tuple[float, float, float]:
    """Return wall time of a campaign [s], time inside its cases where they tell [s], peak memory of the runner [MB]."""
    study: Study = importlib.import_module(f"optsat.studies.{module}").study
    with tempfile.TemporaryDirectory() as folder:
        run_study(study, 100, seed=1, out=Path(folder, "warm"))
        start = time.perf_counter()
        result = run_study(study, count, workers=workers, out=Path(folder, "measured"))
        taken = time.perf_counter() - start
        inside = sum(row.get("taken_s", 0.0) for row in result.rows)
    return taken, inside, peak_memory()


def peak_memory() -> float:
    """Return the peak resident memory of this process [MB].

    Raises
    ------
    OptsatError : a system that does not tell.
    """
    # the peak that getrusage knows is inherited from the process that started this one
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        raise OptsatError("Peak memory is read from /proc, which this system lacks.") from None
    return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median figures of each campaign."""
    figures: dict[str, float] = {}
    for what in dict.fromkeys(row["what"] for row in rows):
        own = [row for row in rows if row["what"] == what]
        name = "overhead" if what.startswith("short") else "us_a_case"
        figures[f"{what}_{name}"] = float(np.median([row[name] for row in own]))
        if what in ("few", "many"):
            figures[f"{what}_peak_mb"] = float(np.median([row["peak_mb"] for row in own]))
    if {"few_peak_mb", "many_peak_mb"} <= figures.keys():
        figures["memory_growth"] = figures["many_peak_mb"] / figures["few_peak_mb"] - 1.0
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars on what was measured."""
    bars = [
        ("batch_us_a_case", 10.0, f"{TRIVIAL} trivial cases as a batch <= 10 us a case [us]"),
        ("single_us_a_case", 40.0, f"{TRIVIAL} trivial cases one by one <= 40 us a case [us]"),
        ("single_2_processes_us_a_case", 40.0, "one by one in two processes, their start included, <= 40 us [us]"),
        ("memory_growth", 0.2, f"peak memory of {MANY} cases above that of {FEW} <= 20 % [-]"),
        ("short_overhead", 0.05, f"cases of 10 ms over {SHORT_S:.0f} s: engine <= 5 % [-]"),
        ("short_2_processes_overhead", 0.05, "the same in two processes, their start included, <= 5 % [-]"),
    ]
    return [
        judge_bar(name.replace("_", "-"), says, measured=figures[name], holds=figures[name] <= most)
        for name, most, says in bars
        if name in figures
    ]


study = Study(
    name="campaign-overhead-timing",
    title="Cost of the campaign engine: time a case, share of short cases, memory",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=len(MEASURED),
)
