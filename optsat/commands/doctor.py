"""`optsat doctor`: what is installed, what is missing and how to get it."""

from dataclasses import asdict

import typer

from optsat.commands.output import AsJson, aligned, print_json


def doctor_command(as_json: AsJson = False) -> None:
    """Examine the installation and run a short self-check. Exit code 1 when a needed part is missing."""
    from optsat.doctor import Health, examine

    findings = examine()
    if as_json:
        print_json([{**asdict(finding), "health": finding.health.value} for finding in findings])
    else:
        typer.echo(aligned([(finding.subject, finding.health.value, finding.says) for finding in findings]))
    if any(finding.health is Health.BROKEN for finding in findings):
        raise typer.Exit(1)
