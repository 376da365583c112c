"""The undeformed chip of five-axis moves on one layer of the stock: its pieces, their outlines and areas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike

from chipload.api.mechanics.cut import Floats, read_only, straight_cutter
from chipload.api.values import AnyCutter
from chipload.engagement.chips.covered import covered
from chipload.engagement.chips.move import Move
from chipload.errors import InputError


@dataclass(frozen=True, eq=False)
class ChipPiece:
    """One piece of a chip on a layer.

    Parameters
    ----------
    outline_mm : (n, 2) float, x and y of its outer boundary, counter-clockwise, the first point not repeated
    holes_mm : the same of each hole, clockwise
    area_mm2 : area between them
    """

    outline_mm: Floats
    holes_mm: tuple[Floats, ...]
    area_mm2: float


def chip_on_layer(
    cutter: AnyCutter,
    tip_mm: ArrayLike,
    axis: ArrayLike,
    height_mm: float,
    *,
    first_move: int = 1,
    stock_mm: ArrayLike | None = None,
    tolerance_mm: float = 1e-3,
) -> tuple[ChipPiece, ...]:
    """Return the pieces that moves of a cutter remove from one layer of the stock, the largest first.

    In move k the tip goes straight from row k - 1 to row k, and the axis turns evenly from one direction to the other.
    On the layer z = h the section of the cutter covers an area, bounded by its edge at the start and at the end and by
    grazing points, at which the edge moves along itself. The chip is what the moves cover of the stock, less what the
    moves before them covered and what the cutter stands in at their start.

    Parameters
    ----------
    cutter : of any shape; its flutes cut, not its shank
    tip_mm : (n, 3) float, n at least 2, the tip at each row
    axis : (n, 3) float, direction from the tip to the holder, z above 0
    height_mm : h of the layer
    first_move : of the chip, 1 to n - 1; the moves before it have been cut
    stock_mm : (m, 2) float, outline of the stock on the layer; None: there is stock everywhere
    tolerance_mm : most that an outline is off the true boundary, above 0

    Returns
    -------
    tuple of ChipPiece
        Empty where nothing is removed. Pieces that are no wider than the tolerance are left out.

    Raises
    ------
    InputError
        A shape or a number is out of range, or an axis does not point up.

    References
    ----------
    [Chips2017].

    Examples
    --------
    A cutter of 10 mm goes 2 mm: 2 R d = 20 mm2 are new.

    >>> import chipload
    >>> mill = chipload.Cutter(diameter_mm=10, flutes=4, helix_deg=30, flute_length_mm=22, overhang_mm=35,
    ...                        modulus_gpa=580)
    >>> pieces = chip_on_layer(mill, [[0, 0, 0], [2, 0, 0]], [[0, 0, 1], [0, 0, 1]], 1.0, tolerance_mm=1e-5)
    >>> [round(piece.area_mm2, 3) for piece in pieces]
    [20.0]
    """
    mill, tips, axes = straight_cutter(cutter), _rows(tip_mm, "tip_mm"), _rows(axis, "axis")
    if len(tips) != len(axes) or len(tips) < 2:
        raise InputError(f"tip_mm of {len(tips)} rows, axis of {len(axes)}: must be as many, at least 2")
    if not 1 <= first_move < len(tips):
        raise InputError(f"first_move = {first_move}: must be from 1 to {len(tips) - 1}")
    ends = [*range(1, len(tips)), first_move - 1]
    starts = [*range(len(tips) - 1), first_move - 1]
    areas = [
        covered(Move.slerp(tips[a], axes[a], tips[b], axes[b]), mill, float(height_mm), tolerance_mm)
        for a, b in zip(starts, ends, strict=True)
    ]
    polygons = [shapely.Polygon() if area is None else area.polygon for area in areas]
    before = shapely.union_all([*polygons[: first_move - 1], polygons[-1]])
    chip = shapely.difference(shapely.union_all(polygons[first_move - 1 : -1]), before)
    if stock_mm is not None:
        chip = shapely.intersection(chip, _outline(stock_mm))
    parts = [p for p in shapely.get_parts(chip) if p.geom_type == "Polygon" and p.area > tolerance_mm * p.length]
    return tuple(_piece(p) for p in sorted(parts, key=lambda p: -p.area))


def _rows(values: ArrayLike, name: str) -> Floats:
    """Return values as an array (n, 3) of finite numbers."""
    rows = np.asarray(values, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 3 or not np.isfinite(rows).all():
        raise InputError(f"{name} of shape {rows.shape}: must be (n, 3) finite numbers")
    return rows


def _outline(values: ArrayLike) -> shapely.Polygon:
    """Return the polygon of an outline of the stock."""
    points = np.asarray(values, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3 or not np.isfinite(points).all():
        raise InputError(f"stock_mm of shape {points.shape}: must be (m, 2) finite numbers, m at least 3")
    polygon = shapely.Polygon(points)
    if not polygon.is_valid:
        raise InputError(f"stock_mm: {shapely.is_valid_reason(polygon)}: must be an outline that does not cross itself")
    return polygon


def _piece(polygon: shapely.Polygon) -> ChipPiece:
    """Return a polygon as a piece."""
    ccw = shapely.geometry.polygon.orient(polygon)
    outline, *holes = (read_only(np.asarray(ring.coords)[:-1]) for ring in (ccw.exterior, *ccw.interiors))
    return ChipPiece(outline, tuple(holes), float(polygon.area))
