"""HTML report: a run as one page."""

from collections.abc import Iterable, Sequence
from html import escape

from optsat.campaign.claim import Claim
from optsat.campaign.finished_run import FinishedRun
from optsat.errors import InputError
from optsat.report import content
from optsat.report.case_table import CaseTable, case_table
from optsat.report.figures import Drawing, drawings
from optsat.report.inline_svg import inline_svg
from optsat.report.page import asset, page


def html_report(run: FinishedRun) -> str:
    """Return the report of a run as a page; the same run gives the same page."""
    identity = run.identity
    parts = [
        f'<header><h1>{escape(run.title)}</h1><p class="quiet">{escape(identity.study)}, version {identity.version}, '
        f"seed {identity.seed}, optsat {escape(identity.optsat)}</p>"
        f'<p class="lead">{content.headline(run.claims, identity.cases, len(run.failures))}</p>'
        f"<p>{content.caution(run)}</p></header>",
        _section("Claims", claim_table(run.claims)) if run.claims else "",
        _section("Figures", _figures(drawings(run))),
        _section("Metrics", pairs(content.metric_rows(run))) if run.metrics else "",
    ]
    data, script = {}, ""
    if len(run.columns["case"]):
        table = case_table(run.columns, identity.run)
        parts.append(_section("Cases", _cases(run, table)))
        data, script = {"case-data": table.document}, asset("case_table.js")
    if run.failures:
        parts.append(_section("Failed cases", _failures(run)))
    parts.append(_section("To repeat it", f"<pre><code>{escape(run.command)}</code></pre>"))
    parts.append(_section("Parameters", facts(content.parameter_rows(run))))
    parts.append(_section("Provenance", facts(content.provenance_rows(run))))
    return page(f"{run.title} ({identity.study})", "\n".join(part for part in parts if part), script, data=data)


def claim_table(claims: Sequence[Claim]) -> str:
    """Return claims as a table whose rows stack on a phone."""
    rows = []
    for claim in claims:
        says, paper, measured, verdict = (escape(each) for each in content.claim_row(claim))
        rows.append(
            f'<tr><td class="says">{says}</td>{cell("Paper", paper)}{cell("Measured", measured)}'
            f'<td data-label="Verdict">{chip(claim.verdict.value, verdict)}</td></tr>'
        )
    return f'<table class="stack claims">{head(content.CLAIM_HEADS)}<tbody>{"".join(rows)}</tbody></table>'


def head(names: Iterable[str]) -> str:
    """Return the head of a table; names of figures stand over them, to the right."""
    figures = ("Paper", "Measured", "Cases", "First case")
    cells = "".join(f"<th{' class=number' if name in figures else ''}>{escape(name)}</th>" for name in names)
    return f"<thead><tr>{cells}</tr></thead>"


def cell(label: str, text: str) -> str:
    """Return a cell that holds a figure."""
    return f'<td class="number" data-label="{label}">{text}</td>'


def chip(verdict: str, words: str) -> str:
    """Return a verdict as a word on its colour."""
    return f'<span class="chip {verdict.lower()}">{words}</span>'


def pairs(rows: content.Rows) -> str:
    """Return names and figures in columns."""
    items = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in rows)
    return f'<dl class="pairs">{items}</dl>'


def facts(rows: content.Rows) -> str:
    """Return names and what is said of them, one below the other."""
    items = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in rows)
    return f'<dl class="facts">{items}</dl>'


def _section(heading: str, inside: str) -> str:
    return f"<section><h2>{heading}</h2>\n{inside}</section>" if inside else ""


def _figures(drawn: Sequence[Drawing]) -> str:
    shown = []
    for k, drawing in enumerate(drawn):
        try:
            svg = inline_svg(drawing.svg, f"f{k}-", drawing.caption)
        except InputError as error:
            shown.append(f'<p class="quiet">{escape(drawing.caption)}: {escape(str(error))}</p>')
        else:
            caption = "" if drawing.titled else f"<figcaption>{escape(drawing.caption)}</figcaption>"
            shown.append(f'<figure><div class="figure">{svg}</div>{caption}</figure>')
    return f'<div class="figures">{"".join(shown)}</div>' if shown else ""


def _cases(run: FinishedRun, table: CaseTable) -> str:
    heads = "".join(
        f"<th{' class=word' if column.dtype.kind in 'bU' else ''}><button>{escape(name)}</button></th>"
        for name, column in run.columns.items()
    )
    says = f"<p>{table.says}</p>" if table.says else ""
    return (
        f"{says}<noscript><p>The table needs scripts; the same is in summary.csv of the run folder.</p></noscript>"
        '<div class="pager"><button>Back</button><button>Next</button>'
        '<span id="case-status" class="quiet" role="status"></span></div>'
        f'<div class="scroll"><table class="cases" id="cases"><thead><tr>{heads}</tr></thead>'
        "<tbody></tbody></table></div>"
    )


def _failures(run: FinishedRun) -> str:
    rows = "".join(
        f'<tr><td data-label="Error">{escape(error)}</td><td class="wide" data-label="Message">{escape(message)}</td>'
        f"{cell('Cases', cases)}{cell('First case', first)}</tr>"
        for error, message, cases, first in content.failure_rows(run.failures)
    )
    count = f"<p>{len(run.failures):,} of {run.identity.cases:,} cases failed; the figures above are of the others.</p>"
    return f'{count}<table class="stack">{head(content.FAILURE_HEADS)}<tbody>{rows}</tbody></table>'
