"""Fingerprint: what a C compiler is and makes on this machine, found out once and remembered beside the kernels."""

import hashlib
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path

from optsat.errors import OptsatError
from optsat.files import write_atomically
from optsat.kernels.folders import searched_folders, writable_folders
from optsat.kernels.processor import features, identity
from optsat.kernels.toolchain import PASSED_ON, CompilationError, Compiler

PROBE = 0xC1EAC06554D0FE37
"""What `os_probe` returns where arithmetic is that of IEEE 754, as tests/unit/kernels/test_fingerprint.py works out."""

# errno and trap flags, which no kernel reads, would keep square roots and choices from being one instruction
_HARMLESS = ("-fno-math-errno", "-fno-trapping-math")
_NEXT_TO = ("-target-cpu", "-target-feature", "-triple", "--param")
_NOT_THE_PROCESSOR = ("-mllvm", "-main-file-name", "-mrelocation-model")
_TIME_LIMIT = 30.0  # seconds, for questions that take milliseconds


class CompilerRefusedError(OptsatError):
    """The C compiler does not compute as IEEE 754 asks, so that its kernels would return other numbers."""


@dataclass(frozen=True)
class Fingerprint:
    """A compiler on this machine.

    version : its own words; flags : what it understands of the flags for this processor
    target : the processor that these flags stand for, in the compiler's words
    refused : why its kernels would be wrong, "" where they are right
    """

    version: str
    flags: tuple[str, ...]
    target: tuple[str, ...]
    refused: str = ""

    def checked(self) -> "Fingerprint":
        """Return the fingerprint of a compiler that can be used.

        Raises
        ------
        CompilerRefusedError : it cannot.
        """
        if self.refused:
            raise CompilerRefusedError(self.refused)
        return self


def fingerprint(compiler: Compiler) -> Fingerprint:
    """Return the fingerprint; a compiler is questioned once, and again when it, its flags or the machine change.

    Raises
    ------
    CompilationError : it cannot be run, or compiles nothing.
    """
    return _fingerprint(compiler, compiler_identity(compiler))


def compiler_identity(compiler: Compiler) -> str:
    """Return a digest that changes with the program, its flags, the machine and this examination; nothing is run."""
    try:
        status = os.stat(compiler.command[0])
        file = [os.path.realpath(compiler.command[0]), str(status.st_size), str(status.st_mtime_ns)]
    except OSError:
        file = []
    known = [*file, *compiler.command, "", *compiler.flags, "", identity(), *_HARMLESS, f"{PROBE:x}"]
    return hashlib.sha256("\n".join(known).encode()).hexdigest()


def tuned(compiler: Compiler, found: Fingerprint) -> Compiler:
    """Return the compiler with the flags for this processor, which the user's own flags may override."""
    return replace(compiler, flags=(*found.flags, *compiler.flags))


@cache
def _fingerprint(compiler: Compiler, name: str) -> Fingerprint:
    file = f"compiler-{name}.json"
    for folder in searched_folders():
        try:
            document = json.loads((folder / file).read_text(encoding="utf-8"))
            document.update({key: tuple(document[key]) for key in ("flags", "target")})
            return Fingerprint(**document)
        except (OSError, ValueError, TypeError, KeyError):
            continue
    found = _examined(compiler)
    for folder in writable_folders():
        try:
            write_atomically(folder / file, json.dumps(asdict(found)).encode(), mode=0o600)
            break
        except OSError:
            continue
    return found


def _examined(compiler: Compiler) -> Fingerprint:
    version = _said(compiler, "--version").strip()
    text = resources.files("optsat.kernels.c").joinpath("os_probe.c").read_text(encoding="utf-8")
    failure: CompilationError | None = None
    with tempfile.TemporaryDirectory(prefix="optsat-") as folder:
        library = Path(folder, "probe.so")
        for flags in _candidates():
            try:
                replace(compiler, flags=(*flags, *compiler.flags)).build_library(text, library)
            except CompilationError as error:
                failure = error
                continue
            target = tuple(_target(_said(compiler, *flags, *compiler.flags, "-###", "-x", "c", "-c", os.devnull)))
            return Fingerprint(version, flags, target, _refusal(compiler, library))
    raise failure or CompilationError(f"{compiler} compiles nothing.")


def _candidates() -> list[tuple[str, ...]]:
    wide = ("-mprefer-vector-width=512",) if "avx512f" in features() else ()
    native = "-march=native" if platform.machine() in ("x86_64", "AMD64", "i686") else "-mcpu=native"
    return [(native, *wide, *_HARMLESS), (native, *_HARMLESS), _HARMLESS, ()]


def _refusal(compiler: Compiler, library: Path) -> str:
    # in a process of its own: the mere loading of code made with -ffast-math changes the arithmetic of all the rest
    program = "import ctypes, sys; f = ctypes.CDLL(sys.argv[1]).os_probe; f.restype = ctypes.c_uint64; print(f())"
    said = _run([sys.executable, "-I", "-S", "-c", program, str(library)])
    if said.strip() == str(PROBE):
        return ""
    return (
        f"{compiler} does not compute as IEEE 754 asks (its probe says {said.strip()[-200:]}, not {PROBE}), so kernels "
        "would return other numbers. Take flags that change results out of CC and OPTSAT_CFLAGS, or let CC name "
        "another compiler."
    )


def _said(compiler: Compiler, *arguments: str) -> str:
    try:
        return _run([*compiler.command, *arguments])
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CompilationError(f"{compiler} cannot be run: {error}.") from None


def _run(command: Sequence[str]) -> str:
    done = subprocess.run(
        command,
        env={name: os.environ[name] for name in PASSED_ON if name in os.environ} | {"LC_ALL": "C"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="replace",
        timeout=_TIME_LIMIT,
        check=False,
    )
    return done.stdout


def _target(said: str) -> list[str]:
    # of the compiler proper, the words about the processor; the rest names files and folders
    words = next((line.split() for line in said.splitlines() if "cc1" in line), [])
    words = [word.strip('"') for word in words]
    chosen = []
    each = iter(words)
    for word in each:
        if word in _NEXT_TO:
            chosen.append(f"{word} {next(each, '')}")
        elif word.startswith("-m") and word not in _NOT_THE_PROCESSOR:
            chosen.append(word)
    return chosen
