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

from optsat._version import __version__
from optsat.campaign.case_runs import run_cases
from optsat.campaign.designs import Layout
from optsat.campaign.disk import disk_faults
from optsat.campaign.executors import Chunk, Executor, Outcomes, Processes, Serial, Task
from optsat.campaign.numerics import numerics_print
from optsat.campaign.provenance import provenance
from optsat.campaign.result import StudyResult
from optsat.campaign.rows import Cases, read_cases
from optsat.campaign.run_folder import Identity, RunFolder, open_run
from optsat.campaign.seeds import campaign_key
from optsat.campaign.store import check_finished, finish
from optsat.campaign.study import Study
from optsat.campaign.table import Table
from optsat.campaign.termination import terminated_as_interrupted
from optsat.errors import InputError

_CHUNK_S = 2.0
_WARM_S = 1.0
_CHUNK_BYTES = 1 << 26
_FIRST_BATCH = 16
_MEASURED_S = 0.05
_MOST_CASES_A_CHUNK = 4096
_LEAST_CHUNKS_A_WORKER = 4

Progress = Callable[[int, int], None]
Watch = Callable[[Table], None]


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
    accept_version: bool = False,
    watch: Watch | None = None,
) -> StudyResult:
    """Return the result of a study over its first `cases` cases.

    A case that raises is kept as a `Failure` and the campaign goes on. The rows do not depend on `workers`; only
    where a case calls BLAS on large matrices start Python with OMP_NUM_THREADS=1, which workers have anyway.
    `progress(done, total)` is called as cases finish.

    out : folder that keeps every finished chunk; a run that is complete there is read, not run again
    resume : go on with an unfinished run in `out`
    executor : where the chunks are run; `workers` processes of this machine unless given
    mixed_machines : take results of machines with another arithmetic into one run; the manifest says which
    accept_version : go on with a run that another version of optsat or of the study's file began; the manifest says so
    watch : gets the cases of every chunk as it finishes, in any order, for running figures

    Raises
    ------
    InputError : `cases` or `workers` below 1, `seed` negative, a study that workers cannot import, or a folder that
        cannot be used.
    OptsatError : the disk is full; every finished chunk is kept.
    KeyboardInterrupt : Ctrl-C or SIGTERM; every finished chunk is kept.
    """
    count = study.default_cases if cases is None else cases
    if count < 1 or workers < 1 or seed < 0:
        raise InputError(
            "`cases` and `workers` must be at least 1 and `seed` at least 0, "
            f"got cases={count}, workers={workers}, seed={seed}."
        )
    layout = Layout.of(study.name, study.cases, count, campaign_key(study.name, seed))
    if executor is None:
        executor = Processes(min(workers, count)) if min(workers, count) > 1 else Serial()
    task = _task(study, layout, seed, executor)
    size = functools.partial(_chunk_size, study, layout, workers)
    if out is None:
        plain = max(1, min(64, count // (8 * workers))) if workers > 1 else 1
        chunks = _chunks(count, plain if study.run_batch is None else size())
        tables: dict[int, Table] = {}
        for chunk, outcomes in _reported(executor.run(task, chunks), progress, watch, count, 0):
            tables[chunk.index] = outcomes.table
        return _judged(study, seed, count, read_cases(study.name, tables.__getitem__, len(chunks)))
    identity = Identity(study.name, study.version, seed, count, __version__, _source_hash(study))
    opened: list[RunFolder] = []
    with (
        terminated_as_interrupted(),
        disk_faults(out, lambda: opened[0].bytes_needed() if opened else 0),
        open_run(out, identity, size, provenance(sys.argv), resume, mixed_machines, accept_version) as folder,
    ):
        opened.append(folder)
        return _run_in_folder(study, seed, count, executor, task, folder, progress, watch)


def _run_in_folder(
    study: Study,
    seed: int,
    count: int,
    executor: Executor,
    task: Task,
    folder: RunFolder,
    progress: Progress | None,
    watch: Watch | None,
) -> StudyResult:
    def cases() -> Cases:
        return read_cases(study.name, lambda chunk: Table.from_arrays(folder.load(chunk)), folder.count)

    if folder.is_complete():
        check_finished(folder)
        return _judged(study, seed, count, cases())
    chunks = _chunks(count, folder.chunk_size)
    missing = [chunk for chunk in chunks if chunk.index not in folder.finished]
    done = count - sum(len(chunk.numbers) for chunk in missing)
    try:
        for chunk, outcomes in _reported(executor.run(task, missing), progress, watch, count, done):
            folder.check_numerics(outcomes.numerics, chunk.index)
            folder.store(chunk.index, outcomes.table.to_arrays())
    except KeyboardInterrupt:
        folder.manifest.append("interrupted", finished=len(folder.finished))
        raise
    done_cases = cases()
    result = _judged(study, seed, count, done_cases)
    finish(study, folder, result, done_cases)
    return result


def _reported(
    finished: Iterator[tuple[Chunk, Outcomes]], progress: Progress | None, watch: Watch | None, count: int, done: int
) -> Iterator[tuple[Chunk, Outcomes]]:
    with contextlib.closing(finished):  # type: ignore[type-var]
        for chunk, outcomes in finished:
            yield chunk, outcomes
            done += len(chunk.numbers)
            if watch is not None:
                watch(outcomes.table)
            if progress is not None:
                progress(done, count)


def _judged(study: Study, seed: int, count: int, cases: Cases) -> StudyResult:
    metrics = dict(study.metrics(cases.rows)) if cases.rows else {}
    claims = tuple(study.claims(metrics)) if cases.rows else ()
    return StudyResult(study.name, study.version, seed, count, cases.rows, metrics, claims, cases.failures)


def _chunks(count: int, size: int) -> list[Chunk]:
    return [Chunk(index, range(first, min(first + size, count))) for index, first in enumerate(range(0, count, size))]


def _chunk_size(study: Study, layout: Layout, workers: int) -> int:
    """Return cases for about two seconds of work or 64 MB, from the first cases; no result depends on it."""
    numerics_print()
    second, size = _cost_of_one(study, layout) if study.run_batch is None else _cost_in_a_batch(study, layout)
    most = max(1, layout.count // (_LEAST_CHUNKS_A_WORKER * workers))
    by_time = round(_CHUNK_S / max(second, 1e-9))
    return max(1, min(most, _MOST_CASES_A_CHUNK, by_time, int(_CHUNK_BYTES // max(size, 1.0))))


def _cost_of_one(study: Study, layout: Layout) -> tuple[float, float]:
    """Return seconds and bytes of a case that runs alone."""
    cost = _cost_a_case(study, layout, 1)
    # the first run of a short case is mostly imports
    return cost if cost[0] >= _WARM_S else _cost_a_case(study, layout, 1)


def _cost_in_a_batch(study: Study, layout: Layout) -> tuple[float, float]:
    """Return seconds and bytes a case in batches of growing length, until one takes a while."""
    most = min(layout.count, _MOST_CASES_A_CHUNK)
    cases = min(most, _FIRST_BATCH)
    while True:
        # what runs for the first time is mostly compilation
        _cost_a_case(study, layout, cases)
        second, size = _cost_a_case(study, layout, cases)
        if cases == most or second * cases > _MEASURED_S:
            return second, size
        cases = min(most, 8 * cases)


def _cost_a_case(study: Study, layout: Layout, cases: int) -> tuple[float, float]:
    start = time.perf_counter()
    table = run_cases(study, layout, range(cases)).table
    second = time.perf_counter() - start
    return second / cases, sum(column.nbytes for column in table.columns.values()) / cases


def _source_hash(study: Study) -> str:
    file = inspect.getsourcefile(study.run)
    return hashlib.sha256(Path(file).read_bytes()).hexdigest() if file is not None else ""


def _task(study: Study, layout: Layout, seed: int, executor: Executor) -> Task:
    if isinstance(executor, Serial):
        return functools.partial(run_cases, study, layout)
    module = study.run.__module__
    if getattr(importlib.import_module(module), "study", None) is not study:
        raise InputError(
            f"study {study.name} cannot run in worker processes: they import `study` from the module of its `run` "
            f"function, and {module} holds another object or none. Define it there or use workers=1."
        )
    return functools.partial(_run_imported, module, layout.count, seed)


def _run_imported(module: str, count: int, seed: int, numbers: Sequence[int]) -> Outcomes:
    return run_cases(*_imported(module, count, seed), numbers)


@functools.lru_cache(maxsize=1)
def _imported(module: str, count: int, seed: int) -> tuple[Study, Layout]:
    study: Study = importlib.import_module(module).study
    return study, Layout.of(study.name, study.cases, count, campaign_key(study.name, seed))
