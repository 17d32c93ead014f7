"""Reproduction page: per published claim whether it is reproduced, with the figure and the command."""

import itertools
from collections.abc import Sequence
from html import escape

from optsat.campaign.claim import Claim, Verdict
from optsat.campaign.reproduce import Reproduction
from optsat.report import content
from optsat.report.html_report import cell, chip, facts, head
from optsat.report.page import page

_TITLE = "What reproduces, and what does not"
REPORT = "report.html"


def reproduction_page(done: Sequence[Reproduction], command: str) -> str:
    """Return the page; command : what repeats all of it."""
    judged = [(each, claim) for each in done if each.run is not None for claim in each.run.claims]
    published = [(each, claim) for each, claim in judged if claim.paper is not None]
    own = [(each, claim) for each, claim in judged if claim.paper is None]
    lost = [each for each in done if each.run is None or not each.run.claims]
    parts = [
        f'<header><h1>{_TITLE}</h1><p class="lead">{_summary(published, own, lost)}</p></header>',
        _section("Published claims", _claims(published)) if published else "",
        _section("Bars of our own", _claims(own)) if own else "",
        _section("No verdict", _lost(lost)) if lost else "",
        _section("To repeat it", f"<pre><code>{escape(command)}</code></pre>"),
        _section("Studies", _studies(done)),
    ]
    return page(_TITLE, "\n".join(part for part in parts if part))


def _summary(
    published: Sequence[tuple[Reproduction, Claim]],
    own: Sequence[tuple[Reproduction, Claim]],
    lost: Sequence[Reproduction],
) -> str:
    said = []
    for one, many, claims in (
        ("published claim", "published claims", published),
        ("bar of our own", "bars of our own", own),
    ):
        counts = {verdict: sum(claim.verdict is verdict for _, claim in claims) for verdict in Verdict}
        found = ", ".join(f"{count} {content.counted_verdict(v, count)}" for v, count in counts.items() if count)
        if found:
            said.append(f"{len(claims)} {one if len(claims) == 1 else many}: {found}.")
    if lost:
        said.append(f"{len(lost)} {'study' if len(lost) == 1 else 'studies'} without a verdict.")
    return " ".join(said) or "No study was run."


def _section(heading: str, inside: str) -> str:
    return f"<section><h2>{heading}</h2>\n{inside}</section>"


def _claims(judged: Sequence[tuple[Reproduction, Claim]]) -> str:
    """Return claims as a table, under each study's title the command that measures them."""
    heads = [name for name in content.CLAIM_HEADS if name != "Paper" or judged[0][1].paper is not None]
    bodies = []
    for _, pairs in itertools.groupby(judged, key=lambda pair: pair[0].study):
        group = list(pairs)
        each = group[0][0]
        assert each.run is not None
        link = f'<a href="{escape(each.study)}/{REPORT}">{escape(each.title)}</a>'
        rows = "".join(_claim(claim) for _, claim in group)
        bodies.append(
            f'<tbody><tr class="group"><th colspan="{len(heads)}">{link}<br>{_command(each.run.command)}</th></tr>'
            f"{rows}</tbody>"
        )
    return f'<table class="stack">{head(heads)}{"".join(bodies)}</table>'


def _claim(claim: Claim) -> str:
    says, paper, measured, verdict = (escape(word) for word in content.claim_row(claim))
    printed = cell("Paper", paper) if claim.paper is not None else ""
    return (
        f'<tr><td class="says">{says}</td>{printed}{cell("Measured", measured)}'
        f'<td data-label="Verdict">{chip(claim.verdict.value, verdict)}</td></tr>'
    )


def _command(command: str) -> str:
    """Return a command that breaks between its options only, never between the dashes of one."""
    first, *options = command.split(" --")
    kept = "".join(f' <span class="option">--{escape(option)}</span>' for option in options)
    return f"<code>{escape(first)}{kept}</code>"


def _lost(lost: Sequence[Reproduction]) -> str:
    rows = "".join(
        f'<tr><td class="says">{escape(each.title)}</td>'
        f'<td class="wide" data-label="Reason">{escape(each.error or "every case failed")}</td>'
        f'<td data-label="Verdict">{chip("none", "no verdict")}</td></tr>'
        for each in lost
    )
    return f'<table class="stack">{head(("Study", "Reason", "Verdict"))}<tbody>{rows}</tbody></table>'


def _studies(done: Sequence[Reproduction]) -> str:
    rows = []
    for each in done:
        about = f"figures of: {each.paper}" if each.paper else "bars of our own"
        if each.run is None:
            rows.append((each.study, "no result"))
            continue
        failed = f", {len(each.run.failures):,} failed" if each.run.failures else ""
        rows.append((each.study, f"{each.title}; {about}; {each.run.identity.cases:,} cases{failed}"))
    return facts(rows)
