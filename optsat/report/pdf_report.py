"""PDF report: a run as pages of text and figures, for paper."""

import io
import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from optsat.campaign.finished_run import FinishedRun
from optsat.errors import InputError
from optsat.report import content
from optsat.report.figures import drawings
from optsat.report.svg_drawing import figure_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PAPER_IN = (8.27, 11.69)
_LINES, _WIDTH, _LONGEST_COLUMN = 78, 100, 62
_SIZE_PT, _HEADING_PT = 8.0, 12.0


def pdf_report(run: FinishedRun) -> bytes:
    """Return the report of a run as a PDF; the same run gives the same bytes.

    Claims, metrics, failures, parameters and provenance, then a page a figure; the cases are in summary.csv.
    """
    from matplotlib.backends.backend_pdf import PdfPages
    from matplotlib.figure import Figure

    lines = list(_lines(run))
    figures = []
    for drawing in drawings(run):
        try:
            figures.append(figure_of(drawing.svg))
        except InputError as error:
            lines += ["", *textwrap.wrap(f"{drawing.caption}: {error}", _WIDTH)]
    data = io.BytesIO()
    facts = {"Title": run.title, "Creator": None, "Producer": None, "CreationDate": None}
    with PdfPages(data, metadata=facts) as pages:
        for first in range(0, len(lines), _LINES):
            page = Figure(figsize=_PAPER_IN)
            _write(page, lines[first : first + _LINES])
            pages.savefig(page)
        for figure in figures:
            pages.savefig(figure)
    return data.getvalue()


def _write(page: "Figure", lines: Sequence[str]) -> None:
    for place, line in enumerate(lines):
        heading = line.startswith("# ")
        page.text(
            0.08,
            0.95 - 0.9 * place / _LINES,
            line.removeprefix("# "),
            family="monospace",
            size=_HEADING_PT if heading else _SIZE_PT,
            weight="bold" if heading else "normal",
            verticalalignment="top",
            parse_math=False,
        )


def _lines(run: FinishedRun) -> Iterator[str]:
    identity = run.identity
    yield from (f"# {line}" for line in textwrap.wrap(run.title, 60))
    yield f"{identity.study}, version {identity.version}, seed {identity.seed}, optsat {identity.optsat}"
    yield content.headline(run.claims, identity.cases, len(run.failures))
    yield from textwrap.wrap(content.caution(run), _WIDTH)
    tables: list[tuple[str, Sequence[Sequence[str]]]] = [
        ("Claims", [content.CLAIM_HEADS, *(content.claim_row(claim) for claim in run.claims)] if run.claims else []),
        ("Metrics", content.metric_rows(run)),
        ("Failed cases", [content.FAILURE_HEADS, *content.failure_rows(run.failures)] if run.failures else []),
        ("To repeat it", [(run.command,)]),
        ("Parameters", content.parameter_rows(run)),
        ("Provenance", content.provenance_rows(run)),
    ]
    for heading, rows in tables:
        if rows:
            yield from ("", f"# {heading}", *_table(rows))


def _table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table, long cells over several lines."""
    columns = len(rows[0])
    widths = [min(_LONGEST_COLUMN, max(len(row[k]) for row in rows)) for k in range(columns)]
    widths[0] = min(widths[0], max(20, _WIDTH - sum(widths[1:]) - 2 * (columns - 1)))
    widths[-1] = min(widths[-1], max(20, _WIDTH - sum(widths[:-1]) - 2 * (columns - 1)))
    for row in rows:
        cells = [textwrap.wrap(cell, width) or [""] for cell, width in zip(row, widths, strict=True)]
        for k in range(max(len(cell) for cell in cells)):
            parts = [(c[k] if k < len(c) else "").ljust(width) for c, width in zip(cells, widths, strict=True)]
            yield "  ".join(parts).rstrip()
