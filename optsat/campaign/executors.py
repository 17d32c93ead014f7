"""Executors: run the chunks of a campaign here or in worker processes, with the same outcomes either way."""

import collections
import concurrent.futures
import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

from optsat.campaign.result import Failure
from optsat.campaign.table import Table
from optsat.campaign.threads import one_thread_each, one_thread_here


@dataclass(frozen=True)
class Outcomes:
    """What became of some consecutive cases, and the print of the arithmetic that computed them."""

    table: Table
    numerics: str


Task: TypeAlias = Callable[[Sequence[int]], Outcomes]
"""Numbers of cases to their outcomes; processes and clusters pickle it."""

MOST_ATTEMPTS = 2
_WATCH_S = 0.5


@dataclass(frozen=True)
class Chunk:
    """Consecutive cases that are run and stored together."""

    index: int
    numbers: range


class Executor(Protocol):
    """Where chunks are run."""

    def run(self, task: Task, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, Outcomes]]:
        """Yield each chunk with its outcomes, in any order."""
        ...


@dataclass(frozen=True)
class Serial:
    """In this process, one chunk after another."""

    def run(self, task: Task, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, Outcomes]]:
        """Yield each chunk with its outcomes, in order."""
        with one_thread_here():
            for chunk in chunks:
                yield chunk, task(chunk.numbers)


@dataclass(frozen=True)
class Processes:
    """In worker processes of this machine; a worker that dies costs the chunks that it and its fellows were at.

    A chunk that was at work in two dead pools runs alone, and if it kills that worker too it is halved down to the
    case, which is reported as a failure CRASHED.
    """

    workers: int

    def run(self, task: Task, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, Outcomes]]:
        """Yield each chunk with its outcomes as it finishes."""
        waiting = collections.deque(chunks)
        attempts: collections.Counter[int] = collections.Counter()
        while waiting:
            if attempts[waiting[0].index] >= MOST_ATTEMPTS:
                chunk = waiting.popleft()
                yield chunk, _alone(task, chunk.numbers)
                continue
            lost: list[Chunk] = []
            yield from self._until_broken(task, waiting, attempts, lost)
            # the pool does not say which of them it was at: as many as it has workers, in order of submission
            attempts.update(chunk.index for chunk in lost[: self.workers])
            waiting.extendleft(reversed(lost))

    def _until_broken(
        self, task: Task, waiting: collections.deque[Chunk], attempts: collections.Counter[int], lost: list[Chunk]
    ) -> Iterator[tuple[Chunk, Outcomes]]:
        running: dict[concurrent.futures.Future[Outcomes], Chunk] = {}
        with _pool(self.workers) as pool:
            try:
                while waiting or running:
                    while waiting and len(running) < 2 * self.workers and attempts[waiting[0].index] < MOST_ATTEMPTS:
                        running[_submitted(pool, task, waiting[0].numbers)] = waiting[0]
                        waiting.popleft()
                    if not running:
                        return
                    done, _ = concurrent.futures.wait(running, return_when=concurrent.futures.FIRST_COMPLETED)
                    # what was finished before the pool broke comes first
                    for future in sorted(done, key=lambda each: (each.exception() is not None, running[each].index)):
                        outcomes = future.result()
                        yield running.pop(future), outcomes
            except BrokenProcessPool:
                lost.extend(sorted(running.values(), key=lambda chunk: chunk.index))


def crashed(case: int) -> Outcomes:
    """Return the outcome of a case that kills every worker."""
    died = Failure(case, "CRASHED", "the worker process that ran this case died (killed, or out of memory)")
    return Outcomes(Table({}, (died,)), "")


def joined(parts: Sequence[Outcomes]) -> Outcomes:
    """Return the outcomes of consecutive cases as one."""
    numerics = next((part.numerics for part in parts if part.numerics), "")
    return Outcomes(Table.joined("that is run", [part.table for part in parts]), numerics)


def _alone(task: Task, numbers: range) -> Outcomes:
    with _pool(1) as pool:
        try:
            return _submitted(pool, task, numbers).result()
        except BrokenProcessPool:
            pass
    if len(numbers) == 1:
        return crashed(numbers[0])
    half = len(numbers) // 2
    return joined([_alone(task, numbers[:half]), _alone(task, numbers[half:])])


@contextlib.contextmanager
def _pool(workers: int) -> Iterator[concurrent.futures.ProcessPoolExecutor]:
    # spawn, never fork: forked BLAS and CasADi threads can deadlock, and a forked worker would keep the folder's lock
    context = multiprocessing.get_context("spawn")
    with one_thread_each():
        pool = concurrent.futures.ProcessPoolExecutor(workers, context, _start_worker, (os.getpid(),))
        try:
            yield pool
        except (GeneratorExit, KeyboardInterrupt):
            for process in multiprocessing.active_children():
                process.terminate()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


def _submitted(
    pool: concurrent.futures.ProcessPoolExecutor, task: Task, numbers: range
) -> concurrent.futures.Future[Outcomes]:
    # a worker that starts now inherits that Ctrl-C is not for it; only the runner answers
    if threading.current_thread() is not threading.main_thread():
        return pool.submit(task, numbers)
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        return pool.submit(task, numbers)
    finally:
        signal.signal(signal.SIGINT, before)


def _start_worker(runner: int) -> None:
    threading.Thread(target=_watch, args=(runner,), daemon=True).start()


def _watch(runner: int) -> Any:
    """End this worker when its runner is gone, however that ended."""
    clock = threading.Event()
    while os.getppid() == runner:
        clock.wait(_WATCH_S)
    os._exit(1)
