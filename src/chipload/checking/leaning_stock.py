"""Checks of the stock after a program whose axis leans: pieces that it cuts free, and slender walls.

Where the axis leans the stock is not followed step by step over columns. After the program, points of it stand on grids
of one distance: upright, and along each fixed direction of the axis in which the program cuts (3+2). Neighbouring
points in the stock are one piece. Whether a piece is cut after it has come free is not known, so that one that nothing
stated holds leaves the job unproven. Walls are found in the columns along each direction, as for an upright axis.

Bound: what is thinner than the distance of the points may be missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.checking.clamped import placed_clamps
from chipload.checking.inputs import CheckInputs
from chipload.checking.workpiece import insides, stock_box
from chipload.errors import Finding, Severity
from chipload.program.motions import lengths
from chipload.program.program import RAPID, Program
from chipload.simulation.heights.clamped_stock import find_clamped_stock
from chipload.simulation.heights.height_map import NEVER, HeightMap
from chipload.simulation.heights.slender_walls import (
    SlenderWall,
    distortion_not_checked,
    slender_wall_findings,
    slender_walls_of,
)
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
Inside = Callable[[Floats], Bools]

#: points over the least radius of a cutter, and most points of a grid
FINE, MOST = 10.0, 400_000
#: fixed directions that are examined, those with the longest path, and the share of it that one has at least
DIRECTIONS, LEAST_PATH = 6, 0.01
#: directions are one within this
SAME = 1e-6
#: a piece has so many points, and the volume of a cube of this share of the least diameter, at least
POINTS, CUBE = 64, 0.25


@dataclass(frozen=True, eq=False)
class StockGrid:
    """Points of a stock along three directions.

    Parameters
    ----------
    axes : (3, 3) float, unit directions as rows, the last that of the columns
    at : places along each [mm]
    filled : (nx, ny, nz) bool
    """

    axes: Floats
    at: tuple[Floats, Floats, Floats]
    filled: Bools

    @property
    def columns(self) -> tuple[Floats, Floats]:
        """Low and top of the columns (nx, ny) [mm]; inf, -inf where there is no stock."""
        z = self.at[2]
        half = 0.5 * float(z[1] - z[0])
        there = self.filled.any(axis=2)
        low = z[np.argmax(self.filled, axis=2)] - half
        top = z[len(z) - 1 - np.argmax(self.filled[:, :, ::-1], axis=2)] + half
        return np.where(there, low, np.inf), np.where(there, top, -np.inf)


def check_leaning_stock(
    inputs: CheckInputs, program: Program, before: Inside, stock: LayeredStock
) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """Return the findings on the stock after a program whose axis leans, and what was not checked.

    Parameters
    ----------
    before : which points lay in the stock before the program
    stock : after the program
    """
    checks, walls = inputs.checks, inputs.checks.slender_walls and inputs.elasticity.workpiece is None
    if not (checks.loose_stock or walls):
        return (), ()
    diameter = min(c.resolved_diameter for c in inputs.cutters.values())
    low, high = stock_box(stock)
    pitch = max(0.5 * diameter / FINE, float(np.cbrt(np.prod(high - low) / MOST)))
    inside = insides(stock)
    upright = grid_along(inside, low, high, np.eye(3), pitch)
    start = grid_along(before, low, high, np.eye(3), pitch)
    findings, unchecked = list[Finding](), list[str]()
    if checks.loose_stock:
        findings += _loose(inputs, stock, upright, start, (CUBE * diameter) ** 3)
        unchecked.append("pieces that are cut free and milled away: the axis leans")
    if walls:
        along, left = fixed_directions(program)
        found = list[SlenderWall](_walls(upright, start, checks.wall_slenderness))
        for axis in along:
            frame = _frame(axis)
            after, initial = (grid_along(points, low, high, frame, pitch) for points in (inside, before))
            found += _walls(after, initial, checks.wall_slenderness)
        findings += slender_wall_findings(_distinct(found), checks.wall_slenderness)
        thinnest = min((wall.thickness_mm for wall in found), default=math.inf)
        unchecked += distortion_not_checked(thinnest, checks.stress_wall_mm)
        unchecked.append(f"deflection of slender walls: one thinner than {pitch:.2g} mm may be missed{left}")
    return tuple(findings), tuple(unchecked)


def fixed_directions(program: Program) -> tuple[Floats, str]:
    """Return the fixed directions (d, 3) of the axis besides the upright one in which a program cuts, those with the
    longest path first, and what is left out of them in words.
    """
    axis, path = np.asarray(program.axis), lengths(program)
    cuts = program.motion != RAPID
    same = np.append(False, np.abs(np.diff(axis, axis=0)).max(axis=1) <= SAME) & cuts
    whole = float(path[cuts].sum())
    kinds, at = np.unique(axis[same].round(6), axis=0, return_inverse=True)
    share = np.bincount(at.ravel(), path[same], minlength=len(kinds)) / whole if whole > 0.0 else np.zeros(len(kinds))
    leaning = (kinds[:, 2] < 1.0 - SAME) & (share >= LEAST_PATH)
    order = np.flatnonzero(leaning)[np.argsort(-share[leaning], kind="stable")][:DIRECTIONS]
    upright = float(share[kinds[:, 2] >= 1.0 - SAME].sum())
    left = 1.0 - float(share[order].sum()) - upright
    return kinds[order], ", or one along another direction of the axis" if left > LEAST_PATH else ""


def grid_along(inside: Inside, low: Floats, high: Floats, axes: Floats, pitch: float) -> StockGrid:
    """Return the points of a stock on a grid along directions; ``low`` and ``high`` are corners of its box [mm]."""
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    a, b = (f(corners @ axes.T, axis=0) for f in (np.min, np.max))
    count = np.maximum(np.ceil((b - a) / pitch - 1e-9), 2.0).astype(np.int64)
    x, y, z = (a[k] + (b[k] - a[k]) / count[k] * (np.arange(count[k]) + 0.5) for k in range(3))
    own = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    return StockGrid(axes, (x, y, z), inside(own @ axes).reshape(tuple(count.tolist())))


def _frame(axis: Floats) -> Floats:
    """Unit directions (3, 3) as rows with the axis as the last."""
    reference = np.eye(3)[int(np.argmin(np.abs(axis[:2])))]
    u = reference - (reference @ axis) * axis
    u = u / np.linalg.norm(u)
    return np.stack([u, np.cross(axis, u), axis])


def _walls(after: StockGrid, start: StockGrid, slenderness: float) -> list[SlenderWall]:
    """Walls along the columns of a grid, their places in the work frame."""
    (low, top), (_, before) = after.columns, start.columns
    out = []
    for wall in slender_walls_of(after.at[0], after.at[1], low, top, before, slenderness):
        x, y, z = (np.array(wall.place) @ after.axes).tolist()
        out.append(SlenderWall(wall.height_mm, wall.thickness_mm, wall.length_mm, (x, y, z)))
    return out


def _distinct(walls: list[SlenderWall]) -> list[SlenderWall]:
    """The walls, the most slender first, each once: two whose places are nearer than their height are one."""
    kept = list[SlenderWall]()
    for wall in sorted(walls, key=lambda w: -w.slenderness):
        if all(np.linalg.norm(np.subtract(wall.place, other.place)) > other.height_mm for other in kept):
            kept.append(wall)
    return kept


def _loose(inputs: CheckInputs, stock: LayeredStock, after: StockGrid, start: StockGrid, least: float) -> list[Finding]:
    """A finding for each piece that comes free and that nothing stated holds; ``least`` volume of one [mm^3]."""
    from scipy import ndimage

    around = np.ones((3, 3, 3), dtype=np.int64)
    label, count = ndimage.label(after.filled, around)
    _, whole = ndimage.label(start.filled, around)
    sides = [float(a[1] - a[0]) for a in after.at]
    size = np.bincount(label.ravel(), minlength=count + 1)[1:]
    large = np.flatnonzero((size >= POINTS) & (size * np.prod(sides) >= least)) + 1
    if len(large) <= max(whole, 1):
        return []
    (low, top), (_, before) = after.columns, start.columns
    highest = after.filled.shape[2] - 1 - np.argmax(after.filled[:, :, ::-1], axis=2)
    seen = np.where(
        after.filled.any(axis=2), np.take_along_axis(label, highest[:, :, None], axis=2)[:, :, 0], 0
    ).astype(np.int64)
    none = np.full(seen.shape, NEVER)
    columns = HeightMap(
        after.at[0], after.at[1], low, top, before, none, none, (), (), np.zeros(1), np.zeros(0, dtype=np.int64)
    )
    workpiece = inputs.elasticity.workpiece
    clamps = () if workpiece is None else placed_clamps(workpiece, stock)
    held = find_clamped_stock(columns, seen, clamps, [f.mesh for f in inputs.surroundings.fixtures])
    held = held or frozenset([int(np.argmax(size)) + 1])
    out = []
    for k in large.tolist():
        if k in held:
            continue
        points = np.argwhere(label == k)
        extent = [float(n + 1) * side for n, side in zip(np.ptp(points, axis=0).tolist(), sides, strict=True)]
        middle = np.median(points, axis=0).astype(np.int64).tolist()
        x, y, z = (float(a[i]) for a, i in zip(after.at, middle, strict=True))
        text = (
            f"cuts a piece of {extent[0]:.3g} x {extent[1]:.3g} x {extent[2]:.3g} mm free of the stock, and no stated "
            "clamp or fixture holds it: whether it is cut after that is not known where the axis leans: leave tabs or "
            "a floor, or state what holds it as a [[fixture]] or a [[workpiece.clamp]]"
        )
        out.append(Finding("loose-stock", 0, text, Severity.UNPROVEN, (x, y, z)))
    return out
