"""Walls from drawn chains, with the material on the right of travel, and the centre paths of the cutter.

Notation: the planning frame has the material on the RIGHT (down milling). For up milling everything is mirrored in y,
planned, and mirrored back: :func:`mirror_contour` is its own inverse. R cutter radius, Q the wall, O the centre path.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.distance import distance
from chipload.geometry.offset import offset

#: spacing [mm] at which a wall is searched for places that the cutter does not reach
PROBE_MM = 0.05


@dataclass(frozen=True, eq=False)
class Walls:
    """Walls in the planning frame, material on the right.

    ``walls`` as drawn; ``extended`` the same with open chains run on along their end tangents by ``run_on`` mm.
    """

    walls: tuple[Contour, ...]
    extended: tuple[Contour, ...]
    run_on: float


def mirror_contour(contour: Contour) -> Contour:
    """The contour reflected in y: what lay on its right lies on its left."""
    seg = contour.segments * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0])
    return Contour(seg)


def walls_of(contours: Sequence[Contour], side: str, milling: str, length: float) -> Walls:
    """Drawn chains turned so that the material lies on the right of travel, in the planning frame.

    Parameters
    ----------
    side : where the cutter runs. `inside`, `outside`: of closed contours (nested by even-odd), or on the side of an
        open chain's closing chord and away from it; `left`, `right`: of open chains as drawn
    milling : `down` or `up`
    length : by which open chains are run on at both ends [mm]

    Raises
    ------
    InputError
        Open and closed chains are mixed; left or right of a closed contour; inside of a straight chain.
    """
    closed = [c for c in contours if c.closed]
    chains = [c for c in contours if not c.closed]
    if closed and chains:
        x, y = chains[0].end
        gap = float(np.hypot(*(chains[0].end - chains[0].start)))
        raise InputError(
            f"part: open chain ends at ({x:.6g}, {y:.6g}), gap {gap:.6g} mm, among closed contours: close it "
            '(part.join_mm), choose its layer alone (part.layers), or leave it out (part.open_chains = "dropped")'
        )
    if side in ("left", "right"):
        if closed:
            raise InputError(f"operation.side = {side}: the contour is closed: choose inside or outside")
        turned = [c if side == "left" else c.reversed() for c in chains]
    else:
        turned = [_turned_to_area(c) for c in chains] + list(Region.of(closed).contours)
        if side == "outside":
            turned = [c.reversed() for c in turned]
    if milling == "up":
        turned = [mirror_contour(c.reversed()) for c in turned]
    return Walls(tuple(turned), tuple(run_on(c, length) for c in turned), length)


def _turned_to_area(chain: Contour) -> Contour:
    """An open chain turned so that the area to its closing chord lies on its left."""
    chord = np.concatenate([chain.end, chain.start, np.zeros(3)])
    area = Contour(np.vstack([chain.segments, chord])).area
    if abs(area) < 1e-9 * chain.length**2:
        x, y = chain.start
        raise InputError(
            f"operation.side = inside: the chain from ({x:.6g}, {y:.6g}) is straight and has no inside: "
            "choose left or right"
        )
    return chain if area > 0.0 else chain.reversed()


def run_on(chain: Contour, length: float) -> Contour:
    """An open chain, extended along its end tangents by ``length`` mm at both ends; a closed contour is unchanged."""
    if chain.closed:
        return chain
    p, t, _ = chain.at([0.0, chain.length])
    ends = np.array([[*(p[0] - length * t[0]), *p[0], 0.0, 0.0, 0.0], [*p[1], *(p[1] + length * t[1]), 0.0, 0.0, 0.0]])
    return Contour(np.vstack([ends[:1], chain.segments, ends[1:]]))


def centre_paths(walls: Walls, radius: float, tolerance_mm: float) -> tuple[Contour, ...]:
    """The finish centre paths: parallels at R that touch every point of the walls.

    Raises
    ------
    InputError
        A corner or passage is too small for the cutter by more than ``tolerance_mm`` of stock left; the message gives
        the place and the largest cutter that fits.
    """
    paths = offset(walls.extended, radius)
    gap, x, y = _left_on(walls, paths, radius)
    if gap <= tolerance_mm:
        return paths
    fits = largest_radius(walls, radius, tolerance_mm)
    what = (
        f"the largest that fits has diameter_mm = {2.0 * fits:.4g}"
        if fits > 0.0
        else "no cutter fits a sharp inside corner: draw a fillet, or mill it with kind = pocket"
    )
    raise InputError(
        f"cutter.diameter_mm = {2.0 * radius:g}: does not reach the wall at ({x:.4f}, {y:.4f}), "
        f"leaves {gap:.4g} mm: {what}"
    )


def _left_on(walls: Walls, paths: Sequence[Contour], radius: float) -> tuple[float, float, float]:
    """Greatest stock left on the walls by the centre paths [mm], and its place."""
    probes = [
        c.at(np.unique(np.concatenate([c.knots, np.linspace(0.0, c.length, int(c.length / PROBE_MM) + 2)])))[0]
        for c in walls.walls
    ]
    points = np.vstack(probes)
    if not paths:
        return math.inf, float(points[0, 0]), float(points[0, 1])
    gap = distance(np.vstack([p.segments for p in paths]), points) - radius
    k = int(np.argmax(gap))
    return float(gap[k]), float(points[k, 0]), float(points[k, 1])


def largest_radius(walls: Walls, below: float, tolerance_mm: float) -> float:
    """Largest R < ``below`` whose parallel touches all of the walls, by bisection to 1e-4 of ``below``; 0: none."""
    low, high = 0.0, below
    while high - low > 1e-4 * below:
        middle = 0.5 * (low + high)
        if _left_on(walls, offset(walls.extended, middle), middle)[0] <= min(tolerance_mm, 0.02 * middle):
            low = middle
        else:
            high = middle
    return low if low > 1e-3 * below else 0.0
