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
_FEWEST = 6
_MOST_NUMBERS = 100_000
_NOISE = 0.01

_FLOAT_ROUNDING = 2.0**-23
_NUDGES = 2
# answers may move by this many roundings of their arguments; beyond, they are no test of anything
_STEADY = 256.0
_TRIES = 3


@dataclass(frozen=True)
class Vector:
    """Arguments as a client would give them, and what must come back.

    x (k_in,) : float32 numbers, so that both precisions take the same; count : valid rows, 0 where there are none
    to count
    """

    x: Array
    count: int
    expected: Outcome


def draw_vectors(definition: Definition, interface: Interface, limits: bool, good: int = GOOD) -> list[Vector]:
    """Return `good` vectors within the checks of the ports, and then one for each way to break a check.

    Of a kernel with many arguments they are fewer, down to six.
    limits : also those with an entry at a limit, where float may answer otherwise than double

    Left out are arguments on which the answer hangs by a thread, such as an attitude from one direction: rounding them
    to float would change it, and no comparison would tell anything. The seed is made of the kernel's name: the same
    vectors everywhere.
    """
    seed = int.from_bytes(hashlib.sha256(definition.source.name.encode()).digest()[:8], "big")
    rng = np.random.default_rng(seed)
    good = min(good, max(_FEWEST, _MOST_NUMBERS // max(interface.length_in, 1)))
    drawn = [draw(interface, rng) for _ in range(_TRIES * good)]
    vectors = [Vector(x, count, outcome(definition, interface, x, count)) for x, count in drawn[:good]]
    scale = np.max([np.abs(vector.expected.y) for vector in vectors], axis=0)
    for port in interface.source.outputs:
        part = slice(interface.first_out[port.name], interface.first_out[port.name] + port.size)
        scale[part] = np.max(scale[part]) or 1.0

    def is_stable(vector: Vector) -> bool:
        if not np.all(np.isfinite(vector.x)):
            return True
        for _ in range(_NUDGES):
            nudged = _nudged(interface, vector.x, rng)
            found = outcome(definition, interface, nudged, vector.count)
            same = (found.initial, found.status) == (vector.expected.initial, vector.expected.status)
            if not same or np.any(np.abs(found.y - vector.expected.y) > _STEADY * _FLOAT_ROUNDING * scale):
                return False
        return True

    found = [vector for vector in vectors if is_stable(vector)]
    for x, count in drawn[good:]:
        if len(found) < good:
            vector = Vector(x, count, outcome(definition, interface, x, count))
            found += [vector] if is_stable(vector) else []
    x, count = (found[0].x, found[0].count) if found else drawn[0]
    spoiled = [Vector(y, n, outcome(definition, interface, y, n)) for y, n in spoilt(interface, x, count, limits)]
    return [*found, *(vector for vector in spoiled if is_stable(vector))]


def draw(interface: Interface, rng: np.random.Generator) -> tuple[Array, int]:
    """Return arguments (k_in,) within the checks of all ports, and a count of rows."""
    inputs = interface.source.inputs
    if interface.source.example is not None:
        return interface.source.example(rng).astype(np.float32).astype(np.float64), 0
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


def spoilt(interface: Interface, x: Array, count: int, limits: bool) -> Iterator[tuple[Array, int]]:
    """Yield the arguments with one check after another broken, each alone, and those at the limits."""
    for port in interface.source.inputs:
        first = interface.first_in[port.name]
        entries = range(first, first + port.size)
        changes = [{entries[0]: np.nan}, {entries[0]: np.inf}, {entries[0]: -np.inf}]
        if port.unit_norm is not None:
            changes += [{k: 2.0 * x[k] for k in entries}, dict.fromkeys(entries, 0.0)]
        if port.direction is not None:
            changes += [dict.fromkeys(entries[: port.row_length], 0.0)]
        for limit in (port.lower, port.upper):
            if limits and limit is not None and not port.positive_definite and float(np.float32(limit)) == limit:
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


def _nudged(interface: Interface, x: Array, rng: np.random.Generator) -> Array:
    nudged = x * (1.0 + _FLOAT_ROUNDING * rng.uniform(-1.0, 1.0, len(x)))
    for port in interface.source.inputs:
        if port.positive_definite:
            part = slice(interface.first_in[port.name], interface.first_in[port.name] + port.size)
            matrix = nudged[part].reshape(port.shape)
            nudged[part] = np.ravel((matrix + matrix.T) / 2)
    return np.asarray(nudged)


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
