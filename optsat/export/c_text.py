"""C text: numbers, comments and blocks as the flight form spells them."""

import math
import textwrap
from collections.abc import Iterable, Sequence


def real(value: float) -> str:
    """Return a constant of the type os_real_t, the same bits with every compiler."""
    if not math.isfinite(value):
        raise ValueError(f"{value} is no constant of flight code")
    if value == int(value) and abs(value) < 1e6:
        return f"(os_real_t){value:.1f}"
    mantissa, exponent = value.hex().split("p")
    digits = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"(os_real_t){digits}p{exponent}"


def comment(lines: Iterable[str]) -> str:
    """Return a block comment; what would end it early, or open another, is broken up."""
    safe = [line.replace("*/", "* /").replace("/*", "/ *").rstrip() for line in lines]
    wrapped: list[str] = []
    for line in safe:
        indent = " " * (len(line) - len(line.lstrip()) + 4)
        wrapped += textwrap.wrap(line, 116, subsequent_indent=indent, break_long_words=False) or [""]
    return "/* " + "\n".join([wrapped[0], *(f" * {line}".rstrip() for line in wrapped[1:])]) + " */"


def call(function: str, *arguments: str) -> str:
    """Return a call or the head of a declaration, on several lines where it is long."""
    line = f"{function}({', '.join(arguments)})"
    return line if len(line) <= 100 else f"{function}(\n" + ",\n".join(f"    {each}" for each in arguments) + ")"


def indented(lines: Iterable[str], levels: int = 1) -> list[str]:
    """Return the lines, deeper by some levels of four columns."""
    return [f"{'    ' * levels}{line}" if line else "" for line in lines]


def loop(count: int, body: str) -> list[str]:
    """Return `body` for k from 0 to count - 1, as a loop, or as one line where count is 1."""
    if count == 1:
        return [body.replace("[k]", "[0U]").replace("U + k]", "U]")]
    return [f"for (uint32_t k = 0U; k < {count}U; k++) {{", f"    {body}", "}"]


def copied(target: str, source: str, count: int) -> list[str]:
    """Return the statements that copy `count` numbers; {target} and {source} hold `[k]`."""
    return loop(count, f"{target} = {source};")


def chained(cases: Sequence[tuple[str, str]], last: str) -> list[str]:
    """Return `if (condition) { statement } else if ... else { last }`."""
    lines = []
    for k, (condition, statement) in enumerate(cases):
        lines += [f"{'if' if k == 0 else '} else if'} ({condition}) {{", f"    {statement}"]
    return [*lines, "} else {", f"    {last}", "}"] if cases else [last]
