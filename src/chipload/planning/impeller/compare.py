"""Comparison of cutter sets: a hand-picked cutter, and one, two or three cutters; and the gouge test of the source.

Notation: B pallet angle. The test of the source takes one contact point, cutter, table angle and B, and checks every
check point. It shares only the frame with the search.

Reference: [Wu2019].
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.planning.impeller.answer import Answer, largest_cutters
from chipload.planning.impeller.closed_form import axis_at, contact_limit
from chipload.planning.impeller.costs import ChannelSide, Costs, Terms
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.patches import PatchDivision, costs_of, divide_sides
from chipload.planning.impeller.scene import Scene
from chipload.progress import Progress, silent


@dataclass(frozen=True, eq=False)
class Partition:
    """One partition of the sides among cutters and table angles.

    Parameters
    ----------
    name : `hand-picked`, `1 cutter`, `2 cutters`, ...
    divided : None: not possible with so many
    catalogue : which the cutters of ``divided`` count in
    share : of the area that is reached
    unreachable : contact points that are not
    certified : whether that is proved for every contact point
    search_s : time of its own search [s]; 0: it is that of all cutters
    """

    name: str
    divided: PatchDivision | None
    catalogue: Catalogue
    share: float
    unreachable: int
    certified: bool
    search_s: float = 0.0

    @property
    def division(self) -> PatchDivision:
        """``divided`` of a partition that is possible.

        Raises
        ------
        InputError
            It is not possible.
        """
        if self.divided is None:
            raise InputError(f"{self.name}: these cutters cannot mill all surfaces: allow more cutters")
        return self.divided


@dataclass(frozen=True, eq=False)
class CutterChoice:
    """One set of cutters for the sides, not yet divided into patches.

    Parameters
    ----------
    name : as of :class:`Partition`
    costs : of its sides; what is proved, and what is measured, stays in them
    most : different cutters at most
    took : time of its own search [s]
    """

    name: str
    costs: tuple[Costs, ...]
    most: int | None
    took: float = 0.0

    def partition(self, workers: int = 1, progress: Progress = silent, keep: Keep = anew) -> Partition:
        """The partition in the least time by the present costs."""
        sides = [c.side for c in self.costs]
        found = divide_sides(self.costs, self.most, workers, progress, keep)
        return Partition(
            self.name, found, sides[0].answer.catalogue, _share(sides), *_count_unreached(sides), self.took
        )


def cutter_choices(
    sides: Sequence[ChannelSide],
    terms: Terms,
    hand_picked: int | None = None,
    numbers: Sequence[int | None] = (1, 2, 3),
    workers: int = 1,
    progress: Progress = silent,
    keep: Keep = anew,
) -> tuple[CutterChoice, ...]:
    """The hand-picked cutter (an index in the catalogue) at any table angle, then one cutter and more, with shared
    costs.

    Raises
    ------
    InputError
        The index is not in the catalogue.
    """
    costs = costs_of(sides, terms, workers)
    catalogue = sides[0].answer.catalogue
    out = []
    if hand_picked is not None:
        if not 0 <= hand_picked < len(catalogue.cutters):
            raise InputError(f"hand_picked = {hand_picked}: must be an index of the {len(catalogue.cutters)} cutters")
        picked = Catalogue("hand-picked", (catalogue.cutters[hand_picked],))
        feed = terms.feed[hand_picked] if isinstance(terms.feed, tuple) else terms.feed

        def search_surfaces() -> tuple[tuple[Answer, ...], float]:
            begin = time.perf_counter()
            answers = tuple(
                largest_cutters(
                    s.scene, picked, s.answer.tables, s.clearance, pallets=s.pallets, workers=workers, progress=progress
                )
                for s in sides
            )
            return answers, time.perf_counter() - begin

        answers, took = keep(("hand-picked",), search_surfaces)
        own = [replace(s, answer=answer) for s, answer in zip(sides, answers, strict=True)]
        out.append(CutterChoice("hand-picked", costs_of(own, replace(terms, feed=feed), workers), 1, took))
    for m in numbers:
        name = "any cutters" if m is None else f"{m} cutter{'s' if m > 1 else ''}"
        out.append(CutterChoice(name, costs, m))
    return tuple(out)


def gouges(
    scene: Scene, point: int, cutter: CatalogueCutter, table: float, pallet: float, clearance: float = 0.0
) -> tuple[int, float] | None:
    """The source's test: the check point that goes deepest into the cutter, and how deep [mm]; None: clear.

    Check points on the contact's own surface within ``near`` are left to the curvature, which counts as check point -2.

    Raises
    ------
    InputError
        The axis points into the surface, or stands along its normal.
    """
    T, S, N, r = axis_at(table, pallet), scene.contact[point], scene.normal[point], cutter.corner_radius
    n = float(N @ T)
    if not -1e-12 <= n < 1.0:
        raise InputError(f"contact point {point}: the axis is at {math.degrees(math.acos(n)):g} deg to the normal")
    if cutter.rho > contact_limit(N, T, r, scene.curvature[point]):
        return -2, math.inf
    tip = S + r * N + cutter.rho * (N - n * T) / math.sqrt(1.0 - n * n) - r * T
    own = (scene.check_surface == scene.surface[point]) & (((scene.check - S) ** 2).sum(axis=1) < scene.near**2)
    a = scene.check - tip
    height = a @ T
    away = np.linalg.norm(a - height[:, None] * T, axis=1)
    radius = cutter.rho + np.where(height < r, np.sqrt(np.clip(r * r - (r - height) ** 2, 0.0, None)), r)
    for bottom, wide in cutter.stages(clearance)[1:]:
        radius = np.where(height >= bottom + r, wide, radius)
    depth = np.where((height < 0.0) | own, -np.inf, radius - away)
    worst = int(depth.argmax())
    return (worst, float(depth[worst])) if depth[worst] > 0.0 else None


def clear_somewhere(
    scene: Scene, point: int, cutter: CatalogueCutter, tables: ArrayLike, pallets: ArrayLike, clearance: float = 0.0
) -> bool:
    """Whether the source's test finds a cutter clear at one of the table and pallet angles [rad]."""
    for table in np.atleast_1d(np.asarray(tables, dtype=np.float64)):
        for B in np.asarray(pallets, dtype=np.float64):
            n = scene.normal[point] @ axis_at(float(table), B)
            if 0.0 <= n < 1.0 and gouges(scene, point, cutter, float(table), float(B), clearance) is None:
                return True
    return False


def _count_unreached(sides: Sequence[ChannelSide]) -> tuple[int, bool]:
    """Contact points that are not reached, and whether all is proved."""
    return sum(len(s.answer.unreachable) for s in sides), all(bool(s.answer.certified.all()) for s in sides)


def _share(sides: Sequence[ChannelSide]) -> float:
    whole = sum(float(s.area.sum()) for s in sides)
    return sum(float(s.area[s.answer.cutter >= 0].sum()) for s in sides) / whole
