"""Short blocks that follow one another as one: fewer steps for a first look at a program of thousands of them.

Notation: a row is a straight cut from its start to its end; ``d`` of a joined row bounds the distance of the path that
it stands for from it. Two rows in line, of chords a and b, become one if the distance of the point where they meet from
the new chord, and the greater of their own d, are together at most the deviation: the new chord lies within that
distance of both old ones, which lie within their d of the path.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from chipload.program.program import LINE, Program

Floats = NDArray[np.float64]

#: rounds of joining pairs; each can halve the number of rows
ROUNDS = 12


def join_rows(program: Program, times: Floats, deviation: float, longest: float) -> tuple[Program, Floats, float]:
    """Join straight cuts of one feed, speed, tool and upright axis; the line is that of the last one.

    Parameters
    ----------
    times : (n,) of the rows [s]; those of joined rows are added
    deviation : greatest distance of the path from what stands for it [mm]
    longest : greatest length of a joined row [mm]

    Returns
    -------
    The program, the times, and the greatest d [mm].

    >>> from chipload.program.build import rows
    >>> points = [[0, 0, 0], [1, 0.1, 0], [2, 0, 0], [2, 5, 0]]
    >>> program = rows([0, 1, 1, 1], points, (0.0, 0.0), [0.0, 10.0, 10.0, 10.0], 500.0, 1, "cut")
    >>> joined, times, d = join_rows(program, np.array([0.0, 0.1, 0.1, 0.5]), 0.2, 10.0)
    >>> joined.p_work.tolist(), times.tolist(), round(d, 9)
    ([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 5.0, 0.0]], [0.0, 0.2, 0.5], 0.1)
    """
    n = len(program)
    if n < 3 or deviation <= 0.0:
        return program, times, 0.0
    # whether the row before goes on in a row: both are straight cuts of one kind
    goes_on = _same_kind(program)
    kept, own = np.arange(n), np.zeros(n)
    points = np.asarray(program.p_work)
    for _ in range(ROUNDS):
        before = len(kept)
        for parity in (0, 1):
            kept, own = _join_pairs(points, kept, own, goes_on, parity, deviation, longest)
        if len(kept) == before:
            break
    columns = {f.name: getattr(program, f.name)[kept] for f in fields(program) if f.name != "labels"}
    return replace(program, **columns), np.add.reduceat(times, np.r_[0, kept[:-1] + 1]), float(own.max())


def _same_kind(program: Program) -> NDArray[np.bool_]:
    """(n,) whether a row and the one before it are straight cuts that differ by their ends alone."""
    out = np.zeros(len(program), dtype=np.bool_)
    straight = program.motion == LINE
    same = straight[1:] & straight[:-1]
    for column in (program.feed, program.spindle, program.tool, program.label):
        same &= column[1:] == column[:-1]
    for column in (program.axis, program.path_mode):
        same &= (column[1:] == column[:-1]).all(axis=1)
    upright = program.axis[:, 2] == 1.0
    # the row before begins where the axis stands as well
    out[2:] = same[1:] & upright[:-2] & upright[1:-1] & upright[2:]
    return out


def _join_pairs(
    points: Floats,
    kept: NDArray[np.int64],
    own: Floats,
    goes_on: NDArray[np.bool_],
    parity: int,
    deviation: float,
    longest: float,
) -> tuple[NDArray[np.int64], Floats]:
    """Join every second pair of rows where it is allowed.

    Parameters
    ----------
    kept : (m,) rows whose ends stay, rising; ``own``: (m,) their d [mm]
    """
    # rows k and k + 1 of the kept ones meet in the end of k
    k = np.arange(1 + parity, len(kept) - 1, 2)
    k = k[goes_on[kept[k] + 1]]
    a, meet, b = points[kept[k - 1]], points[kept[k]], points[kept[k + 1]]
    chord = b - a
    square = (chord * chord).sum(axis=1)
    share = ((meet - a) * chord).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    off = np.linalg.norm(meet - a - np.clip(share, 0.0, 1.0)[:, None] * chord, axis=1)
    whole = off + np.maximum(own[k], own[k + 1])
    allowed = (whole <= deviation) & (share > 0.0) & (share < 1.0) & (square <= longest * longest)
    own = own.copy()
    own[k[allowed] + 1] = whole[allowed]
    stays = np.ones(len(kept), dtype=np.bool_)
    stays[k[allowed]] = False
    return kept[stays], own[stays]
