"""How an attitude series is said: sentences and rows for people, a document for programs."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optsat.errors import InputError

if TYPE_CHECKING:
    from optsat.estimators.series_report import SeriesReport, TimeSpan

_MOST_SPANS = 4


def require_folders(*files: Path | None) -> None:
    """Refuse a file that could not be written, before the work rather than after.

    Raises
    ------
    InputError : the folder is absent, or the file is a folder.
    """
    for file in files:
        if file is not None and not file.parent.is_dir():
            raise InputError(f"{file} cannot be written: there is no folder {file.parent}.")
        if file is not None and file.is_dir():
            raise InputError(f"{file} cannot be written: it is a folder.")


def report_rows(report: "SeriesReport") -> list[tuple[str, str]]:
    """Return name and figure, for `aligned`."""
    rows = [("epochs", f"{report.epochs}, {report.start_s:g} to {report.stop_s:g} s")]
    rows += [(f"  {name}", str(count)) for name, count in report.counts.items() if count]
    if report.median_bound_rad is not None and report.largest_bound_rad is not None:
        rows.append(
            ("bound [deg]", f"median {degrees(report.median_bound_rad)}, max {degrees(report.largest_bound_rad)}")
        )
    if report.inconsistent:
        rows.append(("no attitude fits", spans_in_words(report.inconsistent)))
    rows += [(f"{name} rejected", spans_in_words(spans)) for name, spans in report.rejected.items()]
    if (accuracy := report.accuracy) is not None:
        figures = {"median": accuracy.median_rad, "RMS": accuracy.rms_rad, "max": accuracy.largest_rad}
        error = ", ".join(f"{name} {degrees(angle)}" for name, angle in figures.items())
        rows.append(("true error [deg]", f"{error}; {accuracy.compared} epochs"))
        share = f"{100 * accuracy.containment:.6g} % of the errors, {accuracy.violations} beyond it"
        rows.append(("within the bound", share))
    return rows


def report_document(report: "SeriesReport") -> dict[str, Any]:
    """Return the report for JSON, angles in degrees."""
    accuracy = report.accuracy
    return {
        "epochs": report.epochs,
        "start_s": report.start_s,
        "stop_s": report.stop_s,
        "counts": report.counts,
        "median_bound_deg": _optional_degrees(report.median_bound_rad),
        "max_bound_deg": _optional_degrees(report.largest_bound_rad),
        "inconsistent": [vars(span) for span in report.inconsistent],
        "rejected": {name: [vars(span) for span in spans] for name, spans in report.rejected.items()},
        "accuracy": None
        if accuracy is None
        else {
            "compared": accuracy.compared,
            "median_deg": math.degrees(accuracy.median_rad),
            "rms_deg": math.degrees(accuracy.rms_rad),
            "max_deg": math.degrees(accuracy.largest_rad),
            "violations": accuracy.violations,
            "containment": accuracy.containment,
        },
    }


def finding(report: "SeriesReport") -> str:
    """Return the outcome of a series as part of a title."""
    says = f"attitude in {report.counts['ok']} of {report.epochs} epochs"
    if report.accuracy is None:
        return says
    count = violations(report)
    return f"{says}, {count or 'no'} error{'s' if count > 1 else ''} beyond the bound"


def violations(report: "SeriesReport") -> int:
    """Return how many errors are beyond their bound, as far as the truth is known."""
    return 0 if report.accuracy is None else report.accuracy.violations


def spans_in_words(spans: "tuple[TimeSpan, ...]") -> str:
    """Return '50 epochs, 300 to 349 s', the first few spans where there are many; empty without any."""
    if not spans:
        return ""
    shown = ", ".join(f"{span.start_s:g} to {span.stop_s:g} s" for span in spans[:_MOST_SPANS])
    more = f", and {len(spans) - _MOST_SPANS} more spans" if len(spans) > _MOST_SPANS else ""
    count = sum(span.epochs for span in spans)
    return f"{count} epoch{'' if count == 1 else 's'}, {shown}{more}"


def degrees(angle_rad: float) -> str:
    """Return an angle in degrees with three figures."""
    return f"{math.degrees(angle_rad):.3g}"


def _optional_degrees(angle_rad: float | None) -> float | None:
    return None if angle_rad is None else math.degrees(angle_rad)
