"""Column figures: what the columns of a study look like, where it draws no figure of its own."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# after Okabe and Ito: told apart by every kind of colour vision, and seen on white and on black
_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")
_OTHERS = "#999999"
_MOST_HISTOGRAMS, _ACROSS = 6, 3
_MOST_BARS = 12
_BINS = 40
_LEAST_VALUES = 3
_WIDE = 1e3


def column_figures(columns: Mapping[str, NDArray[Any]]) -> dict[str, "Figure"]:
    """Return by title a figure with histograms of the first columns of numbers, and one with shares of words.

    columns : (cases,) each, "case" among them
    """
    figures: dict[str, Figure] = {}
    shown = {name: column for name, column in columns.items() if name != "case" and len(column)}
    numbers = {
        name: column[np.isfinite(column)].astype(np.float64)
        for name, column in shown.items()
        if column.dtype.kind in "if" and len(np.unique(column[np.isfinite(column)])) >= _LEAST_VALUES
    }
    words = {
        name: column
        for name, column in shown.items()
        if column.dtype.kind in "bU" and len(np.unique(column)) <= len(_COLOURS)
    }
    if numbers:
        first = list(numbers)[:_MOST_HISTOGRAMS]
        figures[f"Histograms{_of(first, numbers)}"] = _histograms({name: numbers[name] for name in first})
    if words:
        first = list(words)[:_MOST_BARS]
        figures[f"Shares of cases, column by column{_of(first, words)}"] = _shares(
            {name: words[name] for name in first}
        )
    return figures


def _of(shown: Sequence[str], there: Mapping[str, NDArray[Any]]) -> str:
    return f" (the first {len(shown)} of {len(there)})" if len(shown) < len(there) else ""


def _histograms(numbers: Mapping[str, Array]) -> "Figure":
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    across = min(_ACROSS, len(numbers))
    down = -(-len(numbers) // across)
    figure = Figure(figsize=(3.0 * across, 2.1 * down), layout="constrained")
    grid = figure.subplots(down, across, squeeze=False)
    for axes in grid.ravel()[len(numbers) :]:
        axes.set_visible(False)
    for axes, (name, values) in zip(grid.ravel(), numbers.items(), strict=False):
        low, high = float(values.min()), float(values.max())
        logarithmic = low > 0 and high / low > _WIDE
        edges = np.geomspace(low, high, _BINS + 1) if logarithmic else np.linspace(low, high, _BINS + 1)
        edges[0], edges[-1] = low, high
        axes.stairs(np.histogram(values, edges)[0], edges, fill=True, color=_COLOURS[0])
        if logarithmic:
            axes.set_xscale("log")
        else:
            axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
        _dress(axes, name)
        axes.set_ylabel("cases")
    return figure


def _shares(words: Mapping[str, NDArray[Any]]) -> "Figure":
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 1.2 + 0.32 * len(words)), layout="constrained")
    axes = figure.subplots()
    said: dict[str, int] = {}
    counts = {name: dict(zip(*_counted(column), strict=True)) for name, column in words.items()}
    for count in counts.values():
        for word, cases in count.items():
            said[word] = said.get(word, 0) + cases
    order = sorted(said, key=lambda word: (-said[word], word))
    left = np.zeros(len(words))
    for k, word in enumerate(order):
        share = np.array([100 * counts[name].get(word, 0) / len(words[name]) for name in words])
        colour = _COLOURS[k] if k < len(_COLOURS) else _OTHERS
        axes.barh(list(words), share, left=left, color=colour, label=word, height=0.7)
        left += share
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.set_xlabel("cases [%]")
    _dress(axes, "")
    figure.legend(loc="outside lower center", ncols=min(len(order), 4), frameon=False, fontsize=9)
    return figure


def _counted(column: NDArray[Any]) -> tuple[list[str], list[int]]:
    values, counts = np.unique(column, return_counts=True)
    return [("yes" if v else "no") if column.dtype.kind == "b" else str(v) for v in values], counts.tolist()


def _dress(axes: "Axes", title: str) -> None:
    axes.set_title(title, fontsize=10)
    axes.tick_params(labelsize=9)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
