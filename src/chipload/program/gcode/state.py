"""What a controller remembers between blocks: modes, numbers, and how coordinates lie in the machine.

Notation: positions are nine numbers X Y Z A B C U V W in mm and degrees. ``machine = rotate_xy(tilt(position) + shift,
rotation) + offset + length``: ``tilt`` of a tilted working plane, ``shift`` of G92 and G52, ``rotation`` and ``offset``
of the work offset, ``length`` of the tool.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from chipload.program.commands import Floats, Frame
from chipload.program.path_mode import FREE, PathMode
from chipload.program.tilt import Tilt

Nine = tuple[float, float, float, float, float, float, float, float, float]
ZERO: Nine = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
AXES = "xyzabcuvw"
#: axes that are lengths, by index
LINEAR = (0, 1, 2, 6, 7, 8)
#: motion modes, in tenths of G: none
NO_MOTION = 800


def nine(values: list[float]) -> Nine:
    """Nine numbers of a list."""
    x, y, z, a, b, c, u, v, w = values
    return x, y, z, a, b, c, u, v, w


def put(position: Nine, values: dict[int, float]) -> Nine:
    """A position with some of its axes replaced."""
    out = list(position)
    for k, value in values.items():
        out[k] = value
    return nine(out)


@dataclass(frozen=True, slots=True)
class Datum:
    """How the coordinates of the text lie in the machine; ``number`` of the work offset, rotation in degrees."""

    number: int = 1
    offset: Nine = ZERO
    rotation: float = 0.0
    shift: Nine = ZERO
    length: Nine = ZERO
    tilt: Tilt | None = None

    def to_machine(self, p: Nine) -> Nine:
        """Position of the machine's axes; in tilted coordinates, that with the rotary axes at zero."""
        if self.tilt is not None:
            x, y, z = self.tilt.to_offset(np.array([p[:3]]))[0].tolist()
            p = (x, y, z, *p[3:])
        q = [a + b for a, b in zip(p, self.shift, strict=True)]
        if self.rotation:
            q[0], q[1] = rotate_point(q[0], q[1], self.rotation)
        return nine([a + b + c for a, b, c in zip(q, self.offset, self.length, strict=True)])

    def from_machine(self, m: Nine) -> Nine:
        """Position in these coordinates."""
        q = [a - b - c for a, b, c in zip(m, self.offset, self.length, strict=True)]
        if self.rotation:
            q[0], q[1] = rotate_point(q[0], q[1], -self.rotation)
        p = nine([a - b for a, b in zip(q, self.shift, strict=True)])
        if self.tilt is not None:
            x, y, z = self.tilt.from_offset(np.array([p[:3]]))[0].tolist()
            p = (x, y, z, *p[3:])
        return p

    def frame(self) -> Frame:
        """The same in rad, as Commands keep it."""
        return Frame(
            number=self.number,
            offset=_rad(self.offset),
            rotation=math.radians(self.rotation),
            shift=_rad(self.shift),
            tool=_rad(self.length),
            tilt=self.tilt,
        )


def rotate_point(x: float, y: float, degrees: float) -> tuple[float, float]:
    """(x, y) turned about the origin."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return c * x - s * y, s * x + c * y


def _rad(values: Nine) -> Floats:
    out = np.array(values, dtype=np.float64)
    out[3:6] = np.radians(out[3:6])
    return out


@dataclass(slots=True)
class State:
    """Modes of a controller; codes in tenths of G.

    Parameters
    ----------
    scale : mm in a unit of the text
    at : programmed position
    motion, plane, feed_mode, path : active codes
    group_one : the code of G0 to G3 that is active behind a cycle
    absolute, absolute_centre : G90, G90.1
    old_level : G98
    diameter : G7
    feed, feed_turning : F as a speed of lengths [mm/min] and of angles [deg/min]; of G95 per revolution
    speed, sense : S [rpm] and the sense of rotation, 1 clockwise
    surface : S is a speed of the cutting edge (G96)
    tool, selected : in the spindle, and named by T
    path_mode : what ``path`` and its words ask for at joints
    tcp, tcp_by_length : X Y Z are the tip in the workpiece; G43.4 made it so, and another length ends it
    """

    scale: float = 1.0
    at: Nine = ZERO
    datum: Datum = Datum()
    motion: int = NO_MOTION
    group_one: int = NO_MOTION
    plane: int = 170
    feed_mode: int = 940
    path: int = 640
    path_mode: PathMode = FREE
    absolute: bool = True
    absolute_centre: bool = False
    old_level: bool = False
    diameter: bool = False
    feed: float = 0.0
    feed_turning: float = 0.0
    speed: float = 0.0
    sense: int = 0
    surface: bool = False
    tool: int = 0
    selected: int = 0
    tcp: bool = False
    tcp_by_length: bool = False
    flood: bool = False
    mist: bool = False
    compensation: int = 400


@dataclass
class PointMemory:
    """What lasts from block to block.

    Parameters
    ----------
    pole : in the axes of the plane [units of the text]
    polar : radius and angle [deg] of the last polar point
    circle, tangent : whether CIP, or CT, is the motion
    """

    pole: complex = 0j
    polar: list[float] = field(default_factory=lambda: [0.0, 0.0])
    circle: bool = False
    tangent: bool = False
