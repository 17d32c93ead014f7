"""Finished run: what a run folder says once its campaign is complete, read back and checked."""

import csv
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from optsat.campaign.claim import Claim, Verdict
from optsat.campaign.manifest import Manifest
from optsat.campaign.result import Failure
from optsat.campaign.run_folder import COMPLETE, Identity
from optsat.campaign.store import FIGURE, RESULT, SUMMARY, check_files
from optsat.errors import InputError, OptsatError

_RUN = "run.json"
_PRINTS = ("numerics", "other numerics")
Read = TypeVar("Read")


@dataclass(frozen=True)
class FinishedRun:
    """A complete run.

    metrics : figures; NaN where one was not finite
    columns : scalars of the cases that ran, the case's number first, each (cases that ran,)
    digests : size and SHA-256 of each of its files
    numerics : prints of the arithmetic that computed it, the first chunk's first; one where all bits are comparable
    provenance : of the start; no result depends on it
    content : hash of all values, which unlike the digests does not change with the libraries that write files
    """

    path: Path
    identity: Identity
    title: str
    metrics: Mapping[str, float]
    claims: tuple[Claim, ...]
    failures: tuple[Failure, ...]
    columns: Mapping[str, NDArray[Any]]
    digests: Mapping[str, Mapping[str, Any]]
    numerics: tuple[str, ...]
    provenance: Mapping[str, Any]
    content: str

    @property
    def command(self) -> str:
        """What repeats it."""
        return f"optsat study run {self.identity.study} --cases {self.identity.cases} --seed {self.identity.seed}"

    @property
    def figure(self) -> bytes | None:
        """The SVG that the study drew, if it draws one."""
        return (self.path / FIGURE).read_bytes() if FIGURE in self.digests else None

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the columns of result.nc that hold an array a case, of the cases that ran; none without that file.

        Raises
        ------
        ImportError : h5netcdf is absent.
        """
        if RESULT not in self.digests:
            return {}
        import h5netcdf

        with h5netcdf.File(self.path / RESULT, "r") as file:
            ran = np.asarray(file.variables["status"][...]) == 0
            return {
                name: np.asarray(variable[...])[ran]
                for name, variable in file.variables.items()
                if len(variable.dimensions) > 1
            }


def read_run(path: Path) -> FinishedRun:
    """Return the complete run in the folder `path`.

    Raises
    ------
    InputError : there is no run, it is not complete, or its documents cannot be read or do not belong together.
    OptsatError : a file is not the one that the run wrote.
    """
    if not (path / _RUN).exists():
        raise InputError(f"{path} holds no run of a study; `optsat study run NAME --out {path}` makes one.")
    start = _document(path / _RUN, _start)
    if not (path / COMPLETE).exists():
        raise InputError(
            f"The run in {path} is not complete. Finish it: optsat study run {start.identity.study} "
            f"--cases {start.identity.cases} --seed {start.identity.seed} --out {path} --resume"
        )
    end = _document(path / COMPLETE, _end)
    if end.run != start.identity.run or start.run != start.identity.run:
        raise OptsatError(f"{path / _RUN} and {path / COMPLETE} are not of the same run.")
    check_files(path, {"study": start.identity.study, "files": end.digests})
    return FinishedRun(
        path,
        start.identity,
        end.title,
        end.metrics,
        end.claims,
        end.failures,
        _columns(path / SUMMARY),
        end.digests,
        tuple(dict.fromkeys(e["print"] for e in Manifest(path / "manifest").read() if e["event"] in _PRINTS)),
        start.provenance,
        end.content,
    )


@dataclass(frozen=True)
class _Start:
    run: str
    identity: Identity
    provenance: Mapping[str, Any]


def _start(document: Any) -> _Start:
    identity = Identity(**document["identity"])
    return _Start(str(document["run"]), identity, dict(document["provenance"]))


@dataclass(frozen=True)
class _End:
    run: str
    title: str
    metrics: Mapping[str, float]
    claims: tuple[Claim, ...]
    failures: tuple[Failure, ...]
    digests: Mapping[str, Mapping[str, Any]]
    content: str


def _end(document: Any) -> _End:
    files = {str(name): dict(digest) for name, digest in document["files"].items()}
    if SUMMARY not in files or not files.keys() <= {SUMMARY, RESULT, FIGURE}:
        raise ValueError(f"it lists the files {', '.join(files)}")
    return _End(
        str(document["run"]),
        str(document["title"]),
        {str(name): _number(value) for name, value in document["metrics"].items()},
        tuple(_claim(claim) for claim in document["claims"]),
        tuple(Failure(int(f["case"]), str(f["error"]), str(f["message"])) for f in document["failed_cases"]),
        files,
        str(document["content"]),
    )


def _document(path: Path, read: Callable[[Any], Read]) -> Read:
    try:
        return read(json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path} cannot be read as the document of a run ({type(error).__name__}: {error}).") from None


def _claim(claim: Mapping[str, Any]) -> Claim:
    measured = math.nan if claim["measured"] is None else claim["measured"]
    interval = None if claim["interval"] is None else tuple(_number(end) for end in claim["interval"])
    if interval is not None and len(interval) != 2:
        raise ValueError(f"the interval {interval} of a claim has no two ends")
    return Claim(str(claim["id"]), str(claim["says"]), claim["paper"], measured, Verdict(claim["verdict"]), interval)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _columns(path: Path) -> dict[str, NDArray[Any]]:
    with path.open(encoding="utf-8", newline="") as stream:
        lines = csv.reader(stream)
        names = next(lines)
        place = names.index("failure")
        cells: list[list[str]] = [[] for _ in names]
        for line in lines:
            if not line[place]:
                for column, cell in zip(cells, line, strict=True):
                    column.append(cell)
    return {name: _typed(column) for k, (name, column) in enumerate(zip(names, cells, strict=True)) if k != place}


def _typed(cells: list[str]) -> NDArray[Any]:
    """Return whole numbers, numbers, truth values or words, whichever all cells are."""
    if set(cells) <= {"True", "False"} and cells:
        return np.array([cell == "True" for cell in cells])
    for kind in (np.int64, np.float64):
        try:
            return np.array(cells, dtype=np.str_).astype(kind)
        except (ValueError, OverflowError):
            continue
    return np.array(cells)
