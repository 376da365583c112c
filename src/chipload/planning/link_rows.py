"""Rows of a planned history for the motions between passes, and its time: that of the program on the machine.

A history has one row for each step of the cut; a link row stands before each pass (where the cutter has come down)
and after it (where it has gone up), so that the history's time goes from 0 to the end of the program.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.machine.machine import Machine
from chipload.planning.result import Columns
from chipload.program.program import Program
from chipload.program.time import program_time

Floats = NDArray[np.float64]

LINK = "link"
#: columns that a link row takes from its neighbour
_PLACE = ("s_mm", "x_mm", "y_mm", "z_mm")


def row_ends(program: Program, machine: Machine) -> Floats:
    """(n,) time at the end of each row of a program [s]."""
    return np.asarray(np.cumsum(program_time(program, machine)))


def with_links(columns: Columns, z_end: float) -> Columns:
    """A pass with a link row before it, at its first place, and one after it, at the height ``z_end`` [mm].

    >>> rows = {"pass": np.array(["finish"], dtype=object), "z_mm": np.array([-3.0]), "force_n": np.array([8.0])}
    >>> {name: column.tolist() for name, column in with_links(rows, 5.0).items()}
    {'pass': ['link', 'finish', 'link'], 'z_mm': [-3.0, -3.0, 5.0], 'force_n': [0.0, 8.0, 0.0]}
    """
    first = {name: _link(name, column[:1]) for name, column in columns.items()}
    last = {name: _link(name, column[-1:]) for name, column in columns.items()} | {"z_mm": np.array([z_end])}
    return {name: np.concatenate([first[name], column, last[name]]) for name, column in columns.items()}


def with_last_link(columns: Columns, z_end: float, t_end: float) -> Columns:
    """A history with a link row at its end, at the height ``z_end`` [mm] and the time ``t_end`` [s]."""
    last = {name: _link(name, column[-1:]) for name, column in columns.items()}
    last |= {"z_mm": np.array([z_end]), "t_s": np.array([t_end])}
    return {name: np.concatenate([column, last[name]]) for name, column in columns.items()}


def _link(name: str, place: NDArray[np.generic]) -> NDArray[np.generic]:
    """The value of a link row: that of its neighbour for a place, else nothing."""
    out = place.copy()
    if name == "pass":
        out[:] = LINK
    elif name not in _PLACE:
        out[:] = 0
    return out
