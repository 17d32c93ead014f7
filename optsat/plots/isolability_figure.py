"""Isolability figure: the distinguishability matrix in nats on a logarithmic scale, exact zeros crossed out."""

from typing import TYPE_CHECKING

import numpy as np

from optsat.estimators.isolability import Isolability

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_INK, _ZERO_FACE = "#222222", "#F4D9CC"
_LOW, _HIGH = 0.1, 1e4


def isolability_figure(result: Isolability, title: str) -> "Figure":
    """Return the matrix: a row a fault, its detection, then against each other fault, then against all others."""
    from matplotlib.figure import Figure

    count = len(result.faults)
    figure = Figure(figsize=(3.4 + 1.3 * count, 2.2 + 0.7 * count), dpi=160, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    draw_matrix(axes, result)
    axes.set_title(title, fontsize=13, color=_INK, loc="left", fontweight="bold")
    figure.supxlabel("mean log-likelihood ratio [nats]; x: cannot be told apart", fontsize=11, color=_INK)
    return figure


def draw_matrix(axes: "Axes", result: Isolability) -> None:
    """Draw the matrix into axes of the caller, cells labelled."""
    from matplotlib.colors import LogNorm

    count = len(result.faults)
    nats = np.column_stack([result.detection, result.distinguishability, result.against_others])
    zeros = np.column_stack([result.undetectable, result.indistinguishable, result.masked])
    own = np.zeros_like(zeros)
    own[:, 1 : count + 1] = np.eye(count, dtype=bool)
    shown = np.ma.masked_where(zeros | own, np.clip(nats, _LOW, _HIGH))
    axes.imshow(shown, cmap="Blues", norm=LogNorm(_LOW, _HIGH), aspect="auto")
    for i, j in np.ndindex(*nats.shape):
        if zeros[i, j]:
            axes.axvspan(j - 0.5, j + 0.5, 1 - (i + 1) / count, 1 - i / count, color=_ZERO_FACE)
        dark = not zeros[i, j] and nats[i, j] > 100
        label = (
            ""
            if own[i, j]
            else "x"
            if zeros[i, j]
            else f"{nats[i, j]:.3g}"
            if nats[i, j] < 1e3
            else f"{nats[i, j]:.0f}"
        )
        axes.text(j, i, label, ha="center", va="center", color="white" if dark else _INK, fontsize=11)
    axes.set_xticks(range(count + 2), ["detected", *(f"from\n{name}" for name in result.faults), "from all\nothers"])
    axes.set_yticks(range(count), list(result.faults))
    axes.tick_params(length=0, labelsize=11, colors=_INK)
    for side in axes.spines.values():
        side.set_visible(False)
