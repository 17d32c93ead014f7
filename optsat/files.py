"""Files: written so that no crash leaves half of one."""

import contextlib
import os
import secrets
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

CRASH_AFTER = "OPTSAT_CRASH_AFTER"
"""Environment variable of the tests: the number of durable steps after which the process kills itself."""

_steps = 0


def durable_step() -> None:
    """Mark one step of a sequence that must survive being killed at any of them."""
    global _steps
    _steps += 1
    if os.environ.get(CRASH_AFTER) == str(_steps):
        os.kill(os.getpid(), signal.SIGKILL)


def write_atomically(path: Path, data: bytes, mode: int = 0o666) -> None:
    """Write a file so that whoever reads it, even after a power cut, finds the old bytes or the new.

    mode : permissions of the file, less those that the process withholds
    """
    with atomic_stream(path, mode) as stream:
        stream.write(data[: len(data) // 2])
        durable_step()
        stream.write(data[len(data) // 2 :])


@contextlib.contextmanager
def atomic_stream(path: Path, mode: int = 0o666) -> Iterator[BinaryIO]:
    """Yield a stream whose bytes become the file `path`, all of them or none, once it is left without an error.

    mode : permissions of the file, less those that the process withholds
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with open(temporary, "xb", opener=lambda name, flags: os.open(name, flags, mode)) as stream:
            durable_step()
            yield stream
            stream.flush()
            durable_step()
            os.fsync(stream.fileno())
        durable_step()
        temporary.replace(path)
        durable_step()
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)
    durable_step()


def sync_folder(folder: Path) -> None:
    """Make the names in a folder survive a power cut."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
