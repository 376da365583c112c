"""The removal mesh: the surface of the stock over the rows of a history as quads, each with its visible frames.

Notation: a **frame** stands for a run of rows; frame 0 is the stock before row 0, frame i + 1 that after row
``rows[i]``. The stock is kept as dexels (:mod:`chipload.stock.dexel`), independent of the removed volume: it
knows the tip, the axis and the cutter of each row, nothing of chips. Its cells are so wide that the work stays within
:data:`WORK`; what is thinner than a cell may be missing in the picture.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.lazy import trimesh
from chipload.stock.dexel import TriDexel
from chipload.stock.surface_net import STEPS, SurfaceNet

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: cells along the longest side of the stock, and of the smallest cutter's diameter, at most
LONGEST, ACROSS = 200, 32
#: cells of a stock, and rays times poses, at most
CELLS, WORK = 1_500_000, 12_000_000
#: frames at most; distance of two instants in radii of the cutter, turn of the path or the axis between them [rad]
FRAMES, APART, TURN = 320, 0.3, 0.03
#: volume of a box around two over the sum of theirs, at most
JOINED = 1.5


@dataclass(frozen=True, eq=False)
class RemovalMesh:
    """The surface of a stock at all rows of a history.

    Parameters
    ----------
    low, high : (3,) float [mm], the box that the corners count in
    corners : (q, 4, 3) uint16, counter-clockwise from outside, in 1 / 65535 of the box
    seen : (q, 2) uint16, first frame, and the frame that does not show it any more; 65535: never
    rows : (m,) int, rows after which frames 1 to m stand
    volumes : (m + 1,) float [mm^3] of the dexels at each frame
    cell : (3,) float [mm], distances of the rays
    """

    low: Floats
    high: Floats
    corners: NDArray[np.uint16]
    seen: NDArray[np.uint16]
    rows: Ints
    volumes: Floats
    cell: Floats

    def frame_of(self, row: int) -> int:
        """Return the frame that is shown at a row: the last one that represents the stock after no later row."""
        return int(np.searchsorted(self.rows, row, side="right"))

    def volume(self, frame: int) -> float:
        """Volume [mm^3] within the surface of a frame."""
        here = (self.seen[:, 0] <= frame) & (frame < self.seen[:, 1])
        a, b, c, d = np.moveaxis(self.corners[here] * ((self.high - self.low) / STEPS), 1, 0)
        six = np.einsum("ij,ij->i", a, np.cross(b, c)) + np.einsum("ij,ij->i", a, np.cross(c, d))
        return float(six.sum()) / 6.0


@dataclass(frozen=True, eq=False)
class ToolPoses:
    """Position, axis and cutter of the tool at each row.

    Parameters
    ----------
    tip : (n, 3) float [mm], at the end of the row
    axis : (n, 3) unit axis, from the tip to the holder
    tool : (n,) int, its number
    apart : (n,) bool, whether the row does not go on from the row before
    """

    tip: Floats
    axis: Floats
    tool: Ints
    apart: NDArray[np.bool_]


def removal_mesh(
    blank: trimesh.Trimesh,
    path: ToolPoses,
    cutters: Mapping[int, Cutter],
    before: Sequence[ToolPoses] = (),
    wider: float = 1.0,
) -> RemovalMesh:
    """Return the removal mesh of a tool that moves along the rows through the blank.

    Parameters
    ----------
    blank : closed mesh [mm]
    cutters : by tool number; rows of other numbers take nothing
    before : paths that have cut the blank before; frame 0 is what they leave
    wider : how many times as wide as usual the cells are; there are as many times fewer frames

    Examples
    --------
    >>> line = np.column_stack([np.linspace(-6.0, 26.0, 33), np.full(33, 10.0), np.full(33, 6.0)])
    >>> path = ToolPoses(line, np.tile([0.0, 0.0, 1.0], (33, 1)), np.ones(33, int), np.zeros(33, bool))
    >>> box = trimesh.creation.box(bounds=[[0, 0, 0], [20, 20, 10]])
    >>> mesh = removal_mesh(box, path, {1: Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)})
    >>> [round(float(v), -2) for v in mesh.volumes[[0, -1]]]  # a slot 10 wide and 4 deep
    [4000.0, 3200.0]
    """
    every = [*before, path]
    used = np.unique(np.concatenate([p.tool for p in every]))
    radius = min((cutters[int(n)].radius for n in used if int(n) in cutters), default=1.0)
    each = [_instants(p, cutters, np.isin(p.tool, list(cutters))) for p in every]
    instants = each[-1]
    low, high = (np.asarray(b, dtype=np.float64) for b in blank.bounds)
    pitch = wider * _pitch(high - low, radius, sum(len(i) for own in each for i in own))
    stock = TriDexel.of_mesh(blank, pitch)
    for earlier, runs in zip(before, each, strict=False):
        for places in runs:
            _remove_run(stock, earlier, places, cutters, pitch)
    net = SurfaceNet(stock)
    rows, volumes = list[int](), [_volume(net)]
    ends = _frames(instants, path, round(FRAMES / wider))
    sizes = {id(c): float(c.profile(0.1)[:, 0].max()) for c in cutters.values()}
    for run, frame in zip(_runs(instants, ends), range(1, len(ends) + 1), strict=True):
        changed: list[tuple[Floats, Floats]] = []
        for places in run:
            tip, axis, cutter = _remove_run(stock, path, places, cutters, pitch)
            ends_of = np.concatenate([tip, tip + cutter.flute_length * axis])
            size = sizes[id(cutter)]
            changed.append((ends_of.min(axis=0) - size, ends_of.max(axis=0) + size))
        for box in _joined_boxes(changed):
            net.update(*box, frame)
        rows.append(int(ends[frame - 1]))
        volumes.append(_volume(net))
    corners, seen = merged_quads(net.corners, net.seen)
    return RemovalMesh(net.low, net.high, corners, seen, np.array(rows, np.int64), np.array(volumes), net.pitch)


def _remove_run(
    stock: TriDexel, path: ToolPoses, places: Ints, cutters: Mapping[int, Cutter], pitch: float
) -> tuple[Floats, Floats, Cutter]:
    """Take away what a run of rows cuts; its tips, axes and cutter."""
    cutter = cutters[int(path.tool[places[-1]])]
    tip, axis = _poses_between(path, places, APART * cutter.radius)
    stock.remove_poses(tip, axis, cutter.outline, tol=0.02 * pitch)
    return tip, axis, cutter


def _joined_boxes(boxes: Sequence[tuple[Floats, Floats]]) -> list[tuple[Floats, Floats]]:
    """Boxes that follow one another as one, where it is hardly larger than they are: thousands of short runs of a
    frame, as of holes side by side, are looked at once.
    """
    out: list[tuple[Floats, Floats]] = []
    for low, high in boxes:
        if out:
            a, b = np.minimum(out[-1][0], low), np.maximum(out[-1][1], high)
            if np.prod(b - a) <= JOINED * (np.prod(out[-1][1] - out[-1][0]) + np.prod(high - low)):
                out[-1] = a, b
                continue
        out.append((low, high))
    return out


def _volume(net: SurfaceNet) -> float:
    return math.fsum(r.volume() for r in net.rays.values()) / 3.0


def _pitch(size: Floats, radius: float, poses: int) -> float:
    """Width of the cells [mm]: as fine as the cutter asks for and the work allows."""
    fine = max(float(size.max()) / LONGEST, 2.0 * radius / ACROSS, float(np.prod(size) / CELLS) ** (1.0 / 3.0))
    # a pose meets about three faces of its box in rays
    return float(max(fine, 2.0 * radius * math.sqrt(3.0 * max(poses, 1) / WORK)))


def _instants(path: ToolPoses, cutters: Mapping[int, Cutter], known: NDArray[np.bool_]) -> list[Ints]:
    """Rows that stand for runs of rows that go on from one another with one tool: the first and last of each run, and
    those between at which the path has turned or gone some share of the radius.
    """
    n = len(path.tool)
    new = path.apart.copy()
    new[1:] |= path.tool[1:] != path.tool[:-1]
    new[:1] = True
    bounds = np.append(np.flatnonzero(new), n)
    out = []
    for a, b in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        if not known[a]:
            continue
        step = np.diff(path.tip[a:b], axis=0)
        length = np.linalg.norm(step, axis=1)
        unit = step / np.where(length > 0.0, length, 1.0)[:, None]
        bend = np.zeros(b - a)
        bend[1:-1] = np.linalg.norm(np.diff(unit, axis=0), axis=1)
        lean = np.concatenate([[0.0], np.linalg.norm(np.diff(path.axis[a:b], axis=0), axis=1)])
        far = np.concatenate([[0.0], np.cumsum(length)]) / (APART * cutters[int(path.tool[a])].radius)
        # a new instant wherever a sum passes a whole number
        score = np.floor(far) + np.floor(np.cumsum(lean) / TURN)
        keep = np.concatenate([[True], score[1:] > score[:-1]]) | (bend > TURN)
        keep[-1] = True
        out.append(a + np.flatnonzero(keep))
    return out


def _frames(instants: list[Ints], path: ToolPoses, most: int) -> Ints:
    """(m,) rows at which frames end: after equal lengths of path, at most so many."""
    if not instants:
        return np.zeros(0, dtype=np.int64)
    rows = np.concatenate(instants)
    step = np.linalg.norm(np.diff(path.tip[rows], axis=0, prepend=path.tip[rows[:1]]), axis=1)
    s = np.cumsum(step + 1e-9)
    wanted = s[-1] * np.arange(1, min(most, len(rows)) + 1) / min(most, len(rows))
    out: Ints = np.unique(rows[np.minimum(np.searchsorted(s, wanted), len(rows) - 1)])
    return out


def _runs(instants: list[Ints], ends: Ints) -> list[list[Ints]]:
    """Of each frame the instants, a run each; runs of a frame begin where those of the frame before ended."""
    out: list[list[Ints]] = [[] for _ in ends]
    for rows in instants:
        at = np.searchsorted(ends, rows)
        for k in np.unique(at).tolist():
            own = rows[at == k]
            before = rows[rows < own[0]][-1:]
            out[k].append(np.concatenate([before, own]))
    return out


def _poses_between(path: ToolPoses, places: Ints, far: float) -> tuple[Floats, Floats]:
    """Tips and axes at some rows, and between rows that are farther apart than ``far`` [mm]; at least two."""
    if len(places) == 1:
        places = np.repeat(places, 2)
    tip, axis = path.tip[places], path.axis[places]
    gap = np.linalg.norm(np.diff(tip, axis=0), axis=1)
    parts = np.maximum(np.ceil(gap / far), 1.0).astype(np.int64)
    if parts.max() > 1:
        k = np.repeat(np.arange(len(parts)), parts)
        share = (np.arange(len(k)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[k]
        tip = np.vstack([tip[k] + share[:, None] * (tip[k + 1] - tip[k]), tip[-1:]])
        axis = np.vstack([axis[k] + share[:, None] * (axis[k + 1] - axis[k]), axis[-1:]])
        axis = axis / np.linalg.norm(axis, axis=1)[:, None]
    return tip, axis


def merged_quads(
    corners: NDArray[np.uint16], seen: NDArray[np.uint16]
) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """Fewer quads of the same surface: rectangles in one plane across an axis that are seen together become one.

    A quad that is gone in the frame in which it came is left out.
    """
    alive = seen[:, 0] < seen[:, 1]
    corners, seen = corners[alive], seen[alive]
    low, high = corners.min(axis=1), corners.max(axis=1)
    side = high.astype(np.int64) - low
    # in a rectangle each corner has the least or the greatest coordinate, and one side is 0
    at_corner = ((corners == low[:, None]) | (corners == high[:, None])).all(axis=(1, 2))
    flat = at_corner & ((side == 0).sum(axis=1) == 1)
    out_c, out_s = [corners[~flat]], [seen[~flat]]
    for k in range(3):
        own = flat & (side[:, k] == 0)
        c, s = corners[own], seen[own]
        if not len(c):
            continue
        u, v = (k + 1) % 3, (k + 2) % 3
        a, b = low[own].astype(np.int64), high[own].astype(np.int64)
        # seen from +k: counter-clockwise or not
        e, f = c[:, 1].astype(np.int64) - c[:, 0], c[:, 2].astype(np.int64) - c[:, 1]
        up = (e[:, u] * f[:, v] - e[:, v] * f[:, u]) > 0
        table = np.column_stack([a[:, k], up, s.astype(np.int64), a[:, u], b[:, u], a[:, v], b[:, v]])
        for fixed, first in (([4, 5], 6), ([6, 7], 4)):
            table = _join_intervals(table, fixed, first)
        out_c.append(_rectangles(table, k))
        out_s.append(table[:, 2:4].astype(np.uint16))
    return np.concatenate(out_c), np.concatenate(out_s)


def _join_intervals(table: Ints, fixed: list[int], first: int) -> Ints:
    """Rows whose interval in columns first, first + 1 begins where that of a row alike ends become one row."""
    key = [0, 1, 2, 3, *fixed]
    order = np.lexsort((table[:, first], *(table[:, i] for i in key)))
    t = table[order]
    new = np.ones(len(t), dtype=np.bool_)
    new[1:] = (t[1:, key] != t[:-1, key]).any(axis=1) | (t[1:, first] != t[:-1, first + 1])
    starts = np.flatnonzero(new)
    out = t[starts]
    out[:, first + 1] = t[np.append(starts[1:], len(t)) - 1, first + 1]
    return out


def _rectangles(table: Ints, k: int) -> NDArray[np.uint16]:
    """(r, 4, 3) corners of rectangles across axis k."""
    u, v = (k + 1) % 3, (k + 2) % 3
    out = np.zeros((len(table), 4, 3), dtype=np.uint16)
    out[:, :, k] = table[:, :1]
    for n, (i, j) in enumerate(((4, 6), (5, 6), (5, 7), (4, 7))):
        out[:, n, u], out[:, n, v] = table[:, i], table[:, j]
    down = table[:, 1] == 0
    out[down] = out[down][:, ::-1]
    return out
