"""Thin walls that a program leaves standing.

Notation: over each level floor L that the program cuts, the columns that stand higher are a plan; the thickness of a
wall is the diameter of the greatest circle in that plan at its middle, its height that of its top over L. The
slenderness of a wall is its height over its thickness; what stands beside the stock counts as air.

A long wall that is clamped along its foot alone deflects under a force at its free edge by w = 0.168 F H^2 / D, with
the stiffness of a plate D = E t^3 / 10.9: at a slenderness of 5, of aluminium 2 mm thick, 0.33 um/N.
Reference: [Jaramillo1950].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.simulation.heights.height_map import HeightMap

Floats = NDArray[np.float64]
#: floors that are examined: with the greatest area, at least this share of what was cut, equal within so many mm
FLOORS, SHARE, ALIKE = 16, 0.002, 0.01
#: a wall is at least so many times as long as it is thick, and covers so many squares of the radius of the circle that
#: it is too thin for: a right corner that the circle does not reach covers 0.2 of them
LONG, COVER = 2.0, 0.75


@dataclass(frozen=True)
class SlenderWall:
    """A thin wall: height, thickness and length [mm], and the place of the middle of its top."""

    height_mm: float
    thickness_mm: float
    length_mm: float
    place: tuple[float, float, float]

    @property
    def slenderness(self) -> float:
        """Height over thickness."""
        return self.height_mm / self.thickness_mm


def find_slender_walls(found: HeightMap, slenderness: float) -> tuple[SlenderWall, ...]:
    """Return the walls that are more slender than ``slenderness``, the most slender first.

    A wall that stands over several floors is given once, over the lowest.
    """
    from scipy import ndimage

    there = np.isfinite(found.low)
    cut = there & (found.top < found.before)
    if not cut.any():
        return ()
    ground = np.where(np.isfinite(found.top), found.top, np.where(there, found.low, np.inf))
    levels, area = np.unique((ground[cut] / ALIKE).round().astype(np.int64), return_counts=True)
    kept = np.sort(levels[area >= SHARE * area.sum()][np.argsort(-area[area >= SHARE * area.sum()])][:FLOORS])
    hx, hy = float(found.x[1] - found.x[0]), float(found.y[1] - found.y[0])
    out: list[SlenderWall] = []
    taken = np.zeros(there.shape, dtype=np.bool_)
    for level in (ALIKE * kept).tolist():
        standing = there & np.isfinite(found.top) & (found.top > level + 2.0 * ALIKE)
        if not standing.any():
            continue
        inner = ndimage.distance_transform_edt(np.pad(standing, 1), sampling=(hx, hy))[1:-1, 1:-1]
        highest = float(found.top[standing].max()) - level
        radius = 0.5 * highest / slenderness
        # opened by a circle of this radius: what is wide stays
        wide = inner >= radius + 0.5 * max(hx, hy)
        if wide.any():
            away = ndimage.distance_transform_edt(np.pad(~wide, 1, constant_values=True), sampling=(hx, hy))[1:-1, 1:-1]
            thin = standing & (away > radius + 2.0 * max(hx, hy))
        else:
            thin = standing
        label, count = ndimage.label(thin & ~taken)
        for k, box in enumerate(ndimage.find_objects(label)[:count], start=1):
            own = label[box] == k
            thickness = max(2.0 * float(inner[box][own].max()) - max(hx, hy), max(hx, hy))
            tops = found.top[box][own]
            height = float(np.median(tops)) - level
            length = float(own.sum()) * hx * hy / thickness
            if height <= slenderness * thickness or length < max(LONG * thickness, COVER * radius**2 / thickness):
                continue
            taken[box] |= own
            i, j = (int(v[len(v) // 2]) for v in np.nonzero(own))
            place = (float(found.x[box[0]][i]), float(found.y[box[1]][j]), float(tops.max()))
            out.append(SlenderWall(height, thickness, length, place))
    return tuple(sorted(out, key=lambda w: -w.slenderness))
