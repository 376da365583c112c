"""A loop over contact points in blocks, on threads; the result does not depend on their number."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from chipload.progress import Progress

#: contact points between two reports of progress
BLOCK = 32


def in_blocks(block: Callable[[int], None], total: int, workers: int, progress: Progress, what: str) -> None:
    """Run ``block(first)`` for the first of every :data:`BLOCK` in 0..``total``, and report the progress.

    Raises
    ------
    Cancelled
        By ``progress``; blocks that have not begun are dropped.
    """
    if workers == 1 or total <= BLOCK:
        for first in range(0, total, BLOCK):
            block(first)
            progress(min(first + BLOCK, total) / total, what)
        return
    with ThreadPoolExecutor(workers) as pool:
        waiting = [pool.submit(block, first) for first in range(0, total, BLOCK)]
        try:
            for k, one in enumerate(waiting, 1):
                one.result()
                progress(k / len(waiting), what)
        except BaseException:
            for one in waiting:
                one.cancel()
            raise
