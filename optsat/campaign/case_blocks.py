"""Case blocks: all cells of a run in blocks of a fixed length, failed ones too, and the hash of what they hold."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from optsat.campaign.rows import Cases
from optsat.campaign.table import Kinds

_MOST_CASES, _MOST_BYTES = 4096, 1 << 25
WORDS = np.dtype(object)

Block: TypeAlias = Mapping[str, NDArray[Any]]


def result_kinds(cases: Cases) -> Kinds:
    """Return the kinds of the study's columns, without the case's number."""
    return {name: kind for name, kind in cases.rows.kinds.items() if name != "case"}


def block_length(kinds: Kinds) -> int:
    """Return the cases of one block: 4096, and fewer where they would take more than 32 MB."""
    size = sum(8 * int(np.prod(kind.shape, dtype=np.int64)) for kind in kinds.values())
    return max(1, min(_MOST_CASES, _MOST_BYTES // max(size, 1)))


def case_blocks(cases: Cases, count: int) -> Iterator[tuple[int, Block]]:
    """Yield the first cell of each block and its columns: `status` (0 ran, 1 failed), `failure` (why), the study's own.

    A failed case holds NaN, 0 or an empty word in the study's columns.
    """
    kinds = result_kinds(cases)
    length = block_length(kinds)
    source = cases.rows.tables()
    waiting: list[Block] = []
    failures = iter(cases.failures)
    failure = next(failures, None)
    for start in range(0, count, length):
        stop = min(start + length, count)
        while not waiting or waiting[-1]["case"][-1] < stop - 1:
            table = next(source, None)
            if table is None:
                break
            if table.columns:
                waiting.append(table.columns)
        block = _empty(kinds, stop - start)
        while failure is not None and failure.case < stop:
            block["status"][failure.case - start] = 1
            block["failure"][failure.case - start] = f"{failure.error}: {failure.message}"
            failure = next(failures, None)
        for columns in waiting:
            here = slice(*np.searchsorted(columns["case"], (start, stop)))
            for name in kinds:
                block[name][columns["case"][here] - start] = columns[name][here]
        waiting = [columns for columns in waiting if columns["case"][-1] >= stop]
        yield start, block


def content_hash(cases: Cases, count: int) -> str:
    """Return a hash over names, kinds, shapes and values of all columns, `status` and `failure` among them.

    Unlike the digest of result.nc it does not change with the version of a library that writes files.
    """
    digests: dict[str, Any] = {}
    described: dict[str, list[Any]] = {}
    for _, block in case_blocks(cases, count):
        for name, column in block.items():
            if name not in digests:
                digests[name] = hashlib.sha256()
                described[name] = ["words" if column.dtype == WORDS else column.dtype.str[1:], count, *column.shape[1:]]
            digests[name].update(_bytes(column))
    content = [[name, *described[name], digests[name].hexdigest()] for name in digests]
    return hashlib.sha256(json.dumps(content, separators=(",", ":")).encode()).hexdigest()


def _bytes(column: NDArray[Any]) -> bytes:
    if column.dtype == WORDS:
        # without its brackets, so that the bytes of two blocks are those of both in one
        return json.dumps(column.ravel().tolist(), separators=(",", ":"))[1:-1].encode() + b","
    return np.ascontiguousarray(column, dtype=column.dtype.newbyteorder("<")).tobytes()


def _empty(kinds: Kinds, count: int) -> dict[str, NDArray[Any]]:
    block: dict[str, NDArray[Any]] = {
        "status": np.zeros(count, dtype=np.int8),
        "failure": np.full(count, "", dtype=WORDS),
    }
    for name, kind in kinds.items():
        empty: Any = {"U": "", "f": np.nan, "i": 0, "b": False}[kind.kind]
        block[name] = np.full((count, *kind.shape), empty, dtype=WORDS if kind.kind == "U" else kind.dtype)
    return block
