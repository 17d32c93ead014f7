"""Provenance: what a reader needs to run the same again."""

import os
import platform
from collections.abc import Sequence
from importlib import metadata
from typing import Any

from optsat._version import __version__
from optsat.campaign.threads import THREAD_VARIABLES


def provenance(command: Sequence[str]) -> dict[str, Any]:
    """Return versions, platform, threads and the command of this process."""
    return {
        "optsat": __version__,
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("numpy", "scipy", "casadi")},
        "platform": platform.platform(),
        "threads": {name: os.environ.get(name) for name in THREAD_VARIABLES},
        "command": list(command),
    }
