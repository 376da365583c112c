"""Stock of a tube or a cone: a closed body about Z, with an outer edge that may be eccentric and have bosses.

Notation: r_i(z), r_o(z) [mm] inner and outer radius at the height z, both linear in it; c (2,) [mm] centre of the outer
edge; a boss is the sector between two angles, counter-clockwise from +X, out to r_o + b.

A circle is a polygon with its 512 corners on the circle; at a radius of 25 mm the error is below 0.5 um. The corners
lie on the same rays from Z at both ends of the body, and the faces between them are those of a ruled surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import trimesh
from chipload.stock.layers import LayeredStock
from chipload.stock.tile_grid import polygons

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: corners of a circle
CORNERS = 512
#: corners nearer to one another are one [mm]; rounding, not a setting
ROUNDING = 1e-9


@dataclass(frozen=True)
class Boss:
    """Boss of height ``radial`` [mm] from the angle ``begin`` to ``end`` [rad], begin < end."""

    begin: float
    end: float
    radial: float


def ring_stock(
    bounds: Floats,
    inner: Callable[[Floats], Floats],
    outer: Callable[[Floats], Floats],
    centre: tuple[float, float] = (0.0, 0.0),
    bosses: Sequence[Boss] = (),
    tile_mm: float = 40.0,
) -> LayeredStock:
    """Return a stock of layers of rings, with its body.

    Parameters
    ----------
    bounds : (n + 1,) float [mm], ascending heights of the bounds of the layers
    inner, outer : r_i and r_o as functions of the height [mm], both about Z and linear in it
    centre : c; the inner edge remains centred on Z
    bosses : on the outer edge
    tile_mm : longest side of a tile

    Raises
    ------
    InputError
        A ring has no width at some angle.

    Examples
    --------
    A tube from 9 to 10 mm radius, 2 mm high: 2 pi (100 - 81) mm^3, except for the error of the chords.

    >>> tube = ring_stock(np.array([0.0, 2.0]), lambda z: 0 * z + 9.0, lambda z: 0 * z + 10.0)
    >>> round(tube.volume() / (2.0 * math.pi * 19.0), 4)
    1.0
    """
    bounds = np.asarray(bounds, dtype=np.float64)
    heights = 0.5 * (bounds[:-1] + bounds[1:])
    low, high = inner(heights), outer(heights)
    off = math.hypot(*centre)
    if (high - off <= low).any() or (low <= 0.0).any():
        k = int(np.argmin(high - low))
        raise InputError(
            f"stock: at z = {heights[k]:g} mm a ring from {low[k]:g} to {high[k]:g} mm, {off:g} mm off its centre: "
            "must have a width all round"
        )
    ends = np.array([bounds[0], bounds[-1]])
    return LayeredStock.of_mesh(_ring_body(ends, inner(ends), outer(ends), centre, bosses), bounds, tile_mm)


def _ring_body(
    ends: Floats, inner: Floats, outer: Floats, centre: tuple[float, float], bosses: Sequence[Boss]
) -> trimesh.Trimesh:
    """Closed body between two heights ``ends`` with the radii ``inner`` and ``outer`` there, (2,) [mm] each."""
    borders = [
        edge for boss in bosses if boss.end - boss.begin < math.tau - ROUNDING for edge in (boss.begin, boss.end)
    ]
    angle = np.unique(np.mod([*(np.arange(CORNERS) * (math.tau / CORNERS)), *borders], math.tau).round(12))
    n, middle = len(angle), 0.5 * (angle + np.append(angle[1:], math.tau + angle[0]))
    height = np.zeros(n)
    for boss in bosses:
        within = np.mod(middle - boss.begin, math.tau) < boss.end - boss.begin
        height[within] = np.maximum(height[within], boss.radial)
    # at a border of a boss the outer edge has two corners on one ray: behind it and before it
    ray = np.repeat(np.arange(n), 2)
    raised = np.column_stack([np.roll(height, 1), height]).ravel()
    radius = [_outer_radius(angle[ray], o, raised, centre) for o in outer.tolist()]
    apart = np.maximum(*(np.abs(np.diff(r.reshape(n, 2), axis=1)[:, 0]) for r in radius)) > ROUNDING
    kept = np.column_stack([np.ones(n, dtype=np.bool_), apart]).ravel()
    ray, m = ray[kept], int(kept.sum())
    u = np.column_stack([np.cos(angle), np.sin(angle)])
    points = [np.column_stack([u[ray] * r[kept, None], np.full(m, z)]) for r, z in zip(radius, ends, strict=True)]
    points += [np.column_stack([u * r, np.full(n, z)]) for r, z in zip(inner, ends, strict=True)]
    i, k = np.arange(m), np.arange(n)
    after, then = (i + 1) % m, (k + 1) % n
    # corners of the outer edge below and above, and of the inner edge below and above
    o0, o1, q0, q1 = 0, m, 2 * m, 2 * m + n
    faces = [
        _triangles(o0 + i, o0 + after, o1 + after), _triangles(o0 + i, o1 + after, o1 + i),
        _triangles(q0 + k, q1 + then, q0 + then), _triangles(q0 + k, q1 + k, q1 + then),
    ]  # fmt: skip
    on = ray[after] != ray
    for o, q, up in ((o0, q0, False), (o1, q1, True)):
        ring = _triangles(o + i, o + after, q + ray), _triangles(o + after[on], q + ray[after][on], q + ray[on])
        faces += ring if up else [some[:, ::-1] for some in ring]
    return trimesh.Trimesh(np.vstack(points), np.vstack(faces), process=False)


def _outer_radius(angle: Floats, radius: float, boss: Floats, centre: tuple[float, float]) -> Floats:
    """Distance of the outer edge from Z along rays: that of a circle about ``centre``, or of a boss on it."""
    along = centre[0] * np.cos(angle) + centre[1] * np.sin(angle)
    circle = along + np.sqrt(radius**2 - centre[0] ** 2 - centre[1] ** 2 + along**2)
    return np.where(boss > 0.0, np.maximum(circle, radius + boss), circle)


def _triangles(a: Ints, b: Ints, c: Ints) -> Ints:
    return np.column_stack([a, b, c])


def surface_off(
    stock: LayeredStock, outer: Callable[[Floats], Floats], low: float, high: float, within: float
) -> tuple[float, float] | None:
    """Least and greatest distance of the outer edges of the layers from ``outer`` between two heights [mm]: below 0 the
    wall is cut into, above 0 stock is left. None: no whole layer lies there.

    A section is closed by a disc first: what the cutter took is wider than the disc and remains as it is; a slit
    between two tiles or two cuts, into which the disc does not go, is not a cut.

    Parameters
    ----------
    within : radius of the disc [mm]: the tolerance of the simulated edges, far below the radius of a cutter
    """
    found = []
    for i in range(stock.layers):
        if stock.bounds[i] < low - 1e-9 or stock.bounds[i + 1] > high + 1e-9:
            continue
        whole = polygons(stock.section(i).buffer(within).buffer(-within))
        edge = np.concatenate([np.asarray(p.exterior.coords)[:, :2] for p in whole])
        off = np.hypot(*edge.T) - float(outer(np.array([stock.heights[i]]))[0])
        found.append((float(off.min()), float(off.max())))
    return (min(a for a, _ in found), max(b for _, b in found)) if found else None
