"""`optsat view`: the attitude of a log as a page to be turned and played."""

from pathlib import Path
from typing import Annotated

import typer

from optsat.commands.log_options import (
    AnyLogFormat,
    LogFormat,
    LogPath,
    Strict,
    Stride,
    WindowLength,
    WindowSpacing,
    read_log,
    window_of,
    window_words,
)
from optsat.commands.output import AsJson, note, print_json, progress_bar
from optsat.commands.series_output import require_folders


def view_command(
    log: LogPath,
    log_format: AnyLogFormat = LogFormat.CSV,
    window: WindowLength = None,
    spacing: WindowSpacing = None,
    strict: Strict = False,
    stride: Stride = 1,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.html", help="Where to; LOG.html when absent.", show_default=False)
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show the attitude of a log with its guaranteed bound, in one page that needs no network.

    Body axes, reference and measured directions with their cones, rejected measurements, a time slider.
    """
    from optsat.estimators.attitude_series import certify_record
    from optsat.files import write_atomically
    from optsat.view.view_page import view_page

    target = log.with_suffix(".html") if out is None else out
    memory = window_of(window, spacing)
    require_folders(target)
    record = read_log(log, log_format, strict)
    with progress_bar(f"attitudes of {log.name}") as progress:
        series = certify_record(record, memory, progress, every=stride)
    write_atomically(target, view_page(record, series, f"{log.name}: {window_words(memory)}", stride).encode())
    if as_json:
        print_json({"log": str(log), "epochs": len(series.t), "file": str(target)})
    else:
        note(f"Written to {target}.")
