"""Tilted working planes of conversational programs: PLANE SPATIAL, EULER, VECTOR, RELATIV, AXIAL and RESET, cycle 19.

Notation: in a tilted plane the rows are rows of the tip, which the rotary axes carry along with the workpiece. TURN
turns these axes with X Y Z where they are, MOVE keeps the tip where it is, STAY only tells their angles in Q120, Q121
and Q122.

Reference: Heidenhain, TNC 620 User's Manual Conversational Programming, "The PLANE function".
"""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.program.commands import RAPID, Frame
from chipload.program.heidenhain import words
from chipload.program.heidenhain.state import ConversationalState
from chipload.program.tilt import NEEDS_ROTARY, NO_ROTARY, Floats, of_vectors, spatial, tilt_of, turn_matrix

#: Q parameters of the angles of A, B and C
ANGLES_Q = 120
#: a rotary axis that turns less stands [rad]
STILL = 1e-11
_WORD = re.compile(rf"\b(SP[ABC]|EUL(?:PR|NU|ROT)|[BN][XYZ]|DIST|MB|[ABC])\s*([-+]?)\s*({words.VALUE})")
_KNOWN = ("SPATIAL", "EULER", "VECTOR", "RELATIV", "RELATIVE")


def plane(s: ConversationalState, text: str) -> str:
    """Carry out a PLANE block.

    Returns
    -------
    Why it is not read; empty: it is.
    """
    kind = text.split()[1] if len(text.split()) > 1 else ""
    values = {name: s.signed(sign, value) for name, sign, value in _WORD.findall(text)}
    how = next((word for word in ("TURN", "MOVE", "STAY") if re.search(rf"\b{word}\b", text)), "STAY")
    found = re.search(r"\b(?:SEQ|SYM)\s*([-+])", text)
    sign = 0 if found is None else 1 if found[1] == "+" else -1
    if kind == "RESET":
        R = np.eye(3)
    elif kind == "AXIAL":
        return _by_axes(s, values, how)
    elif kind not in _KNOWN:
        return f"PLANE {kind}: a tilted working plane by projected angles or points is not read"
    else:
        R = _rotation(s, kind, values)
    return put(s, R, how, sign)


def _by_axes(s: ConversationalState, values: dict[str, float], how: str) -> str:
    """PLANE AXIAL: the plane that the machine's axes have with the rotary ones at the angles that it names."""
    if s.swivel is None or not s.swivel.turns:
        return _without_rotary(s)
    target = axes_of(s)
    for k, letter in enumerate("ABC"):
        if letter in values:
            target[3 + k] = math.radians(values[letter])
    _go(s, target, how)
    enter(s, s.swivel.directions(target))
    return ""


def _rotation(s: ConversationalState, kind: str, values: dict[str, float]) -> Floats:
    def three(*names: str) -> tuple[float, float, float]:
        missing = [x for x in names if x not in values]
        if missing and kind != "RELATIV" and kind != "RELATIVE":
            raise InputError(f"PLANE {kind}: {missing[0]} is missing")
        a, b, c = (values.get(x, 0.0) for x in names)
        return a, b, c

    if kind == "EULER":
        return turn_matrix("zxz", three("EULPR", "EULNU", "EULROT"))
    if kind == "VECTOR":
        return of_vectors(np.array(three("BX", "BY", "BZ")), np.array(three("NX", "NY", "NZ")))
    R = spatial(*three("SPA", "SPB", "SPC"))
    if kind == "SPATIAL":
        return R
    before = np.eye(3) if s.tilt is None else s.tilt.matrix
    out: Floats = before @ R
    return out


def put(s: ConversationalState, R: Floats, how: str, sign: int = 0) -> str:
    """Tilt the working plane by R (3, 3) about the datum; ``how``: TURN, MOVE or STAY. Returns why it is not."""
    tilt = tilt_of(R, (0.0, 0.0, 0.0))
    swivel = s.swivel
    if swivel is None or not swivel.turns:
        if not tilt.upright:
            return _without_rotary(s)
        enter(s, R)
        return ""
    now = axes_of(s)
    _go(s, swivel.aligned(tilt.direction, now, sign), how)
    enter(s, R)
    return ""


def _without_rotary(s: ConversationalState) -> str:
    """Why a plane is left out where no machine with rotary axes is given."""
    if s.swivel is not None:
        s.unproven(NO_ROTARY, NEEDS_ROTARY)
    return "a tilted working plane, and no machine with rotary axes"


def _go(s: ConversationalState, target: NDArray[np.float64], how: str) -> None:
    """The rotary axes of a plane: turned, or told."""
    for k in range(3):
        s.q.set(ANGLES_Q + k, math.degrees(target[3 + k]))
    if how == "MOVE":
        _turn_about_tip(s, target)
    elif how == "TURN":
        turn(s, target)


def enter(s: ConversationalState, R: Floats) -> None:
    """Take the coordinates of a tilted plane, or those of the datum where R is the unit; the machine stays."""
    now = axes_of(s)
    s.end_contour()
    s.tilt = None if np.allclose(R, np.eye(3), atol=1e-12) else tilt_of(R, (0.0, 0.0, 0.0))
    s.frame()
    _stand(s, now)


def turn(s: ConversationalState, target: NDArray[np.float64], motion: int = RAPID) -> None:
    """Turn the rotary axes to those of ``target`` (9,), X Y Z of the machine where they are.

    Where Z stands at a position of the machine that is not known (M91, M140 MB MAX), it goes to the end of its travel
    first.
    """
    s.end_contour()
    now = axes_of(s)
    if np.abs(target[3:6] - now[3:6]).max() < STILL:
        return
    tilt = s.tilt
    s.tilt = None
    s.frame()
    _stand(s, now)
    height = s.swivel.highest(Frame()) if s.swivel is not None and 2 in s.unknown else None
    if height is not None and height > now[2]:
        now[2] = height
        _stand(s, now)
        s.row(RAPID, s.at)
    now[3:6] = target[3:6]
    _stand(s, now)
    s.row(motion, s.at, 0.0 if motion == RAPID else s.cutting_feed())
    s.tilt = tilt
    if tilt is not None:
        s.frame()
        _stand(s, now)


def _turn_about_tip(s: ConversationalState, target: NDArray[np.float64]) -> None:
    """Turn the rotary axes with the tip where it is on the workpiece."""
    s.end_contour()
    if np.abs(target[3:6] - np.array(s.at[3:6])).max() < STILL:
        return
    tcp_before, s.tcp = s.tcp, True
    s.at = [*s.at[:3], *target[3:6].tolist(), *s.at[6:]]
    s.row(RAPID, s.at)
    s.tcp = tcp_before


def axes_of(s: ConversationalState) -> NDArray[np.float64]:
    """(9,) where the machine's axes stand [mm, rad]."""
    frame = s.frames[-1]
    at = np.array([s.at])
    flat = frame.to_machine(at)[0]
    if frame.tilt is None or s.swivel is None:
        return np.asarray(flat)
    return s.swivel.axes(frame, Frame(), frame.tilt.to_offset(at[:, :3])[0], flat)


def _stand(s: ConversationalState, axes: NDArray[np.float64]) -> None:
    """The programmed position where the machine's axes stand so."""
    frame = s.frames[-1]
    at = frame.from_machine(axes[None, :])[0]
    if frame.tilt is not None and s.swivel is not None:
        at[:3] = frame.tilt.from_offset(s.swivel.tip(frame, Frame(), axes)[None, :])[0]
    s.at = at.tolist()
