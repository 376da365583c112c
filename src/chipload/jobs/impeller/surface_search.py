"""Search of the largest cutters of the surfaces of an impeller job, in tasks of blocks of contact points.

Notation: a task searches a block of contact points of one surface at all table angles. A contact point has the same
answer in any block, so the answers of the blocks, one after the other, are that of the surface to the last bit.

A task searches :data:`PAIRS` pairs of contact point and table angle or more. Table angles of one contact point stay in
one task: its cutters are tried from the largest down, at whichever table angle leaves most room.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue
from chipload.planning.impeller.answer import Answer, Unreachable, join_answers, largest_cutters, one_cutter
from chipload.planning.impeller.kept import Keep, PlanTask
from chipload.planning.impeller.surfaces import ContactSurface
from chipload.planning.impeller.tables import IndexTable
from chipload.planning.impeller.unreached import with_fits
from chipload.processes import cores
from chipload.progress import Progress, part_of, silent

#: threads of a search in this process; its answer does not depend on them
WORKERS = cores()
#: least number of pairs of contact point and table angle of a task, so that it takes 0.1 s or more (0.15 s at least for
#: the example, by ``python benchmarks/impeller.py --tasks``): handing it over takes milliseconds
PAIRS = 750

#: cutter, table angle and pallet angles at each reached contact point of the one cutter for a surface; None: none
OneFound = tuple[int, int, tuple[NDArray[np.float64], ...]] | None


@dataclass(frozen=True, eq=False)
class SearchInputs:
    """What all tasks of the search share.

    Parameters
    ----------
    surfaces : with their contact points and check points
    table : table angles and pallet ranges of the machine
    catalogue : cutters
    clearance : of neck, shank and holder [mm]
    """

    surfaces: Sequence[ContactSurface]
    table: IndexTable
    catalogue: Catalogue
    clearance: float


@dataclass(frozen=True, eq=False)
class SurfaceSearch:
    """Result of the search of one surface: the answer, the one cutter for all of it, the time of its tasks [s]."""

    answer: Answer
    one: OneFound
    search_s: float


def blocks_of(points: int, tables: int) -> list[tuple[int, int]]:
    """Blocks (first, after the last) of contact points, of equal size to one, :data:`PAIRS` or more in each.

    >>> blocks_of(100, 15), blocks_of(20, 15)
    ([(0, 50), (50, 100)], [(0, 20)])
    """
    count = max(1, points * tables // PAIRS)
    ends = [points * k // count for k in range(count + 1)]
    return list(itertools.pairwise(ends))


def searched_surfaces(
    inputs: SearchInputs, keep: Keep, spread: bool, progress: Progress = silent
) -> tuple[SurfaceSearch, ...]:
    """The largest cutters of all surfaces.

    Parameters
    ----------
    spread : whether other processes make the tasks of ``keep``; else each surface is one block, searched by threads

    Raises
    ------
    Cancelled
        By ``progress``.
    """
    tables = len(inputs.table.angle)
    blocks = []
    for k, surface in enumerate(inputs.surfaces):
        points = len(surface.scene.contact)
        own = blocks_of(points, tables) if spread else [(0, points)]
        blocks.append([PlanTask(("search", k, a, b), _block, (k, a, b)) for a, b in own])
    every = [task for own in blocks for task in own]
    keep.ahead(every, lambda done, what: progress(0.9 * done, f"search, {what}"))
    answers, seconds = list[Answer](), list[float]()
    for k, tasks in enumerate(blocks):
        part = part_of(progress, 0.9 * k / len(blocks), 0.9 * (k + 1) / len(blocks))
        found = [_result_of_task(inputs, task, keep, part) for task in tasks]
        answers.append(join_answers([answer for answer, _ in found]))
        seconds.append(math.fsum(took for _, took in found))
    ones = [PlanTask(("one of surface", k), _one, (k, answer)) for k, answer in enumerate(answers)]
    keep.ahead(ones, lambda done, what: progress(0.9 + 0.1 * done, f"one cutter, {what}"))
    out = []
    for answer, task, took in zip(answers, ones, seconds, strict=True):
        unreachable, one, more = _result_of_task(inputs, task, keep)
        out.append(SurfaceSearch(replace(answer, unreachable=unreachable), one, took + more))
    return tuple(out)


def _result_of_task(inputs: SearchInputs, task: PlanTask, keep: Keep, *more: Any) -> Any:
    """What a task gives, kept or made by this process on all its threads."""
    return keep(task.key, lambda: task.make(inputs, *task.arguments, WORKERS, *more))


def _block(
    inputs: SearchInputs, k: int, first: int, last: int, threads: int = 1, progress: Progress = silent
) -> tuple[Answer, float]:
    """Contact points ``first`` to ``last`` - 1 of surface k at all table angles, and the time of that [s]."""
    begin, scene = time.perf_counter(), inputs.surfaces[k].scene
    answer = largest_cutters(
        scene, inputs.catalogue, inputs.table.angle, inputs.clearance, pallets=inputs.table.spans, workers=threads,
        progress=progress, points=np.arange(first, last),
    )  # fmt: skip
    return answer, time.perf_counter() - begin


def _one(
    inputs: SearchInputs, k: int, answer: Answer, threads: int = 1
) -> tuple[tuple[Unreachable, ...], OneFound, float]:
    """What would fit at the unreached contact points of surface k, the one cutter for it, and the time of that [s]."""
    begin, scene, spans = time.perf_counter(), inputs.surfaces[k].scene, inputs.table.spans
    unreachable = with_fits(scene, answer, spans, threads)
    answer = replace(answer, unreachable=unreachable)
    return unreachable, one_cutter(scene, answer, inputs.clearance, spans, threads), time.perf_counter() - begin
