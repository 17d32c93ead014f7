"""Store: the end of a run, written once all its chunks are on the disk, and read back with every digest checked.

result.nc      every case, where the extra `results` is installed
summary.csv    every case as text
figure.svg     where the study draws one
complete.json  last: digests of all these and of the content, the summary with its claims, failed cases
"""

import csv
import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from optsat.campaign.case_blocks import case_blocks, content_hash, result_kinds
from optsat.campaign.final_file import write_final_file
from optsat.campaign.result import StudyResult
from optsat.campaign.rows import Cases
from optsat.campaign.run_folder import COMPLETE, RunFolder
from optsat.campaign.study import Study
from optsat.errors import OptsatError
from optsat.files import atomic_stream, durable_step, write_atomically

RESULT, SUMMARY, FIGURE = "result.nc", "summary.csv", "figure.svg"


def finish(study: Study, folder: RunFolder, result: StudyResult, cases: Cases) -> None:
    """Write the final files of a run whose chunks are all there."""
    written = [SUMMARY]
    if find_spec("h5netcdf") is not None:
        attributes = {"study": study.name, "version": study.version, "seed": result.seed}
        write_final_file(folder.path / RESULT, cases, result.cases, attributes)
        written.append(RESULT)
    with atomic_stream(folder.path / SUMMARY) as stream:
        _write_csv(stream, cases, result.cases)
    if study.figure is not None and result.rows:
        study.figure(result.rows, folder.path / FIGURE)
        written.append(FIGURE)
    document = {
        "run": folder.run,
        "title": study.title,
        **result.summary(),
        "failed_cases": [asdict(failure) for failure in result.failures],
        "content": content_hash(cases, result.cases),
        "files": {name: _digest(folder.path / name) for name in sorted(written)},
    }
    write_atomically(folder.path / COMPLETE, (json.dumps(document, indent=2, allow_nan=False) + "\n").encode())
    folder.manifest.append("finished")


def check_finished(folder: RunFolder) -> None:
    """Check the digests of the files of a complete run.

    Raises
    ------
    OptsatError : a file has changed or is gone.
    """
    check_files(folder.path, json.loads((folder.path / COMPLETE).read_text(encoding="utf-8")))


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


def _write_csv(stream: BinaryIO, cases: Cases, count: int) -> None:
    names = [name for name, kind in result_kinds(cases).items() if not kind.shape]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["case", "failure", *names])
    for start, block in case_blocks(cases, count):
        stop = start + len(block["status"])
        lists = [range(start, stop), block["failure"], *(block[name].tolist() for name in names)]
        lines = list(zip(*lists, strict=True))
        for failed in np.flatnonzero(block["status"]):
            lines[failed] = (*lines[failed][:2], *[""] * len(names))
        table.writerows(lines)
        stream.write(text.getvalue().encode())
        text.seek(0)
        text.truncate()
    durable_step()
