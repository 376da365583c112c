"""Independent check of programs that mill between walls: gouges by the whole tool, and remaining material.

Notation: S points of the true surface, close together, N their normals out of the metal. Each point has a ray S + s N.
Every part of the tool (cutting part, neck, shank, holder) is moved along every row of the program, and the exact
interval of the ray inside the part is computed. The least s of the cutting part in feed moves is the remaining material
(the scallop); a negative least s of any part in any row is a gouge of that depth.

The check uses nothing of the planner: neither its closed form of the largest cutter, nor its check points, ranges or
step-overs.

Reference: [Jerard1989].
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
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import LateModule, scipy
from chipload.program.motions import is_arc
from chipload.program.program import LINE, Program
from chipload.progress import Progress, silent
from chipload.stock.dexel import cutter_shape

_ray_cuts = LateModule("chipload.simulation.channel._ray_cuts")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: parts of a tool, in their order
PARTS = ("cutting part", "neck", "shank", "holder")
#: length of a part without a stated end [mm]
ENDLESS = 500.0
#: greatest length [mm] of the moves into which a row is divided
PIECE = 4.0
#: moves of a group; a group of which no move can meet a ray is skipped as a whole
GROUP = 3
_BLOCK = 512


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points on a surface, a grid of ``shape`` (a, b) with u the slower, their normals, u, v and area [mm2] of each.

    ``surface`` they lie on; None where only its points are known.
    """

    name: str
    points: Floats
    normals: Floats
    u: Floats
    v: Floats
    area: Floats
    shape: tuple[int, int]
    surface: BSplinePatch | None = None


def wall(name: str, surface: BSplinePatch, u: Floats, v: Floats) -> SurfacePoints:
    """Return the points of the grid u x v (a,), (b,) on a surface.

    Leave out the edges of the metal, such as the tip of a blade: there an inward ray lies in the adjacent face, which a
    cutter may touch.

    >>> from chipload.geometry.bspline import patch_through
    >>> flat = patch_through([[[0, 0, 0], [0, 2, 0]], [[3, 0, 0], [3, 2, 0]]], [0, 1], [0, 1])
    >>> float(wall("flat", flat, np.linspace(0, 1, 7), np.linspace(0, 1, 5)).area.sum())
    6.0
    """
    U, V = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    size = np.linalg.norm(np.cross(surface.at(U, V, 1, 0), surface.at(U, V, 0, 1)), axis=1)
    share = np.outer(_weights(u), _weights(v)).ravel()
    return SurfacePoints(name, surface.at(U, V), surface.normal(U, V), U, V, size * share, (len(u), len(v)), surface)


def _weights(x: Floats) -> Floats:
    step = np.diff(x)
    out: Floats = 0.5 * (np.concatenate([step, [0.0]]) + np.concatenate([[0.0], step]))
    return out


@dataclass(frozen=True, eq=False)
class Remainder:
    """Remaining material and gouges of a program on a wall.

    Parameters
    ----------
    wall : the points
    rest : (n,) [mm] remaining material along the normal; ``height``: this or more
    rest_row : (n,) row of the program that leaves it; -1: none passes below ``height``
    gouge : (n,) [mm] greatest depth below the surface, at most ``depth``
    row, part : (n,) row of the program and part (:data:`PARTS`) of the gouge; -1: there is none
    height, depth : ends of the rays above and below the surface [mm]
    """

    wall: SurfacePoints
    rest: Floats
    rest_row: Ints
    gouge: Floats
    row: Ints
    part: Ints
    height: float
    depth: float

    @property
    def deepest(self) -> tuple[float, int]:
        """The deepest gouge [mm] and the number of its point."""
        k = int(self.gouge.argmax())
        return float(self.gouge[k]), k

    def message(self) -> str:
        """A sentence that locates the deepest gouge."""
        deep, k = self.deepest
        if self.row[k] < 0:
            return f"{self.wall.name}: nothing comes below the surface"
        x, y, z = self.wall.points[k].tolist()
        return (
            f"{self.wall.name}: the {PARTS[int(self.part[k])]} comes {deep:.4f} mm below the surface at "
            f"({x:.2f}, {y:.2f}, {z:.2f}) in row {int(self.row[k])}"
        )

    def scallops(self, across: str, within: NDArray[np.bool_] | None = None, prominence: float = 1e-3) -> Floats:
        """Heights [mm] of the scallops: the maxima between neighbouring passes along every grid line.

        Parameters
        ----------
        across : `u` or `v`, the direction across the passes
        within : (n,) the points that count, for example those between the passes; None: those with a rest below
            ``height``
        prominence : [mm] least prominence of a maximum that counts as a scallop
        """
        rest = self.rest.reshape(self.wall.shape)
        use = (self.rest < self.height if within is None else within).reshape(self.wall.shape)
        if across == "u":
            rest, use = rest.T, use.T
        heights = [
            row[peaks[ok[peaks]]]
            for row, ok in zip(rest, use, strict=True)
            for peaks in [scipy.signal.find_peaks(row, prominence=prominence)[0]]
        ]
        out: Floats = np.concatenate(heights) if heights else np.zeros(0)
        return out

    def excess(self, over: float) -> float:
        """Return the share of the area on which more than ``over`` [mm] is left."""
        return float(self.wall.area[self.rest > over].sum() / self.wall.area.sum())


def tool_parts(cutter: CatalogueCutter) -> tuple[Floats, Floats, Ints]:
    """Return for each part its lower end (k,) [mm] above the tip, its shape (k, 14) and its kind in :data:`PARTS`."""
    top = ENDLESS if cutter.cutting_length is None else cutter.cutting_length
    end = ENDLESS if cutter.reach is None else cutter.reach
    rows = [(0.0, min(top, end), 0.5 * cutter.diameter, cutter.corner_radius, 0)]
    if cutter.cutting_length is not None:
        low = top
        if cutter.neck_diameter is not None and cutter.neck_length is not None:
            rows.append((low, cutter.neck_length, 0.5 * cutter.neck_diameter, 0.0, 1))
            low = cutter.neck_length
        shank = cutter.top_diameter if cutter.shank_diameter is None else cutter.shank_diameter
        rows.append((low, end, 0.5 * shank, 0.0, 2))
    if cutter.reach is not None and cutter.holder_diameter is not None:
        rows.append((cutter.reach, cutter.reach + ENDLESS, 0.5 * cutter.holder_diameter, 0.0, 3))
    rows = [row for row in rows if row[1] > row[0]]
    # without a flank arc: the arc has no length, z3 = z2 = r
    shapes = [[r, R - r, r, 0.0, 0.0, r, R, 0.0, high - low, R, 0.0, R - r, r, r] for low, high, R, r, _ in rows]
    if not cutter.straight:
        shapes[0] = cutter_shape((*cutter.shape.apt[:6], min(top, end), *cutter.shape.outline[7:])).tolist()
    return np.array([row[0] for row in rows]), np.array(shapes), np.array([row[4] for row in rows])


def left_on(
    walls: Sequence[SurfacePoints],
    program: Program,
    cutter: CatalogueCutter,
    height: float,
    depth: float,
    step: float = 0.25,
    tol: float = 1e-5,
    workers: int = 1,
    progress: Progress = silent,
) -> tuple[Remainder, ...]:
    """Return the remaining material of a program on each wall.

    Parameters
    ----------
    height : [mm] end of the rays above the surface
    depth : [mm] end of the rays below it; less than the thickness of a blade, else its other side counts as gouged
    step : [mm] sweep of the tool between the instants at which a move is evaluated first
    tol : [mm] tolerance of the lowest point between them

    Raises
    ------
    InputError
        The program has arcs, or a number is out of range.
    """
    if is_arc(program).any():
        raise InputError("channel: the program has arcs: must be of straight rows")
    if not (height > 0.0 and depth > 0.0 and step > 0.0 and tol > 0.0):
        raise InputError("channel: height, depth, step and tol: must be above 0")
    starts, shapes, kinds = tool_parts(cutter)
    tips, axes, of = parted_moves(program)
    groups = move_groups(tips, axes)
    cutting = (program.motion == LINE)[of]
    out = []
    total, done = sum(len(w.points) for w in walls), 0
    for w in walls:
        n = len(w.points)
        frames = frames_of(w.normals)
        rest, gouge = np.full(n, height), np.zeros(n)
        rest_row, row, part = np.full(n, -1), np.full(n, -1), np.full(n, -1)

        def block(
            first: int, w: SurfacePoints = w, frames: Floats = frames, rest: Floats = rest, rest_row: Ints = rest_row,
            gouge: Floats = gouge, row: Ints = row, part: Ints = part,
        ) -> None:  # fmt: skip
            _ray_cuts.rest_and_gouge(
                w.points, frames, tips, axes, groups, GROUP, starts, shapes, cutting, depth, height, step, tol, first,
                min(first + _BLOCK, len(w.points)), rest, rest_row, gouge, row, part,
            )  # fmt: skip

        with ThreadPoolExecutor(workers) as pool:
            for k, _ in enumerate(pool.map(block, range(0, n, _BLOCK)), 1):
                progress((done + min(k * _BLOCK, n)) / total, w.name)
        done += n
        row, rest_row = (np.where(k >= 0, of[np.maximum(k, 0)], -1) for k in (row, rest_row))
        found_part = np.where(part >= 0, kinds[np.maximum(part, 0)], -1)
        out.append(Remainder(w, rest, rest_row, gouge, row, found_part, height, depth))
    return tuple(out)


def parted_moves(program: Program) -> tuple[Floats, Floats, Ints]:
    """Return tips and axes (m, 3) of the rows in pieces of at most :data:`PIECE`, and the row of each."""
    length = np.linalg.norm(np.diff(program.p_work, axis=0, prepend=program.p_work[:1]), axis=1)
    count = np.maximum(np.ceil(length / PIECE), 1.0).astype(np.int64)
    of = np.repeat(np.arange(len(program)), count)
    share = ((np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[of])[:, None]
    before = np.maximum(of - 1, 0)
    tips = program.p_work[before] * (1.0 - share) + program.p_work[of] * share
    axes = program.axis[before] * (1.0 - share) + program.axis[of] * share
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    return np.ascontiguousarray(tips), np.ascontiguousarray(axes), of


def move_groups(tips: Floats, axes: Floats) -> Floats:
    """(g, 8) float: bounds of every :data:`GROUP` moves, as :func:`_ray_cuts.bound_groups`."""
    out = np.empty((max(0, math.ceil((len(tips) - 1) / GROUP)), 8))
    _ray_cuts.bound_groups(tips, axes, GROUP, out)
    return out


def frames_of(normals: Floats) -> Floats:
    """(n, 3, 3) rows e1, e2, N."""
    other = np.eye(3)[np.abs(normals).argmin(axis=1)]
    e1 = np.cross(other, normals)
    e1 /= np.linalg.norm(e1, axis=1)[:, None]
    return np.ascontiguousarray(np.stack([e1, np.cross(normals, e1), normals], axis=1))


def scallop_numbers(heights: Floats, required: float) -> dict[str, float]:
    """Return greatest and mean scallop height [mm], and the mean over the required height; 0 if there are none.

    >>> scallop_numbers(np.array([0.25, 0.5]), 0.5)
    {'greatest_mm': 0.5, 'mean_mm': 0.375, 'mean_share': 0.75, 'count': 2.0}
    """
    if not len(heights):
        return {"greatest_mm": 0.0, "mean_mm": 0.0, "mean_share": 0.0, "count": 0.0}
    mean = math.fsum(heights) / len(heights)
    return {
        "greatest_mm": float(heights.max()),
        "mean_mm": mean,
        "mean_share": mean / required,
        "count": float(len(heights)),
    }
