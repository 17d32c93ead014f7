"""Toolchain: find the C compiler and run it so that it keeps the bits."""

import os
import platform
import shlex
import shutil
import signal
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from optsat.errors import InputError, OptsatError
from optsat.kernels.codes import LIBM

CANDIDATES = ("cc", "gcc", "clang")

# a compiler that knows a function evaluates it on constants in its own way, up to one unit in the last place off
# on x86, gcc 12 joins products into alternating sums and differences (vfmaddsub) even with -ffp-contract=off
_NO_FUSED_PRODUCTS = ("-mno-fma",) if platform.machine().lower() in ("x86_64", "amd64", "i386", "i686") else ()

KEEP_BITS = (
    "-std=c99",
    "-ffp-contract=off",
    *_NO_FUSED_PRODUCTS,
    *(f"-fno-builtin-{name}{suffix}" for name in sorted(set(LIBM.values())) for suffix in ("", "f")),
)
"""Flags that every kernel is compiled with, after all others."""

BREAK_BITS = (
    "-Ofast",
    "-ffast-math",
    "-funsafe-math-optimizations",
    "-fassociative-math",
    "-freciprocal-math",
    "-ffinite-math-only",
    "-fno-signed-zeros",
    "-fno-honor-nans",
    "-fno-honor-infinities",
    "-ffp-model=fast",
    "-fapprox-func",
    "-mdaz-ftz",
)
"""Flags that no later flag makes good again."""

PASSED_ON = ("PATH", "HOME", "TMPDIR", "TEMP", "TMP", "SYSTEMROOT", "SDKROOT", "DEVELOPER_DIR")


class CompilerMissingError(OptsatError):
    """No C compiler was found; the message says how to bring one."""


class CompilationError(OptsatError):
    """The C compiler failed or ran out of time; the message holds what it said."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its command with the leading arguments, and the user's own flags."""

    command: tuple[str, ...]
    flags: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for flag in (*self.command[1:], *self.flags):
            if flag.startswith(BREAK_BITS):
                raise InputError(
                    f"The compiler flag {flag} changes results (NaN, signed zeros, order of operations). "
                    "Take it out of CC or OPTSAT_CFLAGS."
                )

    def build_library(self, source: str, library: Path, optimisation: str = "-O2", time_limit: float = 120.0) -> None:
        """Compile C text to a shared library.

        time_limit : after which the compiler is stopped [s]

        Raises
        ------
        CompilationError : the compiler fails, cannot be run, or takes too long; no library is left.
        """
        arguments = [
            *(*self.command, optimisation, *self.flags, *KEEP_BITS),
            *("-fPIC", "-shared", "-x", "c", "-", "-o", str(library), "-lm"),
        ]
        environment = {name: os.environ[name] for name in PASSED_ON if name in os.environ} | {"LC_ALL": "C"}
        try:
            process = subprocess.Popen(
                arguments,
                env=environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                encoding="utf-8",
                errors="replace",
                start_new_session=True,
            )
        except OSError as error:
            raise CompilationError(f"{self} cannot be run: {error}.") from None
        try:
            said, _ = process.communicate(source, timeout=time_limit)
        except subprocess.TimeoutExpired:
            _stop(process)
            library.unlink(missing_ok=True)
            raise CompilationError(
                f"{self} took longer than {time_limit:g} s. Make the kernel smaller, or allow it more time."
            ) from None
        if process.returncode != 0:
            library.unlink(missing_ok=True)
            raise CompilationError(f"{self} failed with status {process.returncode} and said:\n{said.strip()}")

    def __str__(self) -> str:
        return shlex.join(self.command)


def find_compiler(environment: Mapping[str, str] | None = None) -> Compiler:
    """Return the compiler that CC names, else the first of cc, gcc and clang on the path, with the flags OPTSAT_CFLAGS.

    environment : `os.environ` unless given

    Raises
    ------
    CompilerMissingError : CC names no program, or none of the usual ones is there.
    InputError : CC or OPTSAT_CFLAGS holds a flag that changes results.
    """
    known = os.environ if environment is None else environment
    flags = tuple(shlex.split(known.get("OPTSAT_CFLAGS", "")))
    if wanted := shlex.split(known.get("CC", "")):
        program = shutil.which(wanted[0], path=known.get("PATH"))
        if program is None:
            raise CompilerMissingError(f"CC names {wanted[0]}, which is not on the path. Correct it, or unset CC.")
        return Compiler((program, *wanted[1:]), flags)
    for name in CANDIDATES:
        if program := shutil.which(name, path=known.get("PATH")):
            return Compiler((program,), flags)
    raise CompilerMissingError(
        f"No C compiler: none of {', '.join(CANDIDATES)} is on the path. Install gcc or clang, or let CC name one."
    )


def _stop(process: "subprocess.Popen[str]") -> None:
    # the driver's own children hold the pipes
    if hasattr(os, "killpg"):
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.communicate()
