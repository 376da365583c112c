"""Comparison of a program with divided lines with the program as it was: the same path in more rows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from chipload.program.motions import is_arc, lengths, starts
from chipload.program.program import Program

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: segments leave the path by at most this [mm] beside the resolution of the text
SAME_MM = 1e-3
#: ends of lines agree within this [mm]
END_MM = 1e-6


def lines_off_path(
    old: Program, new: Program, first: Mapping[int, int], divided: set[int], resolution: float
) -> set[int]:
    """Return the lines of the old text that do not move as they did; empty: it is the same program.

    Parameters
    ----------
    first : line of the new text at which each line of the old text begins
    divided : lines of the old text that are in segments
    resolution : of the new text [mm]
    """
    numbers = np.array([0, *first])
    begins = np.array([0, *first.values()])
    line = numbers[np.searchsorted(begins, new.line, "right") - 1]
    inside = np.isin(line, list(divided))
    ends = np.append((line[1:] != line[:-1]) | ~inside[1:], True)
    if ends.sum() != len(old) or (line[ends] != old.line).any():
        counts = [np.bincount(x, minlength=int(numbers.max()) + 1) for x in (old.line, line[ends])]
        return set(np.flatnonzero(counts[0] != counts[1]).tolist()) or set(divided)
    of = np.concatenate([[0], np.cumsum(ends)[:-1]])
    off = np.zeros(len(new), dtype=np.bool_)
    for name in ("motion", "spindle", "tool", "turns"):
        off |= getattr(new, name) != getattr(old, name)[of]
    for name in ("axis", "normal"):
        off |= np.abs(getattr(new, name) - getattr(old, name)[of]).max(axis=1) > 1e-9
    # any point of the axis of an arc is its centre
    shift = new.centre - old.centre[of]
    off |= np.linalg.norm(np.cross(shift, new.normal), axis=1) > SAME_MM + resolution
    off |= np.abs(new.feed - old.feed[of]) > 1e-9 * old.feed[of]
    off |= (new.path_mode != old.path_mode[of]).any(axis=1)
    off |= ends & (np.abs(new.p_work - old.p_work[of]).max(axis=1) > END_MM)
    off |= ~ends & (_distance(new.p_work, old, of) > SAME_MM + resolution)
    # segments that go back, or the other way round an arc, are longer or shorter than the line
    total = np.zeros(len(old))
    np.add.at(total, of, lengths(new))
    segments = np.bincount(of, minlength=len(old))
    off |= (np.abs(total - lengths(old)) > END_MM + 2.0 * (SAME_MM + resolution) * (segments - 1))[of]
    return set(line[off].tolist())


def _distance(p: Floats, old: Program, of: Ints) -> Floats:
    """Return how far points (m, 3) are from the lines, or the cylinders and rises of arcs, of rows ``of`` (m,) [mm]."""
    begin = starts(old)
    way = old.p_work - begin
    size = np.linalg.norm(way, axis=1)
    unit = way / np.where(size > 0.0, size, 1.0)[:, None]
    v = p - begin[of]
    along = (v * unit[of]).sum(axis=1)
    straight = np.linalg.norm(v - along[:, None] * unit[of], axis=1)
    normal = old.normal[of]

    def arm(point: Floats, rows: Ints) -> Floats:
        w = point - old.centre[rows]
        return np.asarray(np.linalg.norm(w - (w * old.normal[rows]).sum(axis=1)[:, None] * old.normal[rows], axis=1))

    near, far = arm(begin[of], of), arm(old.p_work[of], of)
    radius = arm(p, of)
    rise, height = (way[of] * normal).sum(axis=1), (v * normal).sum(axis=1)
    out = np.maximum(np.minimum(near, far) - radius, radius - np.maximum(near, far))
    out = np.maximum(out, np.maximum(np.minimum(rise, 0.0) - height, height - np.maximum(rise, 0.0)))
    return np.asarray(np.where(is_arc(old)[of], out, straight))
