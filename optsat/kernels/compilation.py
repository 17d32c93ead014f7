"""Compilation: C text to a library in the cache, made once whatever number of processes ask for it."""

import contextlib
import hashlib
import re
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from optsat.kernels import cache
from optsat.kernels.entry import Entry
from optsat.kernels.fingerprint import Fingerprint, fingerprint, tuned
from optsat.kernels.folders import writable_folders
from optsat.kernels.lowering import LARGE
from optsat.kernels.processor import c_library, features
from optsat.kernels.record import KernelRecord
from optsat.kernels.toolchain import KEEP_BITS, Compiler, find_compiler
from optsat.kernels.unit import ABI

T = TypeVar("T")

LONGEST_WAIT = 30.0
"""Seconds to wait for another process that compiles the same kernel, before it is compiled twice."""

_WIDTH = re.compile(r"\bos_width = (\d+)U?;")


def compiled(
    record: KernelRecord,
    text: str,
    bind: Callable[[str, KernelRecord], T],
    extra: Sequence[str] = (),
    compiler: Compiler | None = None,
) -> tuple[T, Entry]:
    """Return what `bind` makes of the library of a C text, and its entry in the cache, where it is kept from now on.

    record : what is known before; extra : more flags; compiler : the one that is found unless given

    Raises
    ------
    CompilerMissingError, CompilerRefusedError : there is none, or none to trust.
    CompilationError : it fails. UnloadableError : the library can be kept or loaded nowhere.
    """
    compiler = compiler or find_compiler()
    found = fingerprint(compiler).checked()
    # what has a status stands in loops: many operations, but little text
    optimisation = "-O2" if record.has_status or record.operations <= LARGE else "-O1"
    # gcc keeps the sums of short loops in memory below this level
    optimisation = "-O3" if record.has_short_loops else optimisation
    # "native" is no name of a processor: the target stands for it
    flags = (optimisation, *(f for f in found.flags if not f.endswith("=native")), *extra, *compiler.flags, *KEEP_BITS)
    width = _WIDTH.search(text)
    record = replace(
        record,
        width=int(width[1]) if width else 1,
        has_tiles=f"{record.name}_tiles(" in text,
        compiler=found.version.partition("\n")[0],
        flags=flags,
        target=found.target,
        c_library=c_library(),
        features=tuple(sorted(features())),
        key=_key(text, flags, found),
    )
    if loaded := cache.load(record.key, bind):
        return loaded
    with _alone(record.key):
        if loaded := cache.load(record.key, bind):
            return loaded
        compiler = tuned(compiler, found)
        library = _library(replace(compiler, flags=(*extra, *compiler.flags)), text, optimisation)
        return cache.store(record, library, text, bind)


def digest_of(text: str) -> str:
    """Return the SHA-256 of a C text."""
    return hashlib.sha256(text.encode()).hexdigest()


def _key(text: str, flags: Sequence[str], found: Fingerprint) -> str:
    known = [str(ABI), text, *flags, "", found.version, *found.target, "", c_library()]
    return digest_of("\n".join(known))


def _library(compiler: Compiler, text: str, optimisation: str) -> bytes:
    with tempfile.TemporaryDirectory(prefix="optsat-") as folder:
        library = Path(folder, "kernel.so")
        compiler.build_library(text, library, optimisation)
        return library.read_bytes()


@contextlib.contextmanager
def _alone(key: str) -> Iterator[None]:
    """Wait for a process that makes the same kernel; this saves work, and nothing depends on it."""
    folder = next(writable_folders(), None)
    try:
        import fcntl

        if folder is None:
            raise OSError
        path = folder / key[:2] / f".{key}.lock"
        path.parent.mkdir(mode=0o700, exist_ok=True)
        stream = path.open("w")
    except (ImportError, OSError):
        yield
        return
    with stream:
        end = time.monotonic() + LONGEST_WAIT
        while time.monotonic() < end:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(0.02)
            except OSError:
                break  # a file system without locks
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                path.unlink()
