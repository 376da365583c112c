"""Tasks on this process, on a pool of processes or on a Dask cluster; what a killed worker had is done again.

A task is a picklable function and its arguments; its result is yielded as it comes, with its number.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

from chipload.errors import ChiploadError, InputError
from chipload.lazy import require_extra

Task = tuple[Any, ...]
#: processes of one computer
MOST_PROCESSES = 1024
#: how often a task is begun again where its worker died
RETRIES = 2
#: how long a cluster may be without any worker [s]
PATIENCE_S = 30.0
#: how often the cluster is asked [s]
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
        """Refuse numbers that mean nothing."""
        if not 1 <= self.processes <= MOST_PROCESSES:
            raise InputError(f"--workers = {self.processes}: must be from 1 to {MOST_PROCESSES}")

    @property
    def alone(self) -> bool:
        """Whether this process does all."""
        return self.processes == 1 and self.dask is None

    def completed(self, function: Callable[..., Any], tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        """As :func:`completed`."""
        return completed(function, tasks, self.processes, self.dask)


class WorkerDied(ChiploadError):
    """A worker died each time that it had a task."""


def completed(
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
    if dask is not None:
        yield from _on_cluster(function, tasks, dask)
    elif workers == 1 or len(tasks) < 2:
        for k, task in enumerate(tasks):
            yield k, function(*task)
    else:
        yield from _in_pool(function, tasks, workers)


def _single_threaded() -> None:
    """One thread for each worker: the processes share the cores."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")


def _in_pool(function: Callable[..., Any], tasks: Sequence[Task], workers: int) -> Iterator[tuple[int, Any]]:
    waiting = dict.fromkeys(range(len(tasks)), 0)
    _single_threaded()
    while waiting:
        # spawned: a fork would copy threads of the libraries in an unknown state
        pool = ProcessPoolExecutor(min(workers, len(waiting)), multiprocessing.get_context("spawn"))
        try:
            running: dict[Future[Any], int] = {}
            ahead = iter(list(waiting))
            for k in ahead:
                running[pool.submit(function, *tasks[k])] = k
                if len(running) >= 2 * workers:
                    break
            while running:
                ended, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in ended:
                    k = running.pop(future)
                    value = future.result()
                    del waiting[k]
                    yield k, value
                    if (following := next(ahead, None)) is not None:
                        running[pool.submit(function, *tasks[following])] = following
        except BrokenProcessPool:
            # which of those that ran ended the worker is not known
            for k in {*running.values()} & set(waiting):
                waiting[k] += 1
                if waiting[k] > RETRIES:
                    raise WorkerDied(f"task {k + 1}: its worker died {RETRIES + 1} times: free memory") from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in list((getattr(pool, "_processes", None) or {}).values()):
                process.terminate()


def _on_cluster(function: Callable[..., Any], tasks: Sequence[Task], address: str) -> Iterator[tuple[int, Any]]:
    require_extra("cluster")
    from distributed import Client, KilledWorker, as_completed

    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError) as err:
        raise InputError(f"--dask {address}: no scheduler answers: {err}") from None
    with client:
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
                future.release()
                yield k, value
            if batch or (time.monotonic() - seen > PATIENCE_S and client.nthreads()):
                seen = time.monotonic()
            elif time.monotonic() - seen > PATIENCE_S:
                raise WorkerDied(f"--dask {address}: no worker is left: start workers; the same command continues")
            else:
                time.sleep(POLL_S)
