"""`optsat simulate`: the log that a satellite of a scenario would write."""

from pathlib import Path
from typing import Annotated

import typer

from optsat.commands.output import AsJson, aligned, note, print_json
from optsat.commands.series_output import require_folders, spans_in_words


def _print_example(asked: bool) -> None:
    if asked:
        from optsat.simulation.scenario_file import example_text

        typer.echo(example_text(), nl=False)
        raise typer.Exit


def _print_diagnosis_example(asked: bool) -> None:
    if asked:
        from optsat.simulation.diagnosis_file import diagnosis_example

        typer.echo(diagnosis_example(), nl=False)
        raise typer.Exit


def simulate_command(
    scenario: Annotated[
        Path, typer.Argument(metavar="SCENARIO.toml", help="The scenario; see --example.", show_default=False)
    ],
    out: Annotated[Path, typer.Option(metavar="LOG", help="The CSV log to write.", show_default=False)],
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Where the truth of a diagnosis scenario goes; LOG.truth.csv.", show_default=False
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sensor errors.")] = 0,
    _example: Annotated[
        bool,
        typer.Option(
            "--example", callback=_print_example, is_eager=True, help="Print a complete orbit scenario and stop."
        ),
    ] = False,
    _diagnosis_example: Annotated[
        bool,
        typer.Option(
            "--example-diagnosis",
            callback=_print_diagnosis_example,
            is_eager=True,
            help="Print a complete scenario of failing sensors and thrusters and stop.",
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Simulate a satellite and write its log: direction sensors of bounded error, or sensors and thrusters that fail.

    Example: optsat simulate --example-diagnosis > s1.toml; optsat simulate s1.toml --out s1.csv --seed 1
    """
    from optsat.errors import InputError
    from optsat.simulation.scenario_file import ScenarioKind, kind_of_scenario, parse_scenario, read_text

    text, file = read_text(scenario), str(scenario)
    if kind_of_scenario(text, file) is ScenarioKind.DIAGNOSIS:
        from optsat.commands.simulate_diagnosis import simulate_diagnosis

        beside = out.with_name(f"{out.stem}.truth.csv") if truth is None else truth
        simulate_diagnosis(text, file, out, beside, seed, as_json)
        return
    if truth is not None:
        raise InputError("--truth is for diagnosis scenarios; the log of an orbit scenario holds the true attitude.")
    import numpy as np

    from optsat.estimators.series_report import time_spans
    from optsat.records.csv_log import write_csv_log

    require_folders(out)
    run = parse_scenario(text, file)
    record = run.simulate(np.random.default_rng(seed))
    write_csv_log(out, record)
    dark = time_spans(record.t, run.in_shadow())
    valid = {channel.name: int(channel.valid.sum()) for channel in record.channels}
    if as_json:
        print_json(
            {
                "scenario": str(scenario),
                "log": str(out),
                "seed": seed,
                "epochs": len(record),
                "start_s": float(record.t[0]),
                "stop_s": float(record.t[-1]),
                "measurements": valid,
                "gyro": record.omega_BN_B is not None,
                "shadow": [vars(span) for span in dark],
                "faults": [vars(fault) for fault in run.faults],
            }
        )
        return
    rows = [("epochs", f"{len(record)}, {record.t[0]:g} to {record.t[-1]:g} s")]
    rows += [(name, f"{count} measurements") for name, count in valid.items()]
    rows.append(("gyro", "yes" if record.omega_BN_B is not None else "none"))
    if dark:
        rows.append(("Earth's shadow", spans_in_words(dark)))
    rows += [
        ("fault", f"{fault.channel} {fault.kind}, {fault.start_s:g} to {fault.stop_s:g} s") for fault in run.faults
    ]
    typer.echo(aligned(rows))
    note(f"Written to {out}.")
