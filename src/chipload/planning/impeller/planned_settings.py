"""Settings of patches with their rest passes, in the order in which they are milled.

Rest passes (``rest_machining.py``) mill what the passes of all patches together leave too high, in the program of the
cutter at the table angle that reaches it, or in a program of their own. Parts that other processes can plan meanwhile
(paths of patches, links, rest passes) are announced in advance, round by round.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chipload.cutter.catalogue import Catalogue
from chipload.planning.impeller.assignment import Changes
from chipload.planning.impeller.feeds import PassRows, pass_feeds
from chipload.planning.impeller.kept import Keep, PlanTask, anew
from chipload.planning.impeller.patch import Patch
from chipload.planning.impeller.rest_machining import (
    Flags,
    Pair,
    RestPasses,
    SurfaceGrid,
    face_of,
    left_over,
    regions,
)
from chipload.planning.impeller.scene import Floats
from chipload.planning.impeller.settings import (
    Box,
    CutterSetting,
    FinishSettings,
    Milling,
    MillingKey,
    milling_key,
    setting_order,
    surface_number,
)
from chipload.planning.impeller.track import ToolTrack
from chipload.program.program import LINE, Program
from chipload.progress import Progress, part_of, silent

#: rest passes remove excess above this share of the scallop: above the scallop between two lines, and below the
#: limit, because only points are checked
_AIM = 0.985


@dataclass(frozen=True, eq=False)
class PlannedSettings:
    """All settings, and the places that by the planner's own check are still higher than required.

    ``left`` [mm2] of each surface by body and side, ``unreached`` [mm2] of it where no cutter and table angle that was
    tried has a valid pallet angle.
    """

    settings: tuple[CutterSetting, ...]
    left: dict[tuple[int, str], float]
    unreached: dict[tuple[int, str], float]


def plan_settings(
    job: FinishSettings,
    patches: Sequence[Patch],
    changes: Changes,
    rounds: int = 8,
    progress: Progress = silent,
    known: dict[MillingKey, Milling] | None = None,
    keep: Keep = anew,
    fine: float = 1.0,
) -> PlannedSettings:
    """The settings of patches with their rest passes, in the order with the shortest changes.

    Parameters
    ----------
    changes : what a change of cutter and a setting of the table take
    rounds : greatest number of rounds of rest passes
    known : millings that are planned already; those that are planned here are added
    keep : gives what an earlier run has finished of them
    fine : distance of the points at which what is left is counted, over the usual one
    """
    groups: dict[Pair, list[Milling]] = {}
    known = {} if known is None else known
    announce_millings([(job, patches)], known, keep, part_of(progress, 0.0, 0.8))
    for done, patch in enumerate(patches):
        key = milling_key(job.catalogue, patch)
        if key not in known:
            known[key] = job.milling(patch, keep)
        milling = replace(known[key], patch=patch)
        groups.setdefault((patch.cutter, patch.table), []).append(milling)
        progress(0.8 * (done + 1) / len(patches), f"paths of {done + 1} patches")
    keep.ahead([job.links_task(pair, rows, ()) for pair, rows in groups.items()])
    settings = {pair: job.setting(pair, rows, (), k, keep) for k, (pair, rows) in enumerate(groups.items(), 1)}
    faces = _faces(job, [m for rows in groups.values() for m in rows], fine)
    h = job.how.scallop
    hopeless = [np.zeros((len(f.u), len(f.v)), dtype=np.bool_) for f in faces]
    left: list[Floats] = []
    memory: LeftMemory = {}
    for turn in range(rounds + 1):
        left = [_excess_left(f, settings.values(), memory) for f in faces]
        if turn == rounds:
            break
        open_yet = [
            (face, region, unreachable)
            for face, over, unreachable in zip(faces, left, hopeless, strict=True)
            for region in regions(over, _AIM * h, unreachable)
        ]
        part = part_of(progress, 0.8 + 0.2 * turn / rounds, 0.8 + 0.2 * (turn + 1) / rounds)
        new = _rest_passes(job, tuple(settings), open_yet, keep, part)
        if not new:
            break
        grown = {pair: _with_rests(settings.get(pair), rests) for pair, rests in new.items()}
        keep.ahead([job.links_task(pair, *rows) for pair, rows in grown.items()])
        for pair, rows in grown.items():
            tool = [*settings].index(pair) + 1 if pair in settings else len(settings) + 1
            settings[pair] = job.setting(pair, *rows, tool, keep)
        progress(0.8 + 0.2 * (turn + 1) / rounds, f"rest passes, {turn + 1} times")
    area, unreachable_area = {}, {}
    for face, over, unreachable in zip(faces, left, hopeless, strict=True):
        cell = _cells(face)
        area[face.body, face.side] = float(cell[over > h].sum())
        unreachable_area[face.body, face.side] = float(cell[(over > h) & unreachable].sum())
    order = setting_order(list(settings), changes)
    numbered = tuple(settings[pair].numbered(job.tools + k) for k, pair in enumerate(order, 1))
    return PlannedSettings(settings_with_feeds(job, numbered), area, unreachable_area)


def announce_millings(
    plans: Sequence[tuple[FinishSettings, Sequence[Patch]]], known: Mapping[MillingKey, Milling], keep: Keep,
    progress: Progress = silent,
) -> None:  # fmt: skip
    """Announce the paths of the patches of several partitions that are not ``known``, the longest path first, so that
    no process waits for it at the end.
    """
    parts = {
        key: (patch.path, job.milling_task(patch))
        for job, patches in plans
        for patch in patches
        if (key := milling_key(job.catalogue, patch)) not in known
    }
    tasks = [task for _, task in sorted(parts.values(), key=lambda one: -one[0])]
    keep.ahead(tasks, lambda done, what: progress(done, f"paths of patches, {what}"))


def _rest_passes(
    job: FinishSettings, used: tuple[Pair, ...], open_yet: Sequence[tuple[SurfaceGrid, Flags, Flags]], keep: Keep,
    progress: Progress,
) -> dict[Pair, list[RestPasses]]:  # fmt: skip
    """Rest passes of regions, each of a surface, by the cutter at a table angle; where there is none it is noted."""
    plan = job.rest_settings(used, keep)
    given = (job.catalogue, used)
    keep.ahead(
        [PlanTask(plan.pair_key(face, region), _rest_pair, (*given, face, region)) for face, region, _ in open_yet],
        lambda done, _: progress(0.5 * done, "cutters of rest passes"),
    )
    chosen = []
    for face, region, unreachable in open_yet:
        pair = plan.chosen(face, region)
        if pair is None:
            unreachable |= region
        else:
            chosen.append((face, region, pair))
        progress(0.5, "cutters of rest passes")
    keep.ahead(
        [PlanTask(plan.passes_key(*one), _rest_path, (*given, *one)) for one in chosen],
        lambda done, _: progress(0.5 + 0.5 * done, "rest passes"),
    )
    new: dict[Pair, list[RestPasses]] = {}
    for face, region, pair in chosen:
        new.setdefault(pair, []).append(plan.passes(face, region, pair))
        progress(1.0, "rest passes")
    return new


def _rest_pair(
    job: FinishSettings, catalogue: Catalogue, used: tuple[Pair, ...], face: SurfaceGrid, region: Flags
) -> Pair | None:
    """The cutter and table angle of a region; another process executes it."""
    return job.with_catalogue(catalogue).rest_settings(used).chosen(face, region)


def _rest_path(
    job: FinishSettings, catalogue: Catalogue, used: tuple[Pair, ...], face: SurfaceGrid, region: Flags, pair: Pair
) -> RestPasses:
    """The rest passes of a region; another process executes it."""
    return job.with_catalogue(catalogue).rest_settings(used).passes(face, region, pair)


def _with_rests(
    old: CutterSetting | None, rests: Sequence[RestPasses]
) -> tuple[tuple[Milling, ...], tuple[RestPasses, ...]]:
    """Patches and rest passes of a setting with more of these."""
    return (old.millings if old else (), (*(old.rests if old else ()), *rests))


def settings_with_feeds(job: FinishSettings, settings: tuple[CutterSetting, ...]) -> tuple[CutterSetting, ...]:
    """The settings, in the order in which they are milled, with the feeds that the forces allow."""
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


def loads_at_feeds(
    job: FinishSettings, settings: tuple[CutterSetting, ...], programs: Sequence[Program]
) -> tuple[CutterSetting, ...]:
    """The settings, in the order in which they are milled, with the loads of other programs of the same rows."""
    if job.forces is None:
        return settings
    other = [replace(s, program=program) for s, program in zip(settings, programs, strict=True)]
    passes = [_pass_rows(job, s) for s in other]
    feeds = [[float(s.program.feed[p.rows].max()) for _, p in rows] for s, rows in zip(other, passes, strict=True)]
    given = [(s.cutter, [p for _, p in rows]) for s, rows in zip(other, passes, strict=True)]
    found = pass_feeds(given, job.forces, job.how.motion.feed, feeds)
    return tuple(replace(s, loads=loads) for s, (_, loads) in zip(settings, found, strict=True))


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


def _excess_left(face: SurfaceGrid, settings: Iterable[CutterSetting], memory: LeftMemory) -> Floats:
    """Excess (a, b) float [mm] of all tracks that are in the moves, on the grid of a surface."""
    out = np.full((len(face.u), len(face.v)), np.inf)
    for s in settings:
        refused, first = {k for k, _ in s.linked.refused}, 0
        for tracks in (*(m.tracks.tracks for m in s.millings), *(r.tracks for r in s.rests)):
            milled = tuple(t for k, t in enumerate(tracks, first) if k not in refused)
            first += len(tracks)
            key = (id(face), tuple(id(t) for t in milled))
            if key not in memory:
                memory[key] = left_over(face, [(s.cutter, milled)]), milled
            out = np.minimum(out, memory[key][0])
    return out


def _faces(job: FinishSettings, millings: Sequence[Milling], fine: float) -> list[SurfaceGrid]:
    """Every surface that is milled, within its patches."""
    boxes: dict[tuple[int, str], list[Box]] = {}
    for m in millings:
        boxes.setdefault((m.patch.body, m.patch.side), []).append(m.box)
    corner = min(job.catalogue.cutters[m.patch.cutter].corner_radius for m in millings)
    out = []
    for (body, side), rows in boxes.items():
        grid = np.array(rows)
        low, high = grid[:, :, 0].min(axis=0), grid[:, :, 1].max(axis=0)
        box = ((float(low[0]), float(high[0])), (float(low[1]), float(high[1])))
        surface, number = job.surface(body, side), surface_number(body, side)
        out.append(face_of(body, side, surface, number, box, job.how.scallop, corner, fine))
    return out


def _cells(face: SurfaceGrid) -> Floats:
    """Area (a, b) [mm2] of the surface round each grid point."""
    U, V = (x.ravel() for x in np.meshgrid(face.u, face.v, indexing="ij"))
    size = np.linalg.norm(np.cross(face.surface.at(U, V, 1, 0), face.surface.at(U, V, 0, 1)), axis=1)
    out: Floats = size.reshape(len(face.u), len(face.v)) * (face.u[1] - face.u[0]) * (face.v[1] - face.v[0])
    return out
