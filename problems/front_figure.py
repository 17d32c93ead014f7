"""Front figure: a Pareto front of two or three objectives, its anchors, and the points that were left out."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# after Okabe and Ito
_FRONT, _ANCHOR, _GREY = "#0072B2", "#D55E00", "#8A8A8A"


class Placed(Protocol):
    """A point with its objectives (k,)."""

    @property
    def objectives(self) -> Array:
        """Objectives (k,)."""
        ...


class Front(Protocol):
    """What is drawn."""

    @property
    def points(self) -> Sequence[Placed]:
        """Points of the front."""
        ...

    @property
    def anchors(self) -> Sequence[Placed]:
        """Points where one objective is least."""
        ...

    @property
    def left_out(self) -> Sequence[Placed]:
        """Points that are not on the front."""
        ...


def draw_front(front: Front, axes: "Axes | None", names: Sequence[str]) -> "Axes":
    """Return axes with the front: a line through the points of two objectives, a cloud for three.

    Raises
    ------
    InputError : axes or names that do not fit the number of objectives.
    """
    count = len(front.anchors)
    labels = list(names) or [f"objective {i}" for i in range(count)]
    if len(labels) != count:
        raise InputError(f"`names` must hold {count} names, one per objective, got {len(labels)}.")
    if axes is None:
        axes = _new_axes(count)
    if count == 3 and not hasattr(axes, "set_zlabel"):
        raise InputError('`axes` must be three-dimensional: figure.add_subplot(projection="3d").')
    drawn: Any = axes
    groups = (
        ("left out", front.left_out, {"marker": "x", "color": _GREY, "linestyle": "none", "markersize": 5}),
        ("front", front.points, {"marker": "o", "color": _FRONT, "linestyle": "-" if count == 2 else "none"}),
        ("anchor", front.anchors, {"marker": "D", "color": _ANCHOR, "linestyle": "none", "markersize": 8}),
    )
    for label, points, style in groups:
        if points:
            drawn.plot(*np.array([each.objectives for each in points]).T, label=label, linewidth=1.2, **style)
    for axis, label in zip("xyz", labels, strict=False):
        getattr(drawn, f"set_{axis}label")(label)
    drawn.grid(visible=True, color="#DDDDDD", linewidth=0.7)
    drawn.legend(frameon=False)
    return axes


def _new_axes(count: int) -> "Axes":
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.2), dpi=150, facecolor="white", layout="constrained")
    return figure.add_subplot(projection="3d") if count == 3 else figure.add_subplot()
