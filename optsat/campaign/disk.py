"""Disk: what a full or a read-only one means for a campaign, in words and bytes."""

import contextlib
import errno
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from optsat.errors import InputError, OptsatError

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_READ_ONLY = (errno.EROFS, errno.EACCES, errno.EPERM)


@contextlib.contextmanager
def disk_faults(path: Path, needed: Callable[[], int]) -> Iterator[None]:
    """Say of a failed write to the run folder `path` what a person can do about it.

    needed : bytes that the rest of the run will take

    Raises
    ------
    OptsatError : the disk is full, or the file too large for it.
    InputError : nothing can be written there.
    """
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            raise OptsatError(
                f"No room for the run in {path}: about {_amount(needed())} are needed and {_amount(_free(path))} are "
                f"free ({os.strerror(error.errno)}). Every finished chunk is kept: make room, and run the same "
                "command with --resume."
            ) from None
        if error.errno in _READ_ONLY:
            raise InputError(
                f"{path} cannot be written ({os.strerror(error.errno)}). Choose a folder that is yours with --out."
            ) from None
        raise


def require_room(path: Path, size: int) -> None:
    """Reserve `size` bytes as the new file `path` and give them back at once.

    For libraries that do not survive a full disk: HDF5 leaves its objects behind and the interpreter crashes.

    Raises
    ------
    OSError : there is no room for them, or a limit forbids them.
    """
    try:
        with path.open("xb") as stream:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(stream.fileno(), 0, size)
            elif _free(path) < size:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    finally:
        path.unlink(missing_ok=True)


def _free(path: Path) -> int:
    path = path.absolute()
    while not path.exists():
        path = path.parent
    return shutil.disk_usage(path).free


def _amount(size: int) -> str:
    return f"{size / 1e6:.1f} MB" if size >= 100_000 else f"{size / 1e3:.1f} kB"
