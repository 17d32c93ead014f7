"""Entry: one compiled kernel on disk, FOLDER/ab/KEY.so, KEY.c and KEY.record: library, text and record.

Each appears whole or not at all and the record last; without it there is no entry. Its first line is the digest of what
follows, its time of change when the kernel was last used.
"""

import contextlib
import hashlib
import os
import time
from dataclasses import dataclass
from pathlib import Path

from optsat.files import write_atomically
from optsat.kernels.folders import fault_of
from optsat.kernels.record import KernelRecord

ENDINGS = (".record", ".so", ".c")
"""In the order of removal: without a record the rest is no entry."""

DAY = 86_400.0
"""Seconds."""


class BadEntryError(Exception):
    """An entry does not hold what its record says."""


@dataclass(frozen=True)
class Entry:
    """One kernel on disk."""

    folder: Path
    record: KernelRecord

    @property
    def library(self) -> Path:
        """Path of the compiled library."""
        return path_of(self.folder, self.record.key, ".so")

    def text(self) -> str | None:
        """Return the C text, None where it is not there or not what was compiled."""
        try:
            data = path_of(self.folder, self.record.key, ".c").read_bytes()
        except OSError:
            return None
        return data.decode() if digest_of(data) == self.record.text else None

    def is_sound(self) -> bool:
        """Return whether the library is the one of the record."""
        try:
            return digest_of(self.library.read_bytes()) == self.record.library
        except OSError:
            return False

    def last_used(self) -> float:
        """Return when, to half a day, it was last used [s since 1970]."""
        return path_of(self.folder, self.record.key, ".record").stat().st_mtime

    def size(self) -> int:
        """Return the bytes on disk."""
        paths = [path_of(self.folder, self.record.key, ending) for ending in ENDINGS]
        return sum(path.stat().st_size for path in paths if path.exists())


def read_entry(folder: Path, key: str, use: bool = True) -> Entry | None:
    """Return the entry of a folder, None where there is none; its library is not looked at.

    use : mark it as used

    Raises
    ------
    BadEntryError : the record is not one.
    """
    path = path_of(folder, key, ".record")
    try:
        with path.open("rb") as stream:
            check_owner(stream.fileno())
            data = stream.read()
            last = os.fstat(stream.fileno()).st_mtime
    except OSError:
        return None
    # file systems that record times of access at most once a day, or never, could not tell
    if use and time.time() - last > DAY / 2:
        with contextlib.suppress(OSError):
            os.utime(path)
    digest, _, body = data.partition(b"\n")
    if digest.decode(errors="replace") != digest_of(body):
        raise BadEntryError("its record is damaged")
    try:
        record = KernelRecord.from_json(body.decode())
    except (ValueError, TypeError, KeyError) as error:
        raise BadEntryError(f"its record cannot be read: {error}") from None
    if record.key != key:
        raise BadEntryError("its record belongs to another kernel")
    return Entry(folder, record)


def write_entry(entry: Entry, library: bytes, text: str) -> None:
    """Write an entry, readable by its user alone.

    Raises
    ------
    OSError : the disk is full, or the folder cannot be written to.
    """
    body = entry.record.to_json().encode()
    entry.library.parent.mkdir(mode=0o700, exist_ok=True)
    write_atomically(entry.library, library, mode=0o600)
    if text:
        write_atomically(path_of(entry.folder, entry.record.key, ".c"), text.encode(), mode=0o600)
    record = digest_of(body).encode() + b"\n" + body
    write_atomically(path_of(entry.folder, entry.record.key, ".record"), record, mode=0o600)


def remove(folder: Path, key: str) -> None:
    """Remove an entry; what cannot be removed, as in a read-only folder, stays."""
    for ending in ENDINGS:
        with contextlib.suppress(OSError):
            path_of(folder, key, ending).unlink()


def check_owner(descriptor: int) -> None:
    """Refuse an open file that somebody else could have written.

    Raises
    ------
    BadEntryError : it belongs neither to this user nor to root, or others can write to it.
    """
    if fault := fault_of(os.fstat(descriptor), shared=True):
        raise BadEntryError(f"its file {fault}")


def path_of(folder: Path, key: str, ending: str) -> Path:
    """Return the path of one file of an entry."""
    return folder / key[:2] / f"{key}{ending}"


def digest_of(data: bytes) -> str:
    """Return the SHA-256 in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()
