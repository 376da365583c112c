"""Tooth loads over a revolution, multiplied along the edge by levers: polynomials of the height above the tip.

Bending moments and deflections are such sums. The moment at a section at the height H has the lever H - z. The
deflection of the tip has the compliance between z and the tip, a cubic polynomial along the fluted part.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.lazy import LateModule

_levers = LateModule("chipload.cutting._levers")

Floats = NDArray[np.float64]

#: columns before those of the levers: axial force, torque, moment of the axial force along T and n
FIXED = 4
#: steps whose loads are there together
BLOCK = 512


def has_lever_loads(engagement: ToothEngagement, cutter: Cutter, material: Material) -> bool:
    """Return whether :func:`lever_loads` applies: a linear force law, and equal teeth where there is no runout."""
    return not any(material.exponents) and (not cutter.teeth_alike or not bool((engagement.tooth >= 0).any()))


def greatest_height(engagement: ToothEngagement) -> float:
    """Return the greatest height [mm] above the tip at which an edge is in material; 0 if none is."""
    if not len(engagement.rows):
        return 0.0
    own = engagement.slices[engagement.slice]
    return float((own[:, 2] + own[:, 3] * (engagement.rows[:, 3] - own[:, 0])).max())


def lever_loads(
    engagement: ToothEngagement, cutter: Cutter, material: Material, count: int, levers: ArrayLike
) -> Floats:
    """Return the loads of each step over ``count`` rotations of a period: a pitch, or a revolution with runout.

    Parameters
    ----------
    engagement : of n steps, for which :func:`has_lever_loads`
    levers : (f, 4) float, polynomials in the height z [mm] above the tip, from the constant on; at least two

    Returns
    -------
    (n, 4 + 2 f, count) float: axial force N [N], torque [N mm], integral of rho dN u along T and n [N mm], u the radial
    direction, and for each lever that of lever(z) dF_l along T and n

    Examples
    --------
    One straight tooth, 2 mm deep: 110 N/mm across the feed at the immersion of 90 deg, at a mean height of 1 mm.

    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 300.0, 0.0, 10.0, 5.0, 0.0, source="made up for this example")
    >>> slot = engagement_of_arcs([0.0], [math.pi], 0.1, mill, 2.0)
    >>> found = lever_loads(slot, mill, plain, 8, [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
    >>> found[0, :, 2].round(9).tolist()
    [0.0, 1100.0, 0.0, 0.0, -70.0, 220.0, -70.0, 220.0]
    """
    out = np.empty((len(engagement), FIXED + 2 * len(np.asarray(levers)), count))
    for some, loads in lever_loads_in_blocks(engagement, cutter, material, count, levers):
        out[some] = loads
    return out


def lever_loads_in_blocks(
    engagement: ToothEngagement, cutter: Cutter, material: Material, count: int, levers: ArrayLike
) -> Iterator[tuple[slice, Floats]]:
    """Yield steps and their :func:`lever_loads`, ``BLOCK`` steps at a time: some MB instead of some ten."""
    polys = np.ascontiguousarray(levers, dtype=np.float64)
    alike = cutter.teeth_alike
    whole = count * (cutter.flutes if alike else 1)
    theta = np.arange(whole) * (math.tau / whole)
    table = np.vstack([np.cos(theta), np.sin(theta)])
    rows = (engagement.rows, engagement.tooth, engagement.slice, engagement.slices)
    for at in range(0, len(engagement), BLOCK):
        some = slice(at, min(at + BLOCK, len(engagement)))
        out = np.empty((some.stop - at, FIXED + 2 * len(polys), count))
        _levers.over_turn(
            engagement.start[at : some.stop + 1], *rows, table, cutter.flutes, count, alike, np.array(material.law),
            polys, out,
        )  # fmt: skip
        yield some, out
