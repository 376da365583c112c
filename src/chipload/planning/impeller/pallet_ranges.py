"""Exact ranges of the pallet angle in which a cutter, with neck, shank and holder, is clear of every check point.

Notation: as in ``search.py``. A range is a row (from, to) [rad] of pallet angles; at its ends the cutter touches a
check point. Parts narrower than ``FLAT`` in which the cutter's axis is along the normal are left out: V is undefined
there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.lazy import LateModule
from chipload.planning.impeller.blocks import BLOCK, in_blocks
from chipload.planning.impeller.scene import Floats, Ints, Scene
from chipload.progress import Progress, silent

_pallet_ranges = LateModule("chipload.planning.impeller._pallet_ranges")

#: all pallet angles [rad]
FULL = ((0.0, 2.0 * math.pi),)
#: a part of B narrower than this [rad] with n close to 1 counts as forbidden
FLAT = 1e-4

#: widest part of B whose check points in reach are listed at once [rad]
_WIDTH = math.radians(8.0)
#: greatest number of ranges of one contact point, and of points of one proof
_MOST = 32


@dataclass(frozen=True, eq=False)
class Ranges:
    """Valid pallet angles of one cutter.

    Parameters
    ----------
    ranges : for each contact point (k, 2) float [rad]; k = 0: there is no range
    blockers : for each contact point the check points that forbid every B, where there is no range, else none
    complete : (c,) bool; False: there were more arcs than the workspace holds, no range is stated
    between : (c,) bool, the check points leave a range, but the walls between them leave none
    """

    ranges: tuple[Floats, ...]
    blockers: tuple[Ints, ...]
    complete: NDArray[np.bool_]
    between: NDArray[np.bool_]


def valid_ranges(
    scene: Scene,
    cutter: CatalogueCutter,
    tables: ArrayLike,
    clearance: float = 0.0,
    pallets: ArrayLike = FULL,
    points: ArrayLike | None = None,
    least: float = 1e-9,
    workers: int = 1,
    progress: Progress = silent,
) -> Ranges:
    """Pallet angles at which the cutter touches a contact point and is clear of every check point.

    Parameters
    ----------
    tables : table angle alpha [rad], one for all or one for each of the ``points``
    clearance : least distance of the parts above the cutting part from the check points [mm]
    pallets : (k, 2) [rad], pallet angles that the machine reaches
    points : (c,) int, the contact points; None: all
    least : narrower ranges [rad] are left out
    """
    which = np.arange(len(scene.contact)) if points is None else np.asarray(points, dtype=np.int64)
    alpha = np.broadcast_to(np.asarray(tables, dtype=np.float64), which.shape)
    spans = np.ascontiguousarray(np.asarray(pallets, dtype=np.float64).reshape(-1, 2))
    rows, tree = np.ascontiguousarray(scene.rows[which]), scene.tree
    cones = np.column_stack([np.sin(alpha), np.cos(alpha)])
    number = np.zeros(len(which), dtype=np.int64)
    found = np.zeros((len(which), _MOST, 2))
    hints = np.full((len(which), 1), -2, dtype=np.int64)
    proof = np.full((len(which), _MOST), -1, dtype=np.int64)
    tool = np.array([cutter.rho, cutter.corner_radius])
    stages = cutter.enclosing(clearance)
    check, own = scene.ordered, scene.own

    def block(first: int) -> None:
        _pallet_ranges.ranges_of_contacts(
            check, own, tree.nodes, tree.spans, tree.leaves, rows, cones, scene.near**2, tool, stages, spans, _WIDTH,
            FLAT, least, hints, first, min(first + BLOCK, len(rows)), number, found, proof,
        )  # fmt: skip

    in_blocks(block, len(which), workers, progress, f"pallet angles of D {cutter.diameter:g} mm")
    # a contact point where the corner is larger than the radius of curvature has no range at any B
    tight = cutter.corner_radius * scene.curvature_max[which] >= 1.0
    number[tight] = 0
    proof[tight] = -1
    proof[tight, 0] = -2
    ranges = tuple(found[k, : max(int(n), 0)].copy() for k, n in enumerate(number))
    if cutter.taper > 0.0:
        ranges = tuple(
            corner_ranges(row, scene.normal[i], float(a), cutter.taper, least)
            for row, i, a in zip(ranges, which, alpha, strict=True)
        )
        number = np.array([len(row) if n > 0 else n for row, n in zip(ranges, number, strict=True)], dtype=np.int64)
    forbidding = np.where(proof >= 0, tree.order[np.maximum(proof, 0)] if len(check) else proof, proof)
    blockers = tuple(
        np.unique(row[(row != -1) & (row != -3)]) if n == 0 else row[:0]
        for row, n in zip(forbidding, number, strict=True)
    )
    complete, between = number >= 0, np.zeros(len(which), dtype=np.bool_)
    open_rows = np.flatnonzero(number > 0)
    if scene.covering is None or not len(open_rows):
        return Ranges(ranges, blockers, complete, between)
    clear, decided = scene.covering.clear_ranges(
        scene,
        cutter,
        alpha[open_rows],
        clearance,
        which[open_rows],
        tuple(ranges[k] for k in open_rows),
        least,
        workers,
    )
    of_row = dict(zip(open_rows.tolist(), clear, strict=True))
    complete[open_rows] = decided
    between[open_rows] = decided & np.array([len(row) == 0 for row in clear])
    return Ranges(tuple(of_row.get(k, row) for k, row in enumerate(ranges)), blockers, complete, between)


def corner_ranges(ranges: Floats, normal: Floats, alpha: float, taper: float, least: float) -> Floats:
    """Parts of ranges (k, 2) [rad] in which a tapered cutter touches with its corner: N.T is at least sin(taper).

    >>> full = np.array([[0.0, 2.0 * math.pi]])
    >>> np.degrees(corner_ranges(full, np.array([1.0, 0.0, 0.0]), math.radians(90.0), math.radians(30.0), 0.0)).round(9)
    array([[  0.,  60.],
           [300., 360.]])
    """
    size = math.sin(alpha) * math.hypot(normal[0], normal[1])
    required = math.sin(taper) - math.cos(alpha) * float(normal[2])
    if required <= -size:
        return ranges
    if required > size:
        return ranges[:0]
    half, middle = math.acos(required / size), math.atan2(float(normal[1]), float(normal[0]))
    out = []
    for low, high in ranges.tolist():
        first = math.ceil((low - middle - half) / math.tau)
        for turn in range(first, math.floor((high - middle + half) / math.tau) + 1):
            at = middle + math.tau * turn
            part = max(low, at - half), min(high, at + half)
            if part[1] - part[0] > least:
                out.append(part)
    return np.array(out).reshape(-1, 2)
