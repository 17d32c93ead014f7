"""`optsat study`: list the studies, run one."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optsat.commands.campaign_progress import campaign_progress
from optsat.commands.output import AsJson, aligned, note, print_json

if TYPE_CHECKING:
    from optsat.campaign.result import StudyResult

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Studies: one table, figure or comparison each, with its claims.",
)


@app.command("list", epilog="Example: optsat study list --json")
def list_command(as_json: AsJson = False) -> None:
    """List the studies with one line each."""
    from optsat.campaign.catalogue import list_studies

    studies = list_studies()
    if as_json:
        print_json([{"study": name, "says": says} for name, says in studies.items()])
    else:
        typer.echo(aligned(list(studies.items())))


@app.command("run", epilog="Example: optsat study run NAME --cases 100 --workers 2 --out results")
def run_command(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A name of `optsat study list`.", show_default=False)],
    cases: Annotated[int | None, typer.Option(min=1, help="Number of cases; the study's own when absent.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the campaign.")] = 0,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Worker processes; the result is the same for any number. All cores when absent, one for `-timing`.",
            show_default=False,
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="tcp://HOST:PORT", help="Run on the Dask cluster at this address.", show_default=False),
    ] = None,
    mixed_machines: Annotated[
        bool, typer.Option("--mixed-machines", help="Allow results of machines with other last bits in one run.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder that keeps every finished chunk and the result.", show_default=False),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the unfinished run in --out.")] = False,
    accept_version: Annotated[
        bool, typer.Option("--accept-version", help="Go on with a run that another version of optsat began.")
    ] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="A line every 30 s where standard error is no terminal.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Run a study and judge its claims. Exit code 1 when a case failed or a bar of our own fails."""
    from optsat.campaign.catalogue import load_study
    from optsat.campaign.dask_executor import Dask
    from optsat.campaign.runner import run_study

    study = load_study(name)
    with campaign_progress(study.name, verbose) as progress:
        result = run_study(
            study,
            cases,
            seed,
            _workers(study.name) if workers is None else workers,
            progress.report,
            out,
            resume,
            None if scheduler is None else Dask(scheduler),
            mixed_machines,
            accept_version,
            progress.watch,
        )
    if out is not None:
        note(f"Written to {out}.")
    if as_json:
        print_json(result.summary())
    else:
        typer.echo(f"{study.title}\n{in_words(result)}")
    if not result.passed:
        raise typer.Exit(1)


def _workers(study: str) -> int:
    """Return all cores; one where times are measured, for two measurements at once disturb each other."""
    return 1 if study.endswith("-timing") else os.cpu_count() or 1


def in_words(result: "StudyResult") -> str:
    """Return metrics, judged claims and failures of a result for people."""
    parts = [f"{result.study}, version {result.version}: {result.cases} cases, seed {result.seed}"]
    if result.metrics:
        parts.append(aligned([(f"  {name}", f"{value:.6g}") for name, value in result.metrics.items()]))
    if result.claims:
        parts.append(
            aligned(
                [
                    (
                        f"  {claim.verdict.value}",
                        f"measured {_figure(claim.measured)}",
                        f"paper {_figure(claim.paper)}" if claim.paper is not None else "",
                        f"{claim.id}: {claim.says}",
                    )
                    for claim in result.claims
                ]
            )
        )
    if result.failures:
        first = result.failures[0]
        count = f"{len(result.failures)} of {result.cases} cases failed"
        parts.append(f"{count}; the first is case {first.case}: {first.error}: {first.message}")
    return "\n".join(parts)


def _figure(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"
