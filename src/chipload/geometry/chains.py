"""Joining of loose lines and arcs to contours.

Notation: a **part** is a contour as it stands in the file, often a single segment. Part k has two **ends**, numbered
2 k (start) and 2 k + 1. Ends are joined in pairs, the nearest first: coincident ends, then ends within increasing gaps
up to ``join_mm``. Where three or more ends meet, the continuation is ambiguous: none of them is joined, and a finding
reports the place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError
from chipload.geometry.contour import JOIN_MM, Contour, Floats
from chipload.geometry.offset import true_centres
from chipload.geometry.split import swept
from chipload.lazy import scipy

#: greatest gap [mm] that counts as rounding and is not reported
SILENT_MM = 1e-6
#: greatest number of findings of one kind that are listed individually
LISTED = 20


@dataclass(frozen=True, eq=False)
class Drawing:
    """The result of a reader: contours [mm], the layer of each, the unit of the file, and findings."""

    contours: tuple[Contour, ...]
    layers: tuple[str, ...]
    units: str
    findings: tuple[Finding, ...]


def chain_parts(
    parts: Sequence[Floats], join_mm: float, where: str = ""
) -> tuple[tuple[Contour, ...], tuple[Finding, ...]]:
    """Closed and open contours from parts, in the order of the file. O(n log n).

    The first part of a contour keeps its direction; a closed contour begins with it. Joined ends are moved to the
    middle of their gap; the centre of an arc moves along its chord. Findings: ``chain-empty``, a part without length
    was dropped; ``chain-double``, a part drawn twice was dropped once; ``chain-joined``, a gap was closed, with its
    place; ``chain-branch``, three or more ends meet and were left open.

    Parameters
    ----------
    parts : (n, 7) float [mm, rad] each, a chain of segments
    join_mm : widest gap [mm] that is closed
    where : text that begins each finding

    Raises
    ------
    InputError
        ``join_mm`` is not a finite number >= 0.

    Examples
    --------
    >>> rows = [np.array([[0, 0, 9, 0, 0, 0, 0.0]]), np.array([[9, 9, 9, 0.004, 0, 0, 0.0]])]
    >>> (c,), (f,) = chain_parts(rows, 0.01)
    >>> c.end.tolist(), f.text
    ([9.0, 9.0], 'gap of 0.004 mm closed at (9, 0.002)')
    """
    if not (np.isfinite(join_mm) and join_mm >= 0.0):
        raise InputError(f"part.join_mm = {join_mm:g}: must be a finite number of at least 0")
    findings: list[Finding] = []
    rows = [np.array(p, dtype=np.float64) for p in _with_length(parts, where, findings)]
    rows = [r for r, first in zip(rows, _is_first(rows, where, findings), strict=True) if first]
    if not rows:
        return (), tuple(findings)
    mate = _mates(rows, join_mm, where, findings)

    used = [False] * len(rows)
    out: list[Contour] = []
    for k in range(len(rows)):
        if used[k]:
            continue
        # backwards from the start of the first part, then forwards from its end
        back: list[int] = []
        end = int(mate[2 * k])
        while end >= 0 and end != 2 * k + 1:
            back.append(end)
            end = int(mate[end ^ 1])
        chain = [2 * k + 1]
        if end >= 0:  # a closed ring, complete
            chain += back[::-1]
        else:
            chain = back[::-1] + chain
            end = int(mate[2 * k + 1])
            while end >= 0:
                chain.append(end ^ 1)
                end = int(mate[end ^ 1])
        for e in chain:
            used[e // 2] = True
        out.append(Contour(np.vstack([rows[e // 2] if e % 2 else _reverse_part(rows[e // 2]) for e in chain])))
    return tuple(out), tuple(findings)


def _reverse_part(rows: Floats) -> Floats:
    """A part in the opposite sense."""
    seg = rows[::-1]
    return np.column_stack([seg[:, 2:4], seg[:, 0:2], seg[:, 4:6], -seg[:, 6]])


def _length(rows: Floats) -> float:
    r = np.hypot(rows[:, 0] - rows[:, 4], rows[:, 1] - rows[:, 5])
    chord = np.hypot(rows[:, 2] - rows[:, 0], rows[:, 3] - rows[:, 1])
    return float(np.where(rows[:, 6] == 0.0, chord, r * np.abs(rows[:, 6])).sum())


def _with_length(parts: Sequence[Floats], where: str, findings: list[Finding]) -> list[Floats]:
    """The parts that have a length."""
    good, texts = [], []
    for p in parts:
        if _length(p) > JOIN_MM:
            good.append(p)
        else:
            texts.append(f"{where}a segment without length at ({p[0, 0]:.6g}, {p[0, 1]:.6g}) dropped")
    _list("chain-empty", texts, findings)
    return good


def _is_first(rows: list[Floats], where: str, findings: list[Finding]) -> NDArray[np.bool_]:
    """Whether each part (n,) is the first of those with the same ends, in either order, and the same middle."""
    keep = np.ones(len(rows), dtype=np.bool_)
    if len(rows) < 2:
        return keep
    mids = np.array([_middle(r) for r in rows])
    size = np.array([_length(r) for r in rows])
    texts = []
    pairs = scipy.spatial.cKDTree(mids).query_pairs(10.0 * SILENT_MM, output_type="ndarray")
    for i, j in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))] if len(pairs) else []:
        a, b = np.concatenate([rows[i][0, 0:2], rows[i][-1, 2:4]]), np.concatenate([rows[j][0, 0:2], rows[j][-1, 2:4]])
        apart = min(np.abs(a - b).max(), np.abs(a - np.roll(b, 2)).max())
        if keep[i] and keep[j] and apart <= 10.0 * SILENT_MM and abs(size[i] - size[j]) <= 100.0 * SILENT_MM:
            keep[j] = False
            texts.append(f"{where}drawn twice at ({mids[j, 0]:.6g}, {mids[j, 1]:.6g}): the second one dropped")
    _list("chain-double", texts, findings)
    return keep


def _middle(rows: Floats) -> Floats:
    """(2,) midpoint [mm] of the middle segment of a part."""
    x0, y0, x1, y1, xc, yc, sweep = rows[len(rows) // 2]
    if len(rows) % 2 == 0:
        return np.array([x0, y0])
    if sweep == 0.0:
        return np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])
    c, s = np.cos(0.5 * sweep), np.sin(0.5 * sweep)
    vx, vy = x0 - xc, y0 - yc
    return np.array([xc + c * vx - s * vy, yc + s * vx + c * vy])


def _mates(rows: list[Floats], join_mm: float, where: str, findings: list[Finding]) -> NDArray[np.int64]:
    """(2 n,) the end to which each end is joined, or -1; joined ends of the parts are moved together."""
    ends = np.array([p for r in rows for p in (r[0, 0:2], r[-1, 2:4])])
    mate = np.full(len(ends), -1, dtype=np.int64)
    for k, r in enumerate(rows):
        if np.hypot(*(r[-1, 2:4] - r[0, 0:2])) <= JOIN_MM:
            mate[2 * k], mate[2 * k + 1] = 2 * k + 1, 2 * k
    branched = np.zeros(len(ends), dtype=np.bool_)
    joined: list[str] = []
    split: list[str] = []
    steps = [g for g in (SILENT_MM, 1e-5, 1e-4, 1e-3, 1e-2, 0.1) if g < join_mm] + [max(join_mm, JOIN_MM)]
    for gap in steps:
        free = np.flatnonzero((mate < 0) & ~branched)
        if len(free) < 2:
            break
        pairs = scipy.spatial.cKDTree(ends[free]).query_pairs(gap, output_type="ndarray")
        graph = scipy.sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(free), len(free)))
        label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
        order = np.argsort(label, kind="stable")
        for group in np.split(free[order], np.flatnonzero(np.diff(label[order])) + 1):
            if len(group) == 2:
                a, b = int(group[0]), int(group[1])
                if a // 2 == b // 2 and _length(rows[a // 2]) < 4.0 * gap:
                    continue
                wide = float(np.hypot(*(ends[a] - ends[b])))
                mate[a], mate[b] = b, a
                at = 0.5 * (ends[a] + ends[b])
                for e in (a, b):
                    _move_end(rows[e // 2], e % 2, at)
                if wide > SILENT_MM:
                    joined.append(f"{where}gap of {wide:.3g} mm closed at ({at[0]:.6g}, {at[1]:.6g})")
            elif len(group) > 2:
                branched[group] = True
                x, y = ends[group[0]]
                split.append(f"{where}{len(group)} ends meet at ({x:.6g}, {y:.6g}): a branch, left open")
    _list("chain-joined", joined, findings)
    _list("chain-branch", split, findings)
    return mate


def _move_end(rows: Floats, last: int, at: Floats) -> None:
    """Move the start (0) or end (1) of a part in place; an arc's centre slides along its chord."""
    k = -1 if last else 0
    column = 2 if last else 0
    rows[k, column : column + 2] = at
    one = rows[k : k + 1] if k == 0 else rows[-1:]
    if one[0, 6] != 0.0:
        one[:, 4:6] = true_centres(one)
        one[:, 6] = swept(one, one[:, 0:2], one[:, 2:4], one[:, 6])


def _list(code: str, texts: list[str], findings: list[Finding]) -> None:
    findings += [Finding(code, 0, t) for t in texts[:LISTED]]
    if len(texts) > LISTED:
        findings.append(Finding(code, 0, f"and {len(texts) - LISTED} more of this kind"))
