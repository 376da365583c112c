"""Polar and cylindrical interpolation (G12.1, G7.1): a plane in which a rotary axis takes the place of a linear one.

Notation: **flat** positions are those of the text: nine numbers whose coordinate ``k`` is the one that the rotary axis
makes [mm]. Polar: flat (x, y) is the place of the tool as the workpiece on the axis C sees it, r = sqrt(x^2 + y^2) is X
and phi = atan2(y, x) the turn of C; the mode begins at the angle 0 where C stands. Cylindrical: the flat coordinate is
r phi, on the cylinder of radius r about the axis. F is the speed in the flat plane. A flat motion becomes straight rows
of the axes, from which it departs by less than ``TOLERANCE``.

Reference: Fanuc B-63944EN-1, "Polar Coordinate Interpolation", "Cylindrical Interpolation".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.program.commands import ARC, DWELL, LINE, PLANE_AXES, RAPID, XY
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.state import Nine, nine
from chipload.program.gcode.track import MotionRows, Row

Floats = NDArray[np.float64]

#: [mm] a row of the axes departs from the flat motion by at most, and nearest to the pole that a motion may pass
TOLERANCE, POLE = 2e-4, 1e-3
#: most rows of a motion
MOST = 1 << 14
#: lengths that are one [mm], and a turn that is none [deg]
SAME, STILL = 1e-9, 1e-6


@dataclass
class Interpolation:
    """A plane whose coordinate ``flat`` is made by the rotary axis ``rotary``.

    Parameters
    ----------
    name : of the code, for messages
    rotary : index of the rotary axis
    linear : index of the linear axis of the plane
    flat : index of the coordinate that the rotary axis makes
    radius : [mm] of the cylinder; None: polar
    kept : where the linear axis ``flat`` stands [mm]
    begin : where the rotary axis stands at the beginning [deg]
    plane : that was active before
    last : (9,) where the axes stand at the beginning; then the flat position where the last row ended
    arc_plane : in which arcs lie
    writes_flat : the text writes the flat coordinate by its own letter, also on a cylinder (G107 of a Haas)
    """

    name: str
    rotary: int
    linear: int
    flat: int
    radius: float | None
    kept: float
    begin: float
    plane: int
    last: Nine
    arc_plane: int = XY
    writes_flat: bool = False

    def __post_init__(self) -> None:
        """Take the position of the axes as the flat one."""
        self._angle: float = self.last[self.rotary]
        self.last = self.first

    @property
    def first(self) -> Nine:
        """The flat position at the beginning."""
        at = list(self.last)
        at[self.flat] = 0.0 if self.radius is None else math.radians(at[self.rotary]) * self.radius
        return nine(at)

    def axes(self, flat: Floats, angle: float) -> Floats:
        """(n, 9) of the machine's axes [mm, deg] along flat positions; ``angle``: of the axis before them [deg]."""
        out = np.array(flat)
        out[:, self.flat] = self.kept
        if self.radius is not None:
            out[:, self.rotary] = np.degrees(flat[:, self.flat] / self.radius)
            return out
        x, y = flat[:, self.linear], flat[:, self.flat]
        r = np.hypot(x, y)
        own = np.degrees(np.arctan2(y, x)) + self.begin
        # on the pole the axis stays where it was
        at_pole = r < POLE
        whole = np.concatenate([[angle], np.where(at_pole, np.nan, own)])
        out[:, self.linear] = r
        out[:, self.rotary] = (_fill_unknown(whole) if at_pole.any() else np.unwrap(whole, period=360.0))[1:]
        return out

    def end(self, flat: Nine, angle: float) -> Nine:
        """Where the axes stand at a flat position."""
        return nine(self.axes(np.array([flat]), angle)[0].tolist())

    @property
    def stands(self) -> Nine:
        """Where the axes stand after the last row."""
        return self.end(self.last, self._angle)

    def rows(self, track: MotionRows, row: Row, centre: tuple[float, float] = (0.0, 0.0), turns: int = 0) -> list[Row]:
        """Rows of the axes for a row in the plane.

        Raises
        ------
        NotReadError
            A rapid, or a motion over the pole.
        """
        motion, context, line = row[0], row[10], row[11]
        end = nine([float(v) for v in row[1:10]])
        if motion == DWELL:
            return [(DWELL, *self.end(end, self._angle), context, line)]
        if motion == RAPID and self.radius is None and end[:2] != self.last[:2]:
            raise NotReadError(f"{self.name}: a rapid in the plane of polar interpolation")
        points = self._points(end, centre, turns if motion == ARC else 0)
        axes = self.axes(points, self._angle)
        if self.radius is None and np.hypot(*points[0, :2]) < POLE and np.ptp(axes[:, self.rotary]) > STILL:
            raise NotReadError(f"{self.name}: a motion that begins on the pole and turns there")
        self.last, self._angle = end, float(axes[-1, self.rotary])
        if motion == RAPID:
            return [(RAPID, *nine(axes[-1].tolist()), context, line)]
        along = np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)
        moved = np.diff(axes, axis=0)
        moved[np.abs(moved) < SAME] = 0.0
        straight = np.linalg.norm(moved[:, :3], axis=1)
        turn = np.radians(np.abs(moved[:, self.rotary]))
        feed = track.feed_of(context)
        out: list[Row] = []
        at = axes[0].tolist()
        for k in range(len(along)):
            if along[k] <= SAME:
                continue
            at = [a + b for a, b in zip(at, moved[k].tolist(), strict=True)]
            share = (straight[k] if straight[k] > 0.0 else turn[k]) / along[k]
            out.append((LINE, *nine(at), track.with_feed(context, float(feed * share)), line))
        return out

    def _points(self, end: Nine, centre: tuple[float, float], turns: int) -> Floats:
        """(n, 9) flat positions from the last one to ``end``, close enough that straight rows lead along them."""
        a, b = np.array(self.last), np.array(end)
        count = 1
        while count <= MOST:
            t = np.linspace(0.0, 1.0, count + 1)
            points: Floats = np.asarray(a + t[:, None] * (b - a))
            if turns:
                self._bend(points, t, centre, turns)
            if self._close(points, centre, turns):
                return points
            count *= 2
        raise NotReadError(f"{self.name}: a motion over or close to the pole")

    def _bend(self, points: Floats, t: Floats, centre: tuple[float, float], turns: int) -> None:
        """Put points of a chord on its arc."""
        first, second, _ = PLANE_AXES[self.arc_plane]
        u, v = points[:, first] - centre[0], points[:, second] - centre[1]
        r0, r1 = math.hypot(u[0], v[0]), math.hypot(u[-1], v[-1])
        begin = math.atan2(v[0], u[0])
        sweep = (math.atan2(v[-1], u[-1]) - begin) % math.tau
        sweep = sweep if turns > 0 else sweep - math.tau
        if abs(sweep) < 1e-12 or abs(abs(sweep) - math.tau) < 1e-12:
            sweep = math.copysign(math.tau, turns)
        sweep += math.copysign(math.tau * (abs(turns) - 1), turns)
        r = r0 + t * (r1 - r0)
        points[:, first] = centre[0] + r * np.cos(begin + t * sweep)
        points[:, second] = centre[1] + r * np.sin(begin + t * sweep)

    def _close(self, points: Floats, centre: tuple[float, float], turns: int) -> bool:
        first, second, _ = PLANE_AXES[self.arc_plane]
        if turns:
            if len(points) < 4 * abs(turns) + 1:
                return False
            chord = np.hypot(np.diff(points[:, first]), np.diff(points[:, second]))
            around = math.hypot(points[0, first] - centre[0], points[0, second] - centre[1])
            if (chord**2).max() > 8.0 * around * TOLERANCE:
                return False
        if self.radius is not None:
            return True
        x, y = points[:, self.linear], points[:, self.flat]
        r = np.hypot(x, y)
        turned = np.abs(np.diff(np.unwrap(np.arctan2(y, x))))
        inner = np.minimum(r[:-1], r[1:]) < POLE
        # what begins or ends on the pole goes along its radius
        turned = np.where(inner, 0.0, turned)
        if (r[1:-1] < POLE).any():
            return False
        wide = np.maximum(r[:-1], r[1:])
        return bool(((wide * turned + 2.0 * np.abs(np.diff(r))) * turned).max() <= 8.0 * TOLERANCE)


def _fill_unknown(values: Floats) -> Floats:
    """Values with those that are not known as the one before, and angles unwrapped over the gaps."""
    out = np.array(values)
    for k in range(1, len(out)):
        if math.isnan(out[k]):
            out[k] = out[k - 1]
        else:
            out[k] = out[k - 1] + math.remainder(values[k] - out[k - 1], 360.0)
    return out
