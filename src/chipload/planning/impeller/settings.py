"""Settings: a cutter at a table angle with its patches, their paths, its rest passes, its moves, one program.

Notation: a setting is a cutter at a table angle with the patches that it mills; alpha table angle [rad]. In the scene
of a channel the surfaces are numbered as :meth:`Impeller.scene` does for the plus side of the blade.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.geometry.bspline import BSplinePatch as Surface
from chipload.planning.impeller.assignment import Changes
from chipload.planning.impeller.feeds import ForceTerms, PassLoads
from chipload.planning.impeller.floor import patch_of
from chipload.planning.impeller.impeller import FILLET, Impeller
from chipload.planning.impeller.kept import Keep, PlanTask, anew
from chipload.planning.impeller.lines import Tracks
from chipload.planning.impeller.links import Link, Linked, link_tracks
from chipload.planning.impeller.passes import surface_joint
from chipload.planning.impeller.patch import Patch
from chipload.planning.impeller.paths import PatchFinish, finish_tracks
from chipload.planning.impeller.programs import program_of
from chipload.planning.impeller.refinement import Refinement
from chipload.planning.impeller.rest_machining import (
    Pair,
    RestPasses,
    RestSettings,
)
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.surfaces import BODIES, ContactSampling, counts, hub_range
from chipload.planning.impeller.tables import IndexTable
from chipload.planning.impeller.track import ToolTrack
from chipload.program.program import Program

#: number of each surface in the scene of the blade's plus side
NUMBERS = {(0, "plus"): 0, (1, "minus"): 1, (0, "minus"): 3, (1, "plus"): 4}
NUMBERS |= {(body, f"{side} fillet"): FILLET + n for (body, side), n in NUMBERS.items()}
_FLOOR = 2
#: rest passes remove excess above this share of the scallop: above the scallop between two lines, and below the
#: limit, because only points are checked
_AIM = 0.985
#: greatest number of settings that are put into the best order; more of them always to the nearest
_EXACT = 7


#: (low, high) of u, of v
Box = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Milling:
    """A patch with its finishing path.

    Parameters
    ----------
    patch : the patch
    along : `u` or `v`, which its lines run along
    box : (low, high) of u, of v
    tracks : what is milled, and what is missed
    """

    patch: Patch
    along: str
    box: Box
    tracks: Tracks


@dataclass(frozen=True, eq=False)
class CutterSetting:
    """A cutter at a table angle with its patches and programs.

    Parameters
    ----------
    cutter, table : which, alpha [rad]
    millings : its patches in their order
    rests : rest passes where other passes leave too much, after the patches
    linked : all moves; tracks that cannot be come to
    program : in the frame of the impeller, of one channel
    loads : of its passes; None: the job has no `forces`
    """

    cutter: CatalogueCutter
    table: float
    millings: tuple[Milling, ...]
    rests: tuple[RestPasses, ...]
    linked: Linked
    program: Program
    loads: PassLoads | None = None

    @property
    def tracks(self) -> tuple[ToolTrack, ...]:
        """Tracks of all patches, then of the rest passes."""
        return (*(t for m in self.millings for t in m.tracks.tracks), *(t for r in self.rests for t in r.tracks))

    @property
    def machined(self) -> tuple[ToolTrack, ...]:
        """The tracks that are in the moves."""
        refused = {k for k, _ in self.linked.refused}
        return tuple(t for k, t in enumerate(self.tracks) if k not in refused)

    @property
    def length(self) -> float:
        """Length of the path in the cut [mm]."""
        return math.fsum(t.length for t in self.machined)

    def numbered(self, tool: int) -> CutterSetting:
        """The setting with another tool number."""
        return replace(self, program=replace(self.program, tool=np.full(len(self.program), tool)))


def channel_scene(impeller: Impeller, how: ContactSampling) -> Scene:
    """Check points of the channels beside the blade, at the spacing of ``how``."""
    check, hub = counts(impeller, how)
    return impeller.scene(
        0, "plus", ([0.5], [0.5]), check, how.near, max(how.around, 1), hub, hub_range(impeller, how.ahead)
    )


@dataclass(frozen=True, eq=False)
class FinishSettings:
    """Parameters with which finishing programs are planned.

    Parameters
    ----------
    scene : of :func:`channel_scene`
    spindle : [rad/s]
    ahead : length of the hub ahead of the blade's leading edge [mm]
    tools : tool numbers that are taken
    forces : what feeds are found with; None: every pass has the feed of ``how``
    """

    impeller: Impeller
    catalogue: Catalogue
    scene: Scene
    how: PatchFinish
    link: Link
    spindle: float
    table: IndexTable
    ahead: float = 0.0
    workers: int = 1
    tools: int = 0
    forces: ForceTerms | None = None

    @property
    def spans(self) -> tuple[tuple[float, float], ...]:
        """Allowed pallet angles [rad]."""
        return tuple((float(a), float(b)) for a, b in self.table.spans)

    def with_catalogue(self, catalogue: Catalogue) -> FinishSettings:
        """The same parameters with the cutters of another catalogue."""
        return replace(self, catalogue=catalogue)

    def milling(self, patch: Patch, keep: Keep = anew) -> Milling:
        """Finishing path of a patch."""
        along, box = lines_of(patch)
        tracks: Tracks = self.milling_task(patch).of(self, keep)
        return Milling(patch, along, box, tracks)

    def milling_task(self, patch: Patch) -> PlanTask:
        """The tracks of a patch as a task."""
        cutter = self.catalogue.cutters[patch.cutter]
        return PlanTask(("milling", *milling_key(self.catalogue, patch)), FinishSettings._tracks_of, (cutter, patch))

    def _tracks_of(self, cutter: CatalogueCutter, patch: Patch) -> Tracks:
        along, box = lines_of(patch)
        surface, number = self.surface(patch.body, patch.side), surface_number(patch.body, patch.side)
        return finish_tracks(
            surface, along, box, self.scene, number, cutter, patch.table, self.how, self.spans, self.workers,
            begin=patch.begin,
        )  # fmt: skip

    def surface(self, body: int, side: str) -> Surface:
        """The surface with its parameters."""
        return patch_of(self.impeller, BODIES[body], side, self.ahead)

    def setting(
        self, pair: Pair, millings: Sequence[Milling], rests: Sequence[RestPasses], tool: int, keep: Keep = anew
    ) -> CutterSetting:
        """The tracks of a cutter at a table angle, linked; ``tool`` its number."""
        cutter, alpha = self.catalogue.cutters[pair[0]], pair[1]
        moves: Linked = self.links_task(pair, millings, rests).of(self, keep)
        program = program_of(moves.moves, self.spindle, self.tools + tool)
        return CutterSetting(cutter, alpha, tuple(millings), tuple(rests), moves, program)

    def links_task(self, pair: Pair, millings: Sequence[Milling], rests: Sequence[RestPasses]) -> PlanTask:
        """The linked tracks of a cutter at a table angle as a task."""
        cutter, alpha = self.catalogue.cutters[pair[0]], pair[1]
        tracks = (*(t for m in millings for t in m.tracks.tracks), *(t for r in rests for t in r.tracks))
        owners = [(m.patch.body, m.patch.side, len(m.tracks.tracks)) for m in millings]
        owners += [(r.body, r.side, len(r.tracks)) for r in rests]
        stages = (sum(len(m.tracks.tracks) for m in millings),) if rests else ()
        return PlanTask(
            ("links", cutter, alpha, tracks, stages), FinishSettings._links, (cutter, alpha, tracks, stages, owners)
        )

    def _links(
        self, cutter: CatalogueCutter, alpha: float, tracks: tuple[ToolTrack, ...], stages: tuple[int, ...],
        owners: Sequence[tuple[int, str, int]],
    ) -> Linked:  # fmt: skip
        motion = self.how.motion
        refinements: list[Refinement | None] = []
        for body, side, count in owners:
            refinement = Refinement(
                self.surface(body, side),
                self.scene,
                surface_number(body, side),
                cutter,
                alpha,
                motion.chord,
                motion.clearance,
            )
            refinements += [refinement] * count
        return link_tracks(
            tracks, self.scene, cutter, alpha, motion.feed, self.link, motion.clearance, rate=motion.rate,
            joint=surface_joint(refinements), stages=stages,
        )  # fmt: skip

    def rest_settings(self, used: tuple[Pair, ...], keep: Keep = anew) -> RestSettings:
        """Parameters of rest passes, with the cutters and table angles in use."""
        how = self.how
        return RestSettings(
            self.scene, self.catalogue, how.motion, how.scallop, how.overrun, used, self.table.angle, self.spans,
            self.workers, keep,
        )  # fmt: skip


def lines_of(patch: Patch) -> tuple[str, Box]:
    """The parameter along which the lines of a patch run, and the ranges of u and v of the patch."""
    strips, part = (patch.low, patch.high), patch.part
    along, box = ("v", (strips, part)) if patch.order == "u" else ("u", (part, strips))
    if patch.part == (0.0, 1.0):
        other = np.unique(patch.at[:, 1 if patch.order == "u" else 0])
        whole = (float(other[0]), float(other[-1]))
        box = (strips, whole) if patch.order == "u" else (whole, strips)
    return along, box


#: key of a milling: surface, order of its strips, box, cutter, table angle
MillingKey = tuple[object, ...]


def milling_key(catalogue: Catalogue, patch: Patch) -> MillingKey:
    """Key of the tracks of a patch."""
    c = catalogue.cutters[patch.cutter]
    at = patch.at[:, 1 if patch.order == "u" else 0]
    ends = (float(at.min()), float(at.max()))
    return (patch.body, patch.side, patch.order, patch.low, patch.high, patch.part, ends, c, patch.table, patch.begin)


def setting_order(pairs: Sequence[Pair], changes: Changes) -> list[Pair]:
    """Cutters at table angles in the order with the shortest changes: exact for up to seven, else always to the
    nearest.

    >>> setting_order([(0, 1.0), (1, 0.5), (0, 0.5)], Changes(60.0, 300.0))
    [(0, 1.0), (0, 0.5), (1, 0.5)]
    """
    if len(pairs) <= _EXACT:
        orders = [list(some) for some in itertools.permutations(pairs)]
        return min(orders, key=lambda some: change_time(some, changes))
    order, left = [pairs[0]], list(pairs[1:])
    while left:
        order.append(min(left, key=lambda pair: change_time((order[-1], pair), changes)))
        left.remove(order[-1])
    return order


def change_time(pairs: Iterable[Pair], changes: Changes) -> float:
    """Time of the changes from each setting to the next [s].

    >>> change_time([(0, 1.0), (1, 0.5), (0, 0.5)], Changes(60.0, 300.0))
    420.0
    """
    two = list(itertools.pairwise(pairs))
    return changes.cutter * sum(a[0] != b[0] for a, b in two) + changes.table * sum(a[1] != b[1] for a, b in two)


def surface_number(body: int, side: str) -> int:
    """Number of a surface in the scene of a channel."""
    return NUMBERS.get((body, side), _FLOOR)
