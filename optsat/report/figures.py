"""Figures of a report: what the study drew, or else what its columns look like."""

from dataclasses import dataclass

from optsat.campaign.finished_run import FinishedRun
from optsat.plots.svg_file import svg_of
from optsat.report.column_figures import column_figures


@dataclass(frozen=True)
class Drawing:
    """A figure as SVG, and what it shows; `titled` where it says so itself."""

    caption: str
    svg: bytes
    titled: bool = False


def drawings(run: FinishedRun) -> list[Drawing]:
    """Return the figures of a run."""
    if run.figure is not None:
        return [Drawing(run.title, run.figure, titled=True)]
    return [Drawing(caption, svg_of(figure)) for caption, figure in column_figures(run.columns).items()]
