"""Orbit run of the interval-Wahba paper: its q-method, its min-max, and the certified attitude with its bound.

The paper says that its method lowers the RMS error by more than 50 %. The min-max, whose middles are the measured
directions, returns the q-method (see the theorem in `optsat.problems.interval_wahba`); it is solved at every 20th
second, the other methods at each. Noise law and initial rate, which the paper leaves open, are varied.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attitude import euler321, quaternion
from optsat.attitude.davenport import canonical, davenport_matrix, dominant_quaternion
from optsat.campaign.claim import Claim, Verdict, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.determine import certify_attitude_batch
from optsat.models.epoch import Epoch
from optsat.plots.svg_file import write_svg
from optsat.problems.component_box import ComponentBox
from optsat.problems.interval_wahba import IntervalWahba
from optsat.simulation.orbit_scenario import OrbitScenario
from optsat.solution import Proof
from optsat.solve import solve
from optsat.studies._interval_scenario import ENGINES

JULIAN_DATES = (2459294.0, 2459385.0, 2459475.5)
VARIANTS = (("lvlh", "cap"), ("lvlh", "angle"), ("inertial", "cap"))
EVERY = 20


def cases(count: int) -> list[Case]:
    """Return the epochs in turn, then the next reading of what the paper leaves open."""
    return [
        {
            "julian_date": JULIAN_DATES[k % 3],
            "rate": VARIANTS[(k // 3) % 3][0],
            "noise": VARIANTS[(k // 3) % 3][1],
            "duration_s": 1200.0,
        }
        for k in range(count)
    ]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return errors of one simulated run: RMS of the total, and series [deg] for the figures."""
    record = OrbitScenario(
        epoch=Epoch.from_julian_date(case["julian_date"]),
        duration=case["duration_s"],
        rate=case["rate"],
        noise=case["noise"],
    ).simulate(rng)
    truth = record.q_BN_true
    assert truth is not None
    b_B = np.stack([channel.b_B for channel in record.channels], axis=1)
    r_N = np.stack([channel.r_N for channel in record.channels], axis=1)
    eps = np.stack([channel.angle_bound_rad for channel in record.channels], axis=1)
    equal = _wahba(b_B, r_N, np.full(eps.shape, 0.5))
    weighted = _wahba(b_B, r_N, 1 / eps**2 / np.sum(1 / eps**2, axis=1, keepdims=True))
    certified = certify_attitude_batch(b_B, r_N, eps)
    places = np.arange(0, len(record.t), EVERY)
    pairs = [min_max(b_B[k], r_N[k], eps[k]) for k in places]
    found = np.array([q_BN for q_BN, _ in pairs])
    error = {name: quaternion.error_angle(q, truth) for name, q in (("q", equal), ("weighted", weighted))}
    error["certified"] = quaternion.error_angle(certified.q_BN, truth)
    return {
        "epoch": JULIAN_DATES.index(case["julian_date"]),
        "rate": case["rate"],
        "noise": case["noise"],
        "q_deg": _rms_deg(error["q"]),
        "q_at_places_deg": _rms_deg(error["q"][places]),
        "min_max_at_places_deg": _rms_deg(quaternion.error_angle(found, truth[places])),
        "min_max_from_q_deg": float(np.degrees(np.max(quaternion.error_angle(found, equal[places])))),
        "min_max_solved": len(places),
        "min_max_unproven": sum(proof is not Proof.GLOBAL for _, proof in pairs),
        "weighted_deg": _rms_deg(error["weighted"]),
        "certified_deg": _rms_deg(error["certified"]),
        "bound_deg": _rms_deg(certified.bound_rad),
        "violations": int(np.sum(~(error["certified"] <= certified.bound_rad))),
        "t": record.t,
        "q_axes_deg": _axes_deg(equal, truth),
        "certified_axes_deg": _axes_deg(certified.q_BN, truth),
        "min_max_axes_deg": _axes_deg(found, truth[places]),
        "bound_series_deg": np.degrees(certified.bound_rad),
        "q_running_deg": _running_deg(error["q"]),
        "q_running_at_places_deg": _running_deg(error["q"][places]),
        "certified_running_deg": _running_deg(error["certified"]),
        "min_max_running_deg": _running_deg(quaternion.error_angle(found, truth[places])),
    }


def min_max(b_B: Array, r_N: Array, angle_bound_rad: Array) -> tuple[Array, Proof]:
    """Return the paper's min-max attitude of one instant, by the first engine that ends with a proof, and the proof.

    Each component of b is as uncertain as an error of the bound's angle makes it: that angle times the sine of its
    angle to the axis, to first order; references are exact.
    """
    half_width = angle_bound_rad[:, None] * np.sqrt(np.maximum(1 - b_B**2, 0.0))
    boxes = ComponentBox.from_half_width(b_B, half_width), ComponentBox.from_half_width(r_N, 0.0)
    problem = IntervalWahba(*boxes)
    first, *others = ENGINES
    solution = solve(problem, first)
    for engine in others:
        if solution.proof is Proof.GLOBAL:
            break
        solution = solve(problem, engine)
    return solution.answer.q_BN, solution.proof


def _wahba(b_B: Array, r_N: Array, weights: Array) -> Array:
    return np.asarray(canonical(dominant_quaternion(davenport_matrix(b_B, r_N, weights))))


def _rms_deg(angle: Array) -> float:
    return float(np.degrees(np.sqrt(np.mean(np.square(angle)))))


def _running_deg(angle: Array) -> Array:
    return np.asarray(np.degrees(np.sqrt(np.cumsum(angle**2) / np.arange(1, len(angle) + 1))))


def _axes_deg(q_BN: Array, truth_BN: Array) -> Array:
    """Return roll, pitch and yaw (T, 3) of the error rotation [deg]."""
    error = quaternion.compose(q_BN, quaternion.inverse(truth_BN))
    return np.asarray(np.degrees(euler321.from_quaternion(error)))[:, ::-1]


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return RMS over the runs as the paper reads the orbit, each epoch of it, and the gains of all variants."""
    figures: dict[str, float] = {}
    named = [row for row in rows if (row["rate"], row["noise"]) == VARIANTS[0]]
    columns = ("q_deg", "min_max_at_places_deg", "q_at_places_deg", "weighted_deg", "certified_deg", "bound_deg")
    for name in columns:
        figures[name] = _rms(named, name)
        for epoch in sorted({row["epoch"] for row in named}):
            figures[f"epoch{epoch + 1}_{name}"] = _rms([row for row in named if row["epoch"] == epoch], name)
    for rate, noise in VARIANTS:
        own = [row for row in rows if (row["rate"], row["noise"]) == (rate, noise)]
        if own:
            figures[f"{rate}_{noise}_q_deg"] = _rms(own, "q_deg")
            figures[f"{rate}_{noise}_min_max_gain_percent"] = _gain(own, "min_max_at_places_deg", "q_at_places_deg")
            figures[f"{rate}_{noise}_certified_gain_percent"] = _gain(own, "certified_deg", "q_deg")
    figures["min_max_from_q_deg"] = max(row["min_max_from_q_deg"] for row in rows)
    figures["min_max_solved"] = float(sum(row["min_max_solved"] for row in rows))
    figures["min_max_unproven"] = float(sum(row["min_max_unproven"] for row in rows))
    figures["violations"] = float(sum(row["violations"] for row in rows))
    return figures


def _rms(rows: Sequence[Row], name: str) -> float:
    return float(np.sqrt(np.mean([row[name] ** 2 for row in rows])))


def _gain(rows: Sequence[Row], ours: str, theirs: str) -> float:
    return 100 * (1 - _rms(rows, ours) / _rms(rows, theirs))


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the paper's claim for the min-max and for the best that a memoryless method does here, then our bars."""
    judged = [
        Claim(
            f"{name}-gain",
            f"RMS error of {says} more than 50 % below the q-method's [%]",
            50.0,
            best,
            Verdict.REPRODUCED if best > 50 else Verdict.NOT_REPRODUCED,
        )
        for name, says, kind in (
            ("min-max", "the min-max, best of the variants,", "min_max"),
            ("certified", "the certified attitude, without memory, best of the variants,", "certified"),
        )
        for best in [max(value for key, value in figures.items() if key.endswith(f"_{kind}_gain_percent"))]
    ]
    return [
        *judged,
        judge_bar(
            "min-max-is-q",
            "largest distance of the min-max from the q-method <= 1e-4 deg, every instant with its proof",
            measured=figures["min_max_from_q_deg"],
            holds=figures["min_max_from_q_deg"] <= 1e-4 and figures["min_max_unproven"] == 0,
        ),
        judge_bar(
            "no-violation",
            "errors above the certified bound",
            measured=figures["violations"],
            holds=figures["violations"] == 0,
        ),
    ]


def figure(rows: Sequence[Row], path: Path) -> None:
    """Draw the first run: roll, pitch and yaw error and running RMS, as the paper's figures 1 to 4."""
    from matplotlib.figure import Figure

    row: Any = rows[0]
    t, places = row["t"], row["t"][::EVERY]
    canvas = Figure(figsize=(9, 7), layout="constrained")
    axes = canvas.subplots(2, 2, sharex=True)
    for place, name in enumerate(("roll", "pitch", "yaw")):
        panel = axes.flat[place]
        bound = row["bound_series_deg"]
        panel.fill_between(t, -bound, bound, color="#0072B2", alpha=0.15, linewidth=0, label="certified bound")
        panel.axhline(0, color="#444444", linewidth=0.8, label="nominal")
        panel.plot(t, row["q_axes_deg"][:, place], color="#999999", linewidth=0.8, label="q-method")
        panel.plot(t, row["certified_axes_deg"][:, place], color="#0072B2", linewidth=0.6, label="certified")
        panel.plot(
            places, row["min_max_axes_deg"][:, place], ".", color="#D55E00", markersize=3, label="min-max, every 20 s"
        )
        panel.set_title(f"{name} error")
        panel.set_ylabel("[deg]")
    panel = axes.flat[3]
    panel.plot(t, row["q_running_deg"], color="#999999", label="q-method")
    panel.plot(t, row["certified_running_deg"], color="#0072B2", label="certified")
    panel.plot(places, row["q_running_at_places_deg"], color="#444444", linewidth=2.5, label="q-method, every 20 s")
    panel.plot(places, row["min_max_running_deg"], ".", color="#D55E00", markersize=3, label="min-max, every 20 s")
    panel.plot(t, row["q_running_deg"] / 2, color="#009E73", linestyle="--", label="50 % below, as the paper says")
    panel.set_title("running RMS of the attitude error")
    panel.set_ylim(bottom=0)
    for panel in axes[1]:
        panel.set_xlabel("time [s]")
    named = {
        label: handle for panel in axes.flat for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    canvas.legend(list(named.values()), list(named), loc="outside lower center", ncols=4, frameon=False)
    write_svg(canvas, path)


study = Study(
    name="interval-wahba-orbit",
    title="Orbit run of the interval-Wahba paper: the q-method, its min-max and the certified attitude",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=9,
    figure=figure,
    paper="interval-robust Wahba",
)
