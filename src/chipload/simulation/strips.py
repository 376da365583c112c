"""Steps by moves on several threads: each thread knows every move and calculates its own blocks of steps.

What a block engages depends on the moves before it alone, so that it has the same bytes whichever thread calculates it.
A thread enters the blocks of the others into its index without calculating them, which takes a tenth of the time.
"""

from __future__ import annotations

import multiprocessing
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

from chipload.cutting.material import Material
from chipload.engagement.moves.stock import Engaged
from chipload.processes import cores
from chipload.simulation.moves import Moved, MoveRun, remove_by_moves, with_contact
from chipload.simulation.removal import RunSettings
from chipload.simulation.steps import Steps

__all__ = ["number_of_strips", "remove_in_strips", "threads_of"]

#: least number of blocks of a thread: for fewer its index of the moves is not worth while
FEWEST = 4
#: blocks that wait for each thread at most
AHEAD = 2
#: most threads where none are stated: each has an index of the moves
THREADS = 4

#: Removal of some steps in a run, of which the number of the first is given, and their engagement if that is known
Calculate = Callable[[MoveRun, Steps, int, Engaged | None], Moved]


def threads_of(workers: int | None) -> int:
    """Return the threads of a job: as stated, else one for each core, at most ``THREADS``.

    >>> threads_of(3)
    3
    """
    return min(cores(), THREADS) if workers is None else workers


def number_of_strips(workers: int, steps: int, block: int) -> int:
    """Return how many threads share the steps of a program: 1 where it is short, or other processes use the cores.

    >>> number_of_strips(4, 100_000, 4096), number_of_strips(4, 20_000, 4096)
    (4, 1)
    """
    if multiprocessing.parent_process() is not None:
        return 1
    return max(min(workers, steps // (FEWEST * block)), 1)


def remove_in_strips(
    blocks: Iterable[Steps], setting: RunSettings, runs: Sequence[MoveRun], first: int
) -> Iterator[tuple[Steps, Moved]]:
    """Yield blocks of steps with their removal, in their order.

    Parameters
    ----------
    runs : one for each thread, alike and with the moves before the first block
    first : number of the first step
    """

    def calculate(run: MoveRun, steps: Steps, number: int, found: Engaged | None = None) -> Moved:
        found = run.contact(steps) if found is None else found

        def loads_in(material: Material) -> Moved:
            return remove_by_moves(
                steps, run, number, setting.cutters, material, setting.resolution.rotation, found, setting.loads
            )

        moved = loads_in(setting.material)
        return moved if setting.other is None else replace(moved, other=loads_in(setting.other))

    if len(runs) > 1:
        yield from _shared_blocks(blocks, runs, calculate, first)
        return
    for steps, found in with_contact(blocks, runs[0], setting.workers):
        yield steps, calculate(runs[0], steps, first, found)
        first += len(steps)


def _shared_blocks(
    blocks: Iterable[Steps], runs: Sequence[MoveRun], calculate: Calculate, first: int
) -> Iterator[tuple[Steps, Moved]]:
    """:func:`remove_in_strips` of several threads, which take the blocks in turn."""
    waiting = deque[tuple[Steps, list[Future[Any]], int]]()

    def next_block() -> tuple[Steps, Moved]:
        steps, tasks, own = waiting.popleft()
        # an error of any thread ends the run
        return steps, [task.result() for task in tasks][own]

    with ExitStack() as stack:
        threads = [stack.enter_context(ThreadPoolExecutor(1)) for _ in runs]
        try:
            for k, steps in enumerate(blocks):
                own = k % len(runs)
                tasks: list[Future[Any]] = [
                    thread.submit(calculate, run, steps, first, None)
                    if i == own
                    else thread.submit(run.make, steps, len(steps))
                    for i, (thread, run) in enumerate(zip(threads, runs, strict=True))
                ]
                waiting.append((steps, tasks, own))
                first += len(steps)
                if len(waiting) > AHEAD * len(runs):
                    yield next_block()
            while waiting:
                yield next_block()
        finally:
            for thread in threads:
                thread.shutdown(wait=False, cancel_futures=True)
