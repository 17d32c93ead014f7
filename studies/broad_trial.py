"""BROAD trial 01: plain q-method, certified and windowed attitude from gravity and magnetic field against the
optical reference.

The trial is read from `broad/` in the folder that OPTSAT_DATA names (default ../shared/data); it is not part of optsat
(D. Laidig and others, CC BY 4.0). The bounds follow `optsat.records.broad.BroadBounds`, which never looks at the
reference.
A case is one epoch, every 57th sample (5 a second).
"""

import functools
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.davenport import canonical, davenport_matrix, dominant_quaternion
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.estimators.attitude_series import AttitudeSeries, Window, certify_record
from optsat.plots.svg_file import write_svg
from optsat.records.broad import load_broad
from optsat.records.record import Record

TRIAL = "01_undisturbed_slow_rotation_A.mat"
EVERY = 57
WINDOW = Window(length_s=5.0, spacing_s=0.5)


def cases(count: int) -> list[Case]:
    """Return the first `count` epochs."""
    return [{"epoch": k} for k in range(count)]


@functools.cache
def _series() -> tuple[Record, AttitudeSeries, AttitudeSeries, Array]:
    """Return the record, its single-frame and windowed series, and the q-method's attitude at the same epochs."""
    record = load_broad(Path(os.environ.get("OPTSAT_DATA", "../shared/data")) / "broad" / TRIAL)
    plain = np.full((len(record.t[::EVERY]), 4), np.nan)
    for row, k in enumerate(range(0, len(record.t), EVERY)):
        b, r = record.pairs(k)[:2]
        if len(b) == 2:
            plain[row] = canonical(dominant_quaternion(davenport_matrix(b, r, np.array([0.5, 0.5]))))
    return record, certify_record(record, every=EVERY), certify_record(record, WINDOW, every=EVERY), plain


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return errors and bounds of one epoch [deg]; -1 where there is none."""
    record, single, windowed, plain = _series()
    k = case["epoch"]
    assert record.q_BN_true is not None
    assert record.omega_BN_B is not None
    truth = record.q_BN_true[::EVERY][k]
    row: dict[str, float | int] = {
        "t_s": float(single.t[k]),
        "rate_deg_s": float(np.degrees(np.linalg.norm(record.omega_BN_B[::EVERY][k]))),
        "plain_deg": _error_deg(plain[k], truth),
    }
    for name, series in (("certified", single), ("windowed", windowed)):
        row[f"{name}_deg"] = _error_deg(series.q_BN[k], truth)
        row[f"{name}_bound_deg"] = float(np.degrees(series.bound_rad[k])) if series.ok[k] else -1.0
    row["refused"] = int(sum(not channel.valid[::EVERY][k] for channel in record.channels))
    return row


def _error_deg(q_BN: Array, truth: Array) -> float:
    if not (np.all(np.isfinite(q_BN)) and np.all(np.isfinite(truth))):
        return -1.0
    return float(np.degrees(quaternion.error_angle(q_BN, truth)))


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return error figures of each answer, containment and size of the bounds, and the share of refused samples."""
    figures: dict[str, float] = {"epochs": float(len(rows))}
    for name in ("plain", "certified", "windowed"):
        error = np.array([row[f"{name}_deg"] for row in rows])
        known = error >= 0
        figures[f"{name}_median_deg"] = float(np.median(error[known]))
        figures[f"{name}_rms_deg"] = float(np.sqrt(np.mean(error[known] ** 2)))
        figures[f"{name}_p95_deg"] = float(np.quantile(error[known], 0.95))
        if name != "plain":
            bound = np.array([row[f"{name}_bound_deg"] for row in rows])
            both = known & (bound >= 0)
            figures[f"{name}_containment_percent"] = float(100 * np.mean(error[both] <= bound[both]))
            figures[f"{name}_bound_median_deg"] = float(np.median(bound[both]))
            figures[f"{name}_undetermined_percent"] = float(100 * np.mean(bound < 0))
    figures["refused_samples_percent"] = float(50 * np.mean([row["refused"] for row in rows]))
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the containment bars."""
    return [
        judge_bar(
            f"{name}-containment",
            f"{name}: optical reference inside the bound in at least 99 % of the epochs [%]; median bound "
            f"{figures[f'{name}_bound_median_deg']:.1f} deg, refused samples "
            f"{figures['refused_samples_percent']:.1f} %",
            measured=figures[f"{name}_containment_percent"],
            holds=figures[f"{name}_containment_percent"] >= 99,
        )
        for name in ("certified", "windowed")
    ]


def figure(rows: Sequence[Row], path: Path) -> None:
    """Draw errors against bounds over time, and the rate below."""
    from matplotlib.figure import Figure

    t = [row["t_s"] for row in rows]
    canvas = Figure(figsize=(9, 5.5), layout="constrained")
    upper, lower = canvas.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    for name, colour in (("certified", "#0072B2"), ("windowed", "#009E73")):
        upper.plot(t, _shown(rows, f"{name}_bound_deg"), color=colour, lw=1.5, label=f"{name}: guaranteed bound")
    for name, colour in (("plain", "#999999"), ("certified", "#56B4E9"), ("windowed", "#E69F00")):
        upper.plot(t, _shown(rows, f"{name}_deg"), ".", ms=2.5, color=colour, label=f"{name}: error")
    upper.set(yscale="log", ylabel="attitude angle [deg]", ylim=(0.05, 200))
    inside = metrics(rows)["certified_containment_percent"]
    upper.set_title(f"BROAD trial 01: {inside:.1f} % of the errors lie within the guaranteed bound")
    upper.legend(frameon=False, ncols=5, fontsize=8, loc="upper center")
    lower.plot(t, [row["rate_deg_s"] for row in rows], color="#333333", lw=0.8)
    lower.set(xlabel="time [s]", ylabel="rate [deg/s]")
    write_svg(canvas, path)


def _shown(rows: Sequence[Row], name: str) -> Array:
    values = np.array([row[name] for row in rows])
    return np.where(values >= 0, values, np.nan)


study = Study(
    name="broad-trial",
    title="Attitude from a real 9-axis IMU against an optical reference (BROAD trial 01)",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=999,
    figure=figure,
)
