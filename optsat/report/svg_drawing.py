"""SVG drawing: the drawings that Matplotlib writes as SVG, drawn again by Matplotlib, so that they can enter a PDF.

Not a reader of SVG in general: paths of absolute lines and curves, `use`, rectangular and path clips, images, and
hatches as hatches. Text must be outlines. Anything else is refused.
"""

import base64
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from optsat.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.path import Path
    from matplotlib.transforms import Affine2D

_SVG, _HREF = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}href"
_NUMBER = re.compile(r"-?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_STEP = re.compile(r"([A-Za-z])([^A-Za-z]*(?:[eE][-+]?\d+[^A-Za-z]*)*)")
_TRANSFORM = re.compile(r"(\w+)\(([^)]*)\)")
_POINTS = {"M": 1, "L": 1, "Q": 2, "C": 3}
_SKIPPED = frozenset(("metadata", "defs", "style", "title"))


@dataclass(frozen=True)
class _Pen:
    """What is inherited on the way down."""

    place: "Affine2D"
    style: Mapping[str, str] = field(default_factory=dict)
    clip: "Path | None" = None


def figure_of(svg: bytes) -> "Figure":
    """Return the drawing as a figure of the same size.

    Raises
    ------
    InputError : not a drawing that Matplotlib wrote with text as outlines.
    """
    from matplotlib.figure import Figure
    from matplotlib.transforms import Affine2D

    try:
        if b"<!ENTITY" in svg:
            raise ValueError("it declares entities")
        root = ElementTree.fromstring(svg)
        width, height = (float(side) for side in root.get("viewBox", "").split()[2:])
        figure = Figure(figsize=(width / 72, height / 72))
        axes = figure.add_axes((0, 0, 1, 1))
        axes.axis("off")
        named = {element.get("id", ""): element for element in root.iter()}
        for child in root:
            _draw(axes, child, _Pen(Affine2D()), named)
        axes.set(xlim=(0, width), ylim=(height, 0), aspect="auto")
    except (ValueError, KeyError, ElementTree.ParseError) as error:
        raise InputError(
            f"The figure is not a drawing that Matplotlib wrote with text as outlines ({error})."
        ) from None
    return figure


def _draw(axes: "Axes", element: ElementTree.Element, pen: _Pen, named: Mapping[str, ElementTree.Element]) -> None:
    kind = element.tag.removeprefix(_SVG)
    if kind in _SKIPPED:
        return
    pen = _inherited(element, pen, named)
    if kind == "g":
        for child in element:
            _draw(axes, child, pen, named)
    elif kind == "path":
        if element.get("d", "").strip():
            _stroke(axes, element, pen, named)
    elif kind == "use":
        target = named[element.get(_HREF, "")[1:]]
        moved = _moved(pen, float(element.get("x", 0)), float(element.get("y", 0)))
        _draw(axes, target, moved, named)
    elif kind == "image":
        _paste(axes, element, pen)
    else:
        raise ValueError(f"it holds <{kind}>")


def _inherited(element: ElementTree.Element, pen: _Pen, named: Mapping[str, ElementTree.Element]) -> _Pen:
    own = dict(_declarations(element.get("style", "")))
    opacity = float(pen.style.get("opacity", "1")) * float(own.get("opacity", "1"))
    place = _then(_transform(element.get("transform", "")), pen.place)
    clip = pen.clip
    if (reference := element.get("clip-path")) is not None:
        clip = _clip(named[reference[5:-1]]).transformed(place)
    return _Pen(place, {**pen.style, **own, "opacity": str(opacity)}, clip)


def _declarations(style: str) -> Iterator[tuple[str, str]]:
    for part in style.split(";"):
        name, colon, value = part.partition(":")
        if colon:
            yield name.strip(), value.strip()


def _moved(pen: _Pen, x: float, y: float) -> _Pen:
    from matplotlib.transforms import Affine2D

    return replace(pen, place=_then(Affine2D().translate(x, y), pen.place))


def _then(first: "Affine2D", second: "Affine2D") -> "Affine2D":
    from matplotlib.transforms import Affine2D

    return Affine2D(second.get_matrix() @ first.get_matrix())


def _transform(text: str) -> "Affine2D":
    from matplotlib.transforms import Affine2D

    place = Affine2D()
    for kind, inside in reversed(_TRANSFORM.findall(text)):
        numbers = [float(each) for each in _NUMBER.findall(inside)]
        if kind == "translate":
            place.translate(numbers[0], numbers[1] if len(numbers) > 1 else 0.0)
        elif kind == "scale":
            place.scale(numbers[0], numbers[-1])
        elif kind == "rotate" and len(numbers) == 1:
            place.rotate_deg(numbers[0])
        elif kind == "matrix":
            place = _then(place, Affine2D.from_values(*numbers))
        else:
            raise ValueError(f"it is transformed by {kind}")
    return place


def _clip(element: ElementTree.Element) -> "Path":
    from matplotlib.path import Path

    (shape,) = element
    if shape.tag == f"{_SVG}rect":
        x, y, width, height = (float(shape.get(name, "0")) for name in ("x", "y", "width", "height"))
        return Path([(x, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y)], closed=True)
    return _path(shape.get("d", ""))


def _path(text: str) -> "Path":
    from matplotlib.path import Path

    codes = {"M": Path.MOVETO, "L": Path.LINETO, "Q": Path.CURVE3, "C": Path.CURVE4}
    vertices: list[tuple[float, float]] = []
    kinds: list[Any] = []
    for step, inside in _STEP.findall(text):
        if step in "zZ":
            vertices.append(vertices[-1])
            kinds.append(Path.CLOSEPOLY)
            continue
        numbers = [float(each) for each in _NUMBER.findall(inside)]
        if step not in codes or len(numbers) != 2 * _POINTS[step]:
            raise ValueError(f"a path goes {step}{inside.strip()}")
        vertices += zip(numbers[::2], numbers[1::2], strict=True)
        kinds += [codes[step]] * _POINTS[step]
    return Path(vertices, kinds)


def _stroke(axes: "Axes", element: ElementTree.Element, pen: _Pen, named: Mapping[str, ElementTree.Element]) -> None:
    from matplotlib.colors import to_rgba
    from matplotlib.patches import PathPatch

    style, opacity = pen.style, float(pen.style["opacity"])
    fill, hatch = style.get("fill", "#000000"), None
    if fill.startswith("url("):
        tile = named[fill[5:-1]].find(f"{_SVG}rect")
        fill, hatch = (tile.get("fill", "none") if tile is not None else "none"), "///"
    stroke = style.get("stroke", "none")
    patch = PathPatch(
        _path(element.get("d", "")).transformed(pen.place),
        facecolor="none" if fill == "none" else to_rgba(fill, float(style.get("fill-opacity", "1")) * opacity),
        edgecolor="none" if stroke == "none" else to_rgba(stroke, float(style.get("stroke-opacity", "1")) * opacity),
        linewidth=0.0 if stroke == "none" else float(style.get("stroke-width", "1")),
        hatch=hatch,
        capstyle={"square": "projecting", "round": "round"}.get(style.get("stroke-linecap", ""), "butt"),
        joinstyle="miter" if style.get("stroke-linejoin") == "miter" else "round",
        clip_on=pen.clip is not None,
    )
    if (dashes := _NUMBER.findall(style.get("stroke-dasharray", ""))) and stroke != "none":
        width = float(style.get("stroke-width", "1"))
        offset = float(style.get("stroke-dashoffset", "0"))
        patch.set_linestyle((offset / width, tuple(float(each) / width for each in dashes)))
    axes.add_patch(patch)
    if pen.clip is not None:
        patch.set_clip_path(pen.clip, axes.transData)


def _paste(axes: "Axes", element: ElementTree.Element, pen: _Pen) -> None:
    from matplotlib.image import imread

    head, _, data = element.get(_HREF, "").partition(",")
    if head != "data:image/png;base64":
        raise ValueError("it holds an image that is not a PNG")
    x, y, width, height = (float(element.get(name, "0")) for name in ("x", "y", "width", "height"))
    (left, top), (right, bottom) = pen.place.transform([(x, y), (x + width, y + height)])
    pixels = imread(BytesIO(base64.b64decode(data)))
    # in the order of the file: images lie below everything else by default
    image = axes.imshow(pixels, extent=(left, right, bottom, top), origin="upper", zorder=1)
    if pen.clip is not None:
        image.set_clip_path(pen.clip, axes.transData)
