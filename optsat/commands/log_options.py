"""What commands that read a measurement log share: its format, and the window of past measurements."""

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optsat.errors import InputError

if TYPE_CHECKING:
    from optsat.estimators.attitude_series import Window
    from optsat.records.record import Record

_SPACINGS_IN_A_WINDOW = 15


class LogFormat(Enum):
    """What a log may be."""

    CSV = "csv"
    BROAD = "broad"


LogPath = Annotated[Path, typer.Argument(metavar="LOG", help="The measurement log.", show_default=False)]
AnyLogFormat = Annotated[LogFormat, typer.Option("--format", help="Format of the log.")]
WindowLength = Annotated[
    float | None,
    typer.Option(
        "--window", metavar="SECONDS", help="Use the past this long, carried by the gyro.", show_default=False
    ),
]
WindowSpacing = Annotated[
    float | None,
    typer.Option(
        "--spacing", metavar="SECONDS", help="One past epoch every so often; window / 15.", show_default=False
    ),
]
Strict = Annotated[bool, typer.Option("--strict", help="Stop at the first bad row of the log.")]
Stride = Annotated[
    int, typer.Option("--stride", min=1, help="Determine every N-th epoch only; the gyro is used throughout.")
]


def window_of(length_s: float | None, spacing_s: float | None) -> "Window | None":
    """Return the window that was asked for, if any.

    Raises
    ------
    InputError : a spacing without a window.
    """
    from optsat.estimators.attitude_series import Window

    if length_s is None:
        if spacing_s is not None:
            raise InputError("--spacing needs --window: it is the step in which the past is used.")
        return None
    return Window(length_s, length_s / _SPACINGS_IN_A_WINDOW if spacing_s is None else spacing_s)


def window_words(window: "Window | None") -> str:
    """Return how the past is used, for people."""
    if window is None:
        return "single frames"
    return f"window of {window.length_s:g} s, one epoch every {window.spacing_s:g} s"


def read_log(log: Path, log_format: LogFormat, strict: bool) -> "Record":
    """Return the record in a log."""
    if log_format is LogFormat.BROAD:
        from optsat.records.broad import load_broad

        return load_broad(log)
    from optsat.records.csv_log import read_csv_log

    return read_csv_log(log, strict)
