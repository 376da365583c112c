"""Roughing paths of a channel between two bodies: layers from the shroud down to the hub, with rows in each.

Notation: a layer lies at the share w between the hub, with its allowance, and the shroud (``floor.py``); w decreases
from layer to layer so that none is thicker than the depth. In a layer the rows run along u, as far across as the cutter
fits beside walls thicker by their allowance, at most the step apart. Each row begins beyond the outlet, in the air, and
runs to the inlet: the cutter enters a row from outside, and never plunges into solid material.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import scipy
from chipload.planning.impeller.floor import layer_of, meridian
from chipload.planning.impeller.impeller import ARC, SUNK, Impeller
from chipload.planning.impeller.lines import LineMotion, Lines, Tracks, UnreachedSpan
from chipload.planning.impeller.pallet_ranges import FULL
from chipload.planning.impeller.scene import Floats, Scene
from chipload.planning.impeller.surfaces import hub_range
from chipload.planning.impeller.track import ToolTrack
from chipload.progress import Progress, silent

#: beyond the outlet a row begins so far from it, beside the cutter's diameter [mm]
OUTSIDE = 2.0
#: least stations of a row; how far within the border the outermost rows are, as a share of the width
_FEWEST, _INSET = 17, 0.02


@dataclass(frozen=True)
class RoughingSettings:
    """Parameters of the roughing of a channel.

    Parameters
    ----------
    depth : greatest thickness of a layer [mm]
    step : greatest distance of rows [mm]
    blades, hub : allowances [mm]
    motion : what the rows are milled with
    spacing : of the check points [mm]
    around : bodies beyond the channel's two on either side that are checked
    over : height of the blank over the shroud [mm]; beside the channel it is uncut, and nothing may touch it there
    """

    depth: float
    step: float
    blades: float
    hub: float
    motion: LineMotion
    spacing: float = 1.5
    around: int = 1
    over: float = 0.0

    def __post_init__(self) -> None:
        for name in ("depth", "step", "spacing"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InputError(f"rough.{name}_mm = {value:g}: must be above 0")
        if not (self.blades >= 0.0 and self.hub >= 0.0 and self.around >= 0 and self.over >= 0.0):
            raise InputError("rough: allowances, around and over must be at least 0")


def layers(impeller: Impeller, depth: float, allowance: float, ahead: float = 0.0) -> Floats:
    """Shares w of the layers, decreasing to 0, none thicker than ``depth`` [mm]."""
    where = hub_range(impeller, ahead)
    s = np.linspace(*where, 101)
    low, high = (meridian(impeller, s, w, allowance, where) for w in (0.0, 1.0))
    count = max(1, math.ceil(float(np.linalg.norm(high - low, axis=1).max()) / depth - 1e-9))
    out: Floats = np.arange(count - 1, -1, -1) / count
    return out


def roughing_tracks(
    impeller: Impeller,
    index: int,
    cutter: CatalogueCutter,
    table: float,
    how: RoughingSettings,
    ahead: float = 0.0,
    pallets: tuple[tuple[float, float], ...] = FULL,
    workers: int = 1,
    progress: Progress = silent,
    before: Sequence[ToolTrack] = (),
) -> Tracks:
    """Roughing tracks of the channel on the plus side of a body, clear of walls as :func:`thicken_walls` gives them.

    Parameters
    ----------
    index : 0 blade, 1 splitter
    ahead : length of the hub ahead of the leading edge [mm]
    before : rows that are milled already, at another table angle: where they come as near as a row here is to its
        neighbour, there is no row
    """
    scene = thicken_walls(impeller, index, how, ahead)
    done = scipy.spatial.cKDTree(np.concatenate([_places(t) for t in before])) if before else None
    tracks: list[ToolTrack] = []
    missed: list[UnreachedSpan] = []
    number = 0
    shares = layers(impeller, how.depth, how.hub, ahead)
    for k, w in enumerate(shares):
        patch = layer_of(impeller, index, float(w), how.hub, ahead, cutter.diameter + OUTSIDE)
        p = np.linspace(0.0, 1.0, max(_FEWEST, _counts(patch, how.step)[0]))
        lines = Lines(patch, "u", p, scene, 2, cutter, table, how.motion, pallets, workers)
        first, last = lines.border((0.0, 1.0)), lines.border((1.0, 0.0))
        last = np.maximum(first, last)
        count = max(1, math.ceil(_width(patch, p, first, last) / how.step))
        known = np.full(len(p), np.nan)
        for j in range(count + 1):
            line = lines.line(first + (last - first) * (_INSET + (1.0 - 2.0 * _INSET) * j / count), known)
            known = line.pallet
            use = np.ones(len(p), dtype=np.bool_)
            if done is not None:
                use = done.query(line.S)[0] > 0.5 * how.step
            new, refused = lines.tracks(line, use, number)
            tracks += [t.back() for t in new[::-1]]
            missed += refused
            number += 1
            progress((k + (j + 1) / (count + 1)) / len(shares), f"layer {k + 1} of {len(shares)}")
    return Tracks(tuple(tracks), tuple(missed), number)


def thicken_walls(impeller: Impeller, index: int, how: RoughingSettings, ahead: float = 0.0) -> Scene:
    """Check points of the channel's walls and those around, moved out by the allowances; the hub is surface 2.

    Surface 4 is the top of the blank beside the channel, which is uncut.
    """
    out = (how.blades, how.blades, how.hub, how.blades)
    top = uncut(impeller, index, how, ahead)
    return _walls(impeller, index, how.spacing, how.around, ahead, out, 2.0 * how.spacing, top)


def uncut(impeller: Impeller, index: int, how: RoughingSettings, ahead: float = 0.0, whole: bool = False) -> Floats:
    """Points (n, 3) of the top of the blank, a pitch on either side of a channel; ``whole``: over the channel too."""
    patch = layer_of(impeller, index, 1.0, how.hub, ahead)
    count = _counts(patch, how.spacing)[0]
    u = np.linspace(0.0, 1.0, count)
    left, right = patch.at(u, 0.0), patch.at(u, 1.0)
    where = hub_range(impeller, ahead)
    s = where[0] + u * (where[1] - where[0])
    low, high = (meridian(impeller, s, w, how.hub, where) for w in (0.0, 1.0))
    m = high + how.over * (high - low) / np.linalg.norm(high - low, axis=1)[:, None]
    a, b = (np.arctan2(x[:, 1], x[:, 0]) for x in (left, right))
    b = a + (b - a) % math.tau
    # the blades' own thickness stands there as well, less what the allowance hides of it
    inset = how.blades / m[:, 0]
    across = max(2, math.ceil(impeller.pitch * float(m[:, 0].max()) / how.spacing) + 1)
    share = np.linspace(0.0, 1.0, across)
    spans = [(a - impeller.pitch, a + inset), (b - inset, b + impeller.pitch)]
    if whole:
        spans = [(a - impeller.pitch, b + impeller.pitch)]
    out = []
    for first, last in spans:
        theta = first[:, None] + share * (last - first)[:, None]
        r, z = (np.repeat(m[:, k : k + 1], across, axis=1) for k in (0, 1))
        out.append(np.stack([r * np.cos(theta), r * np.sin(theta), z], axis=-1).reshape(-1, 3))
    return np.concatenate(out)


def _places(track: ToolTrack) -> Floats:
    """Contacts (n, 3) of a track, at most a millimetre apart."""
    length = np.concatenate([[0.0], np.linalg.norm(np.diff(track.contact, axis=0), axis=1).cumsum()])
    at = np.linspace(0.0, length[-1], max(2, math.ceil(length[-1]) + 1))
    return np.column_stack([np.interp(at, length, track.contact[:, k]) for k in range(3)])


def guard_walls(
    impeller: Impeller, index: int, milled: int, spacing: float, corner: float, around: int = 1, ahead: float = 0.0
) -> Scene:
    """Check points for finishing one wall of the channel on the plus side of a body; nothing is cut between them.

    The others are moved out by spacing^2 / (8 corner), as deep as a corner can come between them.

    Parameters
    ----------
    milled : 0 the plus side of the body, 1 the minus side of the next body round, 2 the hub: the number that
        :func:`finishing` takes
    spacing, corner : of the check points, of the cutter [mm]
    """
    if milled not in (0, 1, 2) or not (spacing > 0.0 and corner > 0.0):
        raise InputError(f"milled = {milled}, spacing {spacing:g}, corner {corner:g} mm: must be 0, 1 or 2, above 0")
    sag = spacing**2 / (8.0 * corner)
    out = tuple(0.0 if k == milled else sag for k in range(4))
    return _walls(impeller, index, spacing, around, ahead, out, 1.25 * spacing)


def _walls(
    impeller: Impeller,
    index: int,
    spacing: float,
    around: int,
    ahead: float,
    out: tuple[float, ...],
    near: float,
    more: Floats | None = None,
) -> Scene:
    parts: list[Floats] = []
    names: list[int] = []
    for k in range(-around, 2 + around):
        for side in (1, -1):
            patch = impeller.body(index + k).plus if side > 0 else impeller.body(index + k).minus
            if around == 0 and side != (1 if k == 0 else -1):
                continue
            u, v = (
                x.ravel() for x in np.meshgrid(*(np.linspace(0, 1, n) for n in _counts(patch, spacing)), indexing="ij")
            )
            names.append(0 if (k, side) == (0, 1) else 1 if (k, side) == (1, -1) else 3)
            parts.append(patch.at(u, v) + out[names[-1]] * patch.normal(u, v))
    for k, side in ((k, side) for k in range(-around, 2 + around) for side in (1, -1) if impeller.fillets):
        patch = impeller.foot(index + k, side)
        v = (np.arange(ARC) + 0.5) / ARC
        u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, _counts(patch, spacing)[0]), v, indexing="ij"))
        parts.append(patch.at(u, v) + (out[3] - SUNK) * patch.normal(u, v))
        names.append(3)
    low, high = hub_range(impeller, ahead)
    curve = impeller.hub.curve(np.linspace(low, high, 101))
    along = math.ceil(float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()) / spacing) + 1
    pitch = math.tau * float(curve[:, 0].max()) / (impeller.blades * len(impeller.bodies))
    s, v = np.linspace(low, high, along), np.linspace(0.0, 1.0, math.ceil(pitch / spacing) + 1)
    for k in range(-around, 1 + around):
        theta = impeller.across(index + k, s, v).ravel()
        S = np.repeat(s, len(v))
        parts.append(impeller.hub.at(S, theta) + out[2] * impeller.hub.normal(S, theta))
        names.append(2)
    if more is not None:
        parts.append(more)
        names.append(4)
    surface = np.repeat(names, [len(p) for p in parts])
    one = parts[0][:1]
    return Scene(
        one, np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3, 3)), np.zeros(1, dtype=np.int64), np.concatenate(parts),
        surface, near,
    )  # fmt: skip


def _counts(patch: BSplinePatch, spacing: float) -> tuple[int, int]:
    t = np.linspace(0.0, 1.0, 51)

    def longest(lines: list[Floats]) -> int:
        return math.ceil(max(float(np.linalg.norm(np.diff(x, axis=0), axis=1).sum()) for x in lines) / spacing) + 1

    return longest([patch.at(t, v) for v in (0.0, 0.5, 1.0)]), longest([patch.at(u, t) for u in (0.0, 0.5, 1.0)])


def _width(patch: BSplinePatch, p: Floats, first: Floats, last: Floats) -> float:
    """Widest distance [mm] across, from line to line."""
    v = first + np.linspace(0.0, 1.0, 9)[:, None] * (last - first)
    grid = patch.at(np.tile(p, 9), v.ravel()).reshape(9, len(p), 3)
    return float(np.linalg.norm(np.diff(grid, axis=0), axis=2).sum(axis=0).max())
