"""Cache: compiled kernels kept on disk by the content that they were made from, safe to share and to lose.

FOLDER/ab/KEY.so, KEY.c and KEY.record: library, text and record. Each appears whole or not at all and the record last;
without it there is no entry. Its first line is the digest of what follows, its time of change when it was last used.
"""

import contextlib
import hashlib
import logging
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from optsat.errors import OptsatError
from optsat.files import write_atomically
from optsat.kernels.folders import fault_of, searched_folders, shared_folders, writable_folders
from optsat.kernels.processor import features
from optsat.kernels.record import KernelRecord

T = TypeVar("T")

LARGEST = 2 * 1024**3
"""Bytes of a folder above which the kernels that were not used for the longest time are removed."""

DAY = 86_400.0
"""Seconds within which a kernel that was used is never removed."""

_ENDINGS = (".record", ".so", ".c")  # in the order of removal: without a record the rest is no entry
_DEAD_AFTER = 3600.0  # seconds after which a half-written file has no writer any more

_log = logging.getLogger("optsat.kernels")


class BadEntryError(Exception):
    """An entry does not hold what its record says."""


class UnloadableError(OptsatError):
    """Entries were found or written, and the system would load none of them."""


@dataclass(frozen=True)
class Entry:
    """One kernel on disk."""

    folder: Path
    record: KernelRecord

    @property
    def library(self) -> Path:
        """Path of the compiled library."""
        return _path(self.folder, self.record.key, ".so")

    def text(self) -> str | None:
        """Return the C text, None where it is not there or not what was compiled."""
        try:
            data = _path(self.folder, self.record.key, ".c").read_bytes()
        except OSError:
            return None
        return data.decode() if _digest(data) == self.record.text else None

    def size(self) -> int:
        """Return the bytes on disk."""
        return sum(_size(_path(self.folder, self.record.key, ending)) for ending in _ENDINGS)


def load(key: str, bind: Callable[[str, KernelRecord], T]) -> tuple[T, Entry] | None:
    """Return what `bind` makes of the kernel's library, and its entry; None where no folder holds the kernel.

    bind : of a path and the record; raises OSError where the system does not load the library

    Bad entries are removed and said once in the log.

    Raises
    ------
    UnloadableError : a library is there and the system loads it from nowhere.
    """
    refused = ""
    good: tuple[KernelRecord, bytes] | None = None
    for folder in searched_folders():
        try:
            entry = read_entry(folder, key)
            # a home folder may be shared by unlike machines
            if entry is None or not set(entry.record.features) <= features():
                continue
            return _verified(entry, bind), entry
        except BadEntryError as error:
            _discard(folder, key, str(error))
        except _NotLoadedError as error:
            refused, good = f"{error} ({folder})", (error.record, error.library)
    if good is None:
        return None
    # the folder may forbid programs, as some home folders do
    return _store(good[0], good[1], "", bind, refused)


def store(record: KernelRecord, library: bytes, text: str, bind: Callable[[str, KernelRecord], T]) -> tuple[T, Entry]:
    """Keep a compiled kernel and return what `bind` makes of it, and its entry.

    Raises
    ------
    UnloadableError : no folder can be written to, or the system loads the library from none of them.
    """
    return _store(replace(record, library=_digest(library)), library, text, bind, "")


def read_entry(folder: Path, key: str) -> Entry | None:
    """Return the entry of a folder, None where there is none; its library is not looked at.

    Raises
    ------
    BadEntryError : the record is not one.
    """
    path = _path(folder, key, ".record")
    try:
        with path.open("rb") as stream:
            _check_owner(stream.fileno())
            data = stream.read()
            _mark_used(path, os.fstat(stream.fileno()).st_mtime)
    except OSError:
        return None
    digest, _, body = data.partition(b"\n")
    if digest.decode(errors="replace") != _digest(body):
        raise BadEntryError("its record is damaged")
    try:
        record = KernelRecord.from_json(body.decode())
    except (ValueError, TypeError, KeyError) as error:
        raise BadEntryError(f"its record cannot be read: {error}") from None
    if record.key != key:
        raise BadEntryError("its record belongs to another kernel")
    return Entry(folder, record)


def entries(folder: Path) -> Iterator[Entry]:
    """Yield the entries of a folder; bad records are left out."""
    for path in sorted(folder.glob("??/*.record")):
        with contextlib.suppress(BadEntryError):
            if entry := read_entry_quietly(folder, path.stem):
                yield entry


def read_entry_quietly(folder: Path, key: str) -> Entry | None:
    """Return the entry as `read_entry` does, without marking it as used."""
    path = _path(folder, key, ".record")
    status = path.stat()
    entry = read_entry(folder, key)
    with contextlib.suppress(OSError):
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    return entry


def is_sound(entry: Entry) -> bool:
    """Return whether the library is the one of the record."""
    try:
        return _digest(entry.library.read_bytes()) == entry.record.library
    except OSError:
        return False


def remove(folder: Path, key: str) -> None:
    """Remove an entry; what cannot be removed, as in a read-only folder, stays."""
    for ending in _ENDINGS:
        with contextlib.suppress(OSError):
            _path(folder, key, ending).unlink()


def evict(folder: Path, largest: int = LARGEST, now: float | None = None) -> list[str]:
    """Remove the kernels that were not used for the longest time until the folder is small enough; return their keys.

    None that was used within a day goes. Half-written files of writers that died go too.
    """
    now = time.time() if now is None else now
    used: dict[str, float] = {}
    sizes: dict[str, int] = {}
    for path in folder.glob("??/*"):
        try:
            status = path.stat()
        except OSError:
            continue
        if path.name.startswith("."):
            if now - status.st_mtime > _DEAD_AFTER:
                path.unlink(missing_ok=True)
            continue
        key = path.name.partition(".")[0]
        sizes[key] = sizes.get(key, 0) + status.st_size
        if path.suffix == ".record" or key not in used:
            used[key] = status.st_mtime
    total, removed = sum(sizes.values()), []
    for key in sorted(used, key=lambda key: used[key]):
        if total <= largest or now - used[key] < DAY:
            break
        remove(folder, key)
        removed.append(key)
        total -= sizes[key]
    return removed


class _NotLoadedError(Exception):
    def __init__(self, error: OSError, record: KernelRecord, library: bytes) -> None:
        super().__init__(str(error))
        self.record, self.library = record, library


def _verified(entry: Entry, bind: Callable[[str, KernelRecord], T]) -> T:
    """The library read once, compared with its digest, and bound: damaged code crashes or, worse, computes."""
    path = str(entry.library)
    try:
        stream = open(path, "rb")  # noqa: SIM115  # stays open: no other file can take its number on disk
    except OSError:
        raise BadEntryError("its library is missing") from None
    with stream:
        _check_owner(stream.fileno())
        library = stream.read()
        if _digest(library) != entry.record.library:
            raise BadEntryError("its library is damaged")
        try:
            bound = bind(path, entry.record)
        except OSError as error:
            raise _NotLoadedError(error, entry.record, library) from None
        _check_same(stream.fileno(), path)
    return bound


def _store(
    record: KernelRecord, library: bytes, text: str, bind: Callable[[str, KernelRecord], T], refused: str
) -> tuple[T, Entry]:
    for folder in writable_folders():
        try:
            # of builders that race, the first has written it
            entry = read_entry(folder, record.key)
            if entry is None:
                evict(folder)
                entry = _written(Entry(folder, record), library, text)
            return _verified(entry, bind), entry
        except BadEntryError as error:
            _discard(folder, record.key, str(error))
        except _NotLoadedError as error:
            refused = f"{error} ({folder})"
        except OSError as error:
            # disk full, or read-only after all
            refused = f"{os.strerror(error.errno) if error.errno else error} ({folder})"
            remove(folder, record.key)
    raise UnloadableError(
        f"The kernel {record.name} cannot be kept or loaded anywhere: {refused or 'no folder can be written to'}. "
        "Let OPTSAT_CACHE name a folder of your own, on a disk with room that allows programs."
    )


def _written(entry: Entry, library: bytes, text: str) -> Entry:
    body = entry.record.to_json().encode()
    entry.library.parent.mkdir(mode=0o700, exist_ok=True)
    write_atomically(entry.library, library, mode=0o600)
    if text:
        write_atomically(_path(entry.folder, entry.record.key, ".c"), text.encode(), mode=0o600)
    record = _digest(body).encode() + b"\n" + body
    write_atomically(_path(entry.folder, entry.record.key, ".record"), record, mode=0o600)
    return entry


def _discard(folder: Path, key: str, fault: str) -> None:
    _log.warning("The compiled kernel %s in %s is not used: %s. It is made again.", key[:12], folder, fault)
    if folder not in shared_folders():
        remove(folder, key)


def _mark_used(path: Path, last: float) -> None:
    # file systems that record times of access at most once a day, or never, could not tell
    if time.time() - last > DAY / 2:
        with contextlib.suppress(OSError):
            os.utime(path)


def _check_owner(descriptor: int) -> None:
    if fault := fault_of(os.fstat(descriptor), shared=True):
        raise BadEntryError(f"its file {fault}")


def _check_same(descriptor: int, path: str) -> None:
    read, loaded = os.fstat(descriptor), os.stat(path)
    if (read.st_dev, read.st_ino) != (loaded.st_dev, loaded.st_ino):
        raise BadEntryError("its library was replaced while it was loaded")


def _path(folder: Path, key: str, ending: str) -> Path:
    return folder / key[:2] / f"{key}{ending}"


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
