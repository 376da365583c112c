"""Blocks of motion and numbers alone, read fast.

Notation: such a block is ``N G X Y Z A B C I J K F`` in this order, each once at most, G one of 0 to 3, every value a
plain number. All other blocks take the long way; a test holds both ways against each other.
"""

from __future__ import annotations

import re

from chipload.program.commands import ARC, LINE, RAPID
from chipload.program.gcode.arcs import check_centre
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.motion import ControllerMotion

#: blocks in one go
PIECE = 8192
_NUMBER = r"([-+]?(?:[0-9]{1,6}\.?[0-9]{0,12}|\.[0-9]{1,12}))"


_AXES = "".join(rf"(?:[{x}{x.lower()}][ \t]*{_NUMBER}[ \t]*)?" for x in "XYZABCIJK")
_HEAD = r"[ \t]*(?:[Nn][0-9]{1,9}[ \t]*)?(?:[Gg]0?([0123])(?![ \t]*[0-9.])[ \t]*)?"
_match = re.compile(rf"{_HEAD}{_AXES}(?:[Ff][ \t]*{_NUMBER}[ \t]*)?\r?\Z").match
_CODE = {"0": 0, "1": 10, "2": 20, "3": 30}


def run_plain(c: Controller, motion: ControllerMotion, lines: list[str], line: int) -> tuple[int, int]:
    """Carry out plain blocks from ``line`` on; the line of the first other block, and how many were carried out."""
    state = c.state
    if not (
        state.absolute
        and state.feed_mode in (930, 940)
        and not state.absolute_centre
        and not state.diameter
        and state.compensation == 400
        and motion.splines.spline is None
        and not c.unread
        and c.modal_hole is None
        and state.motion in (0, 10, 20, 30, 800)
    ):
        return line, 0
    if len(c.placed) < 3:
        # which axes have been sent somewhere is noted block by block
        return line, 0
    if c.unplaced:
        c.unplaced = False
        c.changed()
    match = _match
    scale, inch, flat = state.scale, state.scale != 1.0, state.plane == 170
    x, y, z, a, b, cc, u, v, w = state.at
    code = state.motion
    first, count = line, min(len(lines), line + PIECE)
    append, arc = c.track.rows.append, c.track.arc
    inverse = state.feed_mode == 930
    rapid = feed = -1
    while line < count:
        found = match(lines[line])
        if found is None:
            break
        g, sx, sy, sz, sa, sb, sc, si, sj, sk, sf = found.groups()
        new = code if g is None else _CODE[g]
        if sx is None and sy is None and sz is None:
            if sa is None and sb is None and sc is None:
                # no axes: an F, a G or an arc by its centre alone
                break
        elif new == 800:
            break
        if new == 800:
            break
        if new >= 20:
            if not flat or sk is not None or g is None or (si is None and sj is None):
                break
        elif si is not None or sj is not None or sk is not None:
            break
        if inverse and new:
            if sf is None or new != 10:
                break
        elif sf is not None:
            if inverse:
                break
            value = float(sf)
            if value < 0.0 or (new and value * scale == 0.0):
                break
            state.feed, state.feed_turning = value * scale, value
            c.changed()
            rapid = feed = -1
        elif new and state.feed == 0.0:
            break
        here = x, y, z, a, b, cc, u, v, w
        x0, y0, z0 = x, y, z
        if sx is not None:
            x = float(sx) * scale
        if sy is not None:
            y = float(sy) * scale
        if sz is not None:
            z = float(sz) * scale
        line += 1
        if sa is not None or sb is not None or sc is not None:
            if sa is not None:
                a = float(sa)
            if sb is not None:
                b = float(sb)
            if sc is not None:
                cc = float(sc)
            turning = x == x0 and y == y0 and z == z0 and (a, b, cc) != here[3:6]
            if turning and new == 10 and not inverse:
                append((LINE, x, y, z, a, b, cc, u, v, w, c.context(2), line))
                code = new
                continue
        if new == 0:
            if rapid < 0:
                rapid = c.context(0)
            append((RAPID, x, y, z, a, b, cc, u, v, w, rapid, line))
        elif inverse:
            state.at, end = here, (x, y, z, a, b, cc, u, v, w)
            append((LINE, *end, c.straight_context(LINE, end, float(sf)), line))
        else:
            if feed < 0:
                feed = c.context(1)
            if new == 10:
                append((LINE, x, y, z, a, b, cc, u, v, w, feed, line))
            else:
                ci = x0 if si is None else x0 + float(si) * scale
                cj = y0 if sj is None else y0 + float(sj) * scale
                c.line = line
                check_centre(x0, y0, x, y, ci, cj, inch)
                arc((ARC, x, y, z, a, b, cc, u, v, w, feed, line), ci, cj, 1 if new == 30 else -1)
        code = new
    if line != first:
        state.at = (x, y, z, a, b, cc, u, v, w)
        state.motion = code
        motion.drilling.series = None
        motion.splines.tangent = (0.0, 0.0)
    return line, line - first
