"""Checks in C: the statements that count what is wrong with the values of a port."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from optsat.export.c_text import real
from optsat.port import Port

LIMIT = "OS_LARGEST"

_IN_ROW = re.compile(r"(&[\w>-]+\[)(\d+)U\]")


@dataclass(frozen=True)
class Place:
    """A port and where its values stand: an expression of type pointer to os_real_t."""

    port: Port
    pointer: str

    @property
    def end(self) -> str:
        """Where the next port begins, or "" where nobody can tell."""
        found = _IN_ROW.fullmatch(self.pointer)
        return f"{found[1]}{int(found[2]) + self.port.size}U]" if found else ""


def count_not_finite(places: Sequence[Place]) -> list[str]:
    """Return terms that count entries that are NaN or infinite, one for ports that stand one behind another."""
    runs: list[tuple[str, int]] = []
    end = ""
    for place in places:
        if place.pointer == end:
            pointer, size = runs.pop()
            runs.append((pointer, size + place.port.size))
        else:
            runs.append((place.pointer, place.port.size))
        end = place.end
    return [f"os_not_finite({pointer}, {size}U)" for pointer, size in runs]


def count_not_unit(places: Sequence[Place]) -> list[str]:
    """Return terms that count rows whose length is off."""
    return [
        f"os_not_unit({place.pointer}, {port.size // port.row_length}U, {port.row_length}U, "
        f"{real((1.0 - port.unit_norm) ** 2)}, {real((1.0 + port.unit_norm) ** 2)})"
        for place in places
        if (port := place.port).unit_norm is not None
    ]


def count_out_of_range(places: Sequence[Place]) -> list[str]:
    """Return terms that count entries beyond their limits, and of covariances the entries that none can have."""
    terms = []
    for place in places:
        port = place.port
        if port.lower is not None or port.upper is not None:
            lower = f"-{LIMIT}" if port.lower is None else real(port.lower)
            upper = LIMIT if port.upper is None else real(port.upper)
            terms.append(f"os_out_of_range({place.pointer}, {port.size}U, {lower}, {upper})")
        if port.positive_definite:
            terms.append(f"os_not_covariance({place.pointer}, {port.shape[0]}U)")
    return terms


def count_all(places: Sequence[Place]) -> list[str]:
    """Return terms for every check."""
    return [*count_not_finite(places), *count_not_unit(places), *count_out_of_range(places)]


def counter(name: str, terms: Sequence[str]) -> list[str]:
    """Return the definition of a counter as the sum of its terms, or nothing where there are none."""
    if not terms:
        return []
    lines = [f"uint32_t {name} = {terms[0]};"] if len(terms) > 1 else [f"const uint32_t {name} = {terms[0]};"]
    return [*lines, *(f"{name} += {term};" for term in terms[1:])]
