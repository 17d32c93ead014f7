"""SVG file: a figure as vectors, the same bytes whenever and wherever it is drawn."""

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANY_POINTS = 2000
"""A cloud of more points than this is stored as an image inside the drawing."""


def write_svg(figure: "Figure", path: Path) -> None:
    """Write the figure as an SVG file."""
    path.write_bytes(svg_of(figure))


def svg_of(figure: "Figure") -> bytes:
    """Return the figure as the bytes of an SVG file: text as outlines, neither date nor random names in it."""
    import matplotlib as mpl
    from matplotlib.collections import PathCollection
    from matplotlib.lines import Line2D

    for line in figure.findobj(Line2D):
        if isinstance(line, Line2D) and line.get_marker() not in ("None", None, "", " "):
            line.set_rasterized(np.size(line.get_xdata(orig=False)) > MANY_POINTS)
    for cloud in figure.findobj(PathCollection):
        if isinstance(cloud, PathCollection):
            cloud.set_rasterized(np.size(cloud.get_offsets()) > 2 * MANY_POINTS)
    data = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "optsat", "svg.fonttype": "path"}):
        figure.savefig(data, format="svg", dpi=150, metadata={"Date": None, "Creator": None})
    return data.getvalue()
