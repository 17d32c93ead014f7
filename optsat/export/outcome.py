"""Outcome: what the flight form must answer, computed in Python from the ports and the reference."""

import math
from dataclasses import dataclass, replace

import numpy as np

from optsat.arrays import Array
from optsat.export.definition import Definition
from optsat.export.interface import Interface
from optsat.port import Port
from optsat.port_checks import is_accepted

OK, NOT_FINITE, NOT_UNIT, RANGE, OUTPUT, NOT_CONVERGED, STATE = 0, 2, 3, 4, 5, 6, 7
"""Values of os_status_t."""

TRUSTED = 0.5
"""What a verdict must reach; it is 1 or 0."""


@dataclass(frozen=True)
class Outcome:
    """What one call answers, or of a stateful kernel a first step after its state was set from the arguments.

    initial : status of setting the state; y (k_out,) : results, safe ones unless the status is 0
    scaled : how many directions were not of length 1
    """

    initial: int
    status: int
    y: Array
    scaled: int


def outcome(definition: Definition, interface: Interface, x: Array, count: int) -> Outcome:
    """Return what the checked kernel answers to raw arguments (k_in,) and a count of rows."""
    source = definition.source
    safe = np.concatenate([np.array(port.safe_values) for port in source.outputs])
    given, scaled = prepared(interface, x, count)
    arguments = _split(source.inputs, given)
    initial = _refusal([each for each in arguments if each[0] in interface.recurrent], True)
    if initial != OK:
        return Outcome(initial, STATE, safe, 0)
    rows = interface.counted[0].shape[0] if interface.counted else 0
    status = _refusal([each for each in arguments if each[0] in interface.arguments], not rows or 1 <= count <= rows)
    if status == OK:
        status, y = definition.reference(given)
        if status == OK and any(y[interface.first_out[port.name]] < TRUSTED for port in interface.verdicts):
            status = NOT_CONVERGED
        if status == OK and all(is_accepted(port, values) for port, values in _split(source.outputs, y)):
            return Outcome(OK, OK, y, scaled)
        status = status or OUTPUT
    for port, values in arguments:
        if port in interface.recurrent:
            first = interface.first_out[port.name]
            safe[first : first + port.size] = values
    return Outcome(OK, status, safe, 0)


def prepared(interface: Interface, x: Array, count: int) -> tuple[Array, int]:
    """Return the arguments as the kernel gets them: rows beyond the count filled, directions of length 1."""
    parts, scaled = [], 0
    for port, values in _split(interface.source.inputs, x):
        part = np.array(values).reshape(-1, port.row_length if len(port.shape) == 2 else 1)
        if port.counted and 1 <= count <= port.shape[0]:
            part[count:] = part[0] if port.direction is not None or port.padding is None else port.padding
        if port.direction is not None:
            part = part.reshape(-1, port.row_length)
            part, lengths = _directions(part)
            valid = lengths[: count if port.counted else None]
            scaled += int(np.sum(np.abs(valid - 1.0) > port.direction))
        parts.append(part.ravel())
    return np.concatenate(parts) if parts else x, scaled


def _directions(rows: Array) -> tuple[Array, Array]:
    # the operations of os_scale_rows, in their order, so that the kernel gets the same bits
    unit, lengths = np.zeros_like(rows), np.zeros(len(rows))
    for i, row in enumerate(rows):
        largest = float(np.max(np.abs(row)))
        if not 0.0 < largest < math.inf:
            unit[i] = row
            continue
        scaled = row / largest
        square = 0.0
        for entry in scaled.tolist():
            square += entry * entry
        norm = math.sqrt(square)
        unit[i], lengths[i] = scaled / norm, norm * largest
    return unit, lengths


def _refusal(values: list[tuple[Port, tuple[float, ...]]], count_is_right: bool) -> int:
    if not all(math.isfinite(entry) for _, entries in values for entry in entries):
        return NOT_FINITE
    if not all(is_accepted(_only_lengths(port), entries) for port, entries in values):
        return NOT_UNIT
    return OK if count_is_right and all(is_accepted(port, entries) for port, entries in values) else RANGE


def _only_lengths(port: Port) -> Port:
    return replace(port, lower=None, upper=None, positive_definite=False, safe=None)


def _split(ports: tuple[Port, ...], x: Array) -> list[tuple[Port, tuple[float, ...]]]:
    parts = np.split(x, np.cumsum([port.size for port in ports])[:-1])
    return [(port, tuple(part.tolist())) for port, part in zip(ports, parts, strict=True)]
