"""Compiled: least times of many sets of cutters over the strips of a side, milled one after the other.

Notation: as in ``assignment.py``; a state is a cutter of the set at a table angle.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def enter_states(before: Any, cutter: float, table: float, by_cutter: Any, by_table: Any) -> None:
    """Lower the times ``before`` (m, t) [s] to those when each state may be come to from every other.

    ``cutter``, ``table`` [s] what a change of each takes. Workspace: ``by_cutter`` (m,), ``by_table`` (t,).
    """
    m, t = before.shape
    least = math.inf
    by_cutter[:], by_table[:] = math.inf, math.inf
    for k in range(m):
        for a in range(t):
            value = before[k, a]
            by_cutter[k], by_table[a] = min(by_cutter[k], value), min(by_table[a], value)
        least = min(least, by_cutter[k])
    both = least + cutter + table
    for k in range(m):
        for a in range(t):
            before[k, a] = min(before[k, a], by_cutter[k] + table, by_table[a] + cutter, both)


@njit(cache=True, nogil=True)
def mill_strips(
    cells: Any, strips: Any, sets: Any, state: Any, step: int, cutter: float, table: float, out: Any
) -> None:  # fmt: skip
    """Lower ``out`` (n, m, t) to the times after all strips, in their order (``step`` 1) or against it (-1).

    ``cells`` (a, b, cutters, t) [s] of each cell and ``strips`` (a, cutters, t) of each whole strip, inf: the cutter
    does not go there; ``sets`` (n, m) of cutters; ``state`` (n, m, t) times before. A strip that no cutter of a set
    mills whole is milled cell by cell, in the better direction.
    """
    m, t = state.shape[1], state.shape[2]
    now, forth, back = np.empty((m, t)), np.empty((m, t)), np.empty((m, t))
    by_cutter, by_table = np.empty(m), np.empty(t)
    count, each = cells.shape[0], cells.shape[1]
    for i in range(len(sets)):
        now[:] = state[i]
        for s in range(count):
            strip = s if step > 0 else count - 1 - s
            whole = False
            for k in range(m):
                for a in range(t):
                    whole = whole or strips[strip, sets[i, k], a] < math.inf
            if whole:
                enter_states(now, cutter, table, by_cutter, by_table)
                for k in range(m):
                    for a in range(t):
                        now[k, a] += strips[strip, sets[i, k], a]
                continue
            forth[:], back[:] = now, now
            for c in range(each):
                enter_states(forth, cutter, table, by_cutter, by_table)
                enter_states(back, cutter, table, by_cutter, by_table)
                for k in range(m):
                    for a in range(t):
                        forth[k, a] += cells[strip, c, sets[i, k], a]
                        back[k, a] += cells[strip, each - 1 - c, sets[i, k], a]
            now[:] = np.minimum(forth, back)
        out[i] = np.minimum(out[i], now)
