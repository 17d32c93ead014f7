"""What all commands share in talking to people and to programs."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output and nothing else.")]


def print_json(document: object) -> None:
    """Print a document on standard output."""
    typer.echo(json.dumps(document, indent=2, allow_nan=False))


def note(sentence: str) -> None:
    """Say something to people, on standard error."""
    typer.echo(sentence, err=True)


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Yield `report(done, total)`, which draws a bar on standard error where that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def aligned(rows: list[tuple[Any, ...]]) -> str:
    """Return rows as text, every column but the last padded to its longest entry."""
    widths = [max(len(str(row[column])) for row in rows) for column in range(len(rows[0]) - 1)] if rows else []
    lines = [
        "  ".join([*(str(cell).ljust(width) for cell, width in zip(row, widths, strict=False)), str(row[-1])])
        for row in rows
    ]
    return "\n".join(line.rstrip() for line in lines)
