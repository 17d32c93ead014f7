"""Folders: where compiled kernels are kept, and which places are safe to run code from."""

import os
import stat
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import chain
from pathlib import Path

VARIABLE = "OPTSAT_CACHE"
"""Environment variable: the folder to keep kernels in; after it, with colons between, read-only ones searched first."""


class CacheFolderWarning(UserWarning):
    """A folder of kernels is not used, since somebody else could put code into it."""


def own_folder(environment: Mapping[str, str] | None = None) -> Path:
    """Return the folder that kernels are kept in, whether it exists or not."""
    known = os.environ if environment is None else environment
    first = known.get(VARIABLE, "").split(os.pathsep)[0]
    if first:
        return Path(first).expanduser()
    base = known.get("XDG_CACHE_HOME", "")
    # a relative path there is to be ignored, says its standard
    return (Path(base) if os.path.isabs(base) else Path("~/.cache").expanduser()) / "optsat"


def shared_folders(environment: Mapping[str, str] | None = None) -> tuple[Path, ...]:
    """Return the read-only folders that are searched first."""
    known = os.environ if environment is None else environment
    return tuple(Path(each).expanduser() for each in known.get(VARIABLE, "").split(os.pathsep)[1:] if each)


def spare_folders() -> Iterator[Path]:
    """Yield where kernels go when their own folder cannot be used: in memory, then among the temporary files."""
    name = f"optsat-{_user()}"
    if os.path.isdir("/dev/shm"):
        yield Path("/dev/shm", name)
    yield Path(tempfile.gettempdir(), name)


def searched_folders() -> Iterator[Path]:
    """Yield the folders that exist and are safe: shared ones, the user's own, spare ones."""
    for folder in shared_folders():
        if is_safe(folder, shared=True):
            yield folder
    # the spare ones unasked cost a file: the folder of temporary files is found by writing to it
    for folder in chain((own_folder(),), spare_folders()):
        if is_safe(folder):
            yield folder


def writable_folders() -> Iterator[Path]:
    """Yield folders to keep a kernel in, made where they are missing; the later ones for when the earlier fail."""
    for folder in chain((own_folder(),), spare_folders()):
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError:
            continue
        if is_safe(folder) and os.access(folder, os.W_OK):
            yield folder


def is_safe(folder: Path, shared: bool = False) -> bool:
    """Return whether the folder is there and only its user, or of a shared one root, can write to it.

    Warns once of a folder that is there and is not safe.
    """
    try:
        status = folder.stat()
    except OSError:
        return False
    fault = fault_of(status, shared)
    if fault:
        _warn_once(str(folder), fault)
    return not fault


def fault_of(status: os.stat_result, shared: bool = False) -> str:
    """Return why code must not be run from there, or "" where it may."""
    if not hasattr(os, "getuid"):
        return ""
    allowed = {os.getuid(), 0} if shared else {os.getuid()}
    if status.st_uid not in allowed:
        return f"belongs to user {status.st_uid}"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"can be written by others (mode {stat.S_IMODE(status.st_mode):04o})"
    return ""


@cache
def _warn_once(folder: str, fault: str) -> None:
    warnings.warn(
        f"{folder} {fault}, and compiled kernels are code: it is not used. Give it to yourself with mode 0700, or let "
        f"{VARIABLE} name another folder.",
        CacheFolderWarning,
        stacklevel=5,
    )


def _user() -> str:
    return str(os.getuid()) if hasattr(os, "getuid") else "user"
