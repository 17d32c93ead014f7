"""Folder lock: one runner a run folder; the kernel frees it however the runner ends."""

import contextlib
import errno
import fcntl
import json
import os
import platform
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from optsat.errors import InputError


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a run folder.

    Raises
    ------
    InputError : another runner holds it, or the file system has no locks.
    """
    # flock, not lockf, which any close of the same file by this process would free
    handle = os.open(folder / "lock", os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"{folder} is in use by {_holder(handle)}. Wait for it, or choose another folder."
            ) from None
        except OSError as error:
            if error.errno != errno.ENOLCK:
                raise
            raise InputError(f"{folder} is on a file system without locks; choose a local folder.") from None
        text = json.dumps({"host": platform.node(), "pid": os.getpid(), "start": f"{datetime.now(UTC):%FT%TZ}"})
        os.ftruncate(handle, 0)
        os.pwrite(handle, text.encode(), 0)
        yield
    finally:
        os.close(handle)


def _holder(handle: int) -> str:
    try:
        holder = json.loads(os.pread(handle, 4096, 0))
        return f"process {holder['pid']} on {holder['host']}, started {holder['start']}"
    except (ValueError, KeyError, TypeError):
        return "another runner"
