"""Test vectors: arguments drawn from the ports, good and bad, with the status and the results that Python expects."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude import dcm
from optsat.export.definition import Definition
from optsat.export.interface import Interface
from optsat.export.outcome import Outcome, outcome
from optsat.port import Port

GOOD = 32
_NOISE = 0.01


@dataclass(frozen=True)
class Vector:
    """Arguments as a client would give them, and what must come back.

    x (k_in,) : float32 numbers, so that both precisions take the same; count : valid rows, 0 where there are none
    to count
    """

    x: Array
    count: int
    expected: Outcome


def draw_vectors(definition: Definition, interface: Interface, good: int = GOOD) -> list[Vector]:
    """Return `good` vectors within the checks of the ports, and then one for each limit and each way to break a check.

    The seed is made of the kernel's name: the same vectors everywhere.
    """
    seed = int.from_bytes(hashlib.sha256(definition.source.name.encode()).digest()[:8], "big")
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(good):
        x, count = draw(interface, rng)
        found.append(Vector(x, count, outcome(definition, interface, x, count)))
    x, count = draw(interface, rng)
    for broken, broken_count in spoilt(interface, x, count):
        found.append(Vector(broken, broken_count, outcome(definition, interface, broken, broken_count)))
    return found


def draw(interface: Interface, rng: np.random.Generator) -> tuple[Array, int]:
    """Return arguments (k_in,) within the checks of all ports, and a count of rows."""
    inputs = interface.source.inputs
    values = {port.name: _drawn(port, rng) for port in inputs}
    directions = [port for port in inputs if port.direction is not None]
    if len(directions) == 2 and directions[0].shape == directions[1].shape and directions[0].row_length == 3:
        # measured and reference directions that one attitude explains, but for noise
        body, reference = directions
        q = rng.normal(size=4)
        seen = values[reference.name] @ dcm.from_quaternion(q / np.linalg.norm(q)).T
        lengths = np.linalg.norm(seen, axis=-1, keepdims=True)
        values[body.name] = seen + _NOISE * lengths * rng.normal(size=seen.shape)
    x = np.concatenate([np.ravel(values[port.name]) for port in inputs]) if inputs else np.zeros(0)
    rows = interface.counted[0].shape[0] if interface.counted else 0
    return x.astype(np.float32).astype(np.float64), int(rng.integers(1, rows + 1)) if rows else 0


def spoilt(interface: Interface, x: Array, count: int) -> Iterator[tuple[Array, int]]:
    """Yield the arguments with one check after another broken, each alone, and those at the ends of a range."""
    for port in interface.source.inputs:
        first = interface.first_in[port.name]
        entries = range(first, first + port.size)
        changes = [{entries[0]: np.nan}, {entries[0]: np.inf}, {entries[0]: -np.inf}]
        if port.unit_norm is not None:
            changes += [{k: 2.0 * x[k] for k in entries}, dict.fromkeys(entries, 0.0)]
        if port.direction is not None:
            changes += [dict.fromkeys(entries[: port.row_length], 0.0)]
        for limit in (port.lower, port.upper):
            if limit is not None and not port.positive_definite and float(np.float32(limit)) == limit:
                changes += [{entries[-1]: limit}]
        if port.lower is not None:
            changes += [{entries[0]: port.lower - 1.0 - abs(port.lower)}]
        if port.upper is not None:
            changes += [{entries[0]: port.upper + 1.0 + abs(port.upper)}]
        if port.positive_definite:
            changes += [{entries[0]: -1.0}, {entries[0]: 0.0}]
            if port.shape[0] > 1:
                changes += [{entries[1]: x[entries[1]] + x[entries[0]]}]
        for change in changes:
            broken = x.copy()
            broken[list(change)] = list(change.values())
            yield broken, count
    if interface.counted:
        yield x, 0
        yield x, interface.counted[0].shape[0] + 1


def _drawn(port: Port, rng: np.random.Generator) -> Array:
    if port.positive_definite:
        n = port.shape[0]
        root = rng.normal(size=(n, n))
        drawn = root @ root.T / n + 0.1 * np.eye(n)
        return np.asarray(drawn if port.upper is None else drawn * min(1.0, 0.9 * port.upper / drawn.max()))
    values = np.asarray(rng.normal(size=port.shape))
    if port.direction is not None:
        return np.asarray(values * 10.0 ** rng.uniform(-2.0, 2.0, (*port.shape[:-1], 1)))
    if port.unit_norm is not None:
        return np.asarray(values / np.linalg.norm(values, axis=-1, keepdims=True))
    if port.lower is not None and port.upper is not None:
        # off the ends, which rounding to float could pass
        return port.lower + (port.upper - port.lower) * rng.uniform(0.01, 0.99, port.shape)
    if port.lower is not None:
        return port.lower + 0.01 + np.abs(values)
    if port.upper is not None:
        return port.upper - 0.01 - np.abs(values)
    return values
