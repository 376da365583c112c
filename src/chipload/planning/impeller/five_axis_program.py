"""Program of passes on five simultaneous axes: approach from above the part, the passes, and retract.

Notation: p tip [mm], A axis, N normal of the surface; H(A) the height along A above which no point of the impeller
lies: of its outline, the corners of the convex body round all channels. The cutter comes down along A beside the end of
the pass, a lift off the surface, moves to it at the feed of the cut, along it, and leaves it in the same manner. In a
row whose rotary axes would exceed their greatest speed the feed is reduced.

At its end the cutter moves above the part to the start of the next channel. So a program that is repeated, with the
part turned by a pitch each time, has no other motions than those of its rows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.lazy import scipy
from chipload.machine.machine import Machine
from chipload.planning.impeller.clearance import clearance, interpolated_axes
from chipload.planning.impeller.links import Link, Moves
from chipload.planning.impeller.programs import program_of
from chipload.planning.impeller.scene import Floats, Scene
from chipload.program.motions import spans
from chipload.program.program import LINE, RAPID, Program
from chipload.program.to_axes import to_axes

#: of the lift that are tried
_LIFTS = (1.0, 0.5, 0.25)
#: places of a lift that are checked
_SMALL = 12
#: of the axis in one row above the part [rad]
_TURN = math.radians(3.0)


class AxisPath(Protocol):
    """A pass: tips and axes, and the normal of the surface at each."""

    @property
    def tip(self) -> Floats:
        """Tips (n, 3) [mm]."""

    @property
    def axis(self) -> Floats:
        """Unit axes (n, 3)."""

    @property
    def normal(self) -> Floats:
        """Unit normals of the surface (n, 3)."""

    def back(self) -> Self:
        """The same pass from its end to its beginning."""


def outline_of(scene: Scene, blades: int) -> Floats:
    """Corners (k, 3) [mm] of the convex body round the check points of all channels.

    >>> one = np.array([[2.0, 0, 0], [2.0, 0, 1.0], [1.0, 0, 0], [1.5, 0.1, 0.5]])
    >>> none = np.zeros((1, 3))
    >>> scene = Scene(none, none + [1, 0, 0], np.zeros((1, 3, 3)), np.zeros(1), one, np.zeros(4), 0.0)
    >>> len(outline_of(scene, 4))
    8
    """
    points = scene.check[scipy.spatial.ConvexHull(scene.check).vertices]
    a = math.tau * np.arange(blades) / blades
    c, s = np.cos(a)[:, None], np.sin(a)[:, None]
    x, y, z = points.T
    turned = np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(z, (blades, len(z)))], axis=-1).reshape(-1, 3)
    out: Floats = turned[scipy.spatial.ConvexHull(turned).vertices]
    return out


def lift_from_end(
    path: AxisPath, end: int, scene: Scene, outline: Floats, cutter: CatalogueCutter, how: Link, above: float
) -> Floats | None:
    """Tip beside an end (0, -1) of a pass, from which the retract along the axis is free; None: there is none.

    ``above`` : clearance of neck, shank and holder [mm].
    """
    p, A, N = path.tip[end], path.axis[end], path.normal[end]
    out = path.tip[end] - path.tip[1 if end == 0 else -2]
    out = out / np.linalg.norm(out)
    for size in _LIFTS:
        for direction in (N, N + A, N + out, out, A):
            step = how.lift * size * direction / np.linalg.norm(direction)
            tips = p + np.arange(1, _SMALL + 1)[:, None] / _SMALL * step
            rise = np.linspace(0.0, max(top_of(outline, A, how) - float(tips[-1] @ A), 0.0), _SMALL)
            up = tips[-1] + rise[:, None] * A
            both = np.vstack([tips, up])
            got, _ = clearance(scene, cutter, both, np.tile(A, (len(both), 1)), how.lift + 1.0, above)
            if got.min() >= -how.touch and got[_SMALL - 1 :].min() > how.margin:
                end_of_lift: Floats = p + step
                return end_of_lift
    return None


def top_of(outline: Floats, axis: Floats, how: Link) -> float:
    """Height along the axis at which the tip is above the part."""
    return float((outline @ axis).max()) + how.above


@dataclass(frozen=True, eq=False)
class LinkedPath:
    """A pass with the tips (3,) [mm] beside its beginning and its end, of :func:`lift_from_end`."""

    path: AxisPath
    begin: Floats
    end: Floats

    def back(self) -> LinkedPath:
        """The same pass from its end to its beginning."""
        return LinkedPath(self.path.back(), self.end, self.begin)


def five_axis_program(
    passes: Sequence[LinkedPath], outline: Floats, how: Link, feed: float, spindle: float, tool: int, machine: Machine,
    pitch: float,
) -> Program:  # fmt: skip
    """Program of the passes in their order, every second one from its end, in the frame of the impeller.

    Parameters
    ----------
    feed : of the tip [mm/s]
    spindle : [rad/s]
    pitch : from channel to channel [rad]
    """
    parts: list[Moves] = []
    first: tuple[Floats, Floats] | None = None
    last: tuple[Floats, Floats] | None = None
    for k, one in enumerate(passes):
        turned = one if k % 2 == 0 else one.back()
        path, begin, end = turned.path, turned.begin, turned.end
        A0, A1 = path.axis[0], path.axis[-1]
        over = [_move_above(outline, p, A, how) for p, A in ((begin, A0), (end, A1))]
        if last is not None:
            parts.append(_rapids_above(outline, last, (over[0], A0), how))
        parts += [
            Moves.of(RAPID, over[0][None], A0[None], 0.0, "link"),
            Moves.of(LINE, begin[None], A0[None], how.feed, "link"),
            Moves.of(LINE, path.tip[:1], A0[None], feed, "lead"),
            Moves.of(LINE, path.tip[1:], path.axis[1:], feed, "finish"),
            Moves.of(LINE, end[None], A1[None], feed, "lead"),
            Moves.of(LINE, over[1][None], A1[None], how.feed, "link"),
        ]
        first, last = first or (over[0], A0), (over[1], A1)
    if first is not None and last is not None:
        c, s = math.cos(pitch), math.sin(pitch)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        onward = R @ first[0], R @ first[1]
        parts.append(_rapids_above(outline, last, onward, how))
        parts.append(Moves.of(RAPID, onward[0][None], onward[1][None], 0.0, "link"))
    program = program_of(Moves.join(parts), spindle, tool)
    share = rotary_share(program, machine)
    return replace(program, feed=program.feed / np.maximum(share, 1.0))


def _move_above(outline: Floats, tip: Floats, axis: Floats, how: Link) -> Floats:
    """The tip moved up along the axis until it is above the part."""
    out: Floats = tip + max(top_of(outline, axis, how) - float(tip @ axis), 0.0) * axis
    return out


def _rapids_above(outline: Floats, a: tuple[Floats, Floats], b: tuple[Floats, Floats], how: Link) -> Moves:
    """Rapids above the part from one tip and axis to another: at every turn of the axis the tip is above the part."""
    angle = float(np.arccos(np.clip(a[1] @ b[1], -1.0, 1.0)))
    share = np.linspace(0.0, 1.0, max(int(np.ceil(angle / _TURN)), 1) + 1)[:-1]
    axes = interpolated_axes(np.tile(a[1], (len(share), 1)), np.tile(b[1], (len(share), 1)), share)
    tips = a[0] + share[:, None] * (b[0] - a[0])
    # between two of them the part may turn up towards the tip by its size times half of the angle
    size = float(np.linalg.norm(outline, axis=1).max())
    more = 2.0 * size * _TURN
    raised = np.array([_move_above(outline, p, A, how) + more * A for p, A in zip(tips, axes, strict=True)])
    return Moves.of(RAPID, raised, axes, 0.0, "link")


def rotary_share(program: Program, machine: Machine) -> Floats:
    """Rate of the fastest rotary axis in each row over its greatest rate, (n,); 0 for rapids."""
    commands, _ = to_axes(replace(program, line=np.arange(len(program))), machine)
    step = np.abs(np.diff(commands.position, axis=0, prepend=commands.position[:1]))
    out = np.zeros(len(program))
    length = spans(program)
    cut = (program.motion == LINE) & (length > 0.0)
    seconds = np.where(cut, length / np.where(cut, program.feed, 1.0), np.inf)
    for axis in machine.chain.rotary:
        turn = np.bincount(commands.line, step[:, axis.column], len(program))
        out = np.maximum(out, np.where(cut, turn / axis.rate, 0.0) / np.where(cut, seconds, 1.0))
    return out
