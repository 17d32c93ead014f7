"""`optsat bench`: the timing studies, each thing against its real peer in one run."""

from typing import Annotated

import typer

from optsat.commands.output import AsJson, aligned, print_json, progress_bar
from optsat.commands.study import in_words
from optsat.errors import InputError, nearest_name

_SUFFIX = "-timing"


def bench_command(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="A group or a study; the list when absent.")
    ] = None,
    cases: Annotated[int | None, typer.Option(min=1, help="Rounds of each study; its own number when absent.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the inputs.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Time optsat against its peers and print ratios. Exit code 1 when a bar of our own fails."""
    from optsat.campaign.catalogue import list_studies, load_study
    from optsat.campaign.runner import run_study

    benchmarks = {study: says for study, says in list_studies().items() if study.endswith(_SUFFIX)}
    if name is None:
        listed = [(_group(study), study, says) for study, says in benchmarks.items()]
        if as_json:
            print_json([dict(zip(("group", "study", "says"), row, strict=True)) for row in listed])
        else:
            typer.echo(aligned(listed))
        return
    chosen = [study for study in benchmarks if name in (study, _group(study))]
    if not chosen:
        known = sorted({*map(_group, benchmarks), *benchmarks})
        raise InputError(f"There is no benchmark `{name}`.{nearest_name(name, known)}")
    results = []
    for study in chosen:
        # one worker: two measurements at once would disturb each other
        with progress_bar(study) as report:
            results.append(run_study(load_study(study), cases, seed, workers=1, progress=report))
        if not as_json:
            typer.echo(f"{benchmarks[study]}\n{in_words(results[-1])}\n")
    if as_json:
        print_json([result.summary() for result in results])
    if not all(result.passed for result in results):
        raise typer.Exit(1)


def _group(study: str) -> str:
    return study.partition("-")[0]
