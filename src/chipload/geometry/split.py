"""Splitting of segments at their intersections, and chaining of the pieces to contours.

Notation: a **piece** is a part of a segment between two **nodes**; a node is a group of ends and intersections of
segments that count as one point.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.contour import Contour, Floats
from chipload.geometry.distance import boxes
from chipload.lazy import LateModule, scipy

_segments = LateModule("chipload.geometry._segments")

Ints = NDArray[np.int64]

#: tolerances [mm] of the clearance and of coincident ends; the next pair is used if the pieces do not close
LADDER = ((1e-9, 1e-8), (1e-8, 5e-8), (1e-7, 4e-7))
#: curves that miss each other by less [mm] touch
TOUCH_MM = 1e-10


@dataclass(frozen=True, eq=False)
class RawSegments:
    """Raw segments (n, 7). ``smooth`` (n,): number of the segment that follows tangentially, or -1. ``knife`` (n,):
    whether a segment only splits others and is not part of the result. ``ends`` (n, 2): whether its start, and its end,
    is the end of an open chain.
    """

    segments: Floats
    smooth: Ints
    knife: NDArray[np.bool_]
    ends: NDArray[np.bool_]

    @classmethod
    def plain(cls, segments: Floats, smooth: Ints | None = None) -> RawSegments:
        """Segments of closed contours without any knife."""
        n = len(segments)
        follow = np.full(n, -1, dtype=np.int64) if smooth is None else smooth
        return cls(segments, follow, np.zeros(n, dtype=np.bool_), np.zeros((n, 2), dtype=np.bool_))


@dataclass(frozen=True, eq=False)
class SplitSegments:
    """Pieces of raw segments: raw segment (m,), parameters (m, 2) in 0..1, nodes (m, 2); places of the nodes (k, 2)."""

    raw: Ints
    span: Floats
    node: Ints
    place: Floats

    def __getitem__(self, pick: NDArray[np.bool_] | Ints) -> SplitSegments:
        return SplitSegments(self.raw[pick], self.span[pick], self.node[pick], self.place)


def meetings(raw: RawSegments, tol: float) -> tuple[Ints, Floats]:
    """Points at which segments cross, touch or end on one another: segment numbers (k, 2) and points (k, 2) [mm]."""
    seg = raw.segments
    box = boxes(seg)
    order = np.argsort(box[:, 0], kind="stable")
    room = 16 * len(seg) + 64
    while True:
        pairs, places = np.empty((room, 2), dtype=np.int64), np.empty((room, 2))
        count = _segments.crossings(seg, box, order, raw.smooth, tol, TOUCH_MM, pairs, places)
        if count <= room:
            return pairs[:count], places[:count]
        room = count


def split_segments(raw: RawSegments, tol: float, snap: float) -> tuple[SplitSegments, NDArray[np.bool_]]:
    """Split segments where they meet; returns all pieces, and whether each node (k,) may end an open chain."""
    seg = raw.segments
    n = len(seg)
    who, where = meetings(raw, tol)
    at = _parameter(seg[who[:, 0]], where)
    points = np.vstack([seg[:, 0:2], seg[:, 2:4], where])
    owner = np.concatenate([np.arange(n), np.arange(n), who[:, 0]])
    t = np.concatenate([np.zeros(n), np.ones(n), np.clip(at, 0.0, 1.0)])

    pairs = scipy.spatial.cKDTree(points).query_pairs(snap, output_type="ndarray")
    graph = scipy.sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1].astype(np.int64)
    first = np.full(label.max() + 1, len(points))
    np.minimum.at(first, label, np.arange(len(points)))
    place = points[first]
    free = np.concatenate([raw.ends[:, 0], raw.ends[:, 1], raw.knife[who[:, 1]]])
    loose = np.zeros(len(place), dtype=np.bool_)
    loose[label[free]] = True

    rank = np.lexsort((t, owner))
    a, b = rank[:-1], rank[1:]
    whole = (np.abs(seg[owner[a], 6]) > np.pi) & (t[b] - t[a] > 0.5)
    real = (owner[a] == owner[b]) & ((label[a] != label[b]) | whole)
    a, b = a[real], b[real]
    # a piece dropped between two others is a single point: the next piece begins where the previous one ends
    span = np.column_stack([t[a], t[b]])
    return SplitSegments(owner[a], span, np.column_stack([label[a], label[b]]), place), loose


def _parameter(seg: Floats, p: Floats) -> Floats:
    """(m,) shares of the lengths of segments (m, 7) at points (m, 2) on them; may be outside 0..1 by rounding."""
    chord = seg[:, 2:4] - seg[:, 0:2]
    arc = seg[:, 6] != 0.0
    line = np.sum((p - seg[:, 0:2]) * chord, axis=1) / np.where(arc, 1.0, np.sum(chord**2, axis=1))
    u, v = seg[:, 0:2] - seg[:, 4:6], p - seg[:, 4:6]
    full = np.where(arc, np.abs(seg[:, 6]), 1.0)
    turn = np.sign(seg[:, 6]) * np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], np.sum(u * v, axis=1))
    turn = np.where(turn < 0.0, turn + 2.0 * np.pi, turn)
    turn = np.where(turn > 0.5 * full + np.pi, turn - 2.0 * np.pi, turn)
    out: Floats = np.where(arc, turn / full, line)
    return out


def on_segments(seg: Floats, t: Floats) -> Floats:
    """(m, 2) points of segments (m, 7) at the shares t (m,)."""
    v = seg[:, 0:2] - seg[:, 4:6]
    c, s = np.cos(t * seg[:, 6])[:, None], np.sin(t * seg[:, 6])[:, None]
    out: Floats = np.where(
        seg[:, 6:7] == 0.0, seg[:, 0:2] + t[:, None] * (seg[:, 2:4] - seg[:, 0:2]), seg[:, 4:6] + c * v + s * left_of(v)
    )
    return out


def lengths_of(seg: Floats) -> Floats:
    """(m,) lengths of segments (m, 7)."""
    r = np.hypot(seg[:, 0] - seg[:, 4], seg[:, 1] - seg[:, 5])
    return np.where(seg[:, 6] == 0.0, np.hypot(*(seg[:, 2:4] - seg[:, 0:2]).T), r * np.abs(seg[:, 6]))


def chained_segments(raw: RawSegments, pieces: SplitSegments, d: float, tol: float) -> tuple[Contour, ...]:
    """Contours from pieces; at a node with several outgoing pieces the sharpest turn to the offset side is chosen."""
    seg = raw.segments[pieces.raw]
    heading, bend = [], []
    for t in pieces.span.T:
        v = on_segments(seg, t) - seg[:, 4:6]
        arc = seg[:, 6:7] != 0.0
        along = np.where(arc, np.sign(seg[:, 6:7]) * left_of(v), seg[:, 2:4] - seg[:, 0:2])
        heading.append(np.arctan2(along[:, 1], along[:, 0]))
        bend.append(np.sign(seg[:, 6]) / np.where(arc[:, 0], np.hypot(*v.T), 1.0))
    leaving: dict[int, list[int]] = defaultdict(list)
    arriving = np.bincount(pieces.node[:, 1], minlength=len(pieces.place)) if len(seg) else np.zeros(0)
    for k, node in enumerate(pieces.node[:, 0]):
        leaving[node].append(k)
    side = np.sign(d)

    def sharpness(k: int, m: int) -> tuple[float, float]:
        turn = (heading[0][m] - heading[1][k] + np.pi) % (2.0 * np.pi) - np.pi
        if abs(turn) > np.pi - 1e-6:
            turn = side * np.pi
        return float(np.round(side * turn, 6)), float(side * bend[0][m])

    used = np.zeros(len(seg), dtype=np.bool_)
    out: list[tuple[int, Contour]] = []
    free = [k for k, node in enumerate(pieces.node[:, 0]) if arriving[node] < len(leaving[node])]
    for first in [*free, *range(len(seg))]:
        if used[first]:
            continue
        chain = [first]
        used[first] = True
        while True:
            node = pieces.node[chain[-1], 1]
            following = [m for m in leaving[node] if not used[m]]
            if node == pieces.node[first, 0]:
                following.append(first)
            if not following:
                break
            best = following[0] if len(following) == 1 else max(following, key=lambda m: sharpness(chain[-1], m))
            if best == first:
                break
            used[best] = True
            chain.append(best)
        made = _contour(raw, pieces, chain)
        closed = pieces.node[chain[-1], 1] == pieces.node[first, 0]
        if closed and abs(made.area) <= tol * made.length:
            continue
        out.append((int(pieces.raw[first]), made))
    return tuple(c for _, c in sorted(out, key=lambda item: item[0]))


def _contour(raw: RawSegments, pieces: SplitSegments, chain: list[int]) -> Contour:
    """One contour from a chain of pieces; consecutive pieces of one raw segment are merged again."""
    runs: list[list[int]] = []
    for k in chain:
        if runs and pieces.raw[k] == pieces.raw[runs[-1][-1]] and pieces.node[k, 0] == pieces.node[runs[-1][-1], 1]:
            before = pieces.span[runs[-1][-1], 1]
            if 0.0 <= pieces.span[k, 0] - before < 1e-3:
                runs[-1].append(k)
                continue
        runs.append([k])
    a = np.array([run[0] for run in runs])
    b = np.array([run[-1] for run in runs])
    rows = raw.segments[pieces.raw[a]].copy()
    p, q = pieces.place[pieces.node[a, 0]], pieces.place[pieces.node[b, 1]]
    rows[:, 6] = swept(rows, p, q, rows[:, 6] * (pieces.span[b, 1] - pieces.span[a, 0]))
    rows[:, 0:2], rows[:, 2:4] = p, q
    return Contour(rows)


def rows_of(raw: RawSegments, pieces: SplitSegments) -> Floats:
    """The pieces as segments (m, 7)."""
    rows = raw.segments[pieces.raw].copy()
    p, q = pieces.place[pieces.node[:, 0]], pieces.place[pieces.node[:, 1]]
    rows[:, 6] = swept(rows, p, q, rows[:, 6] * (pieces.span[:, 1] - pieces.span[:, 0]))
    rows[:, 0:2], rows[:, 2:4] = p, q
    return rows


def swept(seg: Floats, p: Floats, q: Floats, near: Floats) -> Floats:
    """(n,) sweeps [rad] from p to q about the centres of segments, with the whole turns nearest to ``near``."""
    u, v = p - seg[:, 4:6], q - seg[:, 4:6]
    turn = np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], np.sum(u * v, axis=1))
    turn += 2.0 * np.pi * np.round((near - turn) / (2.0 * np.pi))
    out: Floats = np.where(near == 0.0, 0.0, turn)
    return out


def left_of(v: Floats) -> Floats:
    """Vectors (..., 2) rotated by +90 deg."""
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)
