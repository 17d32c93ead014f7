"""Figures on a page and on paper: harmless, themselves, and the same as Matplotlib drew them."""

import io
import re
from pathlib import Path

import numpy as np
import pytest
from finished_runs import figure
from numpy.typing import NDArray

from optsat.errors import InputError
from optsat.plots.svg_file import svg_of
from optsat.report.inline_svg import inline_svg
from optsat.report.svg_drawing import figure_of

NAMESPACES = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'


@pytest.fixture(scope="module")
def drawing(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("figure") / "figure.svg"
    figure([], path)
    return path.read_bytes()


def _svg(inside: str) -> bytes:
    return f'<svg {NAMESPACES} viewBox="0 0 10 10">{inside}</svg>'.encode()


def test_a_figure_is_the_same_whenever_it_is_drawn(drawing: bytes, tmp_path: Path) -> None:
    figure([], tmp_path / "again.svg")
    assert (tmp_path / "again.svg").read_bytes() == drawing
    assert b"<dc:date>" not in drawing


def test_a_dense_cloud_becomes_an_image_and_a_small_one_stays_points() -> None:
    from matplotlib.figure import Figure

    for count, image in ((2001, True), (2000, False)):
        canvas = Figure()
        axes = canvas.subplots()
        axes.scatter(np.arange(count), np.arange(count))
        axes.plot(np.arange(count), np.arange(count), "o")
        assert (b"<image" in svg_of(canvas)) is image


def test_greys_follow_the_page_and_colours_stay(drawing: bytes) -> None:
    text = inline_svg(drawing, "f0-", "angles & shares")
    assert "#ffffff" not in text
    assert "#000000" not in text
    assert "fill: var(--grey-15)" in text
    assert "stroke: var(--grey-3)" in text
    assert "#fbf3d0" in text
    assert 'aria-label="angles &amp; shares"' in text
    assert text.count('class="text"') > 10
    assert len(text) < len(drawing)


@pytest.mark.parametrize(
    "spite",
    [
        "<script>alert(1)</script>",
        "<foreignObject><p>x</p></foreignObject>",
        "<style>* { display: none }</style>",
        '<g onload="alert(1)"></g>',
        '<a xlink:href="http://x.org"><path d="M 0 0"/></a>',
        '<image xlink:href="http://x.org/x.png"/>',
        '<use xlink:href="http://x.org/x.svg#y"/>',
        '<path d="M 0 0" style="fill: url(http://x.org/x)"/>',
        "<metadata>x</metadata><!-- x -->",
    ],
)
def test_what_could_act_is_dropped(spite: str) -> None:
    text = inline_svg(_svg(spite), "f0-", "label")
    assert not re.search(r"script|foreignObject|display|onload|x\.org|metadata|<!--", text)


def test_names_are_numbered_under_the_prefix() -> None:
    inside = '<defs><path id="a" d="M 0 0"/><clipPath id="b"><rect/></clipPath></defs><g id="unused"/>'
    inside += '<use xlink:href="#a" clip-path="url(#b)"/>'
    text = inline_svg(_svg(inside), "f7-", "label")
    assert re.findall(r'id="([^"]*)"', text) == ["f7-0", "f7-1"]
    assert 'href="#f7-0"' in text
    assert 'clip-path="url(#f7-1)"' in text


@pytest.mark.parametrize("data", [b"", b"<html/>", b"<svg/>", b'<!DOCTYPE svg [<!ENTITY a "b">]><svg>&a;</svg>'])
def test_what_is_no_figure_is_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="figure"):
        inline_svg(data, "f0-", "label")
    with pytest.raises(InputError, match="figure"):
        figure_of(data)


@pytest.mark.parametrize(
    "inside",
    [
        "<text>x</text>",
        '<path d="M 0 0 A 1 1 0 0 0 2 2"/>',
        '<g transform="skewX(3)"/>',
        '<use xlink:href="#nowhere"/>',
        '<image xlink:href="data:image/jpeg;base64,AA"/>',
    ],
)
def test_paper_refuses_what_it_cannot_draw(inside: str) -> None:
    with pytest.raises(InputError, match="not a drawing that Matplotlib wrote"):
        figure_of(_svg(inside))


def _pixels(drawn: object) -> NDArray[np.float64]:
    from matplotlib.image import imread

    data = io.BytesIO()
    drawn.savefig(data, format="png", dpi=72)  # type: ignore[attr-defined]
    pixels = np.asarray(imread(io.BytesIO(data.getvalue()))[..., :3], dtype=np.float64)
    # squares of nine by nine, as edges are smoothed a little differently
    rows, columns = (side // 9 * 9 for side in pixels.shape[:2])
    return np.asarray(pixels[:rows, :columns].reshape(rows // 9, 9, columns // 9, 9, 3).mean(axis=(1, 3)))


def test_paper_shows_what_the_study_drew(drawing: bytes) -> None:
    """Matplotlib's own picture of the figure and that of its SVG read back agree."""
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(5, 3), layout="constrained")
    axes = canvas.subplots()
    axes.plot([0, 1, 2], [0, 1, 0], "--", lw=2)
    axes.fill_between([0, 1], [0, 0.5], [0.5, 1], alpha=0.4)
    axes.plot(np.linspace(0, 2, 3000), np.linspace(1, 0, 3000), "o", ms=3)
    axes.set(title="title", xlabel="x", ylim=(0.1, 0.9))
    svg = svg_of(canvas)
    ours, theirs = _pixels(figure_of(svg)), _pixels(canvas)
    assert ours.shape == theirs.shape
    assert np.max(np.abs(ours - theirs)) < 0.25
    assert np.mean(np.abs(1 - theirs)) > 0.04, "there is something to be seen"
    assert np.mean(np.abs(1 - _pixels(figure_of(drawing)))) > 0.04
