"""Arcs of CL data: CIRCLE, MOVARC, and the TLON of a contour along a circle.

Notation: an arc goes counter-clockwise about (i, j, k) through its centre, from where the tool stands.

CIRCLE/x,y,z,i,j,k[,r][,CLOCKWISE or COUNTERCLOCKWISE] and MOVARC/x,y,z,i,j,k,r[,ANGLE,a] end at the GOTO that follows;
a [deg] is the sweep. INDIRV/u,v,w is the direction in which TLON,GOFWD/(CIRCLE/x,y,z,r),ON[,2,INTOF],(LINE/x,y,z,u,v,w)
begins: it goes along the circle in that direction to where the ray from its centre through the second point of the line
meets it, and lies in the plane of both.

Reference: ISO 3592 (CL data), and the APT output of CATIA V5 for TLON.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.program.apt.frames import unit
from chipload.program.apt.records import AptRecord, number
from chipload.program.apt.track import Point

Floats = NDArray[np.float64]

#: how far the radius of a TLON may be from the distance of its start [mm]
RADIUS_MM = 0.02
#: how far the sweep of ANGLE may be from that of the ends [rad]
SWEEP = math.radians(1.0)
_TLON = re.compile(r"\(?CIRCLE/([^()]*)\)?,ON,(?:2,INTOF,)?\(?LINE/([^()]*)\)?")


@dataclass(frozen=True)
class Circle:
    """An arc whose end comes with the next point; lengths in the unit of the text.

    Parameters
    ----------
    centre, normal : counter-clockwise about ``normal``, a unit vector
    radius : as the record gives it; None: not
    sweep : [rad]; None: not given
    record : that gives it
    unread : what of the record is not read
    """

    centre: Point
    normal: Point
    radius: float | None
    sweep: float | None
    record: AptRecord
    unread: str = ""


def read_circle(record: AptRecord) -> Circle | str:
    """The arc of a CIRCLE or MOVARC record; a text that says why it is not read.

    Raises
    ------
    InputError
        Its normal has no length.
    """
    senses = [arg for arg in record.args if arg in ("CLOCKWISE", "COUNTERCLOCKWISE")]
    args = [arg for arg in record.args if arg not in senses]
    values = [number(arg) for arg in args[:6]]
    if len(values) < 6 or any(value is None for value in values):
        return "no centre and axis of six numbers"
    v = [record.number(record.args.index(arg)) for arg in args[:6]]
    n, _ = unit(record, (v[3], v[4], v[5]))
    sweep = None
    rest = args[6:]
    if "ANGLE" in rest:
        k = rest.index("ANGLE")
        angle = number(rest[k + 1]) if k + 1 < len(rest) else None
        if angle is None or angle == 0.0:
            return "ANGLE without a number of degrees"
        sweep, rest = math.radians(abs(angle)), rest[:k] + rest[k + 2 :]
        senses = senses or (["CLOCKWISE"] if angle < 0.0 else [])
    if senses == ["CLOCKWISE"]:
        n = _reverse_vector(n)
    radius = number(rest[0]) if rest else None
    unread = ",".join(rest[1:] if radius is not None else rest)
    return Circle((v[0], v[1], v[2]), n, radius, sweep, record, unread)


def read_tlon(record: AptRecord, at: Point, direction: Point) -> tuple[Circle, Point] | str:
    """The arc of a TLON record from ``at`` along ``direction`` and where it ends, in the text's unit; or why not.

    The record ends a motion that began before it: the arc's normal follows from its start and its direction.
    """
    found = _TLON.fullmatch("".join(",".join(record.args).split()))
    if record.word != "TLON,GOFWD" or found is None:
        return "is not along a circle to a line"
    circle, line = ([number(x) for x in group.split(",")] for group in found.groups())
    if len(circle) != 4 or len(line) != 6 or None in (*circle, *line):
        return "must have four numbers of its circle and six of its line"
    c, r = np.array(circle[:3], dtype=np.float64), float(circle[3] or 0.0)
    off, along = np.subtract(at, c), np.array(direction)
    ray = np.array(line[3:], dtype=np.float64) - np.array(line[:3], dtype=np.float64)
    n = np.cross(off, along)
    if r <= 0.0 or not n.any() or not ray.any():
        return "its radius, its line, and its direction across the radius must have a length"
    if abs(float(np.linalg.norm(off)) - r) > RADIUS_MM:
        return f"begins {float(np.linalg.norm(off)):.6g} from its centre: must be on its circle of radius {r:g}"
    n /= np.linalg.norm(n)
    ray -= (ray @ n) * n
    end = c + r * ray / np.linalg.norm(ray)
    normal = (float(n[0]), float(n[1]), float(n[2]))
    return Circle(_point(c), normal, r, None, record), _point(end)


def sweep_of(start: Point, end: Point, centre: Point, normal: Point) -> float:
    """Angle from ``start`` to ``end`` counter-clockwise about ``normal``, above 0 to a whole turn [rad].

    >>> round(sweep_of((1, 0, 0), (0, 1, 0), (0, 0, 0), (0, 0, 1)) / math.pi, 6)
    0.5
    """
    a, b, n = np.subtract(start, centre), np.subtract(end, centre), np.array(normal)
    angle = math.atan2(float(np.cross(a, b) @ n), float(a @ b - (a @ n) * (b @ n))) % math.tau
    return angle if angle > 1e-9 else math.tau


def _reverse_vector(n: Point) -> Point:
    return (-n[0] + 0.0, -n[1] + 0.0, -n[2] + 0.0)


def _point(v: Floats) -> Point:
    return (float(v[0]), float(v[1]), float(v[2]))
