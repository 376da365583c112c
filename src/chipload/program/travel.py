"""Travel of a machine of three axes against the positions of its axes that a program commands.

Notation: q [mm] positions of the axes, in the coordinates of the machine where the place of the work offset is stated.
Where it is not, only differences of positions are known: what the program spans along an axis is compared with what the
axis travels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding
from chipload.machine.axis import Axis
from chipload.machine.limits import SLACK, distance_beyond
from chipload.machine.machine import Machine
from chipload.program.commands import ARC, Commands, chord_arcs
from chipload.program.path_mode import PathControl

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: how far the bulge of an arc may pass its chords [mm]
CHORD_MM = 1e-3


def leading_rows(path_mode: Floats) -> int:
    """Number of rows before the one in which the last of the axes X, Y and Z is sent somewhere.

    In these the axes that have not been sent stand where nobody knows.
    """
    unplaced = np.asarray(path_mode)[:, 0] == PathControl.UNPLACED
    count = len(unplaced) if unplaced.all() else int(np.argmin(unplaced))
    return max(count - 1, 0)


def offset_stated(commands: Commands) -> bool:
    """Whether the place of each work offset that the program uses is stated."""
    used = (commands.frames[k] for k in np.unique(commands.frame).tolist())
    return all(frame.stated or frame.number == 0 for frame in used)


def travel_findings(commands: Commands, machine: Machine, lengths: bool = True) -> tuple[Finding, ...]:
    """Findings ``machine-limit`` on positions beyond the travel of an axis, and on spans greater than it; O(n).

    One finding an axis and work offset: the worst row.

    Parameters
    ----------
    lengths : whether the lengths of the tools are known, without which Z is known up to a constant
    """
    chords = chord_arcs(commands, commands.motion == ARC, CHORD_MM)
    first = leading_rows(chords.path_mode)
    axes, frame, line = chords.machine()[first:], chords.frame[first:], chords.line[first:]
    known = np.array([f.stated or f.number == 0 for f in commands.frames])[frame]
    number = np.array([f.number for f in commands.frames])[frame]
    found = []
    for axis in machine.chain.axes:
        q, placed = axes[:, axis.column], known
        if axis.letter == "Z" and not lengths:
            placed = number == 0
        found += _row_beyond(axis, machine, q, line, placed)
        for one in np.unique(number[~placed]).tolist():
            rows = ~placed & (number == one)
            found += _wider(axis, machine, q[rows], line[rows])
    return tuple(found)


def _row_beyond(axis: Axis, machine: Machine, q: Floats, line: Ints, known: Bools) -> list[Finding]:
    """The row that is farthest beyond a limit, of those whose place in the machine is known."""
    over = np.where(known, distance_beyond(axis, q), 0.0)
    if not len(over) or over.max() <= SLACK:
        return []
    k = int(np.argmax(over))
    text = (
        f"{axis.letter} = {q[k]:g} mm in the coordinates of the machine: machine {machine.name} travels from "
        f"{axis.low:g} to {axis.high:g} mm"
    )
    return [Finding("machine-limit", int(line[k]), text)]


def _wider(axis: Axis, machine: Machine, q: Floats, line: Ints) -> list[Finding]:
    """A span that no place of the work offset brings into the travel."""
    low, high = int(np.argmin(q)), int(np.argmax(q))
    if q[high] - q[low] <= axis.high - axis.low + SLACK:
        return []
    text = (
        f"{axis.letter} goes from {q[low]:g} to {q[high]:g} mm, {q[high] - q[low]:g} mm: machine {machine.name} "
        f"travels {axis.high - axis.low:g} mm, wherever the work offset lies"
    )
    return [Finding("machine-limit", int(line[max(low, high)]), text)]
