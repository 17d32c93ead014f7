"""Cache: compiled kernels kept on disk by the content that they were made from, safe to share and to lose."""

import logging
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from optsat.errors import OptsatError
from optsat.kernels.entry import BadEntryError, Entry, check_owner, digest_of, read_entry, remove, write_entry
from optsat.kernels.folders import searched_folders, shared_folders, writable_folders
from optsat.kernels.processor import features
from optsat.kernels.record import KernelRecord
from optsat.kernels.upkeep import evict

T = TypeVar("T")

_log = logging.getLogger("optsat.kernels")


class UnloadableError(OptsatError):
    """Entries were found or written, and the system would load none of them."""


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
    return _store(replace(record, library=digest_of(library)), library, text, bind, "")


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
        check_owner(stream.fileno())
        library = stream.read()
        if digest_of(library) != entry.record.library:
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
                entry = Entry(folder, record)
                write_entry(entry, library, text)
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


def _discard(folder: Path, key: str, fault: str) -> None:
    _log.warning("The compiled kernel %s in %s is not used: %s. It is made again.", key[:12], folder, fault)
    if folder not in shared_folders():
        remove(folder, key)


def _check_same(descriptor: int, path: str) -> None:
    read, loaded = os.fstat(descriptor), os.stat(path)
    if (read.st_dev, read.st_ino) != (loaded.st_dev, loaded.st_ino):
        raise BadEntryError("its library was replaced while it was loaded")
