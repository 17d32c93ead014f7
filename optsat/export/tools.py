"""Tools: compilers, binary tools and simulators, run without a shell in an environment of their own."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from optsat.errors import OptsatError
from optsat.kernels.toolchain import PASSED_ON


class ToolError(OptsatError):
    """A compiler, a binary tool or a simulator failed; the message holds what it said."""


def find_tool(*names: str) -> str | None:
    """Return the path of the first program that is there."""
    return next((path for name in names if (path := shutil.which(name))), None)


def run_tool(command: Sequence[str], folder: Path, time_limit: float = 120.0, accept: Sequence[int] = (0,)) -> str:
    """Return what a program printed; it runs in `folder`, where it may leave files.

    time_limit : after which it is stopped [s]; accept : exit codes that are no failure

    Raises
    ------
    ToolError : it cannot be run, fails, or takes too long.
    """
    environment = {name: os.environ[name] for name in PASSED_ON if name in os.environ} | {"LC_ALL": "C"}
    try:
        done = subprocess.run(
            list(command),
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            timeout=time_limit,
            check=False,
        )
    except OSError as error:
        raise ToolError(f"{command[0]} cannot be run: {error}.") from None
    except subprocess.TimeoutExpired:
        raise ToolError(f"{command[0]} took longer than {time_limit:g} s and was stopped.") from None
    if done.returncode not in accept:
        about = ", ".join(word for word in command[1:] if word.endswith((".c", ".o"))) or command[-1]
        said = done.stdout.strip()
        raise ToolError(f"{command[0]} failed on {about} with status {done.returncode} and said:\n{said}")
    return done.stdout
