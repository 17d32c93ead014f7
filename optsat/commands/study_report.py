"""`optsat study report`: a complete run as a page, as Markdown or as a PDF."""

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from optsat.commands.output import AsJson, note, print_json
from optsat.commands.series_output import require_folders


class ReportFormat(Enum):
    """How a report is written."""

    HTML = "html"
    MARKDOWN = "md"
    PDF = "pdf"


def report_command(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a complete run.", show_default=False)],
    report_format: Annotated[
        ReportFormat, typer.Option("--format", help="One page, text with its figures beside it, or paper.")
    ] = ReportFormat.HTML,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where to; DIR/report.FORMAT when absent.", show_default=False)
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write what a run found as a report that needs no network: claims, figures, cases, provenance.

    Reads the run folder only, and refuses a file in it that the run did not write.
    """
    from optsat.campaign.finished_run import read_run
    from optsat.files import write_atomically
    from optsat.report.html_report import html_report
    from optsat.report.markdown_report import markdown_report
    from optsat.report.pdf_report import pdf_report

    target = folder / f"report.{report_format.value}" if out is None else out
    if out is not None:
        require_folders(out)
    run = read_run(folder)
    beside: dict[str, bytes] = {}
    if report_format is ReportFormat.HTML:
        data = html_report(run).encode()
    elif report_format is ReportFormat.PDF:
        data = pdf_report(run)
    else:
        text, beside = markdown_report(run, target.stem)
        data = text.encode()
    files = {**{target.with_name(name): content for name, content in beside.items()}, target: data}
    for path, content in files.items():
        write_atomically(path, content)
    if as_json:
        print_json({"study": run.identity.study, "files": [str(path) for path in files]})
    else:
        note(f"Written to {target}.")
