"""Detection of a probably misplaced stock, the usual cause of loads far beyond what a cutter can carry.

Notation: t time at feed, of which t_air removes nothing; h greatest height of the stock's box above the tip, along the
tool's axis, where the first chip is cut; l flute length. Three signs are examined:

* air: t_air / t is at least ``AIR_SHARE``;
* depth: h > l, so that the first cut can be deeper than the flutes are long;
* apart: along X, Y or Z the middle of the motions at feed lies outside the stock by more than the cutter's radius.

Two signs make a finding, or ``apart`` alone where nothing is cut. A job with one sign alone is an ordinary one:
finishing runs in air, a plunge is deep.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, InputError, Severity
from chipload.number_text import number_text

Floats = NDArray[np.float64]
#: share of the time at feed that is spent in air
AIR_SHARE = 0.5
#: finding of :func:`stock_placement`
CODE = "stock-misplaced"


@dataclass(frozen=True, eq=False)
class Placement:
    """Position of the motions at feed of a simulated program relative to its stock.

    Parameters
    ----------
    feed_s, air_s : time at feed, and what of it removes nothing [s]
    first : row of the first chip; None: nothing is cut
    depth_mm, flute_mm : h and l at the first chip; 0 where nothing is cut
    low, high : (3,) float [mm], box of the tip at feed
    stock_low, stock_high : (3,) float [mm], box of the stock
    radius_mm : greatest radius of the cutters
    """

    feed_s: float
    air_s: float
    first: int | None
    depth_mm: float
    flute_mm: float
    low: Floats
    high: Floats
    stock_low: Floats
    stock_high: Floats
    radius_mm: float

    @property
    def in_air(self) -> bool:
        """Whether at least ``AIR_SHARE`` of the time at feed removes nothing."""
        return self.feed_s > 0.0 and self.air_s >= AIR_SHARE * self.feed_s

    @property
    def too_deep(self) -> bool:
        """Whether the first cut can be deeper than the flutes are long."""
        return self.depth_mm > self.flute_mm

    @property
    def outside_axes(self) -> tuple[int, ...]:
        """Axes along which the middle of the motions at feed lies outside the stock by more than a radius."""
        middle = 0.5 * (self.low + self.high)
        outside = np.maximum(self.stock_low - middle, middle - self.stock_high)
        return tuple(int(k) for k in np.flatnonzero(outside > self.radius_mm))


def placement_of(
    columns: Mapping[str, NDArray[Any]], bounds: tuple[Floats, Floats], cutters: Mapping[int, Cutter]
) -> Placement:
    """Return the position of the motions at feed relative to the stock; O(n).

    Parameters
    ----------
    columns : (n,) each, of :func:`chipload.simulation.chips.remove`: ``seconds``, ``rapid``, ``tool``,
        ``chip_volume_mm3``, ``x_mm``, ``y_mm``, ``z_mm``, ``axis_x``, ``axis_y``, ``axis_z``
    bounds : (3,) low and (3,) high corner of the stock before the program [mm]
    cutters : by tool number

    Raises
    ------
    InputError
        No step is at feed.
    """
    fed = ~np.asarray(columns["rapid"], dtype=np.bool_)
    if not fed.any():
        raise InputError("program: no motion at a feed: the placement cannot be checked")
    stock_low, stock_high = (np.asarray(corner, dtype=np.float64) for corner in bounds)
    seconds, chips = np.asarray(columns["seconds"]), np.asarray(columns["chip_volume_mm3"])
    tip = np.column_stack([columns[f"{x}_mm"] for x in "xyz"])
    cuts = np.flatnonzero(fed & (chips > 0.0))
    first = int(cuts[0]) if len(cuts) else None
    depth = flute = 0.0
    if first is not None:
        axis = np.array([columns[f"axis_{x}"][first] for x in "xyz"])
        corners = np.where(axis > 0.0, stock_high, stock_low)
        depth, flute = float((corners - tip[first]) @ axis), cutters[int(columns["tool"][first])].flute_length
    used = [cutters[int(number)].radius for number in np.unique(np.asarray(columns["tool"])[fed])]
    return Placement(
        float(seconds[fed].sum()), float(seconds[fed & (chips <= 0.0)].sum()), first, depth, flute,
        tip[fed].min(axis=0), tip[fed].max(axis=0), stock_low, stock_high, max(used),
    )  # fmt: skip


def nothing_cut(
    columns: Mapping[str, NDArray[Any]], bounds: tuple[Floats, Floats], cutters: Mapping[int, Cutter]
) -> Finding | None:
    """Return the finding that a program removes nothing; None if it does, or has tools whose chips are not simulated.

    Parameters and errors as those of :func:`placement_of`.
    """
    fed, tool = ~np.asarray(columns["rapid"], dtype=np.bool_), np.asarray(columns["tool"])
    bodies = [number for number, cutter in cutters.items() if cutter.body]
    if (np.asarray(columns["chip_volume_mm3"]) > 0.0).any() or np.isin(tool[fed], bodies).any():
        return None
    remedy = (
        "compare the zero point of the program (work offset, program.placed_in, tool length) with the position of the "
        "stock (low_mm, high_mm, or the coordinates of its file)"
    )
    if not fed.any():
        return Finding("nothing-cut", 0, f"nothing is cut: no motion is at a feed: {remedy}", Severity.UNPROVEN)
    at = placement_of(columns, bounds, cutters)
    upright = bool((np.asarray(columns["axis_z"])[fed] > 1.0 - 1e-9).all())
    # an upright cutter stands on its tip: it reaches by its radius to the sides and without a limit upwards
    below, above = at.stock_low - at.high, at.low - at.stock_high
    below[:2], above[:2] = below[:2] - at.radius_mm, above[:2] - at.radius_mm
    below[2] = 0.0
    apart = [
        f"{distance:.4g} mm {word}"
        for distance, word in (
            (above[2], "above"), (below[0], "beside (X-)"), (above[0], "beside (X+)"),
            (below[1], "beside (Y-)"), (above[1], "beside (Y+)"),
        )
        if upright and distance > 0.0
    ]  # fmt: skip
    boxes = (
        ", ".join(f"{'XYZ'[k]} {low[k] + 0.0:.4g} to {high[k] + 0.0:.4g}" for k in range(3))
        for low, high in ((at.low, at.high), (at.stock_low, at.stock_high))
    )
    path, stock = boxes
    where = f"the cutter stays {' and '.join(apart)} the stock: " if apart else ""
    text = f"nothing is cut: {where}the tip at a feed lies in {path} mm, the stock in {stock} mm: {remedy}"
    return Finding("nothing-cut", 0, text, Severity.UNPROVEN)


def stock_placement(
    columns: Mapping[str, NDArray[Any]], bounds: tuple[Floats, Floats], cutters: Mapping[int, Cutter]
) -> Finding | None:
    """Return the finding that the stock is probably misplaced; None if nothing suggests it.

    It is no verdict of its own: it says the likely cause of a limit that is exceeded. Parameters and errors as those of
    :func:`placement_of`.
    """
    at = placement_of(columns, bounds, cutters)
    if at.in_air + at.too_deep + bool(at.outside_axes) < 2 and not (at.first is None and at.outside_axes):
        return None
    parts = [f"{at.air_s:.4g} of {number_text(at.feed_s)} s at feed are in air"]
    if at.too_deep:
        line = int(columns["line"][at.first]) if "line" in columns else 0
        where = f" (line {line})" if line else ""
        parts.append(f"the first cut{where} is up to {at.depth_mm:.4g} mm deep, the flutes are {at.flute_mm:g} mm long")
    shown = sorted({*at.outside_axes, *((2,) if at.too_deep else ())})
    boxes = (
        f"the motions at feed lie in {'XYZ'[k]} {at.low[k]:.4g} to {at.high[k]:.4g} mm, the stock in "
        f"{at.stock_low[k]:.4g} to {at.stock_high[k]:.4g} mm"
        for k in shown
    )
    text = "; ".join([*parts, *boxes])
    row = at.first
    place = None if row is None else tuple(float(columns[f"{x}_mm"][row]) for x in "xyz")
    return Finding(
        CODE,
        int(columns["line"][row]) if row is not None and "line" in columns else 0,
        f"the stock is probably misplaced: {text}: compare the stock with the zero of the program",
        place=place,  # type: ignore[arg-type]
        row=row,
    )
