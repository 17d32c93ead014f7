"""Inline SVG: a figure that Matplotlib wrote, made fit to stand inside a page, light or dark.

What could act on the page around it is dropped (styles, scripts, links to elsewhere), names are numbered anew so that
no two figures share one, and greys become variables of the page, so that ink and paper swap in the dark.
"""

import re
from xml.etree import ElementTree

from optsat.errors import InputError

_SVG, _XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
_KEPT = frozenset(
    (
        *("svg", "g", "defs", "use", "path", "rect", "circle", "ellipse", "line", "polyline", "polygon", "image"),
        *("text", "tspan", "clipPath", "mask", "pattern", "marker", "symbol"),
        *("linearGradient", "radialGradient", "stop"),
    )
)
_COLOUR = re.compile(r"#([0-9a-fA-F]{6})\b")
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_GREY_SPREAD = 24
_POINTS_TO_PIXELS = 4 / 3


def inline_svg(data: bytes, prefix: str, label: str) -> str:
    """Return the figure as an element of HTML.

    prefix : of every name in it, its own on the page; label : what it shows, for those who do not see it

    Raises
    ------
    InputError : not an SVG figure with a viewBox.
    """
    if b"<!ENTITY" in data:
        raise InputError("The figure declares entities, which no figure of Matplotlib does.")
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise InputError(f"The figure is not an SVG file ({error}).") from None
    box = root.get("viewBox", "").split()
    if root.tag != f"{_SVG}svg" or len(box) != 4:
        raise InputError("The figure is not an SVG file with a viewBox.")
    _mark_text(root)
    _prune(root)
    _rename(root, prefix)
    for element in root.iter():
        _recolour(element)
        _shorten(element)
        element.tag = element.tag.removeprefix(_SVG)
    width = float(box[2]) * _POINTS_TO_PIXELS
    root.attrib.clear()
    root.attrib.update(
        {"viewBox": " ".join(box), "role": "img", "aria-label": label, "style": f"--natural-width: {width:.0f}px"}
    )
    return ElementTree.tostring(root, encoding="unicode", short_empty_elements=False)


def _mark_text(root: ElementTree.Element) -> None:
    """Mark text by a class before its name is lost: it carries no colour of its own where it is black."""
    for element in root.iter(f"{_SVG}g"):
        if element.get("id", "").startswith("text"):
            element.set("class", "text")


def _prune(parent: ElementTree.Element) -> None:
    for child in list(parent):
        if child.tag not in {_SVG + name for name in _KEPT}:
            parent.remove(child)
        else:
            _prune(child)
    for name in list(parent.attrib):
        value = parent.attrib[name]
        if name == f"{_XLINK}href":
            del parent.attrib[name]
            parent.set("href", value)
            name = "href"
        if (
            name.startswith(("{", "on"))
            or (name == "href" and not value.startswith(("#", "data:image/png")))
            or re.search(r"url\((?!#)|@import", value)
        ):
            del parent.attrib[name]
    parent.text = parent.text if parent.text and parent.text.strip() else None
    parent.tail = parent.tail if parent.tail and parent.tail.strip() else None


def _rename(root: ElementTree.Element, prefix: str) -> None:
    used = {element.get("href", "")[1:] for element in root.iter()}
    for element in root.iter():
        for value in element.attrib.values():
            used.update(_REFERENCE.findall(value))
    names: dict[str, str] = {}
    for element in root.iter():
        name = element.attrib.pop("id", None)
        if name in used and name is not None:
            names[name] = f"{prefix}{len(names)}"
            element.set("id", names[name])
    for element in root.iter():
        for attribute, value in element.attrib.items():
            if attribute == "href" and value.startswith("#"):
                element.set("href", f"#{names.get(value[1:], '')}")
            elif "url(#" in value:
                element.set(attribute, _REFERENCE.sub(lambda found: f"url(#{names.get(found[1], '')})", value))


def _recolour(element: ElementTree.Element) -> None:
    """Turn attributes of colour into style, as variables are known there only, and greys into variables."""
    style = element.get("style", "")
    for name in ("fill", "stroke"):
        if (value := element.attrib.pop(name, None)) is not None:
            style = f"{name}: {value}; {style}" if style else f"{name}: {value}"
    if style:
        element.set("style", _COLOUR.sub(_variable, style))


def _shorten(element: ElementTree.Element) -> None:
    """Round places on the sheet to a hundredth of a point."""
    for name in ("d", "x", "y"):
        if (value := element.get(name)) is not None:
            element.set(name, " ".join(_LONG_NUMBER.sub(lambda found: f"{float(found[0]):.2f}", value).split()))


def _variable(found: re.Match[str]) -> str:
    parts = [int(found[1][k : k + 2], 16) for k in (0, 2, 4)]
    if max(parts) - min(parts) > _GREY_SPREAD:
        return found[0].lower()
    return f"var(--grey-{round(sum(parts) / 3 / 17)})"
