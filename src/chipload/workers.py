"""Tasks in this process, in a pool of processes or on a Dask cluster; the task of a killed worker is repeated.

A task is a picklable function and its arguments; its result is yielded as it comes, with its number. A team stays for
many groups of tasks; it sends a value that all of them need to each worker once.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from multiprocessing.connection import wait as wait_for
from multiprocessing.context import SpawnContext, SpawnProcess
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

from chipload.errors import ChiploadError, InputError
from chipload.lazy import require_extra

Task = tuple[Any, ...]
#: greatest number of processes on one computer
MOST_PROCESSES = 1024
#: greatest number of times that a task is repeated after its worker died
RETRIES = 2
#: longest time that a cluster may have no worker [s]
PATIENCE_S = 30.0
#: longest time until the first answer of a scheduler [s]
ANSWER_S = 10.0
#: interval at which the cluster is polled [s]
POLL_S = 0.02


@dataclass(frozen=True)
class Workers:
    """Where tasks are done.

    Parameters
    ----------
    processes : on this computer; 1: this one
    dask : address of a Dask scheduler, as ``tcp://host:8786``; then ``processes`` has no meaning

    Raises
    ------
    InputError
        The number of processes is out of range.
    """

    processes: int = 1
    dask: str | None = None

    def __post_init__(self) -> None:
        """Refuse a number of processes out of range."""
        if not 1 <= self.processes <= MOST_PROCESSES:
            raise InputError(f"--workers = {self.processes}: must be from 1 to {MOST_PROCESSES}")

    @property
    def alone(self) -> bool:
        """Whether this process does all tasks."""
        return self.processes == 1 and self.dask is None

    def completed(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        """As :func:`run_tasks`."""
        return run_tasks(function, tasks, self.processes, self.dask)

    @contextmanager
    def team(self) -> Iterator[Team]:
        """Workers that stay until the end of the block.

        Raises
        ------
        InputError
            The cluster does not answer.
        """
        if self.dask is not None:
            with _client(self.dask) as client:
                yield _Cluster(client, self.dask)
        elif self.processes == 1:
            yield _Alone()
        else:
            with tempfile.TemporaryDirectory(prefix="chipload-") as folder:
                pool = _Pool(self.processes, Path(folder))
                try:
                    yield pool
                finally:
                    pool.close()


class Team(Protocol):
    """Workers that stay for many groups of tasks."""

    @property
    def size(self) -> int:
        """Number of tasks that run at the same time, at least 1."""

    def share(self, value: Any) -> None:
        """Send the workers the first argument of the functions of :meth:`completed_shared` from now on."""

    def completed(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        """As :func:`run_tasks`."""

    def completed_shared(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        """As :func:`run_tasks`, with the value that is shared before the arguments of each task."""


class WorkerDied(ChiploadError):
    """The worker of a task died at every attempt."""


class _Lost(WorkerDied):
    """No worker of the cluster has the shared value of a task."""


def run_tasks(
    function: Callable[..., Any], tasks: Sequence[Task], workers: int = 1, dask: str | None = None
) -> Iterator[tuple[int, Any]]:
    """Numbers and results of the tasks, in the order in which they end.

    Parameters
    ----------
    workers : processes; 1: this one
    dask : address of a scheduler, as ``tcp://host:8786``; its workers see the same files

    Raises
    ------
    WorkerDied
        A task ended its worker :data:`RETRIES` + 1 times, or a cluster has no worker for :data:`PATIENCE_S`.
    InputError
        The cluster does not answer.
    """
    with Workers(workers, dask).team() as team:
        yield from team.completed(function, tasks)


class _Alone:
    """The calling process as the only worker."""

    def __init__(self) -> None:
        self._value: Any = None

    @property
    def size(self) -> int:
        return 1

    def share(self, value: Any) -> None:
        self._value = value

    def completed(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        for k, task in enumerate(tasks):
            yield k, function(*task)

    def completed_shared(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        return self.completed(partial(function, self._value), tasks)


class _Pool(_Alone):
    """Processes of this computer; a single task is done by this one. The shared value is a file in ``folder``."""

    def __init__(self, processes: int, folder: Path) -> None:
        super().__init__()
        self._processes, self._folder, self._shared = processes, folder, 0
        self._executor: ProcessPoolExecutor | None = None
        self._closed = False

    @property
    def size(self) -> int:
        return self._processes

    def share(self, value: Any) -> None:
        super().share(value)
        self._file.unlink(missing_ok=True)
        self._shared += 1
        self._file.write_bytes(pickle.dumps(value, pickle.HIGHEST_PROTOCOL))

    @property
    def _file(self) -> Path:
        return self._folder / f"{self._shared}.pickle"

    def completed_shared(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        if len(tasks) < 2:
            return super().completed_shared(function, tasks)
        return self.completed(partial(_with_file, str(self._file), function), tasks)

    def completed(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        if len(tasks) < 2:
            yield from super().completed(function, tasks)
            return
        waiting = dict.fromkeys(range(len(tasks)), 0)
        while waiting:
            running: dict[Future[Any], int] = {}
            try:
                for k, value in self._run_numbers(function, tasks, list(waiting), running):
                    del waiting[k]
                    yield k, value
            except BrokenProcessPool:
                if self._closed:
                    raise
                self._end()
                # it is not known which of the running tasks ended the worker
                for k in {*running.values()} & set(waiting):
                    waiting[k] += 1
                    if waiting[k] > RETRIES:
                        raise WorkerDied(f"task {k + 1}: its worker died {RETRIES + 1} times: free memory") from None
            finally:
                for future in running:
                    future.cancel()

    def _run_numbers(
        self,
        function: Callable[..., Any],
        tasks: Sequence[Task],
        numbers: Sequence[int],
        running: dict[Future[Any], int],
    ) -> Iterator[tuple[int, Any]]:
        """Results of the tasks ``numbers``; at most two tasks for each worker are in ``running`` at a time."""
        if self._executor is None:
            _single_threaded()
            # spawned: a fork would copy threads of the libraries in an unknown state
            self._executor = ProcessPoolExecutor(self._processes, _Context(), _begin)
        ahead = iter(numbers)
        for k in ahead:
            running[self._executor.submit(function, *tasks[k])] = k
            if len(running) >= 2 * self._processes:
                break
        while running:
            ended, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in ended:
                value, k = future.result(), running.pop(future)
                yield k, value
                if (following := next(ahead, None)) is not None:
                    running[self._executor.submit(function, *tasks[following])] = following

    def close(self) -> None:
        """End the processes, even while another thread waits for a result."""
        self._closed = True
        self._end()

    def _end(self) -> None:
        pool, self._executor = self._executor, None
        if pool is None:
            return
        processes = list((getattr(pool, "_processes", None) or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()


class _Process(SpawnProcess):
    """A process that does not run the script of the caller again, even if that has no ``__main__`` guard."""

    @staticmethod
    def _Popen(process_obj: Any) -> Any:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            return SpawnProcess._Popen(process_obj)
        finally:
            sys.modules["__main__"] = main


class _Context(SpawnContext):
    Process = _Process


def _begin() -> None:
    """Prepare a process: it ignores Ctrl-C, which the caller handles, and ends with the caller."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (caller := multiprocessing.parent_process()) is not None:
        threading.Thread(target=_end_with, args=(caller.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait_for([sentinel])
    os._exit(1)


def _single_threaded() -> None:
    """One thread for each worker: the processes share the cores."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")


def _with_file(file: str, function: Callable[..., Any], *task: Any) -> Any:
    """Execute a task in a worker, with the value that a file holds as first argument."""
    return function(_read(file), *task)


@lru_cache(maxsize=1)
def _read(file: str) -> Any:
    """The value that a file holds, read once by each worker."""
    return pickle.loads(Path(file).read_bytes())


@contextmanager
def _client(address: str) -> Iterator[Any]:
    """A client of a cluster."""
    require_extra("cluster")
    import dask
    from distributed import Client

    try:
        client = Client(address, timeout=ANSWER_S)
    except (OSError, ValueError) as err:
        raise InputError(f"--dask {address}: no scheduler answers: {err}") from None
    # tiles of a stock go with their task, so that a worker that ends takes none with it
    with client, dask.config.set({"distributed.admin.large-graph-warning-threshold": "2GB"}):
        yield client


class _Cluster(_Alone):
    """Workers of a cluster; the shared value is data of the cluster, copied to each."""

    def __init__(self, client: Any, address: str) -> None:
        super().__init__()
        self._client, self._address = client, address

    @property
    def size(self) -> int:
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def share(self, value: Any) -> None:
        super().share(value)
        self._copies = self._client.scatter(value, broadcast=True, hash=False)

    def completed_shared(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        waiting, tries = list(range(len(tasks))), 0
        while waiting:
            numbers = waiting.copy()
            try:
                for k, value in self.completed(function, [(self._copies, *tasks[number]) for number in numbers]):
                    waiting.remove(numbers[k])
                    yield numbers[k], value
            except _Lost:
                # the workers that had the shared value are gone
                tries += 1
                if tries > RETRIES:
                    raise
                self.share(self._value)

    def completed(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        from distributed import KilledWorker, as_completed

        client, address = self._client, self._address
        numbers = {
            client.submit(function, *task, pure=False, retries=RETRIES): k for k, task in enumerate(tasks)
        }  # fmt: skip
        ended = as_completed(numbers)
        seen = time.monotonic()
        while not ended.is_empty():
            batch = ended.next_batch(block=False)
            for future in batch:
                k = numbers[future]
                try:
                    value = future.result()
                except KilledWorker as err:
                    raise WorkerDied(f"task {k + 1}: {err}") from None
                except CancelledError as err:
                    raise _Lost(f"task {k + 1}: {err}") from None
                future.release()
                yield k, value
            if batch or (time.monotonic() - seen > PATIENCE_S and client.nthreads()):
                seen = time.monotonic()
            elif time.monotonic() - seen > PATIENCE_S:
                raise WorkerDied(f"--dask {address}: no worker is left: start workers; the same command continues")
            else:
                time.sleep(POLL_S)
