"""Division of the sides of a channel into patches, each for one cutter and table angle, in the least time.

Notation: a strip is a row of contact points of a side; its strips follow each other across u or across v. Time: path
over feed, the path of a contact point its area over the step-over there (``costs.py``), cutter changes, settings of the
index table. A strip takes a cutter at a table angle only where every contact point of it that any cutter reaches has
a valid range of the pallet angle, neck, shank and holder included.

Method: the least time (``assignment.py``) is calculated with bounds; what it uses and is not yet proved is proved; this
repeats until all of it is proved. As no bound is above the proved value, the last time is the least of all.

Reference: [Wu2019]. Differs from source: it divides one side by eye, in two, after its diameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from chipload.errors import InputError
from chipload.planning.impeller.answer import Unreachable
from chipload.planning.impeller.assignment import Changes, Step, assign_cutters, bound_of_cells, bound_of_strips
from chipload.planning.impeller.costs import ChannelSide, Costs, Terms
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.patch import Patch
from chipload.progress import Progress, silent


@dataclass(frozen=True, eq=False)
class PatchDivision:
    """Sides divided into patches.

    Parameters
    ----------
    patches : in the order in which they are milled, side after side
    cutters : indices in the catalogue of those that are used
    path, milling : of all patches, ``repeats`` times [mm], [s]
    cutter_changes, table_changes : how many
    total : milling and changes [s]
    bound : below it is no time of the same strips in any sequence, with as many cutters [s]
    bound_any_shape : nor, below this, of patches of any shape on the same contact points [s]
    unreachable : for each side the contact points that no cutter of the catalogue mills
    undecided : ranges with too many arcs to decide, which count as closed
    """

    patches: tuple[Patch, ...]
    cutters: tuple[int, ...]
    path: float
    milling: float
    cutter_changes: int
    table_changes: int
    total: float
    bound: float
    bound_any_shape: float
    unreachable: tuple[tuple[Unreachable, ...], ...]
    undecided: int

    @property
    def above_bound(self) -> float:
        """Share by which the time is above the bound."""
        return self.total / self.bound - 1.0 if self.bound > 0.0 else 0.0


def costs_of(sides: Sequence[ChannelSide], terms: Terms, workers: int = 1) -> tuple[Costs, ...]:
    """Times of the sides, shared by calls of :func:`divide_sides`; the sides have one catalogue."""
    if not sides:
        raise InputError("sides: none: must be at least one")
    catalogue = sides[0].answer.catalogue
    if any(side.answer.catalogue != catalogue for side in sides):
        raise InputError("sides: must be searched with one catalogue")
    tables = np.unique(np.concatenate([side.answer.tables for side in sides]))
    return tuple(Costs(side, tables, terms, workers) for side in sides)


def divide_sides(
    costs: Sequence[Costs],
    most: int | None = None,
    workers: int = 1,
    progress: Progress = silent,
    keep: Keep = anew,
) -> PatchDivision | None:
    """Patches of sides that are milled one after another with at most ``most`` different cutters.

    Parameters
    ----------
    costs : of :func:`costs_of`; what is proved stays in them
    most : None: any number of cutters

    Returns
    -------
    None: no ``most`` cutters mill all contact points that are reachable.

    Raises
    ------
    InputError
        There are too many sets of cutters.
    Cancelled
        By ``progress``.
    """
    terms = costs[0].terms
    changes = Changes(terms.cutter_change, terms.table_change)
    rounds = 0
    while True:
        times = [(c.cells(0) * terms.repeats, c.cells(1) * terms.repeats) for c in costs]
        best = assign_cutters(times, changes, most)
        if best is None:
            return None
        open_ = [_open_times(c, [s for s in best.steps if s.side == k]) for k, c in enumerate(costs)]
        rounds += 1
        progress(1.0 - 1.0 / (1.0 + 0.05 * rounds), "patches")
        if not any(open_):
            break
        for c, open_times in zip(costs, open_, strict=True):
            c.prove(open_times, workers, keep)
    patches = _patches(costs, best.steps)
    runs = [(p.cutter, p.table) for p in patches]
    cutter_changes = sum(a[0] != b[0] for a, b in pairwise(runs))
    table_changes = sum(a[1] != b[1] for a, b in pairwise(runs))
    return PatchDivision(
        patches=patches,
        cutters=tuple(sorted({p.cutter for p in patches})),
        path=terms.repeats * sum(p.path for p in patches),
        milling=terms.repeats * sum(p.time for p in patches),
        cutter_changes=cutter_changes,
        table_changes=table_changes,
        total=best.total,
        bound=bound_of_strips(times, changes, most),
        bound_any_shape=bound_of_cells(times, changes, most),
        unreachable=tuple(c.side.answer.unreachable for c in costs),
        undecided=sum(c.undecided for c in costs),
    )


def _points(costs: Costs, step: Step) -> list[int]:
    """The contact points of a step."""
    row = costs.side.points(step.order)[step.strip]
    return [int(i) for i in (row if step.cell < 0 else row[step.cell : step.cell + 1])]


def _open_times(costs: Costs, steps: Sequence[Step]) -> list[tuple[int, int, int]]:
    return [
        (c, s.cutter, s.table) for s in steps for c in _points(costs, s) if not costs.known[c, s.cutter, s.table]
    ]  # fmt: skip


def _patches(costs: Sequence[Costs], steps: Sequence[Step]) -> tuple[Patch, ...]:
    """Steps of one side, cutter and table angle that follow each other, whole strips or cells of one strip."""
    groups: list[list[Step]] = []
    for step in steps:
        last = groups[-1][-1] if groups else None
        same = last is not None and last[:2] == step[:2] and last[4:] == step[4:]
        if same and last is not None and (last.cell < 0) == (step.cell < 0) and (
            step.cell < 0 or last.strip == step.strip
        ):  # fmt: skip
            groups[-1].append(step)
        else:
            groups.append([step])
    return with_begins(tuple(_patch(costs[g[0].side], g) for g in groups))


def with_begins(patches: Sequence[Patch]) -> tuple[Patch, ...]:
    """Patches whose lines begin at a border that they share with another patch of their surface.

    The first line lies as far inside its border as its pass reaches, the last one up to a step beyond: there it would
    mill once more what the other patch does.
    """
    out = []
    for p in patches:
        same = [o for o in patches if (o.body, o.side, o.order, o.part) == (p.body, p.side, p.order, p.part)]
        below, above = any(o.high == p.low for o in same), any(o.low == p.high for o in same)
        out.append(replace(p, begin="low" if below else "high" if above else "any"))
    return tuple(out)


def _patch(costs: Costs, steps: Sequence[Step]) -> Patch:
    side, first = costs.side, steps[0]
    k, t, order = first.cutter, first.table, first.order
    points = [c for s in sorted(steps, key=lambda s: (s.strip, s.cell)) for c in _points(costs, s)]
    edges, other = side.edges(order), side.edges(1 - order)
    strips, cells = [s.strip for s in steps], [s.cell for s in steps]
    part = (0.0, 1.0) if min(cells) < 0 else (float(other[min(cells)]), float(other[max(cells) + 1]))
    grid = np.stack(np.meshgrid(side.u, side.v, indexing="ij"), axis=-1).reshape(-1, 2)
    reached = [c for c in points if side.answer.cutter[c] >= 0]
    bare = float(costs.time[order, reached, k, t].sum())
    time = bare * float(costs.factor[order, k, t])
    none = np.zeros((0, 2))
    return Patch(
        side.body, side.side, "uv"[order], float(edges[min(strips)]), float(edges[max(strips) + 1]), k,
        float(costs.tables[t]), grid[points], tuple(costs.ranges.get((c, k, t), none) for c in points),
        bare * float(costs.terms.feeds(len(costs.catalogue.cutters))[k]), time,
        float(side.area[reached].sum()), part,
    )  # fmt: skip
