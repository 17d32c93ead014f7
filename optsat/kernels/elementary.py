"""Elementary functions: those that have the same bits on every machine, for one sample and for several at once."""

import re
from collections.abc import Mapping
from typing import Literal

from optsat.kernels.codes import LIBM
from optsat.kernels.program import Operation, Program

Math = Literal["own", "libm"]
"""Whose functions a kernel calls: our own where we have them, or those of the machine's library alone."""

OWN: Mapping[str, str] = {
    "SIN": "{pair}.sine",
    "COS": "{pair}.cosine",
    "TAN": "{pair}.sine / {pair}.cosine",
    "EXP": "os_exp({a})",
    "LOG": "os_log({a})",
    "ATAN2": "os_atan2({a}, {b})",
    "ATAN": "os_atan({a})",
    "ASIN": "os_asin({a})",
    "ACOS": "os_acos({a})",
}
"""Expression in C by code: error below one unit in the last place, of the tangent below 2.5."""

_HEADERS = {
    "os_trigonometric.h": re.compile(r"\bos_(?:lanes_)?sine_cosine\("),
    "os_exponential.h": re.compile(r"\bos_(?:lanes_)?(?:exp|log)\("),
    "os_inverse.h": re.compile(r"\bos_(?:lanes_)?(?:atan2|atan|asin|acos)\("),
}


def headers_of(text: str) -> tuple[str, ...]:
    """Return the headers with the elementary functions that a C text calls."""
    return tuple(header for header, calls in _HEADERS.items() if calls.search(text))


def libm_of(program: Program, math: Math) -> tuple[str, ...]:
    """Return the C functions of the machine's library that the program calls; none means the same bits everywhere."""
    codes = {node.code for node in program.nodes if isinstance(node, Operation)} & LIBM.keys()
    return tuple(sorted({LIBM[code] for code in codes if math == "libm" or code not in OWN}))


def lanes_of(header: str) -> str:
    """Return the functions of a header for several samples at once: the same words, of the types in `os_lanes.h`."""
    text = re.sub(r"^#(?:include|define) .*\n|^#ifndef .*\n|\n#endif\n*\Z", "", header, flags=re.MULTILINE)
    text = text.replace("static inline", "OS_LANE")
    # what is cast is a constant, one number for all samples
    text = re.sub(r"(?<!\(\()\bos_(\w+_t)\b", r"os_lanes_\1", text)
    return re.sub(r"\bos_(\w+)\(", r"os_lanes_\1(", re.sub(r"\bbool\b", "os_lanes_bool_t", text))
