"""Run folder: what a campaign leaves on the disk, so that no finished chunk is lost or computed twice.

run.json     identity and provenance, written first
lock         held by the runner
chunks/      one file a finished chunk; a file with a valid digest is the truth about it
manifest     history, one line an event
quarantine/  files that failed their check, moved, never deleted
"""

import contextlib
import dataclasses
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from optsat.campaign.chunk_file import ChunkError, Columns, read_chunk, write_chunk
from optsat.campaign.folder_lock import locked
from optsat.campaign.manifest import Manifest
from optsat.campaign.numerics import check_same
from optsat.errors import InputError
from optsat.files import write_atomically

COMPLETE = "complete.json"
# result.nc is as large as the chunks, and a number as text takes twice its eight bytes
_FINAL_FILES = 3
_REPLACEABLE = {"optsat", "source"}
_RUN, _CHUNKS, _QUARANTINE, _MANIFEST = "run.json", "chunks", "quarantine", "manifest"


Changes: TypeAlias = dict[str, list[Any]]
"""Fields of an identity that differ: what they were, and what they are now."""


@dataclass(frozen=True)
class Identity:
    """What a result depends on: nothing else may change a byte of it.

    source : SHA-256 of the file that defines the study
    """

    study: str
    version: int
    seed: int
    cases: int
    optsat: str
    source: str

    @property
    def run(self) -> str:
        """A short name for it, the same wherever it runs."""
        text = json.dumps(dataclasses.asdict(self), separators=(",", ":"), sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


class RunFolder:
    """An open run folder; `open_run` makes one and holds its lock."""

    def __init__(self, path: Path, run: str, chunk_size: int, cases: int, mixed_machines: bool = False) -> None:
        self.path, self.run, self.chunk_size, self.mixed_machines = path, run, chunk_size, mixed_machines
        self.count = -(-cases // chunk_size)
        self.manifest = Manifest(path / _MANIFEST)
        self._finished = self._examine()
        events = self.manifest.read()
        self.numerics: str = next((event["print"] for event in events if event["event"] == "numerics"), "")

    def is_complete(self) -> bool:
        """Return whether the final files are there; `finished_result` checks them."""
        return (self.path / COMPLETE).exists() and len(self._finished) == self.count

    @property
    def finished(self) -> frozenset[int]:
        """Chunks that are on the disk, whole."""
        return frozenset(self._finished)

    def bytes_needed(self) -> int:
        """Return about how many bytes the rest of the run takes: missing chunks, and the final files of all.

        A guess from the chunks that are there; 0 where none is.
        """
        sizes = [self._file(chunk).stat().st_size for chunk in self._finished]
        mean = sum(sizes) / len(sizes) if sizes else 0.0
        return round(mean * (self.count - len(sizes) + _FINAL_FILES * self.count))

    def check_numerics(self, found: str, chunk: int) -> None:
        """Refuse results of another arithmetic than the first chunk's; a case that crashed has none.

        Raises
        ------
        OptsatError : the prints differ, and the mixture was not allowed.
        """
        if not found or found == self.numerics:
            return
        if not self.numerics:
            self.numerics = found
            self.manifest.append("numerics", print=found)
        elif self.mixed_machines:
            self.manifest.append("other numerics", print=found, chunk=chunk)
        else:
            check_same(self.numerics, found, f"What ran chunk {chunk}")

    def store(self, chunk: int, columns: Columns) -> None:
        """Write a finished chunk; when this returns it survives whatever happens."""
        data = write_chunk(self.run, chunk, columns)
        write_atomically(self._file(chunk), data)
        self._finished.add(chunk)
        self.manifest.append("chunk", chunk=chunk, sha256=hashlib.sha256(data).hexdigest())

    def load(self, chunk: int) -> Columns:
        """Return the columns of a finished chunk.

        Raises
        ------
        ChunkError : its file has changed since the folder was opened.
        """
        return read_chunk(self._file(chunk).read_bytes(), self.run, chunk)

    def _file(self, chunk: int) -> Path:
        return self.path / _CHUNKS / f"{chunk:06d}"

    def _examine(self) -> set[int]:
        """Return the chunks with a valid file; move aside what is none, and delete what a killed runner left half."""
        self.manifest.repair()
        for leftover in self.path.glob(".*"):
            leftover.unlink()
        finished = set()
        for file in sorted((self.path / _CHUNKS).iterdir()):
            if file.name.startswith("."):
                file.unlink()
                continue
            try:
                chunk = int(file.name)
                if file.name != f"{chunk:06d}" or chunk >= self.count:
                    raise ChunkError("its name is that of no chunk of this run")
                read_chunk(file.read_bytes(), self.run, chunk)
                finished.add(chunk)
            except (ValueError, ChunkError) as error:
                self._set_aside(file, str(error))
        return finished

    def _set_aside(self, file: Path, reason: str) -> None:
        quarantine = self.path / _QUARANTINE
        quarantine.mkdir(exist_ok=True)
        taken = sum(each.name.startswith(f"{file.name}.") for each in quarantine.iterdir())
        file.rename(quarantine / f"{file.name}.{taken}")
        self.manifest.append("quarantined", file=file.name, reason=reason)


@contextlib.contextmanager
def open_run(
    path: Path,
    identity: Identity,
    choose_chunk_size: Callable[[], int],
    provenance: Mapping[str, Any],
    resume: bool = False,
    mixed_machines: bool = False,
    accept_version: bool = False,
) -> Iterator[RunFolder]:
    """Make a run folder, or take up the one that is there, and hold its lock.

    choose_chunk_size : cases a chunk, asked for a new folder only; one that is there keeps its own
    resume : allow to go on with an unfinished run
    mixed_machines : take results of another arithmetic, and write down which
    accept_version : go on with a run that another version of optsat or of the study's file began, and write that down

    Raises
    ------
    InputError : another runner is at it, it holds something else or another run, or it is unfinished and `resume`
        is not given.
    OSError : the folder cannot be made or written.
    """
    path.mkdir(parents=True, exist_ok=True)
    ours = {"lock", _CHUNKS}
    if not (path / _RUN).exists() and any(f.name not in ours and f.name[:1] != "." for f in path.iterdir()):
        raise InputError(f"{path} holds other files and no run. Choose an empty or a new folder.")
    with locked(path):
        (path / _CHUNKS).mkdir(exist_ok=True)
        accepted: Changes = {}
        if not (path / _RUN).exists():
            run, chunk_size = identity.run, choose_chunk_size()
            document = {"run": run, "chunk_size": chunk_size, "identity": dataclasses.asdict(identity)}
            document["provenance"] = dict(provenance)
            write_atomically(path / _RUN, (json.dumps(document, indent=2) + "\n").encode())
            event = "started"
        else:
            run, chunk_size, accepted = _checked(path, identity, resume, accept_version)
            event = "resumed"
        folder = RunFolder(path, run, chunk_size, identity.cases, mixed_machines)
        if accepted:
            folder.manifest.append("accepted", changed=accepted)
        folder.manifest.append(event, finished=len(folder.finished), **dict(provenance))
        yield folder


def _checked(path: Path, identity: Identity, resume: bool, accept_version: bool) -> tuple[str, int, Changes]:
    """Return the name and chunk size of the run that is there, if it is this one, and what was accepted as new."""
    try:
        document = json.loads((path / _RUN).read_text(encoding="utf-8"))
        there, run, chunk_size = dict(document["identity"]), str(document["run"]), int(document["chunk_size"])
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path / _RUN} cannot be read ({error}). Choose another folder.") from None
    wanted = dataclasses.asdict(identity)
    changed = {name: [there.get(name), wanted[name]] for name in wanted if there.get(name) != wanted[name]}
    only_versions = changed.keys() <= _REPLACEABLE
    if changed and not (accept_version and only_versions):
        listed = "; ".join(f"{name} {old!r} -> {new!r}" for name, (old, new) in changed.items())
        advice = ", or take the rest from this version with --accept-version" if only_versions else ""
        raise InputError(
            f"{path} holds another run; what differs (there -> now): {listed}. Choose another folder{advice}."
        )
    if not resume and not (path / COMPLETE).exists():
        raise InputError(f"{path} holds an unfinished run of this study. Add --resume to go on with it.")
    return run, chunk_size, changed
