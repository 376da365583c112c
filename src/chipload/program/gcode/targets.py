"""Where the words of a block lead, and how fast.

Notation: a word is in units of the text; targets are in mm and degrees. ``@`` is a distance from the origin in X and Y,
``^`` an angle about it.

References: Fanuc B-63944EN-1, "Polar Coordinate Command"; LinuxCNC 2.9, "Polar Coordinates", "G90, G91" and "G93, G94,
G95".
"""

from __future__ import annotations

import math

from chipload.errors import InputError, Severity
from chipload.program.commands import PLANE_AXES
from chipload.program.gcode.controller import PLANES, Controller
from chipload.program.gcode.interpolation import Interpolation
from chipload.program.gcode.state import AXES, LINEAR, Nine, put
from chipload.program.gcode.words import Block


def axes(c: Controller, block: Block) -> dict[int, float]:
    """Axes that the block gives, by index [mm, deg]."""
    words, state = block.words, c.state
    out = {}
    for k, axis in enumerate(AXES):
        if axis in words:
            out[k] = words[axis] * (state.scale if k in LINEAR else 1.0)
    if c.interpolation is not None:
        out = flat_axes(c.interpolation, words, out, state.scale)
    if c.polar is not None:
        out |= from_polar(c, words)
    if c.scaled is not None:
        out |= scaled_targets(c, out)
    if state.diameter and 0 in out:
        out[0] *= 0.5
    return out


def flat_axes(plane: Interpolation, words: dict[str, float], given: dict[int, float], scale: float) -> dict[int, float]:
    """Axes of a block in polar or cylindrical interpolation: the rotary one gives the flat coordinate [mm]."""
    out = {k: value for k, value in given.items() if k != plane.rotary}
    letter = AXES[plane.rotary]
    if plane.writes_flat:
        if letter in words:
            raise InputError(
                f"{letter.upper()}: not in {plane.name}, in which {AXES[plane.flat].upper()} stands for it"
            )
    elif letter in words:
        turned = words[letter]
        out[plane.flat] = turned * scale if plane.radius is None else math.radians(turned) * plane.radius
    elif plane.radius is not None and plane.flat in given:
        raise InputError(f"{AXES[plane.flat].upper()}: not in {plane.name}, in which {letter.upper()} takes its place")
    return out


def from_polar(c: Controller, words: dict[str, float]) -> dict[int, float]:
    """Coordinates in the plane [mm] by radius and angle (G16): the first axis is the radius, the second the angle.

    With G91 an angle counts from the one before, about the same pole; the way there from where the tool stands.
    """
    first, second, _ = PLANE_AXES[PLANES[c.state.plane]]
    radius, angle = AXES[first], AXES[second]
    if c.polar is None or (radius not in words and angle not in words):
        return {}
    if not c.state.absolute and radius in words:
        raise InputError("G16 with a radius in G91: polar coordinates about the present point are not read: write G90")
    if c.polar_words is not words:
        c.polar_words, c.polar_before = words, c.polar
    before = c.polar_before
    r = words[radius] * c.state.scale if radius in words else before[0]
    degrees = words.get(angle, 0.0 if not c.state.absolute else before[1]) + (0.0 if c.state.absolute else before[1])
    c.polar = r, degrees
    x, y = r * math.cos(math.radians(degrees)), r * math.sin(math.radians(degrees))
    if c.state.absolute:
        return {first: x, second: y}
    return {first: x - c.state.at[first], second: y - c.state.at[second]}


def scaled_targets(c: Controller, given: dict[int, float]) -> dict[int, float]:
    """Linear coordinates of a block in scaled or mirrored coordinates (G51, G51.1), in those without."""
    if c.scaled is None:
        return {}
    factors, fixed = c.scaled
    if not c.state.absolute:
        return {k: factors[k] * given[k] for k in given.keys() & {0, 1, 2}}
    return {k: fixed[k] + factors[k] * (given[k] - fixed[k]) for k in given.keys() & {0, 1, 2}}


def end(c: Controller, block: Block) -> Nine:
    """Where the words of the block lead."""
    state = c.state
    given, at = axes(c, block), state.at
    if "@" in block.words or "^" in block.words:
        given |= polar(c, block, given)
    elif not state.absolute:
        given = {k: at[k] + value for k, value in given.items()}
    return put(at, given)


def polar(c: Controller, block: Block, given: dict[int, float]) -> dict[int, float]:
    """X and Y of a pole; ``given``: the axes that the block gives besides."""
    if 0 in given or 1 in given:
        raise InputError("@ and ^: give the end by radius and angle: leave X and Y out")
    state, words = c.state, block.words
    x, y = state.at[0], state.at[1]
    r, angle = math.hypot(x, y), math.degrees(math.atan2(y, x))
    if "^" not in words and r == 0.0:
        raise InputError("@ without ^ from the origin: give the angle")
    if state.absolute:
        r, angle = words.get("@", r / state.scale) * state.scale, words.get("^", angle)
    else:
        r, angle = r + words.get("@", 0.0) * state.scale, angle + words.get("^", 0.0)
    out = {0: r * math.cos(math.radians(angle)), 1: r * math.sin(math.radians(angle))}
    if not state.absolute:
        out |= {k: state.at[k] + value for k, value in given.items()}
    return out


def rate(c: Controller, block: Block, what: str) -> float | None:
    """Of G93 [1/min]; None in other modes, where a feed has to be set."""
    state = c.state
    if state.feed_mode == 930:
        if "f" not in block.words:
            raise InputError(f"{what}: each feed by inverse time (G93) needs its own F")
        return block.words["f"]
    if state.feed == 0.0:
        if c.feed is None:
            raise InputError(f"{what}: the feed is 0 or was never set: give F")
        c.once("nc-feed-given", f"{what}: no F before it: feed_mm_min = {c.feed:g} is taken")
        state.feed = state.feed_turning = c.feed
        c.changed()
    if state.feed_mode == 950:
        if state.surface:
            message = "feed per revolution (G95) with G96: the spindle speed is not known here"
            c.once("nc-feed-unknown", message, Severity.UNPROVEN)
        elif state.speed == 0.0:
            raise InputError(f"{what}: feed per revolution (G95) and no spindle speed: give S")
    return None
