"""Contact points at which the steps of a simulation cut, with their force, for rows with known contact points.

Notation: row k of a program goes from the contact point q_(k-1) to q_k with the normals n; a place of a step lies a
share t in it. The contact there is taken between them in proportion, e.g. at the beginning, the middle or the end of
the step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.simulation.deflection import Contacts
from chipload.simulation.removal import Removal

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def touch_points(
    removal: Removal,
    first_line: int,
    contact: NDArray[np.bool_],
    points: Floats,
    normals: Floats,
    values: Floats,
    within: float = 0.5,
) -> tuple[Contacts, Floats]:
    """Return the contacts of the steps that cut at contact points, and other values there.

    Parameters
    ----------
    removal : made with ``keep``; its lines count the rows
    first_line : line of row 0
    contact : (k,) bool, rows that end at a contact point
    points, normals : (k, 3) float, q [mm] and n
    values : (k, m) float, other values of the contact points
    within : where in each step, 0 its beginning, 1 its end

    Returns
    -------
    contacts : a step that cuts each; a normal of 0 where its row ends at no contact point
    values : (c, m)
    """
    step = np.sort(np.concatenate([c.step for c in removal.cuts])) if removal.cuts else np.zeros(0, dtype=np.int64)
    line = np.asarray(removal.columns["line"])
    row = line[step] - first_line
    share = _shares(line, np.asarray(removal.columns["s_mm"]), within)[step]
    before = np.maximum(row - 1, 0)
    before = np.where(contact[before], before, row)
    t = share[:, None]
    n = (1.0 - t) * normals[before] + t * normals[row]
    size = np.linalg.norm(n, axis=1, keepdims=True)
    known = contact[row] & (size[:, 0] > 0.0)
    n = np.where(known[:, None], n / np.where(size > 0.0, size, 1.0), 0.0)
    return (
        Contacts(step, (1.0 - t) * points[before] + t * points[row], n),
        (1.0 - t) * values[before] + t * values[row],
    )


def _shares(line: Ints, s: Floats, within: float) -> Floats:
    """Return the share of its row at which the place ``within`` each step lies, by the path ``s`` (n,) [mm] at its
    end; the steps of a row that does not move are equal, as is the first of all.
    """
    start = np.flatnonzero(np.r_[True, line[1:] != line[:-1]])
    count = np.diff(np.append(start, len(line)))
    length = np.diff(s, prepend=s[:1])
    row = np.repeat(np.arange(len(start)), count)
    whole = np.add.reduceat(length, start)[row] if len(start) else length
    before = np.cumsum(length) - length
    before = before - before[start][row]
    k = np.arange(len(line)) - start[row]
    moved = np.divide(before + within * length, whole, out=np.zeros(len(line)), where=whole > 0.0)
    return np.asarray(np.where(whole > 0.0, moved, (k + within) / count[row]))
