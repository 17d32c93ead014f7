"""Leave the result of a study in a folder, whole or not at all."""

import csv
import io
import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

from optsat._version import __version__
from optsat.campaign.result import StudyResult
from optsat.campaign.threads import THREAD_VARIABLES
from optsat.files import write_atomically


def write_result(result: StudyResult, folder: Path, command: Sequence[str]) -> None:
    """Write `rows.csv` and then `result.json` into `folder`, which is made if absent.

    rows.csv : case, failure (empty where the case ran), then the study's columns; numbers with all digits
    result.json : the summary, the failed cases, and the provenance: versions, platform, threads, command
    """
    folder.mkdir(parents=True, exist_ok=True)
    document = {
        **result.summary(),
        "failed_cases": [asdict(failure) for failure in result.failures],
        "provenance": provenance(command),
    }
    write_atomically(folder / "rows.csv", _rows_as_csv(result).encode())
    write_atomically(folder / "result.json", (json.dumps(document, indent=2, allow_nan=False) + "\n").encode())


def provenance(command: Sequence[str]) -> dict[str, Any]:
    """Return what else a reader needs to run the same again."""
    return {
        "optsat": __version__,
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("numpy", "scipy", "casadi")},
        "platform": platform.platform(),
        "threads": {name: os.environ.get(name) for name in THREAD_VARIABLES},
        "command": list(command),
    }


def _rows_as_csv(result: StudyResult) -> str:
    columns = [name for name in (result.rows[0] if result.rows else ()) if name != "case"]
    lines: dict[Any, list[Any]] = {
        row["case"]: [row["case"], "", *(row[name] for name in columns)] for row in result.rows
    }
    for failure in result.failures:
        lines[failure.case] = [failure.case, f"{failure.error}: {failure.message}", *[""] * len(columns)]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["case", "failure", *columns])
    table.writerows(lines[case] for case in sorted(lines))
    return text.getvalue()
