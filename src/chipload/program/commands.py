"""Commands: the motions of the machine's axes that a program commands, in columns.

Every reader of NC text ends here and every writer of it starts here; :mod:`~chipload.program.to_work` leads to a
:class:`~chipload.program.program.Program`, which knows the workpiece and no axes, ``to_axes`` back. Positions are as
LinuxCNC's canonical commands give them: in the coordinates that are active, so that offsets, the offset of G92, the
rotation and the tool's length are kept beside them, in ``frames``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.program.path_mode import frozen_column, mode_column
from chipload.program.tilt import Tilt

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Row = tuple[Any, ...]

#: the axes of ``Commands.position``, in its columns: X Y Z U V W in mm, A B C in rad
LETTERS = "XYZABCUVW"
#: values of ``Commands.motion``; PROBE is a straight feed that a probe signal may end earlier
RAPID, LINE, ARC, DWELL, PROBE = 0, 1, 2, 3, 4
#: values of ``Commands.plane``: the coordinates that an arc turns in, and the one that it may rise along
XY, ZX, YZ = 0, 1, 2
#: ends of an arc that are nearer than this [mm] are one point: a full turn
FULL_TURN_MM = 1e-7
#: columns of ``position`` by plane: first, second, along
PLANE_AXES = ((0, 1, 2), (2, 0, 1), (1, 2, 0))


def _zeros() -> Floats:
    return np.zeros(9)


@dataclass(frozen=True, eq=False)
class Frame:
    """Position of a program's coordinates in those of the machine.

    ``machine = rotate_xy(tilt(position) + shift, rotation) + offset + tool``, with the rotation about Z. Rows in tilted
    coordinates are rows of the tip: ``machine`` is then where the axes would stand with the rotary ones at zero.

    Parameters
    ----------
    number : of the work offset: 1 for G54 to 9 for G59.3; 0 for the machine's own coordinates
    offset : (9,) float [mm, rad], origin of the work offset
    rotation : of the work offset [rad]
    shift : (9,) float [mm, rad], of G92 and G52
    tool : (9,) float [mm, rad], length offset of the tool
    tilt : the tilted working plane; None: none
    stated : whether the place of the work offset in the machine is stated
    """

    number: int = 1
    offset: Floats = field(default_factory=_zeros)
    rotation: float = 0.0
    shift: Floats = field(default_factory=_zeros)
    tool: Floats = field(default_factory=_zeros)
    tilt: Tilt | None = None
    stated: bool = False

    def __post_init__(self) -> None:
        for name in ("offset", "shift", "tool"):
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.shape != (9,) or not np.isfinite(value).all():
                raise InputError(f"frame.{name}: must be nine finite numbers, one for each of {' '.join(LETTERS)}")
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def to_machine(self, position: Floats) -> Floats:
        """(n, 9) of the machine, less nothing: of its own axes, from (n, 9) in this frame."""
        p = position + self.shift
        if self.tilt is not None:
            p[:, :3] = self.tilt.to_offset(position[:, :3]) + self.shift[:3]
        c, s = math.cos(self.rotation), math.sin(self.rotation)
        x, y = c * p[:, 0] - s * p[:, 1], s * p[:, 0] + c * p[:, 1]
        p[:, 0], p[:, 1] = x, y
        p += self.offset
        p += self.tool
        return p

    def from_machine(self, axes: Floats) -> Floats:
        """(n, 9) in this frame from (n, 9) of the machine's axes."""
        p = axes - self.offset - self.tool
        c, s = math.cos(self.rotation), math.sin(self.rotation)
        x, y = c * p[:, 0] + s * p[:, 1], -s * p[:, 0] + c * p[:, 1]
        p[:, 0], p[:, 1] = x, y
        p = p - self.shift
        if self.tilt is not None:
            p[:, :3] = self.tilt.from_offset(p[:, :3])
        return p


@dataclass(frozen=True, eq=False)
class Commands:
    """Motions in columns; row k goes from the position of row k - 1 to its own. Row 0 comes from where the machine is.

    Parameters
    ----------
    motion : (n,) int
        RAPID, LINE, ARC, DWELL or PROBE.
    position : (n, 9) float [mm, rad]
        End of the motion, X Y Z A B C U V W in the coordinates of its frame.
    plane : (n,) int
        XY (G17), ZX (G18) or YZ (G19); matters for arcs alone.
    centre : (n, 2) float [mm]
        Centre of an arc, in the first and second coordinate of its plane; 0, 0 elsewhere.
    turns : (n,) int
        Of an arc: +1 counter-clockwise seen from the positive side of the plane, +2 with a whole turn before, ...;
        negative clockwise; 0 elsewhere.
    feed : (n,) float [mm/s]
        Of LINE, ARC and PROBE along X Y Z, or U V W where those stand, or [rad/s] where only A B C move; 0 for RAPID;
        of a DWELL the time [s].
    spindle : (n,) float [rad/s]
        Positive clockwise (M3), 0 stopped.
    tool : (n,) int
        Number of the tool in the spindle, 0 none.
    tcp : (n,) bool
        Whether X Y Z are the tip in the workpiece that the rotary axes carry (G43.4, TRAORI, M128).
    frame : (n,) int
        Index into ``frames``.
    line : (n,) int
        Line of the text, from 1; 0 where there is none.
    label : (n,) int
        Index into ``labels``.
    frames : tuple of Frame
    labels : tuple of str
    path_mode : (n, 3) float
        How the joint at the end of the motion is passed, see :mod:`~chipload.program.path_mode`; None: not stated.

    Raises
    ------
    InputError
        Columns differ in length, a value is not finite, an index or a code is unknown.
    """

    motion: Ints
    position: Floats
    plane: Ints
    centre: Floats
    turns: Ints
    feed: Floats
    spindle: Floats
    tool: Ints
    tcp: NDArray[np.bool_]
    frame: Ints
    line: Ints
    label: Ints
    frames: tuple[Frame, ...]
    labels: tuple[str, ...]
    path_mode: Floats = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        n = len(self.motion)
        kinds = {"position": np.float64, "centre": np.float64, "feed": np.float64, "spindle": np.float64, "tcp": bool}
        shapes = {"position": (n, 9), "centre": (n, 2)}
        object.__setattr__(self, "path_mode", mode_column("commands", self.path_mode, n))
        for f in fields(self):
            if f.name in ("frames", "labels", "path_mode"):
                continue
            column = frozen_column(getattr(self, f.name), kinds.get(f.name, np.int64))
            if column.shape != shapes.get(f.name, (n,)):
                raise InputError(f"commands.{f.name}: shape {column.shape}: must be {shapes.get(f.name, (n,))}")
            if not np.isfinite(column).all():
                raise InputError(f"commands.{f.name}: a value is not a finite number")
            object.__setattr__(self, f.name, column)
        most = {"motion": PROBE, "plane": YZ, "frame": len(self.frames) - 1, "label": len(self.labels) - 1}
        for name, top in most.items():
            column = getattr(self, name)
            if n and (column.min() < 0 or column.max() > top):
                raise InputError(f"commands.{name} = {column.min()}..{column.max()}: must be from 0 to {top}")

    def __len__(self) -> int:
        return len(self.motion)

    def machine(self) -> Floats:
        """(n, 9) positions of the machine's own axes [mm, rad], offsets and the tool's length put in."""
        if len(self.frames) == 1:
            return self.frames[0].to_machine(self.position)
        out = np.zeros((len(self), 9))
        for k, frame in enumerate(self.frames):
            rows = self.frame == k
            if rows.any():
                out[rows] = frame.to_machine(self.position[rows])
        return out


def starts(commands: Commands) -> Floats:
    """(n, 9) where each row starts, in the coordinates of its own frame; row 0 starts at its own end."""
    own = np.vstack([commands.position[:1], commands.position[:-1]])
    changed = np.flatnonzero(np.diff(commands.frame, prepend=commands.frame[:1]))
    if len(changed):
        before = commands.machine()[changed - 1]
        for k, row in enumerate(changed):
            own[row] = commands.frames[commands.frame[row]].from_machine(before[k : k + 1])[0]
    return own


def arc_sweeps(commands: Commands) -> Floats:
    """(n,) signed sweep of each arc in its plane [rad], 0 for all else; ends over one another are a full turn."""
    arc = commands.motion == ARC
    pair = np.array(PLANE_AXES)[commands.plane][:, :2]
    v0 = np.take_along_axis(starts(commands), pair, axis=1) - commands.centre
    v1 = np.take_along_axis(commands.position, pair, axis=1) - commands.centre
    sense = np.where(commands.turns > 0, 1.0, -1.0)
    turn = np.arctan2(v0[:, 0] * v1[:, 1] - v0[:, 1] * v1[:, 0], (v0 * v1).sum(axis=1))
    sweep = (sense * turn) % math.tau
    sweep = np.where(np.hypot(*(v1 - v0).T) <= FULL_TURN_MM, math.tau, sweep)
    return np.where(arc, sense * (sweep + math.tau * (np.abs(commands.turns) - 1)), 0.0)


def extents(commands: Commands) -> Floats:
    """(n,) what a feed is counted along: the path of X Y Z [mm], else of U V W [mm], else of A B C [rad]."""
    d = commands.position - starts(commands)
    sizes = [np.linalg.norm(d[:, k : k + 3], axis=1) for k in (0, 6, 3)]
    pair = np.array(PLANE_AXES)[commands.plane]
    end = np.take_along_axis(commands.position, pair[:, :2], axis=1)
    r = np.hypot(*(end - commands.centre).T)
    rise = np.take_along_axis(d, pair[:, 2:], axis=1)[:, 0]
    sizes[0] = np.where(commands.motion == ARC, np.hypot(r * arc_sweeps(commands), rise), sizes[0])
    return np.asarray(np.where(sizes[0] > 0.0, sizes[0], np.where(sizes[1] > 0.0, sizes[1], sizes[2])))


def chord_arcs(commands: Commands, chosen: NDArray[np.bool_], tolerance: float) -> Commands:
    """The commands with the ``chosen`` (n,) arcs as chords that leave them by at most ``tolerance`` [mm].

    Where the radii at both ends differ, that of the arc goes evenly from one to the other.
    """
    chosen = chosen & (commands.motion == ARC)
    if not chosen.any():
        return commands
    sweep = arc_sweeps(commands)
    pair = np.array(PLANE_AXES)[commands.plane][:, :2]
    begin = starts(commands)
    v0 = np.take_along_axis(begin, pair, axis=1) - commands.centre
    r, r1 = np.hypot(*v0.T), np.hypot(*(np.take_along_axis(commands.position, pair, axis=1) - commands.centre).T)
    step = 2.0 * np.arccos(1.0 - np.minimum(tolerance / np.where(r > 0.0, r, math.inf), 0.5))
    count = np.where(chosen, np.ceil(np.abs(sweep) / np.where(step > 0.0, step, 1.0)), 1.0).astype(np.int64).clip(1)
    row = np.repeat(np.arange(len(commands)), count)
    part = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[row]
    inner = chosen[row] & (part < 1.0)
    position = np.where(
        inner[:, None], begin[row] + part[:, None] * (commands.position - begin)[row], commands.position[row]
    )
    a = sweep[row] * part
    c, s = np.cos(a), np.sin(a)
    grown = 1.0 + part * np.where(r > 0.0, r1 / np.where(r > 0.0, r, 1.0) - 1.0, 0.0)[row]
    turned = np.column_stack([c * v0[row, 0] - s * v0[row, 1], s * v0[row, 0] + c * v0[row, 1]])
    turned = commands.centre[row] + grown[:, None] * turned
    which = np.flatnonzero(inner)
    position[which[:, None], pair[row][which]] = turned[which]
    columns = {f.name: getattr(commands, f.name)[row] for f in fields(Commands) if f.name not in ("frames", "labels")}
    columns["position"] = position
    columns["motion"] = np.where(chosen[row], LINE, commands.motion[row])
    columns["centre"] = np.where(chosen[row][:, None], 0.0, commands.centre[row])
    columns["turns"] = np.where(chosen[row], 0, commands.turns[row])
    return Commands(**columns, frames=commands.frames, labels=commands.labels)


def spirals(commands: Commands, skew: float) -> NDArray[np.bool_]:
    """(n,) whether a row is an arc whose radii at its ends differ by more than ``skew`` [mm]."""
    pair = np.array(PLANE_AXES)[commands.plane][:, :2]
    r0, r1 = (
        np.hypot(*(np.take_along_axis(p, pair, axis=1) - commands.centre).T)
        for p in (starts(commands), commands.position)
    )
    return np.asarray((commands.motion == ARC) & (np.abs(r1 - r0) > skew))


def commands_from_rows(rows: Sequence[Row], frames: Sequence[Frame], labels: Sequence[str]) -> Commands:
    """Commands from rows ``(motion, (9 numbers), plane, (2 numbers), turns, feed, spindle, tool, tcp, frame, line,
    label)``, in the order of the columns.
    """
    columns = list(zip(*rows, strict=True)) if rows else [()] * 12
    names = [f.name for f in fields(Commands)][:12]
    values: dict[str, Any] = dict(zip(names, columns, strict=True))
    values["position"] = np.array(values["position"], dtype=np.float64).reshape(-1, 9)
    values["centre"] = np.array(values["centre"], dtype=np.float64).reshape(-1, 2)
    return Commands(**values, frames=tuple(frames), labels=tuple(labels))
