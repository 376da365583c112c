"""Passes over the steps of a program beside the removal (gouge, collisions) that continue after a stop.

Notation: a pass processes the steps block after block and stores arrays. Its results so far are one file
``pass-<name>.npz`` in the checkpoint folder of the run, written completely or not at all. Blocks do not depend on when
the file was written, and arrays are restored bit for bit: a stopped pass has the same result as one that was not
stopped. A finished pass is not repeated.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.simulation.checkpoint import Checkpoint, digest
from chipload.simulation.steps import Steps, blocks_of
from chipload.stock.shapes import read_shapes, shape_bytes

Arrays = Mapping[str, NDArray[Any]]

#: kind of the file of a pass
KIND = "chipload pass over the steps 1"
#: writing takes at most this share of the time
SHARE = 0.05


@dataclass(frozen=True, eq=False)
class KeptPasses:
    """Store of the results of the passes of a run.

    Parameters
    ----------
    checkpoint : of the run; None: nothing is kept
    key : of all that every pass depends on: program, cutters, steps, versions
    """

    checkpoint: Checkpoint | None = None
    key: str = ""

    def blocks(
        self,
        name: str,
        steps: Steps | Iterable[Steps],
        depends: Any,
        state: Callable[[], Arrays],
        restore: Callable[[Arrays], None],
    ) -> Iterator[Steps]:
        """Yield the blocks of steps that the pass has not processed yet.

        Parameters
        ----------
        name : of the pass and its file, a word
        depends : what the pass depends on beside the key
        state : the arrays so far, always the same names; asked for after a block was taken
        restore : puts them back
        """
        kept = self.checkpoint
        if kept is None:
            yield from blocks_of(steps)
            return
        key = np.frombuffer(digest(self.key, name, depends).encode(), dtype=np.uint8)
        done = self._restore_steps(kept, name, key, state(), restore)
        saved, seen = done, 0
        begun = since = time.monotonic()
        cost = 0.0
        for block in blocks_of(steps):
            seen += len(block)
            if seen <= done:
                continue
            yield block
            now = time.monotonic()
            if kept.every_s == 0.0 or now - since >= max(kept.every_s, cost / SHARE):
                self._save(kept, name, key, seen, state())
                saved, since = seen, time.monotonic()
                cost = since - now
        if saved < seen and time.monotonic() - begun >= kept.every_s:
            self._save(kept, name, key, seen, state())

    @staticmethod
    def _save(kept: Checkpoint, name: str, key: NDArray[np.uint8], steps: int, arrays: Arrays) -> None:
        stored = {**arrays, "key": key, "taken": np.array([steps])}
        kept.keep_pass(name, shape_bytes(KIND, stored, np.empty(0, dtype=object)), steps)

    @staticmethod
    def _restore_steps(
        kept: Checkpoint, name: str, key: NDArray[np.uint8], fresh: Arrays, restore: Callable[[Arrays], None]
    ) -> int:
        """Return the number of steps that the pass has already processed."""
        file = kept.kept_pass(name)
        if file is None:
            return 0
        shapes = {k: v.ndim for k, v in fresh.items()}
        try:
            found, _ = read_shapes(file, KIND, {**shapes, "key": 1, "taken": 1})
        except InputError:
            kept.set_aside(file.name, only=file)
            return 0
        if not np.array_equal(found["key"], key):
            return 0
        restore({k: found[k] for k in shapes})
        steps = int(found["taken"][0])
        kept.passes[name] = steps
        kept.notice(f"the pass '{name}' continues after step {steps}, kept in {kept.folder}")
        return steps
