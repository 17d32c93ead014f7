"""Chunk file: the results of consecutive cells, bound to their run and place, with a digest over every byte.

Layout: the magic word, the length of the header as 32-bit little endian, the header as canonical JSON, the columns as
raw little-endian arrays in C order (words as UTF-8 JSON), SHA-256 of all before.
"""

import hashlib
import json
import struct
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from optsat.errors import InputError

Columns: TypeAlias = Mapping[str, NDArray[Any]]
"""Results by name, their cases along the first axis."""

_MAGIC = b"OSCHUNK1"
_DIGEST = hashlib.sha256().digest_size
_LENGTH = struct.Struct("<I")
_KINDS = {"b": "|b1", "i": "<i8", "f": "<f8"}


class ChunkError(Exception):
    """These bytes are no whole chunk of this run and place; the message says why."""


def write_chunk(run: str, chunk: int, columns: Columns) -> bytes:
    """Return the bytes of a chunk; numbers are stored as 64 bits, whatever they were.

    Raises
    ------
    InputError : a column of a kind that no result has.
    """
    described, parts = [], []
    for name, column in columns.items():
        kind, data = _encoded(chunk, name, column)
        described.append({"name": name, "kind": kind, "shape": list(column.shape), "bytes": len(data)})
        parts.append(data)
    header = {"run": run, "chunk": chunk, "columns": described}
    text = json.dumps(header, separators=(",", ":"), sort_keys=True).encode()
    body = b"".join([_MAGIC, _LENGTH.pack(len(text)), text, *parts])
    return body + hashlib.sha256(body).digest()


def read_chunk(data: bytes, run: str, chunk: int) -> dict[str, NDArray[Any]]:
    """Return the columns of a chunk.

    Raises
    ------
    ChunkError : not a whole chunk, bytes changed, or a chunk of another run or place.
    """
    body, digest = data[:-_DIGEST], data[-_DIGEST:]
    if len(data) < len(_MAGIC) + _LENGTH.size + _DIGEST or not body.startswith(_MAGIC):
        raise ChunkError("no chunk file")
    if hashlib.sha256(body).digest() != digest:
        raise ChunkError("its bytes do not match its digest")
    start = len(_MAGIC) + _LENGTH.size
    (length,) = _LENGTH.unpack_from(body, len(_MAGIC))
    header = json.loads(body[start : start + length])
    if (header["run"], header["chunk"]) != (run, chunk):
        raise ChunkError(f"it belongs to chunk {header['chunk']} of run {header['run']}")
    columns, place = {}, start + length
    for column in header["columns"]:
        columns[column["name"]] = _decoded(body[place : place + column["bytes"]], column["kind"], column["shape"])
        place += column["bytes"]
    return columns


def _encoded(chunk: int, name: str, column: NDArray[Any]) -> tuple[str, bytes]:
    if column.dtype.kind == "U":
        return "words", json.dumps(column.ravel().tolist(), ensure_ascii=False, separators=(",", ":")).encode()
    if column.dtype.kind not in _KINDS:
        raise InputError(f"chunk {chunk}: `{name}` holds {column.dtype}; a result is numbers, words or truth values.")
    kind = _KINDS[column.dtype.kind]
    return kind, np.ascontiguousarray(column, dtype=kind).tobytes()


def _decoded(data: bytes, kind: str, shape: list[int]) -> NDArray[Any]:
    if kind == "words":
        return np.array(json.loads(data), dtype=np.str_).reshape(shape)
    return np.frombuffer(data, dtype=kind).reshape(shape)
