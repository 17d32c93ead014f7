"""Bound figure: attitude error against its guaranteed bound over time, on a logarithmic scale."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError, nearest_name
from optsat.estimators.attitude_series import AttitudeSeries
from optsat.estimators.series_report import TimeSpan, report_series, time_spans, violations
from optsat.records.record import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("svg", "png")
# after Okabe and Ito: told apart by every kind of colour vision, and by lightness in print
_COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7")
_INK, _GREY = "#222222", "#666666"
_LEAST_RAD = 1e-9  # a logarithm has no place for 0
_MOST_NAMED_SHADES = 6
_MANY_EPOCHS = 300


@dataclass(frozen=True)
class Shade:
    """A time span to be shaded and named above the axes: grey for what is missing, hatched for what is wrong."""

    span: TimeSpan
    says: str
    wrong: bool


def shades_of(record: Record, series: AttitudeSeries) -> list[Shade]:
    """Return when a channel had no measurement, when one was rejected, and when no attitude fitted."""
    report = report_series(series)
    missing = [Shade(span, f"no {c.name}", False) for c in record.channels for span in time_spans(record.t, ~c.valid)]
    rejected = [Shade(span, f"{name} rejected", True) for name, spans in report.rejected.items() for span in spans]
    inconsistent = [Shade(span, "no attitude fits", True) for span in report.inconsistent]
    return [*missing, *rejected, *inconsistent]


def bound_figure(
    series: Mapping[str, AttitudeSeries], q_BN_true: Array | None, title: str, shades: Sequence[Shade] = ()
) -> "Figure":
    """Return a figure of up to four named series: bounds as lines, errors against q_BN_true (T, 4) as points.

    Epochs without attitude leave gaps; an error beyond its bound is crossed.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 5.8), dpi=160, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    _shade(axes, shades)
    crossed = 0
    point, cross = (2.4, 6.0) if max(len(one.t) for one in series.values()) > _MANY_EPOCHS else (4.5, 9.0)
    for (name, one), colour in zip(series.items(), _COLOURS, strict=False):
        bound_deg = np.degrees(np.where(one.ok, one.bound_rad, np.nan))
        axes.plot(one.t, bound_deg, color=colour, linewidth=1.3, label=f"{name}: guaranteed bound", zorder=3)
        if q_BN_true is not None:
            error_deg = np.degrees(np.maximum(one.error_rad(q_BN_true), _LEAST_RAD))
            axes.plot(
                one.t,
                error_deg,
                linestyle="none",
                marker="o",
                markersize=point,
                markeredgewidth=0,
                alpha=0.6,
                color=colour,
                label=f"{name}: true error",
                zorder=2,
            )
            wrong = violations(one, q_BN_true)
            crossed += int(wrong.sum())
            axes.plot(one.t[wrong], error_deg[wrong], "x", color=colour, markersize=cross, markeredgewidth=2, zorder=4)
    if crossed:
        axes.plot([], [], "x", color=_INK, markersize=9, markeredgewidth=2, label=f"error beyond its bound ({crossed})")
    times = np.concatenate([one.t for one in series.values()])
    axes.set_xlim(times.min(), times.max() if len(np.unique(times)) > 1 else times.min() + 1.0)
    _dress(axes, title)
    _explain(figure, axes, rows=1 if q_BN_true is None else 2)
    return figure


def _shade(axes: "Axes", shades: Sequence[Shade]) -> None:
    for shade in shades:
        start, stop = shade.span.start_s, shade.span.stop_s
        if shade.wrong:
            axes.axvspan(start, stop, facecolor="#FBF3D0", edgecolor="#B8860B", hatch="///", linewidth=0, zorder=0)
        else:
            axes.axvspan(start, stop, color="#DDE1E6", linewidth=0, zorder=0)
        if len(shades) <= _MOST_NAMED_SHADES:
            axes.annotate(
                shade.says,
                ((start + stop) / 2, 1.0),
                xycoords=axes.get_xaxis_transform(),
                xytext=(0, 5),
                textcoords="offset points",
                horizontalalignment="center",
                verticalalignment="bottom",
                fontsize=12,
                color=_GREY,
            )


def _dress(axes: "Axes", title: str) -> None:
    from matplotlib.ticker import FuncFormatter

    axes.set_yscale("log")
    axes.set_xlabel("time [s]", fontsize=13, color=_INK)
    axes.set_ylabel("attitude error and bound [deg]", fontsize=13, color=_INK)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _position: f"{value:g}"))
    axes.tick_params(labelsize=12, colors=_INK)
    axes.grid(True, which="major", color="#CCCCCC", linewidth=0.7, zorder=1)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.set_title(title, fontsize=14.5, color=_INK, loc="left", pad=26, fontweight="bold")


def _explain(figure: "Figure", axes: "Axes", rows: int) -> None:
    """Put the legend below the axes, one column a series, the points as large as they can be recognised."""
    handles, labels = axes.get_legend_handles_labels()
    columns = -(-len(labels) // rows)
    legend = figure.legend(
        handles, labels, loc="outside lower center", ncols=columns, fontsize=12, frameon=False, columnspacing=1.6
    )
    for line in legend.get_lines():
        line.set_linewidth(2.5)
        line.set_alpha(1.0)
        if line.get_marker() == "o":
            line.set_markersize(7)


def figure_format(path: str) -> str:
    """Return "svg" or "png" from the name of a file.

    Raises
    ------
    InputError : another ending.
    """
    ending = path.rpartition(".")[2].lower() if "." in path else ""
    if ending not in FORMATS:
        raise InputError(f"{path}: a figure is written as .svg or .png.{nearest_name(ending, list(FORMATS))}")
    return ending


def rendered(figure: "Figure", kind: str) -> bytes:
    """Return the figure as the bytes of an SVG or PNG file."""
    data = io.BytesIO()
    figure.savefig(data, format=kind, metadata={"Date": None} if kind == "svg" else None)
    return data.getvalue()
