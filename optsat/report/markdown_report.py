"""Markdown report: a run as text with tables; its figures are files beside it."""

import re
from collections.abc import Sequence

from optsat.campaign.finished_run import FinishedRun
from optsat.report import content
from optsat.report.figures import drawings

_SPECIAL = re.compile(r"([\\`*_\[\]<>|#])")


def markdown_report(run: FinishedRun, stem: str) -> tuple[str, dict[str, bytes]]:
    """Return the text, and by name the files that belong beside it; the names begin with `stem`."""
    identity = run.identity
    files = {f"{stem}-figure-{k + 1}.svg": drawing for k, drawing in enumerate(drawings(run))}
    parts = [
        f"# {_plain(run.title)}",
        f"{_plain(identity.study)}, version {identity.version}, seed {identity.seed}, optsat {identity.optsat}. "
        + content.headline(run.claims, identity.cases, len(run.failures)),
        *([caution] if (caution := content.caution(run)) else []),
    ]
    if run.claims:
        parts += ["## Claims", _table(content.CLAIM_HEADS, [content.claim_row(claim) for claim in run.claims])]
    if files:
        parts += ["## Figures", *(f"![{_plain(drawing.caption)}](<{name}>)" for name, drawing in files.items())]
    if run.metrics:
        parts += ["## Metrics", _table(("Metric", "Figure"), content.metric_rows(run))]
    parts += ["## Cases", "Every case is a line of summary.csv in the run folder."]
    if run.failures:
        parts += ["## Failed cases", _table(content.FAILURE_HEADS, content.failure_rows(run.failures))]
    parts += ["## To repeat it", f"```\n{run.command}\n```"]
    parts += ["## Parameters", _table(("Parameter", "Value"), content.parameter_rows(run))]
    parts += ["## Provenance", _table(("What", "Value"), content.provenance_rows(run))]
    return "\n\n".join(parts) + "\n", {name: drawing.svg for name, drawing in files.items()}


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *([_plain(each) for each in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _plain(text: str) -> str:
    """Return text that means itself in Markdown, on one line."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))
