"""Isolability table: the matrix in nats as aligned text and as Markdown, exact zeros marked."""

from optsat.estimators.isolability import Isolability

_ZERO = "0 (!)"


def text_table(result: Isolability) -> str:
    """Return the table in columns, then a line for each thing that cannot be told."""
    rows = _rows(result)
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))]).rstrip()
        for row in rows
    ]
    lines.insert(1, "-" * (sum(widths) + 2 * (len(widths) - 1)))
    return "\n".join([*lines, *result.says]) + "\n"


def markdown_table(result: Isolability) -> str:
    """Return the same as a Markdown table with a list below it."""
    head, *body = (f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in _rows(result))
    rule = "|---|" + "---:|" * (len(result.faults) + 2)
    says = ["", *(f"- {line}" for line in result.says)] if result.says else []
    return "\n".join([head, rule, *body, *says]) + "\n"


def _rows(result: Isolability) -> list[list[str]]:
    rows = [["fault [nats]", "detected", *(f"from {name}" for name in result.faults), "from all others"]]
    for i, name in enumerate(result.faults):
        cells = [
            "-" if i == j else _cell(result.distinguishability[i, j], bool(result.indistinguishable[i, j]))
            for j in range(len(result.faults))
        ]
        detected = _cell(result.detection[i], bool(result.undetectable[i]))
        rows.append([name, detected, *cells, _cell(result.against_others[i], bool(result.masked[i]))])
    return rows


def _cell(nats: float, zero: bool) -> str:
    return _ZERO if zero else f"{nats:.3g}" if nats < 100 else f"{nats:.0f}"
