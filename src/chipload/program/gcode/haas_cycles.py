"""Cycles of a Haas: hole patterns G70, G71 and G72, circular pockets G12 and G13.

Notation: (x, y) [mm] where the tool stands, or the X Y of the block. A pattern drills the cycle that is active; it is
stated before with L0. A pocket begins at its centre: the tool goes down, out to the wall and back on half circles, and
round once for each radius.

Reference: Haas, Mill Operator's Manual, "G70 Bolt Hole Circle", "G71 Bolt Hole Arc", "G72 Bolt Holes Along an Angle",
"G12 CW and G13 CCW Circular Pocket Milling". Differs from source: the manual draws the way out to the wall without
dimensions; it stays within the pocket.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from chipload.program.commands import LINE
from chipload.program.gcode.cycles import CYCLES
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.modal import code_text
from chipload.program.gcode.state import put
from chipload.program.gcode.words import Block

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller

CIRCLE, ARC_OF_HOLES, LINE_OF_HOLES = 700, 710, 720
POCKETS = {120: -1, 130: 1}
#: holes of a pattern, and circles of a pocket
MOST_HOLES, MOST_CIRCLES = 10_000, 10_000


def hole_pattern(block: Block, c: Controller) -> None:
    """Put the holes of a pattern behind the block, each as a block of its own."""
    code = next((x for x in block.g if x in (CIRCLE, ARC_OF_HOLES, LINE_OF_HOLES)), None)
    words, state = block.words, c.state
    if code is None or not {"i", "l"} <= words.keys() or not c.control.cycles.circles:
        return
    block.g.remove(code)
    cycle = next((x for x in block.g if x in CYCLES), state.motion)
    if cycle not in CYCLES or state.plane != 170 or not state.absolute:
        raise NotReadError(f"{code_text(code)}: holes need an active cycle, G17 and G90")
    count = integer_of(words.pop("l"), "L")
    if not 1 <= count <= MOST_HOLES:
        raise NotReadError(f"{code_text(code)}: L{count}: must be from 1 to {MOST_HOLES}")
    size, angle, step = (words.pop(x, 0.0) for x in "ijk")
    x, y = (words.pop(axis, state.at[k] / state.scale) for k, axis in enumerate("xy"))
    for k in range(count):
        turn = angle + k * (360.0 / count if code == CIRCLE else step if code == ARC_OF_HOLES else 0.0)
        reach = k * size if code == LINE_OF_HOLES else size
        at = math.radians(turn)
        block.after.append(Block(words={"x": x + reach * math.cos(at), "y": y + reach * math.sin(at)}))


def circular_pocket(block: Block, c: Controller) -> bool:
    """Carry out G12 or G13 with I; whether the block is one."""
    code = next((x for x in block.g if x in POCKETS), None)
    words, state = block.words, c.state
    if code is None or "i" not in words:
        return False
    name, scale = code_text(code), state.scale
    if not c.control.cycles.circles:
        raise NotReadError(f"{name}: a circular pocket, which this control does not have")
    if state.plane != 170 or state.compensation != 400:
        raise NotReadError(f"{name}: circular pockets lie in G17, without G41 and G42")
    number = integer_of(words.get("d", 0.0), "D")
    radius = c.offset_radius(name, number, c.find_tool(number, "D").diameter) if number else 0.0
    first, last, step = (words.get(x, 0.0) * scale for x in "ikq")
    sizes = [first]
    if last > 0.0:
        if step <= 0.0 or (last - first) / step > MOST_CIRCLES:
            raise NotReadError(f"{name}: K needs Q above 0, the step from circle to circle")
        while sizes[-1] < last - 1e-9:
            sizes.append(min(sizes[-1] + step, last))
    if sizes[0] <= radius:
        raise NotReadError(f"{name}: I = {first:g} mm: must be above the cutter's radius {radius:g} mm")
    if "f" in words:
        state.feed, state.feed_turning = words["f"] * scale, words["f"]
        c.changed()
    if state.feed == 0.0:
        raise NotReadError(f"{name}: the feed is 0 or was never set: give F")
    depths = integer_of(words.get("l", 1.0), "L") if not state.absolute else 1
    centre = put(state.at, {k: words[x] * scale for k, x in enumerate("xy") if x in words and state.absolute})
    if centre != state.at:
        c.straight(LINE, centre)
    for _ in range(max(1, min(depths, MOST_CIRCLES))):
        if "z" in words:
            z = words["z"] * scale
            c.straight(LINE, put(state.at, {2: z if state.absolute else state.at[2] + z}))
        _circles(c, [size - radius for size in sizes], POCKETS[code])
    return True


def _circles(c: Controller, radii: list[float], sense: int) -> None:
    """Circles about where the tool stands, from the least to the greatest, and back."""
    centre = c.state.at
    x, y = centre[:2]
    for k, r in enumerate(radii):
        out = put(centre, {0: x + r})
        if k == 0:
            c.arc(out, (x + 0.5 * r, y), sense)
        else:
            c.straight(LINE, out)
        c.arc(out, (x, y), sense)
    c.arc(centre, (x + 0.5 * radii[-1], y), sense)
