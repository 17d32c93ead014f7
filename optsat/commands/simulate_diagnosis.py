"""`optsat simulate` of a diagnosis scenario: telemetry to one file, the truth to another."""

import math
from pathlib import Path

import typer

from optsat.commands.output import aligned, note, print_json
from optsat.commands.series_output import require_folders
from optsat.errors import InputError


def simulate_diagnosis(text: str, file: str, out: Path, truth: Path, seed: int, as_json: bool) -> None:
    """Simulate the scenario in `text`, write telemetry to `out` and the truth to `truth`, and tell what was written.

    Raises
    ------
    InputError : the scenario is wrong, both files are one, or a folder is missing.
    """
    from optsat.records.telemetry_csv import write_telemetry
    from optsat.simulation.diagnosis_file import parse_diagnosis_scenario
    from optsat.simulation.diagnosis_run import simulate
    from optsat.simulation.truth_file import write_truth

    if out.resolve() == truth.resolve():
        raise InputError(f"--out and --truth are both {out}; the truth goes to a file of its own.")
    require_folders(out, truth)
    scenario = parse_diagnosis_scenario(text, file)
    run = simulate(scenario, seed)
    log = run.telemetry
    write_telemetry(out, log)
    write_truth(truth, run.truth, scenario.name, seed)
    samples = {name: int(log.received(name).sum()) for name in log.sensors}
    if as_json:
        faults = [
            {
                "part": fault.part.value,
                "kind": fault.kind.value,
                "start_s": fault.start_s,
                "stop_s": None if math.isinf(fault.stop_s) else fault.stop_s,
                "value": list(fault.value),
            }
            for fault in scenario.faults
        ]
        print_json(
            {
                "scenario": file,
                "log": str(out),
                "truth": str(truth),
                "seed": seed,
                "rows": len(log),
                "start_s": float(log.t[0]),
                "stop_s": float(log.t[-1]),
                "samples": samples,
                "faults": faults,
            }
        )
        return
    rows = [("rows", f"{len(log)}, {log.t[0]:g} to {log.t[-1]:g} s")]
    rows += [(name, f"{count} samples") for name, count in samples.items()]
    for fault in scenario.faults:
        until = "to the end" if math.isinf(fault.stop_s) else f"to {fault.stop_s:g} s"
        rows.append(("fault", f"{fault.part.value} {fault.kind.value}, {fault.start_s:g} s {until}"))
    typer.echo(aligned(rows))
    note(f"Written to {out}, the truth to {truth}.")
