"""Check of the shank for contact with material: an axial depth greater than the flute length.

The flutes end at ``flute_length``; the shank above them does not cut, it rubs and breaks. In a run that meets material
above the flutes, cutters end where their flutes end, and a second stock follows the run. At the instants of a step at
which material stands above the flutes, and at its end, rings of points of the shank, inside its radius by a margin, are
asked for material upwards from the end of the flutes. The height at which it ends is found by halving.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.bricks.stock import FIXED, BrickStock

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Poses: TypeAlias = tuple[Floats, Floats, Floats, Floats]

#: points of a ring, and distance of rings along the axis over the radius of the cutter
AROUND, APART = 32, 0.1
#: distance of the lowest ring from the end of the flutes [mm], more than that within which a point counts as swept
ABOVE = 1e-7
#: halvings of the distance of two rings
HALVINGS = 40


@dataclass(frozen=True, eq=False)
class ShankContact:
    """The stock along the steps of a run.

    Parameters
    ----------
    stock : before the steps that are asked next; it changes
    margin : what the shank may touch [mm]
    """

    stock: BrickStock
    margin: float

    def overrun(self, poses: Poses, tool: Ints, step: Ints, time: Floats) -> Floats:
        """Make steps; return the greatest length (n,) [mm] of the shank in material of each that is asked.

        Parameters
        ----------
        poses : tips at the start and the end of the steps, and axes there, (n, 3) each
        tool : (n,) int
        step, time : (m,) steps that are asked, and when, 0..1; at their ends they are asked too
        """
        out, before = np.zeros(len(tool)), 0
        for k in np.unique(step).tolist():
            self._make(poses, tool, slice(before, k))
            before = k + 1
            times = [0.0, *np.unique(time[step == k]).tolist(), 1.0]
            tip, axis = poses_at(poses, k, np.array(times))
            alike = np.full(len(times) - 1, tool[k])
            parts = (tip[:-1], tip[1:], axis[:-1], axis[1:])
            for i in range(len(times) - 1):
                self._make(parts, alike, slice(i, i + 1))
                found = axial_overrun(self.stock, self.stock.table[int(tool[k])], tip[i + 1], axis[i + 1], self.margin)
                out[k] = max(out[k], found)
        self._make(poses, tool, slice(before, len(tool)))
        return out

    def _make(self, poses: Poses, tool: Ints, some: slice) -> None:
        if some.start < some.stop:
            p0, p1, a0, a1 = (x[some] for x in poses)
            self.stock.skip(p0, p1, a0, a1, tool[some])


def poses_at(poses: Poses, k: int, times: Floats) -> tuple[Floats, Floats]:
    """Return tips and axes (m, 3) of step ``k`` at times of 0..1; the axis turns evenly."""
    p0, p1, a0, a1 = (x[k] for x in poses)
    t = times[:, None]
    turn = 2.0 * math.atan2(float(np.linalg.norm(a1 - a0)), float(np.linalg.norm(a1 + a0)))
    if turn < FIXED:
        return p0 + t * (p1 - p0), np.tile(a0, (len(times), 1))
    axis = (np.sin((1.0 - t) * turn) * a0 + np.sin(t * turn) * a1) / math.sin(turn)
    return p0 + t * (p1 - p0), axis


def axial_overrun(stock: BrickStock, cutter: Cutter, tip: Floats, axis: Floats, margin: float) -> float:
    """Return the length of the shank in material, from the end of the flutes upwards [mm]; 0 if none.

    Parameters
    ----------
    stock : as it is
    tip, axis : (3,) where the cutter is [mm], and its axis, unit
    margin : what the shank may touch [mm]
    """
    shank = cutter.diameter if cutter.shank_diameter is None else cutter.shank_diameter
    radius = 0.5 * shank - margin
    first, last = cutter.flute_length + ABOVE, cutter.overhang
    if radius <= 0.0 or first >= last:
        return 0.0
    turn = np.arange(AROUND) * (math.tau / AROUND)
    across = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    ring = radius * (np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across))
    ring = np.vstack([np.zeros(3), 0.5 * ring, ring])

    def in_material(heights: Floats) -> NDArray[np.bool_]:
        points = tip + heights[:, None, None] * axis + ring
        return np.asarray(stock.contains(points.reshape(-1, 3)).reshape(len(heights), -1).any(axis=1))

    heights = np.linspace(first, last, max(math.ceil((last - first) / (APART * cutter.radius)), 1) + 1)
    free = np.flatnonzero(~in_material(heights))
    if not len(free):
        return last - cutter.flute_length
    if free[0] == 0:
        return 0.0
    low, high = heights[free[0] - 1], heights[free[0]]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if in_material(np.array([middle]))[0] else (low, middle)
    return float(low - cutter.flute_length)
