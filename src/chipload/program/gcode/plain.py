"""Blocks of motion and numbers alone, read fast.

Notation: such a block is ``N G X Y Z A B C I J K F`` in this order, each once at most, G one of 0 to 3, every value a
plain number. All other blocks take the long way; a test holds both ways against each other.
"""

from __future__ import annotations

import re

from chipload.program.commands import ARC, LINE, RAPID
from chipload.program.gcode.arcs import check_centre
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.modal import GROUP_ONE
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
    if not _ready(c, motion):
        return line, 0
    if c.unplaced:
        c.unplaced = False
        c.changed()
    state, match, append, arc = c.state, _match, c.track.rows.append, c.track.arc
    scale, inch, flat, inverse = state.scale, state.scale != 1.0, state.plane == 170, state.feed_mode == 930
    x, y, z, a, b, cc, u, v, w = state.at
    code, first, count, tilted = state.motion, line, min(len(lines), line + PIECE), state.datum.tilt is not None
    rapid = feed = -1
    pointless, together = c.pointless, bool(c.turning_rule) and not state.tcp
    while line < count:
        found = match(lines[line])
        if found is None or (pointless is not None and pointless.search(lines[line]) is not None):
            break
        g, sx, sy, sz, sa, sb, sc, si, sj, sk, sf = found.groups()
        new = code if g is None else _CODE[g]
        linear = not (sx is None and sy is None and sz is None)
        turning = not (sa is None and sb is None and sc is None)
        # without axes it is an F, a G or an arc by its centre alone
        if not (linear or turning) or (turning and tilted) or new == 800 or not _centre_suits(new, g, si, sj, sk, flat):
            break
        if inverse:
            if (sf is None or new != 10) if new else sf is not None:
                break
        elif sf is not None:
            if not _take_feed(c, float(sf), new):
                break
            rapid = feed = -1
        elif new and state.feed == 0.0:
            break
        here = x, y, z, a, b, cc, u, v, w
        x0, y0, z0 = x, y, z
        x = x if sx is None else float(sx) * scale
        y = y if sy is None else float(sy) * scale
        z = z if sz is None else float(sz) * scale
        if turning:
            a = a if sa is None else float(sa)
            b = b if sb is None else float(sb)
            cc = cc if sc is None else float(sc)
        line += 1
        if new == 0:
            if rapid < 0:
                rapid = c.context(0)
            append((RAPID, x, y, z, a, b, cc, u, v, w, rapid, line))
        elif inverse:
            state.at, end = here, (x, y, z, a, b, cc, u, v, w)
            append((LINE, *end, c.straight_context(LINE, end, float(sf)), line))
        elif turning and new == 10 and together:
            state.at, end = here, (x, y, z, a, b, cc, u, v, w)
            append((LINE, *end, c.straight_context(LINE, end, None), line))
        elif turning and new == 10 and (x, y, z) == (x0, y0, z0) and (a, b, cc) != here[3:6]:
            append((LINE, x, y, z, a, b, cc, u, v, w, c.context(2), line))
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
        state.group_one = code if code in GROUP_ONE else state.group_one
        motion.drilling.end()
        motion.splines.tangent = (0.0, 0.0)
    return line, line - first


def _ready(c: Controller, motion: ControllerMotion) -> bool:
    """Whether the modes are those of plain blocks; which axes have been sent somewhere is noted block by block."""
    state = c.state
    return (
        state.absolute
        and not c.in_corner
        and state.feed_mode in (930, 940)
        and not state.absolute_centre
        and not state.diameter
        and state.compensation == 400
        and motion.splines.spline is None
        and not c.unread
        and not c.left_out
        and c.polar is None
        and c.interpolation is None
        and c.scaled is None
        and c.modal_macro is None
        and c.modal_hole is None
        and c.modal_program is None
        and not c.points.tangent
        and state.motion in (0, 10, 20, 30, 800)
        and len(c.placed) == 3
    )


def _centre_suits(new: int, g: str | None, i: str | None, j: str | None, k: str | None, flat: bool) -> bool:
    """Whether I, J and K suit the code: an arc has its G and a centre in XY, a straight motion none."""
    if new >= 20:
        return flat and k is None and g is not None and not (i is None and j is None)
    return i is None and j is None and k is None


def _take_feed(c: Controller, value: float, new: int) -> bool:
    """Take F; False where the slow way has to refuse it."""
    state = c.state
    if value < 0.0 or (new and value * state.scale == 0.0):
        return False
    state.feed, state.feed_turning = value * state.scale, value
    c.changed()
    return True
