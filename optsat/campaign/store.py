"""Store: the end of a run, written once all its chunks are on the disk, and read back with every digest checked.

result.nc      every case, where the extra `results` is installed
summary.csv    every case as text
figure.svg     where the study draws one
complete.json  last: digests of all these, the summary with its claims, failed cases
"""

import csv
import hashlib
import io
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from optsat.campaign.final_file import write_final_file
from optsat.campaign.result import StudyResult
from optsat.campaign.run_folder import COMPLETE, RunFolder
from optsat.campaign.study import Study
from optsat.campaign.table import Table
from optsat.errors import OptsatError
from optsat.files import write_atomically

RESULT, SUMMARY, FIGURE = "result.nc", "summary.csv", "figure.svg"


def finish(study: Study, folder: RunFolder, result: StudyResult, tables: Callable[[], Iterator[Table]]) -> None:
    """Write the final files of a run whose chunks are all there."""
    written = [SUMMARY]
    if find_spec("h5netcdf") is not None:
        attributes = {"study": study.name, "version": study.version, "seed": result.seed}
        write_final_file(folder.path / RESULT, tables, result.cases, attributes)
        written.append(RESULT)
    write_atomically(folder.path / SUMMARY, _rows_as_csv(result).encode())
    if study.figure is not None and result.rows:
        study.figure(result.rows, folder.path / FIGURE)
        written.append(FIGURE)
    document = {
        "run": folder.run,
        "title": study.title,
        **result.summary(),
        "failed_cases": [asdict(failure) for failure in result.failures],
        "files": {name: _digest(folder.path / name) for name in sorted(written)},
    }
    write_atomically(folder.path / COMPLETE, (json.dumps(document, indent=2, allow_nan=False) + "\n").encode())
    folder.manifest.append("finished")


def finished_result(study: Study, folder: RunFolder, result: StudyResult) -> StudyResult:
    """Return the result of a complete run after checking the digests of its files.

    Raises
    ------
    OptsatError : a file has changed or is gone.
    """
    check_files(folder.path, json.loads((folder.path / COMPLETE).read_text(encoding="utf-8")))
    return result


def check_files(path: Path, document: Mapping[str, Any]) -> None:
    """Check the files of a complete run in the folder `path` against the digests of its complete.json.

    Raises
    ------
    OptsatError : a file has changed or is gone.
    """
    for name, digest in document["files"].items():
        if not (path / name).exists() or _digest(path / name) != digest:
            raise OptsatError(
                f"{path / name} is not the file that the run of {document['study']} wrote. Delete {COMPLETE} there and "
                "run again with --resume to write it anew from the chunks."
            )


def _digest(file: Path) -> dict[str, Any]:
    sha256, size = hashlib.sha256(), 0
    with file.open("rb") as stream:
        while block := stream.read(1 << 20):
            sha256.update(block)
            size += len(block)
    return {"bytes": size, "sha256": sha256.hexdigest()}


def _rows_as_csv(result: StudyResult) -> str:
    first = result.rows[0] if result.rows else {}
    columns = [name for name, value in first.items() if name != "case" and not hasattr(value, "shape")]
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
