"""Thin walls that a program leaves standing.

Notation: over each level floor L that the program cuts, the columns that stand higher are a plan; the thickness of a
wall is the diameter of the greatest circle in that plan at its middle, its height that of its top over L. The
slenderness of a wall is its height over its thickness; what stands beside the stock counts as air. The bottom of the
stock is such a floor too: a thin plate that stands upright is a wall where the program cuts it.

A long wall that is clamped along its foot alone deflects under a force at its free edge by w = 0.168 F H^2 / D, with
the stiffness of a plate D = E t^3 / 10.9: at a slenderness of 5, of aluminium 2 mm thick, 0.33 um/N.
Reference: [Jaramillo1950].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.number_text import number_text
from chipload.simulation.heights.height_map import HeightMap

Floats = NDArray[np.float64]
#: floors that are examined: with the greatest area, at least this share of what was cut, equal within so many mm
FLOORS, SHARE, ALIKE = 8, 0.002, 0.01
#: columns that are looked at, at most
COLUMNS = 250_000
#: a wall is at least so many times as long as it is thick, and covers so many squares of the radius of the circle that
#: it is too thin for: a right corner that the circle does not reach covers 0.2 of them
LONG, COVER = 2.0, 0.75
#: walls that are named
NAMED = 3


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


def distortion_not_checked(thickness: float, least: float) -> tuple[str, ...]:
    """Return the sentence on the distortion of walls [mm] that are thinner than ``least``; none: they are not.

    >>> distortion_not_checked(1.5, 2.0)[0][:56]
    'distortion by residual stress: a wall of 1.5 mm is left,'
    """
    if thickness >= least:
        return ()
    return (
        f"distortion by residual stress: a wall of {number_text(thickness, 3)} mm is left, below "
        f"checks.stress_wall_mm = {least:g}: predict it in a job with [residual_stress]",
    )


def slender_wall_findings(walls: Sequence[SlenderWall], slenderness: float) -> list[Finding]:
    """Return a finding for each of the most slender walls, whose deflection is not calculated.

    Parameters
    ----------
    walls : the most slender first
    slenderness : above which a wall is slender
    """
    out = []
    for wall in walls[:NAMED]:
        more = f" (the most slender of {len(walls)})" if wall is walls[0] and len(walls) > 1 else ""
        text = (
            f"leaves a wall {wall.height_mm:.3g} mm high and {wall.thickness_mm:.2g} mm thick{more}, "
            f"{number_text(wall.slenderness, 2)} times as high as thick: its deflection is not checked: "
            "state [workpiece], or a "
            f"greater checks.wall_slenderness than {slenderness:g}"
        )
        out.append(Finding("slender-wall", 0, text, Severity.UNPROVEN, wall.place))
    return out


def find_slender_walls(found: HeightMap, slenderness: float) -> tuple[SlenderWall, ...]:
    """Return the walls after a program that are more slender than ``slenderness``, the most slender first."""
    return slender_walls_of(found.x, found.y, found.low, found.top, found.before, slenderness)


def slender_walls_of(
    x: Floats, y: Floats, low: Floats, top: Floats, before: Floats, slenderness: float
) -> tuple[SlenderWall, ...]:
    """Return the walls among columns that are more slender than ``slenderness``, the most slender first.

    A wall that stands over several floors is given once, over the lowest.

    Parameters
    ----------
    x, y : (nx,), (ny,) places of the columns [mm]
    low, top : (nx, ny) heights of the columns [mm]; inf, -inf where there is no material
    before : (nx, ny) tops before the cut [mm]: floors are where it is higher
    """
    from scipy import ndimage

    # no finer than needed: of many columns every second one, or fewer
    stride = max(int(np.ceil(np.sqrt(top.size / COLUMNS))), 1)
    x, y = x[::stride], y[::stride]
    low, top, before = (a[::stride, ::stride] for a in (low, top, before))
    there = np.isfinite(low)
    cut = there & (top < before)
    if not cut.any():
        return ()
    ground = np.where(np.isfinite(top), top, np.where(there, low, np.inf))
    levels, area = np.unique((ground[cut] / ALIKE).round().astype(np.int64), return_counts=True)
    kept = np.sort(levels[area >= SHARE * area.sum()][np.argsort(-area[area >= SHARE * area.sum()])][:FLOORS])
    hx, hy = float(x[1] - x[0]), float(y[1] - y[0])
    out: list[SlenderWall] = []
    taken = np.zeros(there.shape, dtype=np.bool_)
    near_cut = ndimage.binary_dilation(before > np.where(np.isfinite(top), top, low), iterations=2)
    bottom = float(low[there].min())
    for level in [bottom, *(ALIKE * kept[ALIKE * kept > bottom + ALIKE]).tolist()]:
        standing = there & np.isfinite(top) & (top > level + 2.0 * ALIKE)
        if not standing.any():
            continue
        inner = ndimage.distance_transform_edt(np.pad(standing, 1), sampling=(hx, hy))[1:-1, 1:-1]
        half = 0.5 * (float(top[standing].max()) - level) / slenderness
        # the thinnest first, so that a thick one that it meets is another wall
        plans = [(half, _thin(standing, inner, half, hx, hy))]
        while plans[-1][1].any() and plans[-1][0] > max(hx, hy):
            plans.append((0.5 * plans[-1][0], _thin(standing, inner, 0.5 * plans[-1][0], hx, hy)))
        for radius, thin in reversed(plans):
            label, count = ndimage.label(thin & ~taken)
            for k, box in enumerate(ndimage.find_objects(label)[:count], start=1):
                own = label[box] == k
                if not (own & near_cut[box]).any():
                    continue
                thickness = max(2.0 * float(inner[box][own].max()) - max(hx, hy), max(hx, hy))
                tops = top[box][own]
                height = float(np.median(tops)) - level
                length = float(own.sum()) * hx * hy / thickness
                if height <= slenderness * thickness or length < max(LONG * thickness, COVER * radius**2 / thickness):
                    continue
                taken[box] |= own
                i, j = (int(v[len(v) // 2]) for v in np.nonzero(own))
                place = (float(x[box[0]][i]), float(y[box[1]][j]), float(tops.max()))
                out.append(SlenderWall(height, thickness, length, place))
    return tuple(sorted(out, key=lambda w: -w.slenderness))


def _thin(standing: NDArray[np.bool_], inner: Floats, radius: float, hx: float, hy: float) -> NDArray[np.bool_]:
    """Mask of the columns that no circle of a radius [mm] within what stands covers; ``inner``: distance from air."""
    from scipy import ndimage

    wide = inner >= radius + 0.5 * max(hx, hy)
    if not wide.any():
        return standing
    away = ndimage.distance_transform_edt(np.pad(~wide, 1, constant_values=True), sampling=(hx, hy))[1:-1, 1:-1]
    return np.asarray(standing & (away > radius + 2.0 * max(hx, hy)))
