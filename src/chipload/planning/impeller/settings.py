"""From patches to moves: one program for each cutter at each table angle, every patch finished in its turn.

What the passes of all patches together leave too high is milled by rest passes (``rest.py``), in the program of the
cutter at the table angle that reaches it, or in one of its own.

Notation: a setting is a cutter at a table angle with the patches that are milled so; alpha table angle [rad]. In the
scene of a channel the surfaces are numbered as :meth:`Impeller.scene` does for the plus side of the blade.
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
from chipload.planning.impeller.feeds import ForceTerms, PassLoads, PassRows, pass_feeds
from chipload.planning.impeller.floor import patch_of
from chipload.planning.impeller.impeller import FILLET, Impeller
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.lines import Tracks
from chipload.planning.impeller.links import Link, Linked, linked
from chipload.planning.impeller.passes import surface_joint
from chipload.planning.impeller.patch import Patch
from chipload.planning.impeller.paths import PatchFinish, finishing
from chipload.planning.impeller.programs import program_of
from chipload.planning.impeller.refinement import Refinement
from chipload.planning.impeller.rest_machining import (
    Pair,
    RestPasses,
    RestSettings,
    SurfaceGrid,
    face_of,
    left_over,
    regions,
)
from chipload.planning.impeller.scene import Floats, Scene
from chipload.planning.impeller.surfaces import BODIES, ContactSampling, counts, hub_range
from chipload.planning.impeller.tables import IndexTable
from chipload.planning.impeller.track import ToolTrack
from chipload.program.program import LINE, Program
from chipload.progress import Progress, silent

#: number of each surface in the scene of the blade's plus side
NUMBERS = {(0, "plus"): 0, (1, "minus"): 1, (0, "minus"): 3, (1, "plus"): 4}
NUMBERS |= {(body, f"{side} fillet"): FILLET + n for (body, side), n in NUMBERS.items()}
_FLOOR = 2
#: rest passes take what is left above this share of the scallop: above what is left between two lines, and below
#: what is asked, for the count is of points
_AIM = 0.985
#: so many settings are brought into the best order; more of them on and on to the nearest
_EXACT = 7


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
    box: tuple[tuple[float, float], tuple[float, float]]
    tracks: Tracks


@dataclass(frozen=True, eq=False)
class CutterSetting:
    """A cutter at a table angle.

    Parameters
    ----------
    cutter, table : which, alpha [rad]
    millings : its patches in their order
    rests : rest passes where other passes leave too much, after the patches
    linked : all moves; tracks that cannot be come to
    program : in the frame of the impeller, of one channel
    loads : of its passes; None: forces are not asked for
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
        """Of all patches, then of the rest passes."""
        return (*(t for m in self.millings for t in m.tracks.tracks), *(t for r in self.rests for t in r.tracks))

    @property
    def machined(self) -> tuple[ToolTrack, ...]:
        """The tracks that are in the moves."""
        gone = {k for k, _ in self.linked.refused}
        return tuple(t for k, t in enumerate(self.tracks) if k not in gone)

    @property
    def length(self) -> float:
        """Of the path in the cut [mm]."""
        return math.fsum(t.length for t in self.machined)

    def numbered(self, tool: int) -> CutterSetting:
        """The same with another tool number."""
        return replace(self, program=replace(self.program, tool=np.full(len(self.program), tool)))


@dataclass(frozen=True, eq=False)
class PlannedSettings:
    """All settings, and what by the planner's own count is still left higher than asked.

    ``left`` [mm2] of each surface by body and side, ``unreached`` [mm2] of it where no cutter and table angle that was
    tried has a valid pallet angle.
    """

    settings: tuple[CutterSetting, ...]
    left: dict[tuple[int, str], float]
    unreached: dict[tuple[int, str], float]


def channel_scene(impeller: Impeller, how: ContactSampling) -> Scene:
    """Check points of the channels beside the blade, as fine as ``how`` says."""
    check, hub = counts(impeller, how)
    return impeller.scene(
        0, "plus", ([0.5], [0.5]), check, how.near, max(how.around, 1), hub, hub_range(impeller, how.ahead)
    )


@dataclass(frozen=True, eq=False)
class FinishSettings:
    """What finishing programs are planned with.

    Parameters
    ----------
    scene : of :func:`channel_scene`
    spindle : [rad/s]
    ahead : how far the hub goes on ahead of the blade's leading edge [mm]
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
        """Where the pallet may stand [rad]."""
        return tuple((float(a), float(b)) for a, b in self.table.spans)

    def with_catalogue(self, catalogue: Catalogue) -> FinishSettings:
        """The same with the cutters of another catalogue."""
        return replace(self, catalogue=catalogue)

    def milling(self, patch: Patch, keep: Keep = anew) -> Milling:
        """The finishing path of a patch."""
        strips, part = (patch.low, patch.high), patch.part
        along, box = ("v", (strips, part)) if patch.order == "u" else ("u", (part, strips))
        if patch.part == (0.0, 1.0):
            other = np.unique(patch.at[:, 1 if patch.order == "u" else 0])
            whole = (float(other[0]), float(other[-1]))
            box = (strips, whole) if patch.order == "u" else (whole, strips)
        tracks = keep(
            ("milling", *_key(self.catalogue, patch)),
            lambda: finishing(
                self.surface(patch.body, patch.side), along, box, self.scene, _number(patch.body, patch.side),
                self.catalogue.cutters[patch.cutter], patch.table, self.how, self.spans, self.workers,
            ),
        )  # fmt: skip
        return Milling(patch, along, box, tracks)

    def surface(self, body: int, side: str) -> Surface:
        """The surface with its parameters."""
        return patch_of(self.impeller, BODIES[body], side, self.ahead)

    def mender(self, body: int, side: str, pair: Pair) -> Refinement:
        """Puts points between those of a track, or of a way between two of them."""
        motion = self.how.motion
        return Refinement(
            self.surface(body, side), self.scene, _number(body, side), self.catalogue.cutters[pair[0]], pair[1],
            motion.chord, motion.clearance,
        )  # fmt: skip

    def setting(
        self, pair: Pair, millings: Sequence[Milling], rests: Sequence[RestPasses], tool: int, keep: Keep = anew
    ) -> CutterSetting:
        """The tracks of a cutter at a table angle, linked; ``tool`` its number."""
        cutter, alpha = self.catalogue.cutters[pair[0]], pair[1]
        tracks = (*(t for m in millings for t in m.tracks.tracks), *(t for r in rests for t in r.tracks))
        motion = self.how.motion
        owners = [(m.patch.body, m.patch.side, m.tracks.tracks) for m in millings]
        owners += [(r.body, r.side, r.tracks) for r in rests]
        menders = [x for body, side, rows in owners for x in [self.mender(body, side, pair)] * len(rows)]
        stages = (sum(len(m.tracks.tracks) for m in millings),) if rests else ()
        moves = keep(
            ("links", cutter, alpha, tracks, stages),
            lambda: linked(
                tracks, self.scene, cutter, alpha, motion.feed, self.link, motion.clearance, rate=motion.rate,
                joint=surface_joint(menders), stages=stages,
            ),
        )  # fmt: skip
        program = program_of(moves.moves, self.spindle, self.tools + tool)
        return CutterSetting(cutter, alpha, tuple(millings), tuple(rests), moves, program)


#: what a milling is known by: surface, order of its strips, box, cutter, table angle
MillingKey = tuple[object, ...]


def planned(
    job: FinishSettings,
    patches: Sequence[Patch],
    changes: Changes,
    rounds: int = 8,
    progress: Progress = silent,
    known: dict[MillingKey, Milling] | None = None,
    keep: Keep = anew,
    fine: float = 1.0,
) -> PlannedSettings:
    """The settings of patches with their rest passes, in the order in which changes take least.

    Parameters
    ----------
    changes : what a change of cutter and a setting of the table take
    rounds : most times that what is left is looked at and milled with rest passes
    known : millings that are planned already; those that are planned here are added
    keep : gives what an earlier run has finished of them
    fine : distance of the points at which what is left is counted, over the usual one
    """
    groups: dict[Pair, list[Milling]] = {}
    known = {} if known is None else known
    for done, patch in enumerate(patches):
        key = _key(job.catalogue, patch)
        if key not in known:
            known[key] = job.milling(patch, keep)
        milling = replace(known[key], patch=patch)
        groups.setdefault((patch.cutter, patch.table), []).append(milling)
        progress(0.8 * (done + 1) / len(patches), f"paths of {done + 1} patches")
    settings = {pair: job.setting(pair, rows, (), k, keep) for k, (pair, rows) in enumerate(groups.items(), 1)}
    faces = _faces(job, [m for rows in groups.values() for m in rows], fine)
    h = job.how.scallop
    hopeless = [np.zeros((len(f.u), len(f.v)), dtype=np.bool_) for f in faces]
    left: list[Floats] = []
    memory: LeftMemory = {}
    for turn in range(rounds + 1):
        left = [_left(f, settings.values(), memory) for f in faces]
        plan = RestSettings(
            job.scene, job.catalogue, job.how.motion, h, job.how.overrun, tuple(settings), job.table.angle, job.spans,
            job.workers, keep,
        )  # fmt: skip
        new: dict[Pair, list[RestPasses]] = {}
        for face, over, lost in zip(faces, left, hopeless, strict=True):
            for region in regions(over, _AIM * h, lost) if turn < rounds else ():
                pair = plan.chosen(face, region)
                if pair is None:
                    lost |= region
                else:
                    new.setdefault(pair, []).append(plan.passes(face, region, pair))
                progress(0.8 + 0.2 * turn / rounds, f"rest passes, {turn + 1} times")
        if not new:
            break
        for pair, rests in new.items():
            old = settings.get(pair)
            settings[pair] = job.setting(
                pair, old.millings if old else (), (*(old.rests if old else ()), *rests),
                [*settings].index(pair) + 1 if old else len(settings) + 1, keep,
            )  # fmt: skip
        progress(0.8 + 0.2 * (turn + 1) / rounds, f"rest passes, {turn + 1} times")
    area, lost_area = {}, {}
    for face, over, lost in zip(faces, left, hopeless, strict=True):
        cell = _cells(face)
        area[face.body, face.side] = float(cell[over > h].sum())
        lost_area[face.body, face.side] = float(cell[(over > h) & lost].sum())
    order = setting_order(list(settings), changes)
    numbered = tuple(settings[pair].numbered(job.tools + k) for k, pair in enumerate(order, 1))
    return PlannedSettings(settings_with_feeds(job, numbered), area, lost_area)


def settings_with_feeds(job: FinishSettings, settings: tuple[CutterSetting, ...]) -> tuple[CutterSetting, ...]:
    """The settings, in the order in which they are milled, with the feeds that forces allow."""
    if job.forces is None:
        return settings
    most = job.how.motion.feed
    passes = [_pass_rows(job, s) for s in settings]
    cutters = [s.cutter for s in settings]
    found = pass_feeds([(c, [p for _, p in rows]) for c, rows in zip(cutters, passes, strict=True)], job.forces, most)
    out = []
    for s, rows, (feeds, loads) in zip(settings, passes, found, strict=True):
        allowed = np.full(len(s.tracks) + 1, most)
        allowed[[number for number, _ in rows]] = feeds
        program, to = s.program, s.linked.track
        # the cutter stays down from the end of one pass to the beginning of the next
        own = np.minimum(allowed[to], allowed[np.concatenate([to[:1], to[:-1]])])
        in_cut = (program.motion == LINE) & (program.feed <= most * (1.0 + 1e-12)) & (to >= 0)
        feed = np.where(in_cut, np.minimum(program.feed, own), program.feed)
        out.append(replace(s, program=replace(program, feed=feed), loads=loads))
    return tuple(out)


def _pass_rows(job: FinishSettings, s: CutterSetting) -> list[tuple[int, PassRows]]:
    """Number and rows of each track of a setting, in the order in which they are milled."""
    owners = [(m.patch.body, m.patch.side, t) for m in s.millings for t in m.tracks.tracks]
    owners += [(r.body, r.side, t) for r in s.rests for t in r.tracks]
    cut = np.array([name == "finish" for name in s.program.labels])[s.program.label] & (s.linked.track >= 0)
    numbers = s.linked.track[cut]
    out = []
    for number in dict.fromkeys(numbers.tolist()):
        rows = np.flatnonzero(cut & (s.linked.track == number))
        body, side, track = owners[number]
        tip = s.program.p_work[rows]
        at = np.array([int(((track.tip - p) ** 2).sum(axis=1).argmin()) for p in tip])
        K = job.surface(body, side).curvature(*track.at[at].T)
        out.append((number, PassRows(rows, tip, s.program.axis[rows], track.contact[at], track.normal[at], K)))
    return out


#: what the tracks of a patch, or of rest passes, leave on a surface: by the surface and the tracks, which it keeps
LeftMemory = dict[tuple[int, tuple[int, ...]], tuple[Floats, tuple[ToolTrack, ...]]]


def _left(face: SurfaceGrid, settings: Iterable[CutterSetting], memory: LeftMemory) -> Floats:
    """(a, b) float [mm] what all tracks that are in the moves leave on the grid of a surface."""
    out = np.full((len(face.u), len(face.v)), np.inf)
    for s in settings:
        gone, first = {k for k, _ in s.linked.refused}, 0
        for tracks in (*(m.tracks.tracks for m in s.millings), *(r.tracks for r in s.rests)):
            milled = tuple(t for k, t in enumerate(tracks, first) if k not in gone)
            first += len(tracks)
            key = (id(face), tuple(id(t) for t in milled))
            if key not in memory:
                memory[key] = left_over(face, [(s.cutter, milled)]), milled
            out = np.minimum(out, memory[key][0])
    return out


def _key(catalogue: Catalogue, patch: Patch) -> MillingKey:
    c = catalogue.cutters[patch.cutter]
    at = patch.at[:, 1 if patch.order == "u" else 0]
    ends = (float(at.min()), float(at.max()))
    return (patch.body, patch.side, patch.order, patch.low, patch.high, patch.part, ends, c, patch.table)


def setting_order(pairs: Sequence[Pair], changes: Changes) -> list[Pair]:
    """Cutters at table angles in the order in which changes take least: exact for up to seven, else on to the nearest.

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
    """What the changes from each to the next take [s].

    >>> change_time([(0, 1.0), (1, 0.5), (0, 0.5)], Changes(60.0, 300.0))
    420.0
    """
    two = list(itertools.pairwise(pairs))
    return changes.cutter * sum(a[0] != b[0] for a, b in two) + changes.table * sum(a[1] != b[1] for a, b in two)


def _number(body: int, side: str) -> int:
    return NUMBERS.get((body, side), _FLOOR)


def _faces(job: FinishSettings, millings: Sequence[Milling], fine: float) -> list[SurfaceGrid]:
    """Every surface that is milled, as far as its patches go."""
    boxes: dict[tuple[int, str], list[tuple[tuple[float, float], tuple[float, float]]]] = {}
    for m in millings:
        boxes.setdefault((m.patch.body, m.patch.side), []).append(m.box)
    corner = min(job.catalogue.cutters[m.patch.cutter].corner_radius for m in millings)
    out = []
    for (body, side), rows in boxes.items():
        grid = np.array(rows)
        low, high = grid[:, :, 0].min(axis=0), grid[:, :, 1].max(axis=0)
        box = ((float(low[0]), float(high[0])), (float(low[1]), float(high[1])))
        surface, number = job.surface(body, side), _number(body, side)
        out.append(face_of(body, side, surface, number, box, job.how.scallop, corner, fine))
    return out


def _cells(face: SurfaceGrid) -> Floats:
    """(a, b) area [mm2] that each grid point stands for."""
    U, V = (x.ravel() for x in np.meshgrid(face.u, face.v, indexing="ij"))
    size = np.linalg.norm(np.cross(face.surface.at(U, V, 1, 0), face.surface.at(U, V, 0, 1)), axis=1)
    out: Floats = size.reshape(len(face.u), len(face.v)) * (face.u[1] - face.u[0]) * (face.v[1] - face.v[0])
    return out
