"""`optsat demo`: simulate an orbit, determine the attitude from the log, check what was promised."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optsat.commands.output import AsJson, aligned, print_json, progress_bar
from optsat.commands.series_output import degrees, finding, report_document, spans_in_words, violations
from optsat.errors import InputError

if TYPE_CHECKING:
    from optsat.certificates.attitude_certificate import AttitudeCertificate
    from optsat.estimators.attitude_series import AttitudeSeries
    from optsat.estimators.series_report import SeriesReport
    from optsat.records.record import Record

WINDOW_S, SPACING_S = 60.0, 4.0
_WHY_SINGLE_FRAMES_FAIL = (
    "A bound holds while every sensor keeps its own. The failing magnetometer did not, and where it turned about the\n"
    "line to the Sun no single frame can notice; the window does, as long as it remembers the time before."
)
SINGLE, WINDOWED = "single frame", f"{WINDOW_S:g} s window"


def demo_command(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for all files.")] = Path("optsat-demo"),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sensor errors.")] = 0,
    scenario: Annotated[
        Path | None,
        typer.Option(metavar="FILE.toml", help="Your own scenario, with a gyro.", show_default=False),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show the library at work: twenty minutes in orbit with a failing magnetometer and an eclipse, in half a minute.

    Exit code 1 when an error of the windowed attitude exceeds its bound, or the certificate is rejected.
    """
    import numpy as np

    from optsat.estimators.attitude_series import Window, certify_record
    from optsat.estimators.series_csv import series_csv
    from optsat.estimators.series_report import report_series
    from optsat.files import write_atomically
    from optsat.records.csv_log import read_csv_log, write_csv_log
    from optsat.simulation.scenario_file import example_text, parse_scenario, read_text

    text = example_text() if scenario is None else read_text(scenario)
    run = parse_scenario(text, "the example" if scenario is None else str(scenario))
    if run.gyro_bound_rad_s is None:
        raise InputError(f"{scenario}: the demo carries the past by a gyro; add the table [gyro] with `bound_deg_s`.")
    out.mkdir(parents=True, exist_ok=True)
    write_atomically(out / "scenario.toml", text.encode())
    write_csv_log(out / "log.csv", run.simulate(np.random.default_rng(seed)))
    # from here on only what the log says is known
    record = read_csv_log(out / "log.csv")
    series = {}
    for name, window in ((SINGLE, None), (WINDOWED, Window(WINDOW_S, SPACING_S))):
        with progress_bar(name) as progress:
            series[name] = certify_record(record, window, progress)
        write_atomically(out / f"attitude-{name.replace(' ', '-')}.csv", series_csv(series[name]).encode())
    certificate = _middle_certificate(record, series[SINGLE])
    write_atomically(out / "certificate.json", f"{certificate.to_json()}\n".encode())
    reports = {name: report_series(one, record.q_BN_true) for name, one in series.items()}
    _draw(record, series, reports, out)
    common = _common(record, series)
    verdict = certificate.verify()
    if as_json:
        print_json(
            {
                "folder": str(out),
                "seed": seed,
                "series": {
                    name: {**report_document(report), "where_both_are_determined": common[name]}
                    for name, report in reports.items()
                },
                "certificate": {"claim": certificate.claim, "accepted": verdict.accepted, "reason": verdict.reason},
                "files": sorted(file.name for file in out.iterdir()),
            }
        )
    else:
        typer.echo(_table(reports, common))
        if violations(reports[SINGLE]):
            typer.echo(f"\n{_WHY_SINGLE_FRAMES_FAIL}")
        typer.echo(f"\nCertificate {'accepted' if verdict else 'REJECTED'}: {certificate.claim}\n")
        typer.echo(
            aligned(
                [
                    (f"open {out}/figure.svg", "the same as a picture"),
                    (f"optsat verify {out}/certificate.json", "check a proof without any solver"),
                    (f"optsat attitude {out}/log.csv --window 60", "the same for a log of your own"),
                ]
            )
        )
    if violations(reports[WINDOWED]) or not verdict:
        raise typer.Exit(1)


def _middle_certificate(record: "Record", series: "AttitudeSeries") -> "AttitudeCertificate":
    """Return the certificate of the determined single frame in the middle."""
    import numpy as np

    from optsat.determine import certify_attitude

    determined = np.flatnonzero(series.ok)
    if len(determined) == 0:
        raise InputError("No single frame of this scenario determines the attitude; let the satellite see the Sun.")
    b_B, r_N, bound, _ = record.pairs(int(determined[len(determined) // 2]))
    return certify_attitude(b_B, r_N, bound, norm_policy="silent").certificate


def _common(record: "Record", series: "dict[str, AttitudeSeries]") -> dict[str, dict[str, Any]]:
    """Return epochs, RMS error and median bound where both series are determined: the fair comparison."""
    import numpy as np

    both = series[SINGLE].ok & series[WINDOWED].ok & record.has_truth
    result: dict[str, dict[str, Any]] = {}
    for name, one in series.items():
        error, bound = one.error_rad(np.asarray(record.q_BN_true))[both], one.bound_rad[both]
        result[name] = {
            "epochs": int(both.sum()),
            "rms_deg": float(np.degrees(np.sqrt(np.mean(error**2)))) if both.any() else None,
            "median_bound_deg": float(np.degrees(np.median(bound))) if both.any() else None,
        }
    return result


def _table(reports: "dict[str, SeriesReport]", common: dict[str, dict[str, Any]]) -> str:
    def rejected(report: "SeriesReport") -> str:
        return "; ".join(f"{name} {spans_in_words(spans)}" for name, spans in report.rejected.items()) or "none"

    each = list(reports.values())
    both = list(common.values())
    return aligned(
        [
            ("", *reports),
            ("attitude determined", *(f"{report.counts['ok']} of {report.epochs}" for report in each)),
            (f"where both are determined, {both[0]['epochs']} epochs:", "", ""),
            ("  RMS of the true error [deg]", *(_figure(one["rms_deg"]) for one in both)),
            ("  median guaranteed bound [deg]", *(_figure(one["median_bound_deg"]) for one in both)),
            ("largest guaranteed bound [deg]", *(degrees(report.largest_bound_rad or 0.0) for report in each)),
            ("errors beyond their bound", *(violations(report) for report in each)),
            ("measurements rejected", *(rejected(report) for report in each)),
            ("no attitude fits", *(spans_in_words(report.inconsistent) or "never" for report in each)),
        ]
    )


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _draw(record: "Record", series: "dict[str, AttitudeSeries]", reports: "dict[str, SeriesReport]", out: Path) -> None:
    from optsat.files import write_atomically
    from optsat.plots.bound_figure import FORMATS, bound_figure, rendered, shades_of

    title = "\n".join(f"{name.capitalize()}: {finding(report)}" for name, report in reports.items())
    figure = bound_figure(series, record.q_BN_true, title, shades_of(record, series[WINDOWED]))
    for kind in FORMATS:
        write_atomically(out / f"figure.{kind}", rendered(figure, kind))
