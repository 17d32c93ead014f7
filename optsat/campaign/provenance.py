"""Provenance: what a reader needs to run the same again."""

import functools
import os
import platform
import subprocess
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from optsat._version import __version__
from optsat.campaign.threads import THREAD_VARIABLES

_PACKAGES = ("numpy", "scipy", "casadi", "h5netcdf", "h5py", "distributed")


def provenance(command: Sequence[str]) -> dict[str, Any]:
    """Return versions, commit, machine, threads and the command of this process."""
    return {
        "optsat": __version__,
        "commit": commit(),
        "python": platform.python_version(),
        **{name: _version(name) for name in _PACKAGES},
        "platform": platform.platform(),
        "cores": os.cpu_count(),
        "threads": {name: os.environ.get(name) for name in THREAD_VARIABLES},
        "command": list(command),
    }


@functools.cache
def commit(root: Path = Path(__file__).parents[2]) -> str | None:
    """Return the commit of the checkout that runs, with "+changes" where files differ from it; None outside of one."""
    if not (root / ".git").exists():
        return None
    try:
        head = _git(root, "rev-parse", "HEAD")
        changed = _git(root, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.CalledProcessError):
        return None
    return head + ("+changes" if changed else "")


def _git(root: Path, *arguments: str) -> str:
    done = subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
