"""Check before the search whether a cutter is long enough for the channel.

Notation: a contact point lies d below the shroud, the least distance in the meridional plane. The holder of a cutter
that touches it begins ``reach`` above its tip, and lies within the shroud where reach < d. A holder that is wider than
the greatest distance of two blades, 2 r sin(pitch / 2) at the outer radius r, has no room there.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.planning.impeller.impeller import Impeller

Floats = NDArray[np.float64]

#: points of the shroud's curve from which distances are measured
POINTS = 1001


def channel_depth(impeller: Impeller, contact: Floats) -> float:
    """Greatest distance of contact points (n, 3) from the shroud [mm]; its error is less than a step of the curve."""
    curve = impeller.shroud.curve(np.linspace(0.0, 1.0, POINTS))
    place = np.column_stack([np.hypot(contact[:, 0], contact[:, 1]), contact[:, 2]])
    least = np.full(len(place), math.inf)
    for a, b in itertools.pairwise(curve):
        d = b - a
        t = np.clip((place - a) @ d / (d @ d), 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(place - a - t[:, None] * d, axis=1))
    return float(least.max())


def too_short(impeller: Impeller, catalogue: Catalogue, depth: float) -> tuple[CatalogueCutter, ...]:
    """Cutters whose holder would have to be between the blades and is wider than the greatest distance of two."""
    radius = max(float(s.meridian[:, 0].max()) for s in (impeller.hub, impeller.shroud))
    gap = 2.0 * radius * math.sin(0.5 * impeller.pitch / (1 if impeller.splitter is None else 2))
    return tuple(
        c
        for c in catalogue.cutters
        if c.reach is not None and c.holder_diameter is not None and c.reach < depth and c.holder_diameter > gap
    )


def reach_line(impeller: Impeller, catalogue: Catalogue, contact: Floats) -> tuple[str, bool]:
    """A line for `chipload check`, and whether any cutter is long enough."""
    depth = channel_depth(impeller, contact)
    short, count = too_short(impeller, catalogue, depth), len(catalogue.cutters)
    line = f"channel: contact points up to {depth:.4g} mm below the shroud"
    if not short:
        unknown = sum(c.reach is None for c in catalogue.cutters)
        stated = f", {unknown} of {count} state no reach_mm" if unknown else ""
        return f"{line}; no cutter is too short{stated}", True
    longest = max(c.reach or 0.0 for c in short)
    line += f"; {len(short)} of {count} cutters are too short, the longest of these with reach_mm = {longest:g}"
    if len(short) < count:
        return line, True
    return f"{line}: no cutter reaches the deepest point: add cutters with reach_mm of at least {depth:.4g}", False
