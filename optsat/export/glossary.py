"""Glossary: what a port means, in words, from its name, shape, unit and checks."""

import re

from optsat.port import Port

FRAMES = {"N": "inertial", "E": "Earth-fixed", "O": "orbital", "B": "body", "R": "reference"}

_FRAME = r"([A-Z][0-9]*)"
_MEANINGS = (
    (rf"q_{_FRAME}{_FRAME}", "quaternion [x, y, z, w], scalar last, from {1} to {0}: {b}_{x} = A({name}) {r}_{y}"),
    (rf"dcm_{_FRAME}{_FRAME}", "direction cosines from {1} to {0}: {b}_{x} = {name} {r}_{y}"),
    (rf"sigma_{_FRAME}{_FRAME}", "modified Rodrigues parameters from {1} to {0}"),
    (rf"omega_{_FRAME}{_FRAME}_[A-Z][0-9]*", "rate of {0} relative to {1}"),
)


def meaning(port: Port) -> str:
    """Return the meaning that the name carries, or ""; the direction of every quaternion is in it."""
    for pattern, words in _MEANINGS:
        if found := re.fullmatch(pattern, port.name):
            x, y = found.groups()
            b, r = ("b", "r") if (x, y) == ("B", "N") else ("v", "v")
            return words.format(_frame(x), _frame(y), name=port.name, x=x, y=y, b=b, r=r)
    return ""


def described(port: Port) -> str:
    """Return shape, unit, frame and meaning in one line."""
    parts = [f"[{port.unit}]"]
    if len(port.shape) == 2:
        parts.append(f"({port.shape[0]}, {port.shape[1]}) by rows: entry (i, j) is [{port.shape[1]} * i + j]")
    if words := meaning(port):
        parts.append(words)
    if frame := port.frame or _frame_of_name(port.name):
        parts.append(f"components in {_frame(frame)}")
    return "; ".join(parts)


def conditions(port: Port) -> str:
    """Return what is checked of the port, beyond finite numbers, or ""."""
    parts = []
    if port.direction is not None:
        parts.append("any length but zero")
    if port.unit_norm is not None:
        rows = "each row of " if len(port.shape) == 2 else ""
        parts.append(f"{rows}length 1 within {port.unit_norm:g}")
    if port.lower is not None and port.upper is not None:
        parts.append(f"in [{port.lower:g}, {port.upper:g}]")
    elif port.lower is not None:
        parts.append(f">= {port.lower:g}")
    elif port.upper is not None:
        parts.append(f"<= {port.upper:g}")
    if port.positive_definite:
        parts.append("symmetric with positive diagonal")
    if port.verdict:
        parts.append("1 where the results can be trusted, else the call is refused")
    if port.counted:
        parts.append("the first `count` rows are read")
    return ", ".join(parts)


def _frame(letter: str) -> str:
    known = FRAMES.get(letter)
    return f"{letter} ({known})" if known else letter


def _frame_of_name(name: str) -> str:
    found = re.search(r"_([A-Z][0-9]*)$", name)
    return found[1] if found and not name.startswith(("P_", "Q_", "R_")) else ""
