"""Index: from the definition of a kernel to its key, so that a kernel in the cache is used without building it again.

A note names the files that the definition could depend on: the modules that were loaded when it was built, of optsat
and of the definition's own package, and those that tell the versions of CasADi and NumPy. It holds as long as none of
them changed. FOLDER/index/REQUEST/MACHINE.json; which machine and compiler is part of the name.

A note is two lines of JSON. The first holds the key and the files outside optsat, looked at for each kernel; the second
the files of optsat, looked at once in a process, as a process whose installation changes has to start again anyway.
The compiler is looked for once too, and again when the environment changes.
"""

import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from optsat.files import write_atomically
from optsat.kernels.fingerprint import compiler_identity
from optsat.kernels.folders import searched_folders, writable_folders
from optsat.kernels.processor import identity
from optsat.kernels.request import Request
from optsat.kernels.toolchain import CompilerMissingError, find_compiler
from optsat.kernels.unit import ABI

_HOME = os.path.join(os.path.dirname(os.path.dirname(__file__)), "")
_LIBRARIES = ("casadi", "casadi.casadi", "casadi._casadi", "numpy")


def find_key(wanted: Request) -> str | None:
    """Return the key that this request had, None where it was never made here or a file has changed since."""
    request, machine = _request_name(wanted), _machine_name()
    for folder in searched_folders():
        place = folder / "index" / request
        for note in _candidates(place, machine):
            if (key := _key_of(note)) is not None:
                return key
    return None


def note_key(wanted: Request, key: str) -> None:
    """Remember the key of a request that was just built in this process; where nothing can be written, do not."""
    files = [_described(path) for path in _files(wanted)]
    document = {"key": key, "files": [each for each in files if not each[0].startswith(_HOME)]}
    installed = [each for each in files if each[0].startswith(_HOME)]
    note = json.dumps(document).encode() + b"\n" + json.dumps(installed).encode()
    for folder in writable_folders():
        place = folder / "index" / _request_name(wanted)
        try:
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_atomically(place / f"{_machine_name() or 'any'}.json", note, mode=0o600)
            return
        except OSError:
            continue


def _candidates(place: Path, machine: str) -> Iterator[Path]:
    if machine:
        yield place / f"{machine}.json"
    else:
        # without a compiler, what another made is better than nothing; the loader passes over other processors' code
        with contextlib.suppress(OSError):
            yield from sorted(place.iterdir())


def _key_of(note: Path) -> str | None:
    try:
        first, _, installed = note.read_bytes().partition(b"\n")
        document = json.loads(first)
        key: str = document["key"]
        fresh = _is_of_this_installation(installed) and all(_is_unchanged(*each) for each in document["files"])
    except (OSError, ValueError, TypeError, KeyError):
        return None
    return key if fresh else None


@cache
def _is_of_this_installation(described: bytes) -> bool:
    return all(_was_unchanged(*each) for each in json.loads(described))


@cache
def _was_unchanged(path: str, size: int, time: int, digest: str) -> bool:
    return _is_unchanged(path, size, time, digest)


def _is_unchanged(path: str, size: int, time: int, digest: str) -> bool:
    status = os.stat(path)
    if status.st_size != size:
        return False
    # a copy or a checkout gives old text a new time
    return status.st_mtime_ns == time or _digest(path) == digest


def _described(path: str) -> list[Any]:
    status = os.stat(path)
    return [path, status.st_size, status.st_mtime_ns, _digest(path)]


def _digest(path: str) -> str:
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _files(wanted: Request) -> list[str]:
    packages = {"optsat", wanted.definition.partition(":")[0].partition(".")[0]}
    modules = {
        module.__file__
        for name, module in list(sys.modules.items())
        if (name.partition(".")[0] in packages or name in _LIBRARIES) and getattr(module, "__file__", None)
    }
    texts = {
        str(path)
        for part in ("c", "templates")
        for path in Path(__file__).parent.joinpath(part).iterdir()
        if path.suffix in (".c", ".h")
    }
    return sorted(path for path in modules | texts if path is not None and os.path.isfile(path))


def _request_name(wanted: Request) -> str:
    # two installations have files of their own
    known = [wanted.definition, wanted.parameters, wanted.real, wanted.math, str(ABI), os.path.dirname(__file__)]
    return hashlib.sha256("\n".join(known).encode()).hexdigest()


def _machine_name() -> str:
    # what `find_compiler` reads
    return _machine_of(*(os.environ.get(name) for name in ("CC", "OPTSAT_CFLAGS", "PATH")))


@cache
def _machine_of(*_environment: str | None) -> str:
    try:
        compiler = compiler_identity(find_compiler())
    except CompilerMissingError:
        return ""
    return hashlib.sha256(f"{identity()}\n{compiler}".encode()).hexdigest()[:32]
