"""Run a study: every case once, serially or in worker processes, with the same rows either way."""

import contextlib
import functools
import importlib
import multiprocessing
import signal
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import numpy as np

from optsat.campaign.result import Failure, StudyResult
from optsat.campaign.seeds import campaign_key, case_generator
from optsat.campaign.study import Case, Row, Scalar, Study
from optsat.campaign.threads import one_thread_each
from optsat.errors import InputError, OptsatError

# What a computation may raise on unlucky data. Anything else (a TypeError, a misspelt name) is a mistake in the
# study and stops the campaign with its traceback.
_CASE_ERRORS = (OptsatError, ArithmeticError, ValueError, RuntimeError)

Progress = Callable[[int, int], None]
Outcomes = Generator[list[Row | Failure], None, None]


def run_study(
    study: Study,
    cases: int | None = None,
    seed: int = 0,
    workers: int = 1,
    progress: Progress | None = None,
) -> StudyResult:
    """Return the result of a study over its first `cases` cases.

    A case that raises is kept as a `Failure` and the campaign goes on. The rows do not depend on `workers`; only
    where a case calls BLAS on large matrices start Python with OMP_NUM_THREADS=1, which workers have anyway.
    `progress(done, total)` is called as cases finish.

    Raises
    ------
    InputError : `cases` or `workers` below 1, `seed` negative, or a study that workers cannot import.
    OptsatError : a worker process died.
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
    chunks = _in_processes(study, count, seed, workers) if workers > 1 else _in_turn(study, design, seed)
    outcomes: list[Row | Failure] = []
    with contextlib.closing(chunks):
        for chunk in chunks:
            outcomes.extend(chunk)
            if progress is not None:
                progress(len(outcomes), count)
    return _assemble(study, seed, outcomes)


def _assemble(study: Study, seed: int, outcomes: Sequence[Row | Failure]) -> StudyResult:
    failures = tuple(outcome for outcome in outcomes if isinstance(outcome, Failure))
    rows = tuple(outcome for outcome in outcomes if not isinstance(outcome, Failure))
    for row in rows:
        if list(row) != list(rows[0]):
            raise InputError(
                f"study {study.name}: every case must return the same columns; case {rows[0]['case']} returned "
                f"{list(rows[0])[1:]}, case {row['case']} returned {list(row)[1:]}."
            )
    metrics = dict(study.metrics(rows)) if rows else {}
    claims = tuple(study.claims(metrics)) if rows else ()
    return StudyResult(study.name, study.version, seed, len(outcomes), rows, metrics, claims, failures)


def _run_chunk(study: Study, design: Sequence[Case], seed: int, numbers: Sequence[int]) -> list[Row | Failure]:
    key = campaign_key(study.name, seed)
    outcomes: list[Row | Failure] = []
    for number in numbers:
        try:
            row = study.run(design[number], case_generator(key, number))
        except _CASE_ERRORS as error:
            outcomes.append(Failure(number, type(error).__name__, str(error)))
        else:
            outcomes.append({"case": number, **{name: _scalar(study, number, name, row[name]) for name in row}})
    return outcomes


def _scalar(study: Study, number: int, name: str, value: object) -> Scalar:
    plain = value.item() if isinstance(value, np.generic) else value
    if not isinstance(plain, float | int | str | bool):
        raise InputError(
            f"study {study.name}: case {number} returned `{name}` of type {type(plain).__name__}. "
            "A row holds numbers, words and truth values only."
        )
    return plain


def _in_turn(study: Study, design: Sequence[Case], seed: int) -> Outcomes:
    for number in range(len(design)):
        yield _run_chunk(study, design, seed, [number])


def _in_processes(study: Study, count: int, seed: int, workers: int) -> Outcomes:
    module = study.run.__module__
    if getattr(importlib.import_module(module), "study", None) is not study:
        raise InputError(
            f"study {study.name} cannot run in worker processes: they import `study` from the module of its `run` "
            f"function, and {module} holds another object or none. Define it there or use workers=1."
        )
    size = max(1, min(64, count // (8 * workers)))
    chunks = [range(first, min(first + size, count)) for first in range(0, count, size)]
    task = functools.partial(_run_imported, module, count, seed)
    # spawn, never fork: forked BLAS and CasADi threads can deadlock
    with one_thread_each():
        pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _ignore_interrupt)
        try:
            yield from pool.map(task, chunks)
        except BrokenProcessPool:
            raise OptsatError(
                f"a worker process of study {study.name} died (killed, out of memory, or a crash in compiled "
                "code). Run again with one worker to see which case it is."
            ) from None
        finally:
            pool.shutdown(cancel_futures=True)


def _ignore_interrupt() -> None:
    # Ctrl-C reaches the whole process group; only the runner answers it
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _run_imported(module: str, count: int, seed: int, numbers: Sequence[int]) -> list[Row | Failure]:
    study, design = _imported(module, count)
    return _run_chunk(study, design, seed, numbers)


@functools.lru_cache(maxsize=1)
def _imported(module: str, count: int) -> tuple[Study, Sequence[Case]]:
    study: Study = importlib.import_module(module).study
    return study, study.cases(count)
