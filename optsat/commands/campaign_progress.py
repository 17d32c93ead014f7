"""Campaign progress: how far a campaign is, how fast, and what its figures look like so far, on standard error."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from optsat.commands.output import note

if TYPE_CHECKING:
    from optsat.campaign.table import Table

_LINE_S = 30.0
_MOST_FIGURES = 3
_RATE_S = 1.0


@dataclass
class CampaignProgress:
    """What a campaign reports to: `report(done, total)` and `watch(table)`, once a chunk each.

    show : (cases done, cases in all, words on rate and running figures) -> None
    """

    show: Callable[[int, int, str], None]
    _start: float = field(default_factory=time.monotonic)
    _before: int | None = None
    _failed: int = 0
    _sums: dict[str, list[float]] = field(default_factory=dict)

    def watch(self, table: "Table") -> None:
        """Add the cases of a chunk to the running figures, which are approximate and never stored."""
        import numpy as np

        self._failed += len(table.failures)
        for name, column in table.columns.items():
            if name != "case" and column.dtype.kind in "bif" and column.ndim == 1:
                finite = column[np.isfinite(column)]
                total = self._sums.setdefault(name, [0.0, 0.0])
                total[0] += float(np.sum(finite))
                total[1] += len(finite)

    def report(self, done: int, total: int) -> None:
        """Show how far it is; cases that an earlier run had finished count for no rate."""
        if self._before is None:
            self._before, self._start = done, time.monotonic()
        self.show(done, total, self._words(done - self._before))

    def _words(self, done: int) -> str:
        taken = time.monotonic() - self._start
        words = [f"{done / taken:.3g} cases/s"] if taken > _RATE_S else []
        words += [f"{self._failed} failed"] if self._failed else []
        means = [f"{name} {total / count:.3g}" for name, (total, count) in self._sums.items() if count]
        return ", ".join(words) + (f"; means so far: {', '.join(means[:_MOST_FIGURES])}" if means else "")


@contextmanager
def campaign_progress(what: str, verbose: bool = False) -> Iterator[CampaignProgress]:
    """Yield what a campaign reports to: a bar where standard error is a terminal, else nothing.

    verbose : where it is none, a line every 30 s
    """
    if sys.stderr.isatty():
        with _bar(what) as progress:
            yield progress
    elif verbose:
        yield CampaignProgress(_Lines(what))
    else:
        yield CampaignProgress(lambda _done, _total, _words: None)


@dataclass
class _Lines:
    what: str
    _next: float = field(default_factory=lambda: time.monotonic() + _LINE_S)

    def __call__(self, done: int, total: int, words: str) -> None:
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + _LINE_S
            note(f"{self.what}: {done} of {total} cases, {words}")


@contextmanager
def _bar(what: str) -> Iterator[CampaignProgress]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns: tuple[Any, ...] = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[words]}", markup=False),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True, refresh_per_second=4) as bar:
        task = bar.add_task(what, total=None, words="")
        yield CampaignProgress(lambda done, total, words: bar.update(task, completed=done, total=total, words=words))
