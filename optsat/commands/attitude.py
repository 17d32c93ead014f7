"""`optsat attitude`: attitudes of a measurement log, each with a guaranteed bound."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
from optsat.commands.output import AsJson, aligned, note, print_json, progress_bar
from optsat.commands.series_output import finding, report_document, report_rows, require_folders
from optsat.errors import InputError

if TYPE_CHECKING:
    from optsat.arrays import Array
    from optsat.estimators.attitude_series import AttitudeSeries
    from optsat.records.record import BadRow, Record

_MOST_BAD_ROWS = 10


def attitude_command(
    log: LogPath,
    log_format: AnyLogFormat = LogFormat.CSV,
    window: WindowLength = None,
    spacing: WindowSpacing = None,
    strict: Strict = False,
    stride: Stride = 1,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Write one row per epoch.", show_default=False)
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE.svg|png", help="Draw bounds and errors.", show_default=False)
    ] = None,
    certificates: Annotated[
        Path | None,
        typer.Option(metavar="FILE.jsonl", help="Write a certificate per epoch, single frames.", show_default=False),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Determine the attitude of every epoch of a log. Exit code 1 for bad rows or measurements that contradict."""
    from optsat.estimators.attitude_series import certify_record
    from optsat.estimators.series_csv import series_csv
    from optsat.estimators.series_report import report_series
    from optsat.files import write_atomically

    memory = window_of(window, spacing)
    if certificates is not None and memory is not None:
        raise InputError("--certificates holds single frames; leave out --window.")
    require_folders(out, plot, certificates)
    figure_kind = _figure_format(plot)
    record = read_log(log, log_format, strict)
    with progress_bar(f"attitudes of {log.name}") as progress:
        series = certify_record(record, memory, progress, every=stride)
    truth = None if record.q_BN_true is None else record.q_BN_true[::stride]
    report = report_series(series, truth)
    if out is not None:
        write_atomically(out, series_csv(series).encode())
    if plot is not None:
        write_atomically(plot, _figure(record, series, truth, finding(report).capitalize(), figure_kind))
    if certificates is not None:
        write_atomically(certificates, _certificates(record, stride).encode())
    if as_json:
        print_json(
            {
                "log": str(log),
                "window_s": None if memory is None else memory.length_s,
                "spacing_s": None if memory is None else memory.spacing_s,
                **report_document(report),
                "bad_rows": [vars(row) for row in record.bad_rows],
            }
        )
    else:
        typer.echo(f"{log}: {window_words(memory)}")
        typer.echo(aligned([*report_rows(report), *_bad_rows_in_words(record.bad_rows)]))
    for file in (out, plot, certificates):
        if file is not None:
            note(f"Written to {file}.")
    if record.bad_rows or report.contradiction:
        raise typer.Exit(1)


def _figure_format(plot: Path | None) -> str:
    if plot is None:
        return ""
    from optsat.plots.bound_figure import figure_format

    return figure_format(str(plot))


def _figure(record: "Record", series: "AttitudeSeries", truth: "Array | None", title: str, kind: str) -> bytes:
    from optsat.plots.bound_figure import bound_figure, rendered, shades_of

    name = "windowed" if series.windowed else "single frame"
    return rendered(bound_figure({name: series}, truth, title, shades_of(record, series)), kind)


def _certificates(record: "Record", stride: int) -> str:
    """Return a certificate a line, the time in front; epochs without measurement have none."""
    import json

    from optsat.determine import certify_attitude

    lines = []
    with progress_bar("certificates") as progress:
        for k in range(0, len(record), stride):
            b_B, r_N, bound, _ = record.pairs(k)
            if len(b_B):
                certificate = certify_attitude(b_B, r_N, bound, norm_policy="silent").certificate
                lines.append(json.dumps({"t": float(record.t[k]), **json.loads(certificate.to_json())}))
            progress(k + 1, len(record))
    return "".join(f"{line}\n" for line in lines)


def _bad_rows_in_words(bad_rows: "tuple[BadRow, ...]") -> list[tuple[str, str]]:
    rows = [(f"{row.file}:{row.line}", f"{row.column}: {row.reason}") for row in bad_rows[:_MOST_BAD_ROWS]]
    if len(bad_rows) > _MOST_BAD_ROWS:
        rows.append(("", f"and {len(bad_rows) - _MOST_BAD_ROWS} more"))
    return [("bad rows", str(len(bad_rows))), *rows] if rows else []
