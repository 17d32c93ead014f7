"""Isolability of torque, gyro and star-tracker faults about one axis, for seven sets of sensors, each figure judged.

Steps of 3 N m, 0.3 rad/s and 0.01 rad, 1 s into a window of 5 s at 10 Hz. Nothing is drawn: each case is one set of
sensors, computed once. The bars are figures found earlier by another implementation, to 5 %; zeros must be exact.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.estimators.added_sensor import cheapest_added_sensor
from optsat.estimators.isolability import AdditiveFault, Isolability, isolability
from optsat.models.single_axis import AXIS_SENSORS, single_axis
from optsat.plots.isolability_figure import draw_matrix
from optsat.plots.svg_file import write_svg

WINDOW = 5.0
FAULTS = {
    "torque": AdditiveFault("torque", {"torque": 3.0}),
    "gyro": AdditiveFault("gyro", {"gyro": 0.3}),
    "star": AdditiveFault("star", {"star": 0.01}),
}
SENSORS = {
    "star_gyro": ("star", "gyro"),
    "gyro": ("gyro",),
    "star": ("star",),
    "star_two_gyros": ("star", "gyro", "second gyro"),
    "two_gyros": ("gyro", "second gyro"),
    "star_gyro_pressure": ("star", "gyro", "pressure"),
    "gyro_pressure": ("gyro", "pressure"),
}
FIGURES = {
    "torque_detected": "torque detected",
    "torque_gyro": "torque against gyro",
    "torque_star": "torque against star",
    "gyro_torque": "gyro against torque",
    "torque_others": "torque against gyro and star together",
}
BARS: Mapping[str, tuple[float | None, ...]] = {
    "star_gyro": (12.5, 12.4, 8.9, 17231.0, 0.0),
    "gyro": (8.9, 0.0, None, 0.0, None),
    "star": (12.4, None, 0.0, None, None),
    "star_two_gyros": (12.7, 12.5, 10.6, 17445.0, 8.9),
    "two_gyros": (10.6, 8.9, None, 9000.0, None),
    "star_gyro_pressure": (732.0, 732.0, 729.0, 17685.0, 720.0),
    "gyro_pressure": (729.0, 720.0, None, 1929.0, None),
}


def cases(count: int) -> list[Case]:
    """Return the sets of sensors, as many as asked for."""
    return [{"sensors": name} for name in list(SENSORS)[:count]]


def analysed(name: str) -> Isolability:
    """Return the isolability of one set of sensors for the faults of its parts."""
    sensors = SENSORS[name]
    return isolability(single_axis(sensors), [f for k, f in FAULTS.items() if k == "torque" or k in sensors], WINDOW)


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the nats of one set of sensors, NaN where it has no such pair."""
    result = analysed(case["sensors"])
    place = {name: k for k, name in enumerate(result.faults)}

    def pair(one: str, other: str) -> float:
        both = one in place and other in place
        return float(result.distinguishability[place[one], place[other]]) if both else float("nan")

    return {
        "sensors": case["sensors"],
        "torque_detected": float(result.detection[0]),
        "torque_gyro": pair("torque", "gyro"),
        "torque_star": pair("torque", "star"),
        "gyro_torque": pair("gyro", "torque"),
        "torque_others": float(result.against_others[0]),
    }


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return each figure that has a bar, the gain of the pressure transducer and the cost of the cheapest sensor."""
    figures = {
        f"{row['sensors']}_{name}": float(row[name])
        for row in rows
        for name, bar in zip(FIGURES, BARS[str(row["sensors"])], strict=True)
        if bar is not None
    }
    if {"star_gyro", "star_gyro_pressure"} <= {row["sensors"] for row in rows}:
        figures["pressure_gain"] = figures["star_gyro_pressure_torque_detected"] / figures["star_gyro_torque_detected"]
    offered = [AXIS_SENSORS[name] for name in ("star", "second gyro", "pressure")]
    added = cheapest_added_sensor(single_axis(("gyro",)), [FAULTS["torque"], FAULTS["gyro"]], WINDOW, offered)
    figures["second_gyro_is_cheapest"] = float(added.sensors == ("second gyro",))
    figures["cheapest_cost"] = added.cost
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bar of every figure: zeros below 1e-6, the others within 5 %."""
    judged = []
    for name, bars in BARS.items():
        for figure, bar in zip(FIGURES, bars, strict=True):
            key = f"{name}_{figure}"
            if bar is None or key not in figures:
                continue
            words = f"{' + '.join(SENSORS[name])}: {FIGURES[figure]} [nats], "
            value = figures[key]
            holds = abs(value) < 1e-6 if bar == 0.0 else abs(value - bar) <= 0.05 * bar
            expected = "zero, below 1e-6" if bar == 0.0 else f"{bar:g} within 5 %"
            judged.append(judge_bar(key.replace("_", "-"), words + expected, measured=value, holds=holds))
    judged.append(
        judge_bar(
            "cheapest-sensor",
            "star tracker out: a second gyro is the cheapest that tells gyro and thruster apart; its cost, a skewed "
            "gyro being 1",
            measured=figures["cheapest_cost"],
            holds=figures["second_gyro_is_cheapest"] == 1.0,
        )
    )
    return judged


def figure(rows: Sequence[Row], path: Path) -> None:
    """Draw the matrix of every set of sensors."""
    from matplotlib.figure import Figure

    names = [str(row["sensors"]) for row in rows]
    canvas = Figure(figsize=(11, 2.3 * -(-len(names) // 2)), layout="constrained")
    for place, name in enumerate(names):
        axes = canvas.add_subplot(-(-len(names) // 2), 2, place + 1)
        draw_matrix(axes, analysed(name))
        axes.set_title(" + ".join(SENSORS[name]), loc="left", fontsize=11)
    canvas.supxlabel("mean log-likelihood ratio over 5 s [nats]; x: cannot be told apart")
    write_svg(canvas, path)


study = Study(
    name="fault-isolability",
    title="Which faults of one axis can be told apart with which sensors, and how well",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=len(SENSORS),
    figure=figure,
)
