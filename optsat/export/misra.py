"""MISRA C:2012: what the checker finds in flight code, against the record of deviations and their reasons."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from optsat.export.bundle import Bundle
from optsat.export.tools import find_tool, run_tool

DEVIATIONS: Mapping[str, tuple[str, str]] = {
    "12.1": ("advisory", "Found falsely by cppcheck 2.10 in `c ? (a * b) : d`, whose operands stand in parentheses."),
    "19.2": ("advisory", "The bits of a real number are read through a union, as C99 allows; a copy would be a call."),
    "2.4": ("advisory", "Sizes are constants of an enumeration without a name: C99 has no other for sizes of arrays."),
    "2.5": ("advisory", "The run-time headers serve all kernels; one kernel does not use every macro."),
    "8.9": ("advisory", "The constant tables of a bank stand together at its head, also what one function reads."),
}
"""Category and reason by rule: every deviation that flight code is allowed. No required rule is among them."""

Extent: TypeAlias = Literal["none", "small", "all"]

LARGE = 500
"""Lines of a kernel above which the checker takes minutes."""

_FOUND = re.compile(r"^misra-c2012-(\d+\.\d+)\|([^|]+)\|(\d+)$", re.MULTILINE)


@dataclass(frozen=True, order=True)
class Finding:
    """One place that does not follow a rule."""

    rule: str
    file: str
    line: int


def check(bundle: Bundle, folder: Path, extent: Extent = "small") -> tuple[list[Finding], list[str]]:
    """Return what cppcheck's add-on finds in the kernels in `folder` and their headers, and what was not checked.

    extent : which kernels: none, those of at most LARGE lines, all

    Raises
    ------
    ToolError : cppcheck fails or takes more than ten minutes.
    """
    checker = find_tool("cppcheck")
    if checker is None:
        return [], ["MISRA not checked: cppcheck is not on the path."]
    # the add-on would mix both precisions, had it to guess
    real = "-DOS_REAL_IS_FLOAT" if bundle.precision == "float" else "-UOS_REAL_IS_FLOAT"
    options = ["--addon=misra", "--std=c99", "--quiet", "--enable=style", real, "-U__FAST_MATH__", "-U__cplusplus"]
    found: set[Finding] = set()
    unchecked = []
    for name in bundle.names:
        lines = len((folder / f"{name}.c").read_text(encoding="utf-8").splitlines())
        if extent == "none" or (lines > LARGE and extent == "small"):
            unchecked.append(f"MISRA not checked for {name}, {lines} lines; ask for it with --misra all.")
            continue
        command = [checker, *options, "--template={id}|{file}|{line}", f"{name}.c"]
        said = run_tool(command, folder, time_limit=600.0)
        found |= {Finding(rule, file, int(line)) for rule, file, line in _FOUND.findall(said)}
    if foreign := sorted(finding for finding in found if finding.rule not in DEVIATIONS):
        listed = ", ".join(f"{each.rule} at {each.file}:{each.line}" for each in foreign)
        unchecked.append(f"MISRA rules broken without a recorded reason: {listed}.")
    return sorted(found), unchecked


def print_record(findings: Sequence[Finding], unchecked: Sequence[str]) -> str:
    """Return the text of DEVIATIONS.md: rule, category, reason and places; without reason where none is recorded."""
    known = {finding.rule: ("not recorded", "none: report it") for finding in findings} | dict(DEVIATIONS)
    rows = [
        f"| {rule} | {category} | {reason} | {_places(findings, rule)} |" for rule, (category, reason) in known.items()
    ]
    sentences = "".join(f"\n{sentence}" for sentence in unchecked)
    return "\n".join(
        [
            "# Deviations from MISRA C:2012",
            "",
            "Found by the add-on of cppcheck, which checks a part of the rules only: no finding is no proof.",
            f"The self-test is no flight code and not checked.{sentences}",
            "",
            "| Rule | Category | Reason | Places |",
            "|---|---|---|---|",
            *rows,
            "",
        ]
    )


def _places(findings: Sequence[Finding], rule: str) -> str:
    lines: dict[str, list[str]] = {}
    for finding in findings:
        if finding.rule == rule:
            lines.setdefault(finding.file, []).append(str(finding.line))
    return "; ".join(f"{file}:{','.join(numbers)}" for file, numbers in lines.items()) or "none"
