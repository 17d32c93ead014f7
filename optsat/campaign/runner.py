"""Run a study: every case once, here or in worker processes, with the same rows either way, and no result lost."""

import contextlib
import functools
import hashlib
import importlib
import inspect
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from optsat._version import __version__
from optsat.campaign.executors import Chunk, Executor, Outcomes, Processes, Serial, Task
from optsat.campaign.numerics import numerics_print
from optsat.campaign.provenance import provenance
from optsat.campaign.result import Failure, StudyResult
from optsat.campaign.run_folder import Identity, RunFolder, open_run
from optsat.campaign.seeds import campaign_key, case_generator
from optsat.campaign.store import finish, finished_result
from optsat.campaign.study import Case, Row, Study
from optsat.campaign.table import Table
from optsat.errors import InputError, OptsatError

# What a computation may raise on unlucky data. Anything else (a TypeError, a misspelt name) is a mistake in the
# study and stops the campaign with its traceback.
_CASE_ERRORS = (OptsatError, ArithmeticError, ValueError, RuntimeError)

_CHUNK_S = 2.0
_WARM_S = 1.0
_MOST_CASES_A_CHUNK = 4096
_LEAST_CHUNKS_A_WORKER = 4

Progress = Callable[[int, int], None]


def run_study(
    study: Study,
    cases: int | None = None,
    seed: int = 0,
    workers: int = 1,
    progress: Progress | None = None,
    out: Path | None = None,
    resume: bool = False,
    executor: Executor | None = None,
    mixed_machines: bool = False,
) -> StudyResult:
    """Return the result of a study over its first `cases` cases.

    A case that raises is kept as a `Failure` and the campaign goes on. The rows do not depend on `workers`; only
    where a case calls BLAS on large matrices start Python with OMP_NUM_THREADS=1, which workers have anyway.
    `progress(done, total)` is called as cases finish.

    out : folder that keeps every finished chunk; a run that is complete there is read, not run again
    resume : go on with an unfinished run in `out`
    executor : where the chunks are run; `workers` processes of this machine unless given
    mixed_machines : take results of machines with another arithmetic into one run; the manifest says which

    Raises
    ------
    InputError : `cases` or `workers` below 1, `seed` negative, a study that workers cannot import, or a folder that
        cannot be used.
    """
    count = study.default_cases if cases is None else cases
    if count < 1 or workers < 1 or seed < 0:
        raise InputError(
            "`cases` and `workers` must be at least 1 and `seed` at least 0, "
            f"got cases={count}, workers={workers}, seed={seed}."
        )
    design = study.cases(count)
    if len(design) != count:
        raise InputError(f"study {study.name} laid out {len(design)} cases where {count} were asked for.")
    if executor is None:
        executor = Processes(workers) if workers > 1 else Serial()
    task = _task(study, design, count, seed, executor)
    if out is None:
        chunks = _chunks(count, max(1, min(64, count // (8 * workers))) if workers > 1 else 1)
        tables: dict[int, Table] = {}
        for chunk, outcomes in _reported(executor.run(task, chunks), progress, count, 0):
            tables[chunk.index] = Table.of(study.name, outcomes.cases)
        return _assembled(study, seed, count, [tables[index] for index in sorted(tables)])
    identity = Identity(study.name, study.version, seed, count, __version__, _source_hash(study))
    size = functools.partial(_chunk_size, study, design, seed, workers)
    with open_run(out, identity, size, provenance(sys.argv), resume, mixed_machines) as folder:
        return _run_in_folder(study, seed, count, executor, task, folder, progress)


def _run_in_folder(
    study: Study, seed: int, count: int, executor: Executor, task: Task, folder: RunFolder, progress: Progress | None
) -> StudyResult:
    def tables() -> Iterator[Table]:
        return (Table.from_arrays(folder.load(index)) for index in range(folder.count))

    if folder.is_complete():
        return finished_result(study, folder, _assembled(study, seed, count, list(tables())))
    chunks = _chunks(count, folder.chunk_size)
    missing = [chunk for chunk in chunks if chunk.index not in folder.finished]
    done = count - sum(len(chunk.numbers) for chunk in missing)
    try:
        for chunk, outcomes in _reported(executor.run(task, missing), progress, count, done):
            folder.check_numerics(outcomes.numerics, chunk.index)
            folder.store(chunk.index, Table.of(study.name, outcomes.cases).to_arrays())
    except KeyboardInterrupt:
        folder.manifest.append("interrupted", finished=len(folder.finished))
        raise
    result = _assembled(study, seed, count, list(tables()))
    finish(study, folder, result, tables)
    return result


def _reported(
    finished: Iterator[tuple[Chunk, Outcomes]], progress: Progress | None, count: int, done: int
) -> Iterator[tuple[Chunk, Outcomes]]:
    with contextlib.closing(finished):  # type: ignore[type-var]
        for chunk, outcomes in finished:
            yield chunk, outcomes
            done += len(chunk.numbers)
            if progress is not None:
                progress(done, count)


def _assembled(study: Study, seed: int, count: int, tables: Sequence[Table]) -> StudyResult:
    table = Table.joined(study.name, tables)
    rows = table.rows()
    metrics = dict(study.metrics(rows)) if rows else {}
    claims = tuple(study.claims(metrics)) if rows else ()
    return StudyResult(study.name, study.version, seed, count, rows, metrics, claims, table.failures)


def _chunks(count: int, size: int) -> list[Chunk]:
    return [Chunk(index, range(first, min(first + size, count))) for index, first in enumerate(range(0, count, size))]


def _chunk_size(study: Study, design: Sequence[Case], seed: int, workers: int) -> int:
    """Return cases for about two seconds of work, from the time of the first case; no result depends on it."""
    numerics_print()
    second = _second_of_first_case(study, design, seed)
    if second < _WARM_S:
        # the first run of a short case is mostly imports
        second = _second_of_first_case(study, design, seed)
    most = max(1, len(design) // (_LEAST_CHUNKS_A_WORKER * workers))
    return max(1, min(most, _MOST_CASES_A_CHUNK, round(_CHUNK_S / max(second, 1e-9))))


def _second_of_first_case(study: Study, design: Sequence[Case], seed: int) -> float:
    start = time.perf_counter()
    _run_cases(study, design, seed, range(1))
    return time.perf_counter() - start


def _source_hash(study: Study) -> str:
    file = inspect.getsourcefile(study.run)
    return hashlib.sha256(Path(file).read_bytes()).hexdigest() if file is not None else ""


def _run_cases(study: Study, design: Sequence[Case], seed: int, numbers: Sequence[int]) -> Outcomes:
    key = campaign_key(study.name, seed)
    outcomes: list[Row | Failure] = []
    for number in numbers:
        try:
            row = study.run(design[number], case_generator(key, number))
        except _CASE_ERRORS as error:
            outcomes.append(Failure(number, type(error).__name__, str(error)))
        else:
            outcomes.append({"case": number, **{name: _value(study, number, name, row[name]) for name in row}})
    return Outcomes(outcomes, numerics_print())


def _value(study: Study, number: int, name: str, value: object) -> object:
    if isinstance(value, np.ndarray) and value.dtype.kind in "bif":
        return value
    plain = value.item() if isinstance(value, np.generic) else value
    if not isinstance(plain, float | int | str | bool):
        raise InputError(
            f"study {study.name}: case {number} returned `{name}` of type {type(plain).__name__}. "
            "A row holds numbers, words, truth values and arrays of numbers only."
        )
    return plain


def _task(study: Study, design: Sequence[Case], count: int, seed: int, executor: Executor) -> Task:
    if isinstance(executor, Serial):
        return functools.partial(_run_cases, study, design, seed)
    module = study.run.__module__
    if getattr(importlib.import_module(module), "study", None) is not study:
        raise InputError(
            f"study {study.name} cannot run in worker processes: they import `study` from the module of its `run` "
            f"function, and {module} holds another object or none. Define it there or use workers=1."
        )
    return functools.partial(_run_imported, module, count, seed)


def _run_imported(module: str, count: int, seed: int, numbers: Sequence[int]) -> Outcomes:
    study, design = _imported(module, count)
    return _run_cases(study, design, seed, numbers)


@functools.lru_cache(maxsize=1)
def _imported(module: str, count: int) -> tuple[Study, Sequence[Case]]:
    study: Study = importlib.import_module(module).study
    return study, study.cases(count)
