"""Dask executor: chunks on an existing Dask cluster, one task each, with the same outcomes as anywhere."""

import collections
import contextlib
import importlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from optsat._version import __version__
from optsat.campaign.executors import Chunk, Outcomes, Task, crashed, joined
from optsat.errors import MissingExtraError, OptsatError

_CHUNKS_A_THREAD = 2


@dataclass(frozen=True)
class Dask:
    """Workers of the cluster at `address`, such as tcp://127.0.0.1:8786.

    A worker that dies costs its chunk, which the cluster runs again; a chunk that kills workers again and again is
    halved down to the case, which is reported as a failure CRASHED.
    """

    address: str
    connect_s: float = 10.0

    def run(self, task: Task, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, Outcomes]]:
        """Yield each chunk with its outcomes as it finishes.

        Raises
        ------
        MissingExtraError : distributed is absent.
        OptsatError : no cluster there, no worker, another version on a worker, or the scheduler went away.
        """
        distributed = _distributed()
        try:
            client = distributed.Client(self.address, timeout=self.connect_s, set_as_default=False)
        except (OSError, ValueError) as error:
            raise OptsatError(
                f"No Dask scheduler answers at {self.address} ({error}). Start one with `dask scheduler`."
            ) from None
        with contextlib.closing(client):
            try:
                window = _CHUNKS_A_THREAD * self._checked_threads(client)
                yield from _run(client, task, chunks, window)
            except (OSError, TimeoutError) as error:
                raise OptsatError(
                    f"The scheduler at {self.address} was lost ({type(error).__name__}). What is finished is kept; "
                    "run the same command with --resume."
                ) from None

    def _checked_threads(self, client: Any) -> int:
        try:
            client.wait_for_workers(1, timeout=self.connect_s)
        except TimeoutError:
            raise OptsatError(
                f"The cluster at {self.address} has no worker. Start some with `dask worker {self.address}`."
            ) from None
        versions = client.run(_version)
        wrong = {worker: version for worker, version in versions.items() if version != __version__}
        if wrong:
            table = "; ".join(f"{worker} has {version}" for worker, version in sorted(wrong.items()))
            raise OptsatError(f"Every worker needs optsat {__version__}: {table}. Install it there.")
        return sum(client.nthreads().values())


def _distributed() -> Any:
    # typed in parts only
    try:
        return importlib.import_module("distributed")
    except ImportError:
        raise MissingExtraError("A Dask cluster needs distributed: pip install 'optsat[cluster]'.") from None


def _version() -> str:
    return __version__


def _run(client: Any, task: Task, chunks: Sequence[Chunk], window: int) -> Iterator[tuple[Chunk, Outcomes]]:
    waiting = collections.deque(chunks)
    running: dict[Any, Chunk] = {}
    finished = _distributed().as_completed(loop=client.loop)
    try:
        while waiting or running:
            while waiting and len(running) < window:
                chunk = waiting.popleft()
                future = client.submit(task, chunk.numbers, pure=False, retries=0)
                running[future] = chunk
                finished.add(future)
            future = next(finished)
            chunk = running.pop(future)
            outcomes = _outcomes(client, task, chunk.numbers, future)
            future.release()
            yield chunk, outcomes
    finally:
        client.cancel(list(running), force=True)


def _outcomes(client: Any, task: Task, numbers: range, future: Any, once_more: bool = True) -> Outcomes:
    """Return the outcomes of a task; of one that kills its workers, those of its halves, one after the other.

    once_more : a case that is left alone gets a second chance, for its worker may have died of another task
    """
    distributed = _distributed()
    try:
        outcomes: Outcomes = future.result()
        return outcomes
    except distributed.CancelledError:
        raise ConnectionError("its tasks were cancelled") from None
    except distributed.KilledWorker:
        if len(numbers) == 1 and not once_more:
            return crashed(numbers[0])
    half = len(numbers) // 2
    parts = [numbers[:half], numbers[half:]] if half else [numbers]
    return joined(
        [_outcomes(client, task, part, client.submit(task, part, pure=False, retries=0), half > 0) for part in parts]
    )
