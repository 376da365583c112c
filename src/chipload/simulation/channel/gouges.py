"""The deepest gouge of a program on walls, between bounds: cells of a wall that may contain a deeper one are divided.

Notation: p a point of a wall, N its normal, s(p) the least s at which the ray p + s N is in a part of the tool in any
row; -s is the gouge. t [mm] greatest distance along a wall from a point of a cell to its nearest corner q, w [rad]
greatest angle of their normals.

Where the gouge is greatest, G, the part's boundary is parallel to the wall. If a ball of radius r rolls inside the part
along its boundary, one of its positions has the centre at the height r - G over p, and the ray of q meets it at s(q) <=
bend - G with bend = r - sqrt(r^2 - (t + r w)^2) + 3/2 t w. No gouge of a cell is therefore deeper than bend - s of its
corners. Inside the cutting part rolls a ball of its corner radius. The parts above have sharp edges: they are enlarged
by g all round, a ball of radius g then rolls inside them, and their depth less g counts.

Limits: w is 1.5 times the angle of the normals at the corners. On the edge of a wall the bound is that along the edge.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.program.motions import is_arc
from chipload.program.program import Program
from chipload.simulation.channel.channel import (
    GROUP,
    PARTS,
    SurfacePoints,
    frames_of,
    move_groups,
    parted_moves,
    tool_parts,
)

_ray_cuts = LateModule("chipload.simulation.channel._ray_cuts")

Floats = NDArray[np.float64]

#: width of the first cells [mm]
_FIRST = 2.5
#: greatest number of times that a cell is halved
_LEVELS = 8
#: enlargement g of the parts above the cutting part, as a multiple of the reach t of the cells
_GROWN = 2.5
#: angle w to the nearest corner of a cell as a share of the greatest angle between the normals at its corners
_TURN = 0.75
#: greatest number of corners that are evaluated; the division of cells ends there
_MOST = 4_000_000
#: reach of the cells at which a cutter with a sharp corner is evaluated [mm]; its bound is unknown
_SHARP = 0.5
#: a bound below this share of the limit is enough
_ENOUGH = 0.5
#: share of the depth of a ray below which a value counts as its end
_BOTTOM = 1.0 - 1e-9
#: allowance for rounding of a height [mm]
_ROUNDED = 1e-12
#: least height above a wall that is searched [mm]; bound of the dip of a tool between two instants [mm]
_LOW, _DIP = 0.1, 0.05
_BLOCK = 512


@dataclass(frozen=True)
class Gouge:
    """The deepest gouge of a program.

    Parameters
    ----------
    found : greatest depth found of a part of the tool below a wall [mm]; 0: there is no gouge
    bound : upper bound of the depth below all points of the walls [mm]; inf: unknown, as with a sharp corner
    wall, place, row, part : of the gouge found: name of the wall, point [mm], row of the program, of :data:`PARTS`
    """

    found: float
    bound: float
    wall: str
    place: tuple[float, float, float]
    row: int
    part: int

    @property
    def message(self) -> str:
        """A sentence that locates the gouge."""
        if self.row < 0:
            return "nothing comes below a wall"
        x, y, z = self.place
        limit = f", nothing deeper than {self.bound:.4f} mm" if math.isfinite(self.bound) else ""
        return (
            f"{self.wall}: the {PARTS[self.part]} comes {self.found:.4f} mm below the surface at "
            f"({x:.2f}, {y:.2f}, {z:.2f}) in row {self.row}{limit}"
        )


@dataclass(frozen=True, eq=False)
class _Cells:
    """Cells of walls: number of the wall (n,), low and high u and v (n, 4)."""

    wall: NDArray[np.int64]
    box: Floats

    def corners(self) -> Floats:
        """(n, 4, 2) u and v."""
        return self.box[:, [[0, 2], [1, 2], [0, 3], [1, 3]]]

    def divided(self, which: NDArray[np.bool_]) -> _Cells:
        """Return each cell of ``which`` divided into four."""
        box = self.box[which]
        u, v = 0.5 * (box[:, 0] + box[:, 1]), 0.5 * (box[:, 2] + box[:, 3])
        a, b, c, d = box.T
        four = [(a, u, c, v), (u, b, c, v), (a, u, v, d), (u, b, v, d)]
        return _Cells(np.tile(self.wall[which], 4), np.concatenate([np.stack(x, axis=-1) for x in four]))


def deepest_gouge(
    walls: Sequence[SurfacePoints], program: Program, cutter: CatalogueCutter, depth: float, resolution: float,
    limit: float, step: float = 0.25, tol: float = 1e-5, workers: int = 1,
) -> Gouge:  # fmt: skip
    """Return the deepest gouge of a program, within the resolution or proven to be below half of the limit.

    Parameters
    ----------
    walls : the surface of each is searched from the least to the greatest u and v of its points
    depth : [mm] depth of the search below a wall; less than the thickness of a blade
    resolution : of the gouge [mm]; finer where the limit lies between the gouge found and its bound
    limit : of the gouge [mm]
    step, tol : as :func:`left_on`

    Raises
    ------
    InputError
        The program has arcs, a wall has no surface, or a number is out of range.
    """
    if is_arc(program).any():
        raise InputError("channel: the program has arcs: must be of straight rows")
    if not (depth > 0.0 and resolution > 0.0 and limit > 0.0):
        raise InputError("channel: depth, resolution and limit: must be above 0")
    tips, axes, of = parted_moves(program)
    groups = move_groups(tips, axes)
    cells = _first(walls)
    best = Gouge(0.0, 0.0, "", (0.0, 0.0, 0.0), -1, 0)
    settled, evaluated = 0.0, 0
    for level in range(_LEVELS + 1):
        at = cells.corners()
        # cells share their corners
        rows = np.column_stack([np.repeat(cells.wall, 4), at.reshape(-1, 2)])
        once, inverse = _once(np.asarray(rows, dtype=np.float64))
        number, corner = once[:, 0].astype(np.int64), inverse.reshape(-1, 4)
        points, normals = _places_on(walls, number, once[:, 1:])
        t, w = _reach(points[corner], normals[corner])
        grown = _GROWN * float(t.max())
        known = _has_bound(cutter.corner_radius, grown, t, w).any()
        if not known and cutter.corner_radius > resolution and level < _LEVELS and 16 * len(t) <= _MOST:
            # every cell is divided, whatever the rays meet
            cells = cells.divided(np.ones(len(t), dtype=np.bool_))
            continue
        starts, shapes, kinds = _parts(cutter, grown)
        tall = _height(_sag(cutter.corner_radius, t, w), grown)
        low = _enough(corner, len(points), cutter.corner_radius, grown, t, w, max(settled, best.found), best.found)
        low = np.clip(low, -_BOTTOM * depth, tall)
        row, part = np.full((len(points), 3), -1), np.zeros((len(points), 3), dtype=np.int64)

        def block(
            first: int, points: Floats = points, normals: Floats = normals, starts: Floats = starts,
            shapes: Floats = shapes, kinds: NDArray[np.int64] = kinds, low: Floats = low,
            row: NDArray[np.int64] = row, part: NDArray[np.int64] = part, height: float = tall,
        ) -> None:  # fmt: skip
            last = min(first + _BLOCK, len(points))
            frames = frames_of(normals[first:last])
            _ray_cuts.lowest_of_kinds(
                points[first:last], frames, tips, axes, groups, GROUP, starts, shapes, kinds, depth, height, step, tol,
                low[first:last], row[first:last], part[first:last],
            )  # fmt: skip

        with ThreadPoolExecutor(workers) as pool:
            for _ in pool.map(block, range(0, len(points), _BLOCK)):
                pass
        k, which = np.unravel_index(int(low[:, :2].argmin()), (len(points), 2))
        if -low[k, which] > best.found:
            x, y, z = points[k].tolist()
            name = walls[int(number[k])].name
            best = Gouge(
                -float(low[k, which]),
                0.0,
                name,
                (x, y, z),
                int(of[row[k, which]]),
                int(tool_parts(cutter)[2][part[k, which]]),
            )
        bound = _bounds(low[corner].min(axis=1), t, w, cutter.corner_radius, grown, depth)
        evaluated += len(points)
        target = max(best.found + resolution, _ENOUGH * limit)
        if best.found <= limit < target:
            target = max(limit, best.found + 0.1 * resolution)
        open_cells = bound > target
        settled = max(settled, float(bound[~open_cells].max(initial=0.0)))
        sharp = cutter.corner_radius <= resolution and float(t.max()) <= _SHARP
        # the gouge reaches the ends of the rays
        ended = sharp or best.found >= depth
        if ended or level == _LEVELS or evaluated + 16 * int(open_cells.sum()) > _MOST or not open_cells.any():
            settled = max(settled, float(bound.max(initial=0.0)))
            break
        cells = cells.divided(open_cells)
    return Gouge(best.found, max(settled, best.found), best.wall, best.place, best.row, best.part)


def _once(rows: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """The different rows (m, k) in ascending order, and the one (n,) of each row: faster than :func:`numpy.unique`.

    >>> once, which = _once(np.array([[1.0, 2.0], [0.0, 3.0], [1.0, 2.0]]))
    >>> once.tolist(), which.tolist()
    ([[0.0, 3.0], [1.0, 2.0]], [1, 0, 1])
    """
    order = np.lexsort(rows.T[::-1])
    ascending = rows[order]
    new = np.concatenate([[True], (ascending[1:] != ascending[:-1]).any(axis=1)])
    which = np.empty(len(rows), dtype=np.int64)
    which[order] = np.cumsum(new) - 1
    return ascending[new], which


def _has_bound(r: float, grown: float, t: Floats, w: Floats) -> NDArray[np.bool_]:
    """Whether cells (n,) have a bound at all."""
    return np.isfinite(_sag(r, t, w)) & np.isfinite(_sag(grown, t, w))


def _enough(
    corner: NDArray[np.int64], count: int, r: float, grown: float, t: Floats, w: Floats, bound: float, found: float
) -> Floats:
    """Heights (count, 3) [mm] over each point above which the parts of each kind need not be known.

    Parts above them neither raise the bound of a cell, whose ``corner`` (n, 4) are points, beyond ``bound``, nor are
    deeper than ``found``.
    """
    out = np.full((count, 3), -found)
    out[:, 2] = -np.inf
    known = _has_bound(r, grown, t, w)
    for kind, least in ((0, _sag(r, t, w) - bound), (2, _sag(grown, t, w) - grown - bound)):
        np.maximum.at(out[:, kind], corner[known].ravel(), np.repeat(least[known] + _ROUNDED, 4))
    return out


def _height(bend: Floats, grown: float) -> float:
    """Return the search height [mm] above a wall: a tool higher than the bend (n,) of a cell does not gouge there."""
    most = max(1.0, grown)
    known = bend[np.isfinite(bend)]
    return min(most, max(float(known.max()) + _DIP, _LOW)) if len(known) == len(bend) else most


def _parts(cutter: CatalogueCutter, grown: float) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """As :func:`tool_parts`, with the parts above the cutting part a second time, enlarged by ``grown`` [mm].

    Kinds: 0 cutting part, 1 part above it, 2 enlarged part above it.
    """
    starts, shapes, kinds = tool_parts(cutter)
    upper = kinds > 0
    larger = shapes[upper].copy()
    # radius, length and the largest radius of a cylinder
    larger[:, [1, 6, 9]] += grown
    larger[:, 8] += 2.0 * grown
    return (
        np.concatenate([starts, starts[upper] - grown]),
        np.concatenate([shapes, larger]),
        np.concatenate([(kinds > 0).astype(np.int64), np.full(int(upper.sum()), 2)]),
    )


def _bounds(low: Floats, t: Floats, w: Floats, r: float, grown: float, depth: float) -> Floats:
    """Upper bound (n,) [mm] of the gouge in cells with the least s ``low`` (n, 3) of the kinds of parts at corners."""
    out = _sag(r, t, w) - low[:, 0]
    larger = _sag(grown, t, w) - low[:, 2] - grown
    # rays end at the depth: a deeper gouge is not measured
    larger[low[:, 2] <= -depth] = np.inf
    out[low[:, 0] <= -depth] = np.inf
    return np.maximum(out, larger)


def _sag(r: float, t: Floats, w: Floats) -> Floats:
    """Return the bend (n,) [mm]: how much higher than its lowest point a ball of radius r is at the nearest corner."""
    wide = t + r * w
    out: Floats = np.where(wide < r, r - np.sqrt(np.maximum(r * r - wide * wide, 0.0)) + 1.5 * t * w, np.inf)
    return out


def _first(walls: Sequence[SurfacePoints]) -> _Cells:
    """Divide all walls into cells about :data:`_FIRST` wide."""
    number, boxes = [], []
    for k, wall in enumerate(walls):
        ends = []
        for axis, x in enumerate((wall.u, wall.v)):
            low, high = float(x.min()), float(x.max())
            grid = wall.points.reshape(*wall.shape, 3)
            length = float(np.linalg.norm(np.diff(grid, axis=axis), axis=2).sum(axis=axis).max())
            ends.append(np.linspace(low, high, max(math.ceil(length / _FIRST), 1) + 1))
        u, v = ends
        a, c = (x.ravel() for x in np.meshgrid(u[:-1], v[:-1], indexing="ij"))
        b, d = (x.ravel() for x in np.meshgrid(u[1:], v[1:], indexing="ij"))
        boxes.append(np.stack([a, b, c, d], axis=-1))
        number.append(np.full(len(a), k))
    return _Cells(np.concatenate(number), np.concatenate(boxes))


def _places_on(walls: Sequence[SurfacePoints], number: NDArray[np.int64], at: Floats) -> tuple[Floats, Floats]:
    """Points and normals (n, 3) at u and v (n, 2) of the walls of these numbers."""
    points, normals = np.empty((len(at), 3)), np.empty((len(at), 3))
    for k in np.unique(number).tolist():
        of, surface = number == k, walls[k].surface
        if surface is None:
            raise InputError(f"channel: wall {walls[k].name}: only points of it are known: state its surface")
        points[of], normals[of] = surface.at(*at[of].T), surface.normal(*at[of].T)
    return points, normals


def _reach(p: Floats, N: Floats) -> tuple[Floats, Floats]:
    """Greatest distance t and angle w (n,) from a point of a cell to its nearest corner; corners p (n, 4, 3)."""
    t, w = np.zeros(len(p)), np.zeros(len(p))
    # opposite corners: of a cell that is nearly a parallelogram none of its points is farther than half of the longer
    for a, b in ((0, 3), (1, 2)):
        t = np.maximum(t, 0.5 * np.linalg.norm(p[:, a] - p[:, b], axis=1))
    for a, b in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)):
        w = np.maximum(w, np.linalg.norm(N[:, a] - N[:, b], axis=1))
    return t, _TURN * w
