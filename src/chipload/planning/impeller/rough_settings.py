"""Roughing of every channel: its cutters, their table angles, and the programs.

Notation: alpha table angle, D diameter. A channel is searched at points of its layers (``floor.py``) between walls that
are thicker by their allowances. The roughing cutter is the largest that, by the proved search, fits at a stated share
of these points; its table angle is the one at which it fits at most of them. Points that it does not reach are roughed
at a second angle where that adds enough, and so on; its rows cover only what earlier rows do not reach.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.floor import layer_of
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.lines import Tracks
from chipload.planning.impeller.links import Link, Linked, link_tracks
from chipload.planning.impeller.pallet_ranges import valid_ranges
from chipload.planning.impeller.programs import program_of
from chipload.planning.impeller.roughing import RoughingSettings, layers, roughing_tracks, thicken_walls, uncut
from chipload.planning.impeller.scene import Floats, Scene
from chipload.planning.impeller.tables import IndexTable
from chipload.planning.impeller.track import ToolTrack
from chipload.program.program import Program
from chipload.progress import Progress, silent

#: shares along and across a layer of the points at which a channel is searched; greatest number of layers
_ALONG, _ACROSS, _LAYERS = np.linspace(0.06, 0.94, 9), (0.25, 0.5, 0.75), 4
#: least share of the points that a further table angle must add
_WORTH = 0.1


@dataclass(frozen=True, eq=False)
class RoughingSetting:
    """Roughing of one channel with one cutter at one table angle.

    Parameters
    ----------
    index : number of the body on whose plus side the channel lies
    cutter, table : the cutter, alpha [rad]
    layers : number of layers
    tracks : rows, and the spans that they miss
    linked : all moves
    program : in the frame of the impeller
    stopped : rows that are left out because the tool above its cutting part would meet uncut blank
    walls, top, how, link, spindle, tool : inputs of the moves
    """

    index: int
    cutter: CatalogueCutter
    table: float
    layers: int
    tracks: Tracks
    linked: Linked
    program: Program
    stopped: tuple[ToolTrack, ...]
    walls: Scene
    top: Floats
    how: RoughingSettings
    link: Link
    spindle: float
    tool: int

    def without(self, numbers: Sequence[int]) -> RoughingSetting:
        """The setting without some of its rows, with new links."""
        removed = set(numbers)
        remaining = tuple(t for k, t in enumerate(self.tracks.tracks) if k not in removed)
        left_out = tuple(t for k, t in enumerate(self.tracks.tracks) if k in removed)
        tracks = replace(self.tracks, tracks=remaining)
        linked = _link_rows(remaining, self.walls, self.cutter, self.table, self.how, self.link, self.top)
        program = program_of(linked.moves, self.spindle, self.tool)
        return replace(self, tracks=tracks, linked=linked, program=program, stopped=(*self.stopped, *left_out))

    def numbered(self, tool: int) -> RoughingSetting:
        """The setting with another tool number."""
        return replace(self, tool=tool, program=program_of(self.linked.moves, self.spindle, tool))

    @property
    def machined(self) -> tuple[ToolTrack, ...]:
        """The rows that are in the moves."""
        refused = {k for k, _ in self.linked.refused}
        return tuple(t for k, t in enumerate(self.tracks.tracks) if k not in refused)


def rough_channels(
    impeller: Impeller, catalogue: Catalogue, stated: CatalogueCutter | None, how: RoughingSettings, link: Link,
    spindle: float,
    table: IndexTable, share: float, ahead: float = 0.0, workers: int = 1, progress: Progress = silent,
    keep: Keep = anew,
) -> tuple[RoughingSetting, ...]:  # fmt: skip
    """Roughing programs of all channels.

    Parameters
    ----------
    stated : the cutter; None: the largest of the catalogue that fits at the ``share`` of the points of the channels
    spindle : [rad/s]
    ahead : length of the hub ahead of the blade's leading edge [mm]

    Raises
    ------
    InputError
        No cutter fits at the share of the points.
    """
    scenes = [_channel_scene(impeller, k, how, ahead) for k in range(len(impeller.bodies))]
    cutter = stated
    if cutter is None:
        cutter = keep(("rough cutter",), lambda: _largest(scenes, catalogue, how, table, share, workers))
    spans = tuple((float(a), float(b)) for a, b in table.spans)
    plans: list[tuple[int, float]] = []
    for index, scene in enumerate(scenes):
        fits = keep(("rough tables", index, cutter), partial(_reached_at, scene, cutter, how, table, workers))
        if not fits.any():
            raise InputError(
                f"operation.0.rough: {cutter.label} mm fits nowhere in the channel "
                f"on the plus side of the {'splitter' if index else 'blade'}: state a smaller one"
            )
        done = np.zeros(fits.shape[1], dtype=np.bool_)
        while True:
            gain = (fits & ~done).sum(axis=1)
            best = int(gain.argmax())
            if done.any() and gain[best] < _WORTH * len(done):
                break
            plans.append((index, float(table.angle[best])))
            done |= fits[best]
            if done.all():
                break
    out: list[RoughingSetting] = []
    for k, (index, alpha) in enumerate(plans):
        before = [t for r in out if r.index == index for t in r.machined]
        tracks = keep(
            ("rough rows", index, cutter, alpha, before),
            partial(
                roughing_tracks, impeller, index, cutter, alpha, how, ahead, spans, workers,
                _part(progress, k, len(plans)), before,
            ),
        )  # fmt: skip
        walls, top = thicken_walls(impeller, index, how, ahead), uncut(impeller, index, how, ahead, whole=True)
        linked = keep(
            ("rough links", index, cutter, alpha, before),
            partial(_link_rows, tracks.tracks, walls, cutter, alpha, how, link, top),
        )
        count = len(layers(impeller, how.depth, how.hub, ahead))
        program, tool = program_of(linked.moves, spindle, len(out) + 1), len(out) + 1
        out.append(
            RoughingSetting(
                index, cutter, alpha, count, tracks, linked, program, (), walls, top, how, link, spindle, tool
            )
        )
    return tuple(out)


def _link_rows(
    tracks: tuple[ToolTrack, ...],
    walls: Scene,
    cutter: CatalogueCutter,
    alpha: float,
    how: RoughingSettings,
    link: Link,
    top: Floats,
) -> Linked:
    motion = how.motion
    return link_tracks(
        tracks, walls, cutter, alpha, motion.feed, link, motion.clearance, "rough", motion.rate, one_way=True,
        outline=top,
    )  # fmt: skip


def _part(progress: Progress, k: int, n: int) -> Progress:
    return lambda done, what: progress((k + done) / n, what)


def _channel_scene(impeller: Impeller, index: int, how: RoughingSettings, ahead: float) -> Scene:
    """Points of some layers of a channel, with its thickened walls."""
    w = layers(impeller, how.depth, how.hub, ahead)
    some = w[np.unique(np.linspace(0, len(w) - 1, min(len(w), _LAYERS)).round().astype(int))]
    parts: list[tuple[Floats, Floats, Floats]] = []
    u, v = (x.ravel() for x in np.meshgrid(_ALONG, _ACROSS, indexing="ij"))
    for share in some:
        patch = layer_of(impeller, index, float(share), how.hub, ahead)
        parts.append((patch.at(u, v), patch.normal(u, v), patch.curvature(u, v)))
    S, N, K = (np.concatenate([p[k] for p in parts]) for k in range(3))
    return thicken_walls(impeller, index, how, ahead).at_contacts(S, N, K, 2)


def _largest(
    scenes: Sequence[Scene], catalogue: Catalogue, how: RoughingSettings, table: IndexTable, share: float, workers: int
) -> CatalogueCutter:
    """The largest cutter that fits at the share of the points, each at its own table angle."""
    found = np.concatenate(
        [
            largest_cutters(
                s, catalogue, table.angle, how.motion.clearance, pallets=table.spans, workers=workers
            ).diameter
            for s in scenes
        ]
    )
    most = float(np.sort(found)[::-1][max(int(np.ceil(share * len(found))) - 1, 0)])
    if most <= 0.0:
        raise InputError(
            f"operation.0.rough.share = {share:g}: no cutter of catalogue {catalogue.name} fits at that share of "
            f"the points of the channels, at most at {float((found > 0.0).mean()):.3g} of them: lower it, or "
            "state a cutter"
        )
    candidates = [c for c in catalogue.cutters if c.diameter <= most]
    return max(candidates, key=lambda c: (c.diameter, c.corner_radius))


def _reached_at(
    scene: Scene, cutter: CatalogueCutter, how: RoughingSettings, table: IndexTable, workers: int
) -> NDArray[np.bool_]:
    """(t, c) whether a cutter fits at each point of a channel, at each table angle."""
    return np.array([_fits_at(scene, cutter, float(alpha), how, table, workers) for alpha in table.angle])


def _fits_at(
    scene: Scene, cutter: CatalogueCutter, alpha: float, how: RoughingSettings, table: IndexTable, workers: int
) -> NDArray[np.bool_]:
    got = valid_ranges(scene, cutter, alpha, how.motion.clearance, table.spans, workers=workers)
    return np.array([len(r) > 0 for r in got.ranges])
