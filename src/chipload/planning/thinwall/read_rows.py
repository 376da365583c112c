"""Rows of a finishing program: the parts in which its cutter touches a side of a wall, from edge to edge.

Notation as in :mod:`chipload.planning.thinwall.contact` and :mod:`chipload.planning.thinwall.finish_rows`. The path is
divided into short straight pieces. A place of it belongs to a row where the clearance between cutter and side is small.
Between a place that touches within the side and the next one that does not, the edge is found by bisection.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.planning.thinwall.contact import ContactFinder, SideAt, SideContacts, tangents
from chipload.planning.thinwall.finish_rows import FinishRow, FinishSide, heights_of
from chipload.program.motions import radii, straighten_arcs
from chipload.program.program import LINE, Program

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: greatest distance of the cutter from the finished side [mm], on either side of it, at which it touches
NEAR = 0.02
#: greatest clearance that is reported [mm]
NEAR_ENOUGH = 1.0
#: greatest deviation of chords from arcs [mm]
CHORD = 0.001
#: halvings between two places of the path; one that is nearer to the edge [mm] is moved there
HALVINGS, SAME = 30, 0.1
#: greatest rise along the side, per length, of a piece of a path that is part of a row
STEEP = math.sin(math.radians(45.0))
#: number of places along a side at which rows are compared
LOOKS = 33
#: rows lie on one another if their distance is below this share of the greatest one; a row is missing where the
#: distance is above this many medians
DOUBLE, GAP = 0.1, 1.5
#: relative tolerance of comparisons
SLACK = 1e-6


@dataclass(frozen=True, eq=False)
class _FeedMotions:
    """Places of the feed motions of a program: tip, axis, line, and the number of the piece without interruption."""

    tip: Floats
    axis: Floats
    line: Ints
    piece: Ints


@dataclass(frozen=True, eq=False)
class _Edge:
    """Point at which a path leaves a side: place, axis, and distance [mm] from the nearest place of the path."""

    u: float
    v: float
    axis: Floats
    off: float


def sides_of_program(
    program: Program,
    cutter: Cutter,
    sides: Sequence[SideAt],
    foot: float,
    step: float,
    name: str,
    tool: int | None = None,
) -> tuple[tuple[FinishSide, ...], float]:
    """The rows of a program over each side, and the greatest distance [mm] of neighbouring rows.

    Parameters
    ----------
    program : in the frame of the sides; its feed motions count
    cutter : ball or bull nose that it was made for
    foot : share of v that keeps its stock
    step : [mm] greatest distance of contact points
    name : of the program, for messages
    tool : whose feed motions count; None: all

    Raises
    ------
    InputError
        The rows do not cover a side, or lie on one another.
    """
    path = _path(program, step, tool)
    made, widest = [], 0.0
    for number, side in enumerate(sides):
        where = f"{name}: side {number + 1}"
        rows, nearest = _rows_on(path, ContactFinder(side, cutter, foot))
        if len(rows) < 2:
            off = f"; it comes within {nearest:.3g} mm of it" if math.isfinite(nearest) else ""
            raise InputError(
                f"{where}: {len(rows)} rows touch the finished surface within {NEAR:g} mm{off}: must be at least 2: "
                "state a finishing program of this wall, in its coordinates, whose cutter leans"
            )
        widest = max(widest, _greatest_row_distance(FinishSide(side, rows, foot), where))
        made.append(FinishSide(side, rows, foot))
    return tuple(made), widest


def _path(program: Program, step: float, tool: int | None) -> _FeedMotions:
    """The feed motions of a program in steps of at most ``step`` [mm]."""
    r = radii(program)
    turn = 2.0 * np.arccos(1.0 - np.minimum(CHORD / np.where(r > 0.0, r, math.inf), 1.0))
    program = straighten_arcs(program, np.where(r > 0.0, turn, math.inf))
    cuts = (program.motion == LINE) & (True if tool is None else program.tool == tool)
    cuts[0] = False
    ends = np.flatnonzero(np.diff(np.concatenate([[0], cuts.astype(np.int64), [0]])))
    parts = [_piece(program, int(a), int(b), step) for a, b in zip(ends[0::2], ends[1::2], strict=True)]
    if not parts:
        return _FeedMotions(
            np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        )
    tip, axis, line = (np.concatenate(x) for x in zip(*parts, strict=True))
    return _FeedMotions(tip, axis, line, np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts]))


def _piece(program: Program, first: int, last: int, step: float) -> tuple[Floats, Floats, Ints]:
    """Tip, axis and line of rows ``first`` to before ``last``, which begin where the row before them ends."""
    p, axis = program.p_work[first - 1 : last], program.axis[first - 1 : last]
    count = np.ceil(np.linalg.norm(np.diff(p, axis=0), axis=1) / step - SLACK).astype(np.int64).clip(1)
    row = np.repeat(np.arange(len(count)), count)
    share = ((np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[row])[:, None]
    tip, turned = ((1.0 - share) * x[row] + share * x[row + 1] for x in (p, axis))
    tip, turned = np.concatenate([p[:1], tip]), np.concatenate([axis[:1], turned])
    line = program.line[first:last][row]
    return tip, turned / np.linalg.norm(turned, axis=1, keepdims=True), np.concatenate([line[:1], line])


def _rows_on(path: _FeedMotions, finder: ContactFinder) -> tuple[tuple[FinishRow, ...], float]:
    """Rows over a side, and how near [mm] the cutter comes to it."""
    if not len(path.tip):
        return (), math.inf
    found = finder.contacts(path.tip, path.axis, NEAR_ENOUGH)
    on = _touches(found)
    number = np.concatenate([[-1], np.where(on, path.piece, -1), [-1]])
    ends = np.flatnonzero(np.diff(number))
    runs = [(int(a), int(b)) for a, b in itertools.pairwise(ends) if on[a]]
    rows: list[FinishRow] = []
    if runs:
        edges = [_edges(path, found, finder, [run[k] - k for run in runs], 2 * k - 1) for k in (0, 1)]
        for (a, b), *added in zip(runs, *edges, strict=True):
            u, v, axis = found.u[a:b].copy(), found.v[a:b].copy(), path.axis[a:b].copy()
            for k, edge in enumerate(added):
                if edge is None:
                    continue
                if edge.off <= SAME:
                    u[-k], v[-k], axis[-k] = edge.u, edge.v, edge.axis
                else:
                    at, new = len(u) * k, (edge.u, edge.v, edge.axis)
                    u, v, axis = (np.insert(x, at, y, axis=0) for x, y in zip((u, v, axis), new, strict=True))
            rows += _split(FinishRow(u, v, axis, int(path.line[min(a + 1, b - 1)])), finder.side)
    return tuple(rows), float(np.abs(found.clearance).min(initial=math.inf))


def _touches(found: SideContacts) -> NDArray[np.bool_]:
    """Which places of a path touch a side."""
    return np.asarray(np.abs(found.clearance) <= NEAR)


def _edges(
    path: _FeedMotions, found: SideContacts, finder: ContactFinder, inside: Sequence[int], sense: int
) -> list[_Edge | None]:
    """Points at which a path leaves the side next to places ``inside`` that touch, backwards (-1) or forwards (1).

    None where the path ends there.
    """
    here = np.array(inside)
    there = np.clip(here + sense, 0, len(path.tip) - 1)
    goes_on = (path.piece[there] == path.piece[here]) & (there != here)
    there = np.where(goes_on, there, here)
    low, high = np.zeros(len(here)), np.ones(len(here))
    u, v = found.u[here], found.v[here]
    for _ in range(HALVINGS):
        share = 0.5 * (low + high)
        tip, axis = _places_between(path, here, there, share)
        one = finder.contacts(tip, axis, NEAR_ENOUGH)
        on = _touches(one)
        low, high = np.where(on, share, low), np.where(on, high, share)
        u, v = np.where(on, one.u, u), np.where(on, one.v, v)
    axis = _places_between(path, here, there, low)[1]
    moved = np.linalg.norm(finder.side(u, v)[0] - finder.side(found.u[here], found.v[here])[0], axis=1)
    return [_Edge(float(u[k]), float(v[k]), axis[k], float(moved[k])) if goes_on[k] else None for k in range(len(here))]


def _places_between(path: _FeedMotions, here: Ints, there: Ints, share: Floats) -> tuple[Floats, Floats]:
    """Tips and axes between two places of a path each."""
    tip, axis = (x[here] + share[:, None] * (x[there] - x[here]) for x in (path.tip, path.axis))
    return tip, axis / np.linalg.norm(axis, axis=1, keepdims=True)


def _split(row: FinishRow, side: SideAt) -> list[FinishRow]:
    """Parts of a path over a side along which u is monotone; parts up or down the side are left out."""
    if len(row.u) < 2:
        return []
    along, up = tangents(side, row.u[:-1], row.v[:-1])
    du, dv = np.diff(row.u), np.diff(row.v)
    rise, whole = (
        np.linalg.norm(dv[:, None] * up, axis=1),
        np.linalg.norm(du[:, None] * along + dv[:, None] * up, axis=1),
    )
    sense = np.where(rise > STEEP * whole, 0, np.sign(du)).astype(np.int64)
    ends = np.flatnonzero(np.diff(np.concatenate([[9], sense, [9]])))
    return [
        FinishRow(row.u[a : b + 1], row.v[a : b + 1], row.axis[a : b + 1], row.line)
        for a, b in itertools.pairwise(ends)
        if sense[a] != 0
    ]


def _greatest_row_distance(side: FinishSide, where: str) -> float:
    """Greatest distance [mm] of neighbouring rows of a side that they cover.

    Raises
    ------
    InputError
        A row ends within the side, two lie on one another, or there is a gap.
    """
    u = np.linspace(0.0, 1.0, LOOKS)
    v = np.sort(heights_of(side.rows, u), axis=0)
    points = side.at(np.tile(u, len(v)), v.ravel())[0].reshape(*v.shape, 3)
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=2)
    widest, usual = float(gaps.max()), float(np.median(gaps))
    for row in side.rows:
        _from_edge_to_edge(side, row, widest, where)
    if float(gaps.min()) < DOUBLE * widest:
        k = int(np.unravel_index(gaps.argmin(), gaps.shape)[0])
        raise InputError(
            f"{where}: rows lie {gaps.min():.3g} mm apart at v = {v[k].mean():.3g}, others {widest:.3g} mm: must not "
            "lie on one another: state a program with one finishing pass"
        )
    if widest > GAP * usual:
        k = int(np.unravel_index(gaps.argmax(), gaps.shape)[0])
        raise InputError(
            f"{where}: rows {widest:.4g} mm apart at v = {v[k].mean():.3g}, most {usual:.4g} mm: a row is missing: "
            "must cover the side evenly"
        )
    for what, edge, row in (("free edge", 1.0, points[-1]), ("foot", side.foot, points[0])):
        off = float(np.linalg.norm(side.at(u, np.full(LOOKS, edge))[0] - row, axis=1).max())
        if off > widest * (1.0 + SLACK):
            raise InputError(
                f"{where}: the last row lies {off:.4g} mm off the {what}: must be at most the distance of the rows, "
                f"{widest:.4g} mm: state a program that covers the side"
            )
    return widest


def _from_edge_to_edge(side: FinishSide, row: FinishRow, widest: float, where: str) -> None:
    """Refuse a row that ends within the side."""
    for end, edge in ((row.u.min(), 0.0), (row.u.max(), 1.0)):
        v = np.full(2, row.v[0 if row.u[0] == end else -1])
        off = float(np.linalg.norm(np.diff(side.at(np.array([end, edge]), v)[0], axis=0)))
        if off > widest * (1.0 + SLACK):
            raise InputError(
                f"{where}: the row of line {row.line} ends {off:.4g} mm off the side's edge: must be at most the "
                f"distance of the rows, {widest:.4g} mm: rows must run along the wall, from edge to edge"
            )
