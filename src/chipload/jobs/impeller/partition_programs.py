"""Partitions with their programs: divided, planned, timed, divided again by the program times, and checked.

Notation: a partition is for one set of cutters, as in ``planning/impeller/compare.py``. Contact points predict the time
of a patch from the step-over alone. The time of its program on the machine, with links and rest passes, over that
prediction is a factor of its surface, order of strips, cutter and table angle. Divided again with these factors, the
partition is chosen by program time. Of all rounds the quickest is kept.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.impeller.outcome import Checked, CheckedPartition, Covered
from chipload.jobs.impeller.paths import checked_programs
from chipload.jobs.impeller.tables import PathsTable
from chipload.machine.machine import Machine
from chipload.planning.impeller.assignment import Changes
from chipload.planning.impeller.compare import CutterChoice, Partition
from chipload.planning.impeller.costs import Costs, MeasuredCost
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.patch import Patch
from chipload.planning.impeller.planned_settings import PlannedSettings, announce_millings, plan_settings
from chipload.planning.impeller.settings import (
    CutterSetting,
    FinishSettings,
    Milling,
    MillingKey,
    change_time,
    setting_order,
)
from chipload.program.read import times_on
from chipload.progress import Progress

#: greatest number of divisions of a partition
_ROUNDS = 2
#: where the check finds more than the limit on a patch or surface, the excess is measured on points so many times
#: closer together and planned again; not where it finds more than this share of the limit on a surface that the
#: planner knows to be out of reach in part
_FINER, _NEARLY = (0.5, 0.25), 1.25


@dataclass(frozen=True, eq=False)
class _Planned:
    """A planned partition: its division, its predicted time [s], its settings, the times of the rows of each program
    (n,) [s], the time of all channels [s].
    """

    partition: Partition
    predicted: float
    plan: PlannedSettings
    rows: tuple[NDArray[np.float64], ...]
    seconds: float


@dataclass(eq=False)
class _Memory:
    """Shared results of all partitions: planned millings, row times and checks of the same programs."""

    millings: dict[MillingKey, Milling] = field(default_factory=dict)
    checks: dict[str, tuple[tuple[Checked, ...], tuple[Covered, ...]]] = field(default_factory=dict)


def checked_partitions(
    choices: Sequence[CutterChoice],
    first: Sequence[Partition],
    job: FinishSettings,
    machine: Machine,
    paths: PathsTable,
    progress: Progress,
    keep: Keep = anew,
) -> tuple[CheckedPartition, ...]:
    """Each partition that mills all, with the programs of its best round.

    Parameters
    ----------
    first : the partitions by what their contact points predict
    job : what programs are planned with; the catalogue is that of each choice
    """
    memory = _Memory()
    best: dict[str, _Planned] = {}
    rows: dict[int, list[tuple[int, MeasuredCost]]] = {}
    partitions: Sequence[Partition] = first
    for turn in range(_ROUNDS):
        new = [
            k for k, (choice, partition) in enumerate(zip(choices, partitions, strict=True))
            if partition.divided is not None and not (turn and _same(partition, best[choice.name].partition))
        ]  # fmt: skip
        patches = [(job.with_catalogue(partitions[k].catalogue), partitions[k].division.patches) for k in new]
        announce_millings(patches, memory.millings, keep, _forward_share(progress, 0.8 * turn / _ROUNDS))
        for k in new:
            choice, partition = choices[k], partitions[k]
            done = (turn + k / len(choices)) / _ROUNDS
            plan = _plan_choice(choice, partition, job, machine, memory, _forward_share(progress, 0.8 * done), keep)
            for number, row in _measure_costs(choice.costs, plan):
                rows.setdefault(id(choice.costs), []).append((number, row))
            if choice.name not in best or plan.seconds < best[choice.name].seconds:
                best[choice.name] = plan
        if not new:
            break
        for choice in choices:
            for number, costs in enumerate(choice.costs):
                costs.measured([row for n, row in rows.get(id(choice.costs), []) if n == number])
        # what was planned is now known by its programs
        for choice in choices:
            if choice.name in best:
                kept = best[choice.name]
                best[choice.name] = replace(kept, predicted=_predict_time(choice, kept.partition))
        if turn + 1 < _ROUNDS:
            partitions = [choice.partition(job.workers, keep=keep) for choice in choices]
    out = []
    for k, choice in enumerate(choices):
        if choice.name in best:
            out.append(_check_choice(choice, best[choice.name], job, machine, paths, memory, keep))
        progress(0.8 + 0.2 * (k + 1) / len(choices), f"check of the programs of {choice.name}")
    return tuple(out)


def _forward_share(progress: Progress, done: float) -> Progress:
    """Forward the share that is done, scaled to the whole."""
    return lambda _, what: progress(done, what)


def _changes(choice: CutterChoice) -> Changes:
    terms = choice.costs[0].terms
    return Changes(terms.cutter_change, terms.table_change)


def _predict_time(choice: CutterChoice, partition: Partition) -> float:
    """Time of all channels by the costs as they stand, with one program for each cutter at each table angle [s]."""
    patches = partition.division.patches
    pairs = list(dict.fromkeys((p.cutter, p.table) for p in patches))
    milling = 0.0
    for p in patches:
        costs, order, table, bare = _place(choice.costs, p)
        milling += bare * float(costs.factor[order, p.cutter, table])
    repeats = choice.costs[0].terms.repeats
    return repeats * milling + change_time(setting_order(pairs, _changes(choice)), _changes(choice))


def _place(costs: Sequence[Costs], p: Patch) -> tuple[Costs, int, int, float]:
    """Costs of the side of a patch, its order and table angle there, and what its contact points predict [s]."""
    own = next(c for c in costs if (c.side.body, c.side.side) == (p.body, p.side))
    bare = p.path / float(own.terms.feeds(len(own.catalogue.cutters))[p.cutter])
    return own, "uv".index(p.order), int(np.abs(own.tables - p.table).argmin()), bare


def _plan_choice(
    choice: CutterChoice, partition: Partition, job: FinishSettings, machine: Machine, memory: _Memory,
    progress: Progress, keep: Keep,
) -> _Planned:  # fmt: skip
    own = job.with_catalogue(partition.catalogue)
    plan = plan_settings(
        own, partition.division.patches, _changes(choice), progress=progress, known=memory.millings, keep=keep
    )
    rows = tuple(times_on(s.program, machine) for s in plan.settings)
    each = [float(row.sum()) for row in rows]
    seconds = choice.costs[0].terms.repeats * sum(each) + _change_time(plan.settings, choice)
    return _Planned(partition, _predict_time(choice, partition), plan, rows, seconds)


def _change_time(settings: Sequence[CutterSetting], choice: CutterChoice) -> float:
    cutters = list(dict.fromkeys(s.cutter for s in settings))
    return change_time([(cutters.index(s.cutter), s.table) for s in settings], _changes(choice))


def _same(a: Partition, b: Partition) -> bool:
    """Whether two divisions have the same patches."""

    def key(p: Patch) -> tuple[object, ...]:
        return (p.body, p.side, p.order, p.low, p.high, p.part, p.cutter, p.table)

    if a.divided is None or b.divided is None:
        return a.divided is b.divided
    return [key(p) for p in a.divided.patches] == [key(p) for p in b.divided.patches]


def _measure_costs(costs: Sequence[Costs], done: _Planned) -> list[tuple[int, MeasuredCost]]:
    """For each patch the number of its side and the cost of its program; rest passes count to the patch they finish."""
    rest_time: dict[int, float] = {}
    millings = [m for s in done.plan.settings for m in s.millings]
    for s, seconds in zip(done.plan.settings, done.rows, strict=True):
        owners = [m for m in s.millings for _ in m.tracks.tracks]
        owners += [_patch_of_rest(r.body, r.side, r.box, millings) for r in s.rests for _ in r.tracks]
        for number, time in zip(s.linked.track.tolist(), seconds.tolist(), strict=True):
            if number >= 0:
                owner = id(owners[number].patch)
                rest_time[owner] = rest_time.get(owner, 0.0) + time
    out = []
    for m in millings:
        own, order, table, bare = _place(costs, m.patch)
        number = next(k for k, c in enumerate(costs) if c is own)
        row = MeasuredCost(order, m.patch.cutter, table, bare, rest_time.get(id(m.patch), 0.0))
        out.append((number, row))
    return out


def _patch_of_rest(
    body: int, side: str, box: tuple[tuple[float, float], tuple[float, float]], millings: Sequence[Milling]
) -> Milling:
    """The patch of a surface in which the middle of a box lies, or is nearest to."""
    at = np.array([0.5 * (low + high) for low, high in box])

    def away(m: Milling) -> float:
        low, high = np.array(m.box).T
        return float(np.linalg.norm(np.maximum(np.maximum(low - at, at - high), 0.0)))

    return min((m for m in millings if (m.patch.body, m.patch.side) == (body, side)), key=away)


def _check_choice(
    choice: CutterChoice, done: _Planned, job: FinishSettings, machine: Machine, paths: PathsTable, memory: _Memory,
    keep: Keep,
) -> CheckedPartition:  # fmt: skip
    own = job.with_catalogue(done.partition.catalogue)
    programs, covered = _checked_plan(own, done.plan, machine, paths, memory, keep)
    for fine in _FINER:
        if not _refinable(_left_shares(programs, covered)):
            break
        plan = plan_settings(
            own, done.partition.division.patches, _changes(choice), known=memory.millings, keep=keep, fine=fine
        )  # fmt: skip
        again = _checked_plan(own, plan, machine, paths, memory, keep)
        kept, new = ((_left_shares(*x), sum(p.seconds for p in x[0])) for x in ((programs, covered), again))
        if _rank(*new) < _rank(*kept):
            programs, covered = again
    repeats = choice.costs[0].terms.repeats
    changes = _change_time([p.setting for p in programs], choice)
    return CheckedPartition(done.partition, programs, covered, repeats, done.predicted, changes)


def _left_shares(programs: Sequence[Checked], covered: Sequence[Covered]) -> list[tuple[float, bool]]:
    """The most that is left in each patch and on each surface, as a share of the limit, and whether some of the
    surface is known to be out of reach.
    """
    out_of_reach = {(c.body, c.side): c.unreached > 0.0 for c in covered}
    patches = [
        (x.greatest / x.limit, out_of_reach[m.patch.body, m.patch.side])
        for p in programs
        for x, m in zip(p.scallops, p.setting.millings, strict=True)
    ]
    return [*patches, *((c.greatest[0] / c.limit, c.unreached > 0.0) for c in covered)]


def _refinable(left: Sequence[tuple[float, bool]]) -> bool:
    """Whether more is left somewhere than the limit that rest passes might take: little, or all of it is within reach.

    >>> _refinable([(0.9, False), (1.4, True)]), _refinable([(1.4, False)]), _refinable([(1.2, True)])
    (False, True, True)
    """
    return any(x > 1.0 and (x <= _NEARLY or not out_of_reach) for x, out_of_reach in left)


def _rank(left: Sequence[tuple[float, bool]], seconds: float) -> tuple[int, float, float]:
    """Order of plans: in how many patches and surfaces more is left than the limit; the most, to a hundredth of what is
    the limit, where that is too much: a corner that no cutter reaches stays; the time [s].

    >>> _rank([(0.9, False), (1.05, False), (5.4, True)], 9.0) > _rank([(1.0, False), (5.4, True)], 10.0)
    True
    >>> _rank([(5.401, True)], 9.0) < _rank([(5.4, True)], 10.0)
    True
    """
    most = max((x for x, _ in left), default=0.0)
    return sum(x > 1.0 for x, _ in left), round(most, 2) if most > 1.0 else 0.0, seconds


def _checked_plan(
    own: FinishSettings, plan: PlannedSettings, machine: Machine, paths: PathsTable, memory: _Memory, keep: Keep
) -> tuple[tuple[Checked, ...], tuple[Covered, ...]]:
    """The programs of a plan with what the check finds; of like programs once."""
    text = hashlib.sha256()
    for s in plan.settings:
        for column in (s.program.motion, s.program.p_work, s.program.axis, s.program.feed):
            text.update(np.ascontiguousarray(column).tobytes())
        text.update(repr(s.cutter).encode())
    key = text.hexdigest()
    if key not in memory.checks:
        memory.checks[key] = checked_programs(own, machine, plan, paths, keep)
    return memory.checks[key]
