"""The codes that begin and end polar and cylindrical interpolation: G12.1, G13.1, G7.1 and those of a Haas.

G107 of a Haas wraps a linear axis: Y on the cylinder of radius R is the angle Y / R of A, both from 0.

Reference: Fanuc B-63944EN-1, "Polar Coordinate Interpolation", "Cylindrical Interpolation"; Haas Mill Operator's
Manual, "G107 Cylindrical Mapping".
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.program.commands import PLANE_AXES, XY
from chipload.program.gcode.controller import PLANES
from chipload.program.gcode.dialect import NotReadError, leave_out
from chipload.program.gcode.interpolation import Interpolation
from chipload.program.gcode.modal import code_text
from chipload.program.gcode.state import AXES, ZERO

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller
    from chipload.program.gcode.words import Block

POLAR, NO_POLAR, CYLINDER = (121, 1120), (131, 1130), 71
#: cylindrical mapping of a Haas: the text goes on to write the linear axis that is wrapped
MAPPED = 1070
#: linear axis along each rotary one
ALONG = {"a": "x", "b": "y", "c": "z"}
#: largest radius of a cylinder [mm], and what counts as beside the axis [mm]
LARGEST, BESIDE = 1e5, 1e-6
#: codes that another code must end before: they change coordinates or the plane
EXCLUDED = frozenset({160, 170, 180, 190, 200, 210, 280, 300, 510, 511, 520, 530, 680, 682, 920}) | frozenset(
    range(540, 600, 10)
)


def refuse_within(block: Block, c: Controller) -> None:
    """Refuse codes that change coordinates within such a plane.

    Raises
    ------
    NotReadError
        The block has one.
    """
    wrong = [code for code in block.g if code in EXCLUDED]
    if c.interpolation is not None and wrong:
        raise NotReadError(f"{code_text(wrong[0])} within {c.interpolation.name}")


def change_plane(block: Block, c: Controller) -> None:
    """Carry out the codes of the block that begin or end such a plane."""
    words, g = block.words, block.g
    own = [code for code in g if code in (*POLAR, *NO_POLAR, CYLINDER, MAPPED)]
    now = c.interpolation
    if not own:
        return
    code = own[0]
    g.remove(code)
    if now is not None and (code in NO_POLAR or code in (CYLINDER, MAPPED)):
        c.not_compensated(code_text(code))
        c.interpolate(None)
        words.clear()
        return
    if code in NO_POLAR or (code == MAPPED and not words):
        return
    reason = _begin(code, words, c)
    words.clear()
    if reason:
        leave_out(c, f"{code_text(code)}: {reason}")


def _begin(code: int, words: dict[str, float], c: Controller) -> str:
    """Begin a plane; why it cannot be, empty if it can."""
    c.not_compensated(code_text(code))
    at = c.state.at
    turns = "" if c.swivel is None else "".join(axis.letter.lower() for axis in c.swivel.machine.chain.rotary)
    if code in POLAR:
        if "c" not in turns:
            return "polar interpolation, and no machine with an axis C"
        if abs(at[1]) > BESIDE:
            return f"polar interpolation beside the axis: Y = {at[1]:g} mm"
        c.interpolate(Interpolation(code_text(code), 5, 0, 1, None, at[1], at[5], c.state.plane, at, XY))
        c.state.plane = 170
        return ""
    if code == MAPPED:
        return _begin_mapping(words, c, turns)
    given = [letter for letter in "abc" if letter in words]
    if len(given) != 1 or not 0.0 <= words[given[0]] * c.state.scale <= LARGEST:
        raise NotReadError(f"{code_text(code)}: must name one rotary axis with the radius of the cylinder")
    letter = given[0]
    radius = words[letter] * c.state.scale
    if radius == 0.0:
        # G7.1 C0 ends what did not begin
        return ""
    if letter not in turns:
        return f"cylindrical interpolation, and no machine with an axis {letter.upper()}"
    linear, plane = AXES.index(ALONG[letter]), PLANES[c.state.plane]
    first, second, _ = PLANE_AXES[plane]
    if linear not in (first, second):
        plane_word = code_text(c.state.plane)
        return f"cylindrical interpolation about {letter.upper()} in the plane of {plane_word}, which it is not in"
    flat = second if linear == first else first
    name = code_text(code)
    made = Interpolation(name, AXES.index(letter), linear, flat, radius, at[flat], ZERO[0], c.state.plane, at, plane)
    c.interpolate(made)
    return ""


def _begin_mapping(words: dict[str, float], c: Controller, turns: str) -> str:
    """Begin to wrap a linear axis (G107 A0 Y0 R20.); why it cannot be, empty if it can."""
    at, name, scale = c.state.at, code_text(MAPPED), c.state.scale
    rotary, linear = [x for x in "abc" if x in words], [x for x in "xyz" if x in words]
    if len(rotary) != 1 or len(linear) != 1:
        raise NotReadError(f"{name}: must name one rotary axis and the linear axis that is wrapped about it")
    letter, wrapped = rotary[0], linear[0]
    radius = scale * (words["r"] if "r" in words else 0.5 * words.get("q", 0.0))
    if letter not in turns:
        return f"cylindrical mapping, and no machine with an axis {letter.upper()}"
    if not 0.0 < radius <= LARGEST:
        return "cylindrical mapping whose radius (R) or diameter (Q) is not stated: Setting 34 gives it"
    along, flat, plane = AXES.index(ALONG[letter]), AXES.index(wrapped), PLANES[c.state.plane]
    if {along, flat} != set(PLANE_AXES[plane][:2]):
        plane_word = code_text(c.state.plane)
        return f"cylindrical mapping of {wrapped.upper()} about {letter.upper()} in the plane of {plane_word}"
    if words[letter] != 0.0 or words[wrapped] != 0.0 or abs(at[flat]) > BESIDE:
        return f"cylindrical mapping that does not begin at {wrapped.upper()}0, with {letter.upper()}0 there"
    made = Interpolation(
        name, AXES.index(letter), along, flat, radius, at[flat], ZERO[0], c.state.plane, at, plane, writes_flat=True
    )
    c.interpolate(made)
    return ""
