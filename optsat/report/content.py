"""Content: what a report says about a run, the same in every format."""

import math
from collections.abc import Sequence
from typing import Any

from optsat.campaign.claim import Claim, Figure, Verdict
from optsat.campaign.finished_run import FinishedRun
from optsat.campaign.result import Failure

Rows = list[tuple[str, str]]

CLAIM_HEADS = ("Claim", "Paper", "Measured", "Verdict")
FAILURE_HEADS = ("Error", "Message", "Cases", "First case")
MOST_FAILURES = 50

_VERDICT_WORDS = {
    Verdict.REPRODUCED: "reproduced",
    Verdict.NOT_REPRODUCED: "not reproduced",
    Verdict.BEATEN: "beaten",
    Verdict.HOLDS: "holds",
    Verdict.FAILS: "fails",
}


def verdict_words(verdict: Verdict) -> str:
    """Return the verdict for people."""
    return _VERDICT_WORDS[verdict]


def figure_words(value: Figure | None) -> str:
    """Return a figure for people: six digits; nothing where the paper prints none."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    return f"{value:.6g}" if math.isfinite(value) else "not finite"


def claim_row(claim: Claim) -> tuple[str, str, str, str]:
    """Return a claim under CLAIM_HEADS."""
    return claim.says, figure_words(claim.paper), measured_words(claim), verdict_words(claim.verdict)


def measured_words(claim: Claim) -> str:
    """Return the measured figure, with its interval where there is one, whose ends are known to few digits."""
    if claim.interval is None:
        return figure_words(claim.measured)
    low, high = (f"{end:.4g}" if math.isfinite(end) else "not finite" for end in claim.interval)
    return f"{figure_words(claim.measured)} ({low} to {high})"


def headline(claims: Sequence[Claim], cases: int, failed: int) -> str:
    """Return the outcome in one sentence."""
    ran = f"{cases:,} case{'' if cases == 1 else 's'}" + (f", {failed:,} of them failed" if failed else "")
    if not claims:
        return f"{ran}; no claim was judged."
    counts = {verdict: sum(claim.verdict is verdict for claim in claims) for verdict in Verdict}
    found = [f"{count} {counted_verdict(verdict, count)}" for verdict, count in counts.items() if count]
    return f"{ran}. Claims: {', '.join(found)}."


def caution(run: FinishedRun) -> str:
    """Return what a reader must know before the figures; empty where there is nothing."""
    if len(run.numerics) > 1:
        return (
            "Machines whose arithmetic differs in the last bits took part: another run of this is not comparable bit "
            "by bit, only within a tolerance."
        )
    return ""


def metric_rows(run: FinishedRun) -> Rows:
    """Return every metric by name."""
    return [(name, figure_words(value)) for name, value in run.metrics.items()]


def parameter_rows(run: FinishedRun) -> Rows:
    """Return what the result depends on."""
    identity = run.identity
    return [
        ("study", f"{identity.study}, version {identity.version}"),
        ("cases", str(identity.cases)),
        ("seed", str(identity.seed)),
        ("optsat", identity.optsat),
        ("SHA-256 of the study's source", identity.source),
        ("run", identity.run),
    ]


def provenance_rows(run: FinishedRun) -> Rows:
    """Return where it was computed, and the digests of its files."""
    said = [(name, _provenance_words(value)) for name, value in run.provenance.items() if value is not None]
    files = [(name, f"{digest['bytes']} bytes, SHA-256 {digest['sha256']}") for name, digest in run.digests.items()]
    return [*said, ("numerics", ", ".join(run.numerics)), *files]


def failure_rows(failures: Sequence[Failure]) -> list[tuple[str, str, str, str]]:
    """Return failures that say the same as one row each under FAILURE_HEADS, the most frequent first."""
    groups: dict[tuple[str, str], list[int]] = {}
    for failure in failures:
        groups.setdefault((failure.error, failure.message), []).append(failure.case)
    ordered = sorted(groups.items(), key=lambda group: (-len(group[1]), group[1][0]))
    rows = [(error, message, str(len(cases)), str(cases[0])) for (error, message), cases in ordered[:MOST_FAILURES]]
    if len(ordered) > MOST_FAILURES:
        rest = sum(len(cases) for _, cases in ordered[MOST_FAILURES:])
        rows.append(("others", f"{len(ordered) - MOST_FAILURES} other messages", str(rest), ""))
    return rows


def counted_verdict(verdict: Verdict, count: int) -> str:
    """Return the verb that follows a number of claims."""
    words = verdict_words(verdict)
    return words.removesuffix("s") if count > 1 else words


def _provenance_words(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name}={'unset' if each is None else each}" for name, each in value.items())
    if isinstance(value, list):
        return " ".join(str(each) for each in value)
    return str(value)
