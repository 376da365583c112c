"""Check of the shank for contact with material: an axial depth greater than the flute length.

The flutes end at ``flute_length``; the shank above them does not cut, it rubs and breaks. The stock is asked when a
step ends: rings of points of the shank, inside its radius by a margin, upwards from the end of the flutes layer by
layer, as far as the material goes on. A layer is known by its section at half its height, so an excess of less than
half a layer is not seen.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.stock.tile_rings import TileRings

Floats = NDArray[np.float64]

#: points of a ring
AROUND = 32


def axial_overrun(tiles: TileRings, cutter: Cutter, tip: Floats, axis: Floats, margin: float) -> float:
    """Return the length of the shank in material, from the end of the flutes upwards [mm]; 0 if none.

    Parameters
    ----------
    tiles : of the stock, as they are
    tip, axis : (3,) where the cutter is [mm], and its axis, unit
    margin : what the shank may touch [mm]
    """
    stock = tiles.stock
    shank = cutter.diameter if cutter.shank_diameter is None else cutter.shank_diameter
    radius = 0.5 * shank - margin
    low = float(tip[2] + cutter.flute_length * axis[2])
    lean = radius * math.sqrt(max(1.0 - float(axis[2]) ** 2, 0.0))
    first = int(np.searchsorted(stock.heights, low - lean))
    if radius <= 0.0 or first >= stock.layers:
        return 0.0
    turn = np.arange(AROUND) * (math.tau / AROUND)
    across = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    ring = radius * (np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across))
    ring = np.vstack([np.zeros(3), 0.5 * ring, ring])
    height, step = cutter.flute_length, float(stock.thickness[first])
    # the lowest section above the flutes decides where an upright cutter begins
    offset = float(stock.heights[first] - low) if lean < 1e-9 else 0.5 * step
    found = 0.0
    while height + offset < cutter.overhang and tiles.holds(tip + (height + offset) * axis + ring):
        height += step
        found = height - cutter.flute_length
    return found
