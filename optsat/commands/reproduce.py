"""`optsat reproduce`: every study of the papers, and one page that says what reproduces."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optsat.commands.output import AsJson, aligned, note, print_json, progress_bar

if TYPE_CHECKING:
    from optsat.campaign.reproduce import Reproduction

_PAGE = "index.html"


def reproduce_command(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for all runs and the page.")] = Path("reproduction"),
    cases: Annotated[
        int | None, typer.Option(min=1, help="At most so many cases a study; its own number when absent.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = os.cpu_count() or 1,
    everything: Annotated[
        bool, typer.Option("--all", help="Also the studies of our own bars and of times, which take long.")
    ] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with unfinished runs in --out.")] = False,
    as_json: AsJson = False,
) -> None:
    """Run the studies of the papers and say per published claim: reproduced, not reproduced, or beaten.

    A study that fails is a row of the page. Exit code 1 when a claim has no verdict or a bar of our own fails.
    """
    from optsat.campaign.catalogue import list_studies
    from optsat.campaign.reproduce import reproduce
    from optsat.files import write_atomically
    from optsat.report.html_report import html_report
    from optsat.report.reproduction_page import REPORT, reproduction_page

    out.mkdir(parents=True, exist_ok=True)
    done = []
    for each in reproduce(list(list_studies()), everything, out, cases, workers, resume, progress_bar):
        done.append(each)
        if each.run is not None:
            write_atomically(out / each.study / REPORT, html_report(each.run).encode())
        note(f"{each.study}: {_outcome(each)}")
    limit = "" if cases is None else f" --cases {cases}"
    command = f"optsat reproduce{limit}{' --all' if everything else ''}"
    write_atomically(out / _PAGE, reproduction_page(done, command).encode())
    if as_json:
        print_json({"page": str(out / _PAGE), "studies": [_document(each) for each in done]})
    else:
        typer.echo(_table(done))
        note(f"Written to {out / _PAGE}.")
    if not all(each.passed for each in done):
        raise typer.Exit(1)


def _outcome(each: "Reproduction") -> str:
    from optsat.report.content import headline

    if each.run is None:
        return each.error
    return headline(each.run.claims, each.run.identity.cases, len(each.run.failures))


def _table(done: "list[Reproduction]") -> str:
    from optsat.report.content import claim_row

    rows = []
    for each in done:
        if each.run is None or not each.run.claims:
            rows.append(("no verdict", "", "", f"{each.study}: {_outcome(each)}"))
            continue
        for claim in each.run.claims:
            says, paper, measured, verdict = claim_row(claim)
            rows.append((verdict, f"measured {measured}", f"paper {paper}" if paper else "", f"{each.study}: {says}"))
    return aligned(rows)


def _document(each: "Reproduction") -> dict[str, Any]:
    claims = [] if each.run is None else each.run.claims
    return {
        "study": each.study,
        "paper": each.paper,
        "error": each.error,
        "command": None if each.run is None else each.run.command,
        "claims": [
            {
                "id": claim.id,
                "says": claim.says,
                "paper": _json_figure(claim.paper),
                "measured": _json_figure(claim.measured),
                "verdict": claim.verdict.value,
                "interval": None if claim.interval is None else [_json_figure(end) for end in claim.interval],
            }
            for claim in claims
        ],
    }


def _json_figure(value: float | str | None) -> float | str | None:
    return None if isinstance(value, float) and value - value != 0 else value
