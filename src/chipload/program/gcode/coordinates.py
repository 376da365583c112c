"""Polar, scaled and mirrored coordinates: G16, G51, G51.1 of a Fanuc and a Haas, MIRROR and SCALE of a Sinumerik.

Notation: a coordinate x of the text lies at f (x - p) + p of the work offset, f the factor of its axis and p the point
that stays. A mirror is a factor of -1; one mirrored axis of the plane turns G2 into G3 and G41 into G42.

Reference: Fanuc B-63944EN-1, "Polar Coordinate Command", "Scaling", "Programmable Mirror Image"; Haas Mill Operator's
Manual, "G51 Scaling", "G101 Enable Mirror Image".
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from chipload.program.commands import PLANE_AXES
from chipload.program.gcode.cycles import CYCLES
from chipload.program.gcode.dialect import NotReadError, leave_out

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller
    from chipload.program.gcode.words import Block

POLAR, NO_POLAR, SCALED, UNSCALED = 160, 150, 510, 500
#: mirrors of a Fanuc and of a Haas, and what ends them
MIRRORED, UNMIRRORED = (511, 1010), (501, 1000)
#: codes that exchange in one mirrored axis of the plane
EXCHANGED = {20: 30, 30: 20, 410: 420, 420: 410}
_UNCHANGED = (1.0, 1.0, 1.0)


def change_coordinates(block: Block, c: Controller) -> None:
    """Carry out the codes of the block that begin or end such coordinates, and its words that depend on them."""
    words, g = block.words, block.g
    for code in [code for code in g if code in (POLAR, NO_POLAR)]:
        g.remove(code)
        radius = PLANE_AXES[_plane(block, c)][0]
        c.polar = (c.state.at[radius], 0.0) if code == POLAR else None
        if code == POLAR and not (c.state.absolute or 900 in g):
            c.polar = None
            leave_out(c, "G16: polar coordinates about the present point (G91)")
            words.clear()
    if SCALED in g:
        g.remove(SCALED)
        _scale(words, c)
    for code in [code for code in g if code in MIRRORED]:
        g.remove(code)
        factors, fixed = map(list, c.scaled or (_UNCHANGED, (0.0, 0.0, 0.0)))
        for k, axis in enumerate("xyz"):
            if axis in words:
                factors[k] = -abs(factors[k])
                value = words.pop(axis) * c.state.scale
                fixed[k] = value if code == 511 else 0.0
        c.scaled = _triple(factors), _triple(fixed)
    if UNSCALED in g:
        g.remove(UNSCALED)
        c.scaled = None
    for code in [code for code in g if code in UNMIRRORED]:
        g.remove(code)
        if c.scaled is not None:
            ended = [k for k, axis in enumerate("xyz") if axis in words] or [0, 1, 2]
            factors = [abs(f) if k in ended else f for k, f in enumerate(c.scaled[0])]
            c.scaled = None if tuple(factors) == _UNCHANGED else (_triple(factors), c.scaled[1])
        for axis in "xyz":
            words.pop(axis, None)
    if c.scaled is not None:
        words_of_arcs(block, c, c.scaled[0])


def _scale(words: dict[str, float], c: Controller) -> None:
    """G51: about X Y Z, where it is without them, by P or by I J K of each axis; without a point 1000 is 1."""
    at = c.state.at
    fixed = [words.pop(axis) * c.state.scale if axis in words else at[k] for k, axis in enumerate("xyz")]
    if "p" in words:
        p = words.pop("p")
        factors = [p / 1000.0 if p >= 100.0 else p] * 3
    elif words.keys() & {"i", "j", "k"}:
        factors = [words.pop(x, 1.0) for x in "ijk"]
        factors = [f / 1000.0 if abs(f) >= 100.0 else f for f in factors]
    else:
        raise NotReadError("G51 without P: its factor is a setting of the control")
    c.scaled = _triple(factors), _triple(fixed)


def factor_axes(c: Controller, factors: Mapping[str, float]) -> None:
    """Further factors of axes about the origin (MIRROR and SCALE of a Sinumerik)."""
    old, fixed = c.scaled or (_UNCHANGED, (0.0, 0.0, 0.0))
    new = [f * factors.get(axis, 1.0) for f, axis in zip(old, "xyz", strict=True)]
    c.scaled = None if tuple(new) == _UNCHANGED else (_triple(new), fixed)


def words_of_arcs(block: Block, c: Controller, factors: tuple[float, float, float]) -> None:
    """Sense, centre and radius of an arc and side of compensation in coordinates scaled by the factors of the axes."""
    words = block.words
    first, second, _ = PLANE_AXES[_plane(block, c)]
    for code in [code for code in block.g if code in EXCHANGED and factors[first] * factors[second] < 0.0]:
        block.g[block.g.index(code)] = EXCHANGED[code]
    motion = next((code for code in block.g if code in (0, 10, 20, 30) or code in CYCLES), c.state.motion)
    if motion not in (20, 30):
        if motion in CYCLES and (factors[2] != 1.0 or not c.state.absolute):
            raise NotReadError("a cycle in coordinates that are scaled or mirrored along Z, or in G91")
        return
    if abs(factors[first]) != abs(factors[second]):
        raise NotReadError("G51: an arc with two factors is none")
    for k, letter in enumerate("ijk"):
        if letter in words:
            words[letter] *= factors[k]
    if "r" in words:
        words["r"] *= abs(factors[first])


def _plane(block: Block, c: Controller) -> int:
    code = next((code for code in block.g if code in (170, 180, 190)), c.state.plane)
    return {170: 0, 180: 1, 190: 2}.get(code, 0)


def _triple(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z
