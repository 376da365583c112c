"""Largest diameter that would reach a contact point that no cutter of a catalogue reaches.

Notation: as in ``search.py``; the search of a catalogue ends at its smallest cutter, this one continues to rho = 0.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from chipload.planning.impeller.answer import Answer, Unreachable, shortest
from chipload.planning.impeller.pallet_ranges import FULL
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.search import limits


def with_fits(
    scene: Scene, answer: Answer, pallets: ArrayLike = FULL, workers: int = 1, most: int = 64
) -> tuple[Unreachable, ...]:
    """The unreachable points of an answer, each with the largest diameter that would fit, by the cutting part alone.

    Parameters
    ----------
    most : greatest number of points that are searched; the others keep the diameter of the first search
    """
    rows = [k for k, u in enumerate(answer.unreachable) if u.reason == "cutting part"][:most]
    if not rows:
        return answer.unreachable
    at = np.array([answer.unreachable[k].point for k in rows])
    best = np.full(len(at), np.nan)
    corner = np.full(len(at), np.nan)
    for f in answer.families:
        cut = shortest(answer.catalogue.family(f.corner_radius))
        found = limits(
            scene, answer.tables, f.corner_radius, f.cap, 0.0, cut, pallets=pallets, workers=workers, points=at
        )
        rho = found.rho.max(axis=1)
        size = np.where(rho >= 0.0, 2.0 * (rho + f.corner_radius), np.nan)
        larger = ~(size <= best) & (size > 0.0)
        best, corner = np.where(larger, size, best), np.where(larger, f.corner_radius, corner)
    out = list(answer.unreachable)
    for k, size, r in zip(rows, best.tolist(), corner.tolist(), strict=True):
        out[k] = replace(out[k], fits=size, fits_corner=r)
    return tuple(out)
