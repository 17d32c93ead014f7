"""Upkeep: what a folder of kernels holds, and how it is kept small."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path

from optsat.kernels.entry import DAY, BadEntryError, Entry, read_entry, remove

LARGEST = 2 * 1024**3
"""Bytes of a folder above which the kernels that were not used for the longest time are removed."""

_DEAD_AFTER = 3600.0  # seconds after which a half-written file has no writer any more


def entries(folder: Path) -> Iterator[Entry]:
    """Yield the entries of a folder whose records are good, in the order of their keys; they do not count as used."""
    for path in sorted(folder.glob("??/*.record")):
        with contextlib.suppress(BadEntryError):
            if entry := read_entry(folder, path.stem, use=False):
                yield entry


def damaged(folder: Path) -> list[str]:
    """Return the keys whose record or library is not what was written."""
    found = []
    for path in sorted(folder.glob("??/*.record")):
        try:
            entry = read_entry(folder, path.stem, use=False)
        except BadEntryError:
            entry = None
        if entry is None or not entry.is_sound():
            found.append(path.stem)
    return found


def evict(folder: Path, largest: int = LARGEST, unused: float = DAY, now: float | None = None) -> list[str]:
    """Remove the kernels that were not used for the longest time until the folder is small enough; return their keys.

    None that was used within `unused` seconds goes. Half-written files of writers that died go too.
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
        if total <= largest or now - used[key] < unused:
            break
        remove(folder, key)
        removed.append(key)
        total -= sizes[key]
    return removed


def clean(folder: Path, unused: float = 0.0) -> tuple[int, int]:
    """Remove the kernels not used for so many seconds; where all go, also what is known of compilers and definitions.

    Only files of the cache go, whatever else lies in the folder. Returns how many kernels, and how many bytes.
    """
    before = {entry.record.key: entry.size() for entry in entries(folder)}
    removed = evict(folder, largest=-1, unused=unused)
    if unused <= 0.0:
        for pattern in ("index/*/*.json", "compiler-*.json", "??/.*"):
            for path in folder.glob(pattern):
                path.unlink(missing_ok=True)
        for pattern in ("index/*", "index", "??"):
            for path in folder.glob(pattern):
                with contextlib.suppress(OSError):
                    path.rmdir()
    return len(removed), sum(before.get(key, 0) for key in removed)
