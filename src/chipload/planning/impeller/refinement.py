"""Refinement of tracks: points are added where a straight row would leave the path or touch the part.

Notation: between two poses the tip moves straight and the axis turns evenly. Half-way the cutter should touch the
surface at the middle of u, v and B; the distance of the straight row from that along the normal is its chord error. A
check point, or a node of the scene's covering, that lies deeper than the chord in the cutter at a quarter, a half or
three quarters is a gouge. Both are removed by a point between, whose pallet angle is the nearest valid one to the
middle.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.geometry.bspline import BSplinePatch
from chipload.planning.impeller.clearance import clearance, interpolated_axes
from chipload.planning.impeller.pallet_ranges import valid_ranges
from chipload.planning.impeller.scene import Floats, Ints, Scene
from chipload.planning.impeller.track import ToolTrack, pose_cutter, track_of

_ROUNDS = 7
_BISECT = 7
_SHARES = np.array([0.25, 0.5, 0.75])
_WINDOW = np.radians(6.0)


@dataclass(frozen=True, eq=False)
class Refinement:
    """Refinement of the tracks of one cutter on one surface at one table angle.

    Parameters
    ----------
    surface, scene, number : as :func:`finishing`
    chord : [mm] that a row may leave its path, or be in a check point
    clearance : of neck, shank and holder [mm]
    """

    surface: BSplinePatch
    scene: Scene
    number: int
    cutter: CatalogueCutter
    table: float
    chord: float
    clearance: float

    def refined(self, track: ToolTrack) -> tuple[tuple[ToolTrack, ...], Ints]:
        """The track with more points, split where a row cannot be refined, and the number of such rows."""
        for _ in range(_ROUNDS):
            bad = self.bad(track)
            if not len(bad):
                return (track,), bad
            grown = self.split(track, bad)
            if grown is None:
                break
            track = grown
        bad = self.bad(track)
        ends = [0, *(int(k) + 1 for k in bad), len(track.tip)]
        parts = [_part(track, a, b) for a, b in itertools.pairwise(ends) if b - a > 1]
        return tuple(parts), bad

    def bad(self, track: ToolTrack) -> Ints:
        """Rows (k to k + 1) that leave the path or touch the part."""
        at = 0.5 * (track.at[1:] + track.at[:-1])
        S, N = self.surface.facing(*at.T)
        B = 0.5 * (track.pallet[1:] + track.pallet[:-1])
        true, _ = pose_cutter(S, N, self.table, B, self.cutter)
        off = np.abs(((true - 0.5 * (track.tip[1:] + track.tip[:-1])) * N).sum(axis=1))
        row = np.repeat(np.arange(len(at)), len(_SHARES))
        share = np.tile(_SHARES, len(at))
        tips = track.tip[row] + share[:, None] * (track.tip[row + 1] - track.tip[row])
        axes = interpolated_axes(track.axis[row], track.axis[row + 1], share)
        got, _ = clearance(self.scene, self.cutter, tips, axes, 1.0, self.clearance)
        deep = np.zeros(len(at))
        np.maximum.at(deep, row, -got)
        if self.scene.covering is not None:
            np.maximum.at(deep, row, self.scene.covering.node_depth(self.cutter, tips, axes, self.clearance))
        out: Ints = np.flatnonzero((off > self.chord) | (deep > self.chord))
        return out

    def split(self, track: ToolTrack, rows: Ints) -> ToolTrack | None:
        """The track with a point in the middle of each of the rows that has a valid one; None: none has."""
        at = 0.5 * (track.at[rows] + track.at[rows + 1])
        B = 0.5 * (track.pallet[rows] + track.pallet[rows + 1])
        got = [self.pallet(a, b) for a, b in zip(at, B, strict=True)]
        ok = np.array([g is not None for g in got])
        if not ok.any():
            return None
        pallet = np.array([g for g in got if g is not None])
        k = rows[ok] + 1
        whole = np.insert(track.at, k, at[ok], axis=0)
        B = np.insert(track.pallet, k, pallet)
        return self.track(whole, B, track.line)

    def track(self, at: Floats, pallet: Floats, line: int) -> ToolTrack:
        """The track through (u, v) (n, 2) at pallet angles (n,)."""
        S, N = self.surface.facing(*at.T)
        return track_of(at, S, N, self.table, pallet, self.cutter, line)

    def pallet(self, at: Floats, wanted: float, window: float = float(_WINDOW)) -> float | None:
        """Valid pallet angle nearest to the wanted one, within the window."""
        scene = self.scene.at_contacts(*self.surface.shape(*at)[:3], self.number)
        spans = ((wanted - window, wanted + window),)
        r = valid_ranges(scene, self.cutter, self.table, self.clearance, spans).ranges[0]
        if not len(r):
            return None
        inset = np.minimum(0.25 * (r[:, 1] - r[:, 0]), 1e-3)
        near = np.clip(wanted, r[:, 0] + inset, r[:, 1] - inset)
        return float(near[np.abs(near - wanted).argmin()])

    def furthest(self, inside: Floats, pallet: float, outside: Floats) -> tuple[Floats, float, float] | None:
        """Last (u, v) between one point and another that is reached with B near that before it.

        Returns
        -------
        (u, v), B there, the share of the way; None: at once none.
        """
        found: tuple[Floats, float, float] | None = None
        low, high, B = 0.0, 1.0, pallet
        for _ in range(_BISECT):
            mid = 0.5 * (low + high)
            at = inside + mid * (outside - inside)
            got = self.pallet(at, B)
            if got is None:
                high = mid
            else:
                low, B = mid, got
                found = at, got, mid
        return found


def _part(track: ToolTrack, first: int, last: int) -> ToolTrack:
    cut = slice(first, last)
    return ToolTrack(
        track.at[cut], track.contact[cut], track.normal[cut], track.pallet[cut], track.tip[cut], track.axis[cut],
        track.line,
    )  # fmt: skip
