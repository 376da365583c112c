"""The coordinates of points in CL data: CSYS, TRNTYP, ROTABL, TLAXIS.

Notation: p_work in the one work frame, p in the coordinates of the text; R (3, 3), t (3,) with p_work = R (p - t), a
direction a_work = R a. CSYS/a11,a12,a13,t1,a21,a22,a23,t2,a31,a32,a33,t3 describes a coordinate system whose axes, in
the work frame, are the columns of (a_ij) = A, and p = A' p_work + t are the coordinates in it.

TRNTYP states the coordinates of the points. Under TRNTYP/WORLD, which CAM systems write for indexed tables, that is the
work frame: R = 1, t = 0, and CSYS gives the axis of the tool alone, its third axis. Under TRNTYP/LOCAL it is the system
of CSYS: R = A.

ROTABL/angle,AAXIS,TABLE,CCLW says that the table has turned the work: the points are in axes that stand still, with
the tool along +Z, R = rotation by the angle about X (BAXIS: Y, CAXIS: Z), counter-clockwise for CCLW. The angle is in
rad or in degrees; TLAXIS, the axis of the tool in the work frame, tells which, and has more digits: R z is that axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.program.apt.records import AptRecord

Floats = NDArray[np.float64]

#: how far the axes of a CSYS may be from unit vectors at right angles
SKEW = 1e-3
#: how far R z of ROTABL may be from TLAXIS [rad]
SAME_AXIS = 1e-4

_ABOUT = {"AAXIS": 0, "BAXIS": 1, "CAXIS": 2}
_Z = (0.0, 0.0, 1.0)


def _identity() -> Floats:
    return np.eye(3)


def _zero() -> Floats:
    return np.zeros(3)


@dataclass(frozen=True, eq=False)
class Coordinates:
    """The current values of CSYS, TRNTYP, ROTABL and TLAXIS.

    Parameters
    ----------
    A : (3, 3) float, t : (3,) float [mm], of CSYS
    points_in : ``work`` or ``csys``, coordinates of points under a CSYS; None: not stated
    turned : angles as ROTABL gives them, about X, Y, Z
    tlaxis : of TLAXIS, a unit vector; None: not stated
    line : of the CSYS
    """

    A: Floats = field(default_factory=_identity)
    t: Floats = field(default_factory=_zero)
    points_in: str | None = None
    turned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tlaxis: tuple[float, float, float] | None = None
    line: int = 0

    def resolved(self) -> tuple[Floats, Floats, Floats]:
        """R (3, 3), t (3,) [mm] and the tool's axis (3,) in the work frame where a point gives none.

        Raises
        ------
        InputError
            The coordinates of the points are not stated, or ROTABL and TLAXIS do not agree.
        """
        if any(self.turned):
            R = self._table_rotation()
            return R, np.zeros(3), R @ _Z
        if not self._untransformed and self.points_in is None:
            raise InputError(
                f"line {self.line}: CSYS without TRNTYP leaves the frame of the points open: state whether it is the "
                "work frame or the coordinates of CSYS"
            )
        R, t = (self.A, self.t) if self.points_in == "csys" else (np.eye(3), np.zeros(3))
        return R, t, self.A @ _Z if self.tlaxis is None else R @ self.tlaxis

    @property
    def in_work(self) -> bool:
        """Whether points are in the work frame as they stand."""
        return not any(self.turned) and (self._untransformed or self.points_in == "work")

    @property
    def note(self) -> str:
        """How points are read where a CSYS or ROTABL is in effect, else empty."""
        if any(self.turned):
            return "ROTABL: points are turned back with the table into the work frame"
        if self._untransformed:
            return ""
        if self.points_in == "csys":
            return "CSYS: points are brought from its coordinates into the work frame"
        return "CSYS: points are in the work frame and stay unchanged"

    @cached_property
    def _untransformed(self) -> bool:
        return bool(np.abs(self.A - np.eye(3)).max() < 1e-12) and not self.t.any()

    def _table_rotation(self) -> Floats:
        about = [k for k in range(3) if abs(self.turned[k]) > 1e-9]
        if self.tlaxis is None or len(about) > 1:
            raise InputError(
                f"line {self.line}: ROTABL: must turn one axis and come with TLAXIS, the tool's axis in the work frame"
            )
        if not about:
            return np.eye(3)
        k, angle = about[0], self.turned[about[0]]
        u = self.tlaxis
        own = (math.atan2(-u[1], u[2]), math.atan2(u[0], u[2]), 0.0)[k]
        near = [abs(math.remainder(angle * scale - own, math.tau)) < SAME_AXIS for scale in (1.0, math.pi / 180.0)]
        if sum(near) != 1 or abs(u[k]) > SAME_AXIS:
            raise InputError(
                f"line {self.line}: ROTABL: an angle of {angle:g} turns the tool to TLAXIS {u} neither in rad nor in "
                f"degrees: correct the angle or TLAXIS"
            )
        return _rotation(k, own)

    def csys(self, record: AptRecord, mm: float) -> Coordinates:
        """After a CSYS record of 12 numbers; ``mm`` in one unit of the text."""
        m = np.array(record.numbers(12)).reshape(3, 4)
        A = m[:, :3]
        if np.abs(A.T @ A - np.eye(3)).max() > SKEW or np.linalg.det(A) < 0.0:
            raise record.error("its axes must be unit vectors at right angles, right-handed")
        u, _, v = np.linalg.svd(A)
        near = u @ v
        exact = A if np.abs(A - near).max() < 1e-12 else near
        return replace(self, A=exact, t=m[:, 3] * mm, line=record.line)

    def trntyp(self, record: AptRecord) -> Coordinates:
        """After a TRNTYP record."""
        points_in = {"WORLD": "work", "LOCAL": "csys"}.get(record.args[0] if record.args else "")
        if points_in is None or any(record.number(k) for k in range(1, len(record.args))):
            raise record.error("must be TRNTYP/WORLD or TRNTYP/LOCAL, its numbers 0")
        return replace(self, points_in=points_in)

    def rotabl(self, record: AptRecord) -> Coordinates:
        """After a ROTABL record; angles are those that the table has then, not added up."""
        about = [_ABOUT[word] for word in record.args if word in _ABOUT]
        words = {"TABLE", "CLW", "CCLW", "ATANGL", *_ABOUT}
        angles = [record.number(k) for k, word in enumerate(record.args) if word not in words]
        if len(about) != 1 or len(angles) != 1:
            raise record.error("must name one axis, AAXIS, BAXIS or CAXIS, and one angle")
        sign = -1.0 if "CLW" in record.args else 1.0
        turned = list(self.turned)
        turned[about[0]] = sign * angles[0]
        return replace(self, turned=(turned[0], turned[1], turned[2]), line=record.line)

    def tool_axis(self, record: AptRecord) -> Coordinates:
        """After a TLAXIS record."""
        return replace(self, tlaxis=unit(record, record.numbers(3))[0])


def unit(record: AptRecord, a: tuple[float, ...]) -> tuple[tuple[float, float, float], float]:
    """A direction as a unit vector, and the length that it had."""
    length = math.hypot(*a)
    if length < 1e-6:
        raise record.error(f"direction {a}: must have a length above 0")
    return (a[0] / length + 0.0, a[1] / length + 0.0, a[2] / length + 0.0), length


def _rotation(about: int, angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    R = np.eye(3)
    i, j = (about + 1) % 3, (about + 2) % 3
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R
