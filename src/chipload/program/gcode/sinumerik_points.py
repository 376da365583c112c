"""Points of a Sinumerik that are not stated by coordinates: polar, by an angle, arcs by three points or their angle.

Notation: in the plane of G17 to G19 with the axes u and v. G110, G111 and G112 set the pole: from where the tool
stands, from the zero, from the last pole; without one the zero is the pole. RP radius [units of the text] and AP angle
[deg] about it; the one that is missing is that of the block before. ANG [deg] direction of a line from the first axis,
with one of its coordinates. AR [deg] angle of an arc, with its centre or with its end. CIP goes through the point I1 J1
K1, CT goes on in the direction of the motion before it; both last until another motion.

Reference: Siemens, SINUMERIK 840D sl Programming Manual Fundamentals, "Polar coordinates", "Circular interpolation".
Differs from source: CIP lies in the plane, with no height of its own.
"""

from __future__ import annotations

import cmath
import math

from chipload.errors import InputError
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.words import Block

#: axes of each plane, the letters of an arc's centre and of a point on it
PLANES = {170: ("x", "y", "i", "j"), 180: ("z", "x", "k", "i"), 190: ("y", "z", "j", "k")}
#: words of a point, besides its coordinates
POINT_WORDS = frozenset({"RP", "AP", "ANG", "AR", "I1", "J1", "K1"})
POLES = (110, 111, 112)
#: codes of motion in tenths
LINES, CLOCKWISE, COUNTER = (0, 10), 20, 30


def place_points(block: Block, c: Controller, values: list[tuple[str, str, float]]) -> None:
    """Put coordinates for the words of a point, ``block.point``, and set the pole of ``block.pole``.

    Raises
    ------
    NotReadError, InputError
        The words do not determine a point.
    """
    memory = c.points
    if {0, 10, 20, 30, 330} & set(block.g):
        memory.circle = memory.tangent = False
    if block.circle or block.tangent:
        memory.circle, memory.tangent = block.circle, block.tangent
    named = block.words.keys() | {letter for letter, _, _ in values}
    if not block.point and block.pole is None and not ((memory.circle or memory.tangent) and named & set("xyz")):
        return
    plane = next((g for g in reversed(block.g) if g in PLANES), c.state.plane)
    if plane not in PLANES:
        raise NotReadError("points by an angle lie in the planes of G17, G18 and G19")
    if c.scaled is not None:
        raise NotReadError("points by an angle in mirrored or scaled coordinates")
    u, v, iu, iv = PLANES[plane]
    coordinates = _plane_values(block, c, values, (u, v))
    here = complex(*(c.state.at["xyz".index(x)] / c.state.scale for x in (u, v)))
    if block.pole is not None:
        base = {110: here, 111: 0j, 112: memory.pole}[block.pole]
        memory.pole = base + complex(coordinates.get(u, 0.0), coordinates.get(v, 0.0))
        return
    point = block.point
    motion = next((g for g in reversed(block.g) if g in (0, 10, 20, 30)), c.state.motion)
    if memory.tangent:
        _tangent_arc(block, c, values, here, coordinates, (u, v, iu, iv))
    elif memory.circle:
        _arc_through_point(block, values, here, coordinates, (u, v, iu, iv))
    elif "RP" in point or "AP" in point:
        radius, angle = memory.polar
        if "RP" in point:
            radius = point["RP"][1]
        if "AP" in point:
            angle = point["AP"][1] + (angle if point["AP"][0] == "IC" else 0.0)
        memory.polar = [radius, angle]
        _put(block, values, (u, v), memory.pole + cmath.rect(radius, math.radians(angle)))
        if motion in (CLOCKWISE, COUNTER) and not {iu, iv, "r"} & block.words.keys():
            _centre(block, (iu, iv), memory.pole - here)
    elif "ANG" in point:
        _line(block, values, here, coordinates, point["ANG"][1], (u, v))
    elif "AR" in point:
        _arc_by_angle(block, values, here, coordinates, (motion, point["AR"][1]), (u, v, iu, iv))


def _plane_values(
    block: Block, c: Controller, values: list[tuple[str, str, float]], axes: tuple[str, str]
) -> dict[str, float]:
    """Take the coordinates of the plane out of a block: absolute, in units of the text."""
    absolute = 910 not in block.g and (c.state.absolute or 900 in block.g)
    out: dict[str, float] = {}
    for x in axes:
        here = c.state.at["xyz".index(x)] / c.state.scale
        if x in block.words:
            value = block.words.pop(x)
            # the coordinates of G111 are always those of the zero, those of G110 and G112 distances
            out[x] = value if absolute or block.pole is not None else here + value
    for entry in list(values):
        if entry[0] in axes:
            values.remove(entry)
            here = c.state.at["xyz".index(entry[0])] / c.state.scale
            out[entry[0]] = entry[2] + (here if entry[1] == "IC" else 0.0)
    return out


def _put(block: Block, values: list[tuple[str, str, float]], axes: tuple[str, str], at: complex) -> None:
    """Let a block end in a point, in absolute coordinates."""
    values += [(axes[0], "AC", at.real), (axes[1], "AC", at.imag)]


def _centre(block: Block, letters: tuple[str, str], from_here: complex) -> None:
    block.words[letters[0]], block.words[letters[1]] = from_here.real, from_here.imag


def _line(
    block: Block, values: list[tuple[str, str, float]], here: complex, coordinates: dict[str, float], angle: float,
    axes: tuple[str, str],
) -> None:  # fmt: skip
    """A line in a direction up to one coordinate."""
    if len(coordinates) != 1:
        raise NotReadError("ANG: needs one coordinate of the end in its plane")
    direction = cmath.rect(1.0, math.radians(angle))
    if axes[0] in coordinates:
        along, by = coordinates[axes[0]] - here.real, direction.real
    else:
        along, by = coordinates[axes[1]] - here.imag, direction.imag
    if abs(by) < 1e-9 and abs(along) > 1e-9:
        raise InputError(f"ANG={angle:g}: a line in this direction does not reach the coordinate of its end")
    _put(block, values, axes, here + direction * (along / by if abs(by) >= 1e-9 else 0.0))


def _arc_by_angle(
    block: Block, values: list[tuple[str, str, float]], here: complex, coordinates: dict[str, float],
    of: tuple[int, float], names: tuple[str, str, str, str],
) -> None:  # fmt: skip
    """An arc by its angle with its centre or its end."""
    u, v, iu, iv = names
    motion, angle = of
    if not 0.0 < angle < 360.0 or motion not in (CLOCKWISE, COUNTER):
        raise InputError(f"AR={angle:g}: must be above 0 and below 360, with G2 or G3")
    if coordinates:
        end = complex(coordinates.get(u, here.real), coordinates.get(v, here.imag))
        half = 0.5 * math.radians(angle)
        sign = 1.0 if motion == COUNTER else -1.0
        chord = end - here
        _centre(block, (iu, iv), 0.5 * chord + sign * 0.5j * chord / math.tan(half))
        _put(block, values, (u, v), end)
        return
    if not {iu, iv} & ({*block.words} | {entry[0] for entry in values}):
        raise NotReadError(f"AR={angle:g}: needs the centre or the end of the arc")
    centre = here + complex(block.words.get(iu, 0.0), block.words.get(iv, 0.0))
    for entry in values:
        if entry[0] in (iu, iv) and entry[1] != "IC":
            centre = complex(entry[2], centre.imag) if entry[0] == iu else complex(centre.real, entry[2])
    turn = math.radians(angle if motion == COUNTER else -angle)
    _put(block, values, (u, v), centre + (here - centre) * cmath.rect(1.0, turn))


def _tangent_arc(
    block: Block, c: Controller, values: list[tuple[str, str, float]], here: complex, coordinates: dict[str, float],
    names: tuple[str, str, str, str],
) -> None:  # fmt: skip
    """CT: the arc that leaves here in the direction of the motion before it, or a line where its end lies ahead."""
    u, v, iu, iv = names
    heading = None
    if c.state.compensation == 400 and not c.in_corner:
        heading = c.track.heading("xyz".index(u), "xyz".index(v))
    if heading is None:
        raise NotReadError("CT: the direction before it is not known here: its motion is left out")
    chord = complex(coordinates.get(u, here.real), coordinates.get(v, here.imag)) - here
    across = (chord / (1j * heading)).real
    if abs(across) < 1e-9 * max(abs(chord), 1e-9):
        block.g.append(LINES[1])
    else:
        block.g.append(COUNTER if across > 0.0 else CLOCKWISE)
        _centre(block, (iu, iv), 1j * heading * abs(chord) ** 2 / (2.0 * across))
    _put(block, values, (u, v), here + chord)


def _arc_through_point(
    block: Block, values: list[tuple[str, str, float]], here: complex, coordinates: dict[str, float],
    names: tuple[str, str, str, str],
) -> None:  # fmt: skip
    """CIP: the arc from here through a point to the end."""
    u, v, iu, iv = names
    middle = here
    for k, letter in enumerate((iu, iv)):
        if f"{letter.upper()}1" in block.point:
            how, value = block.point[f"{letter.upper()}1"]
            part = value + ((here.real, here.imag)[k] if how == "IC" else 0.0)
            middle = complex(part, middle.imag) if k == 0 else complex(middle.real, part)
    end = complex(coordinates.get(u, here.real), coordinates.get(v, here.imag))
    a, b = middle - here, end - here
    area = (a.conjugate() * b).imag
    if abs(area) < 1e-9 * max(abs(a) * abs(b), 1e-9):
        raise InputError("CIP: its three points lie on a line, or two of them in one place")
    centre = 1j * (b * abs(a) ** 2 - a * abs(b) ** 2) / (-2.0 * area)
    # the arc passes the middle point: it turns as the three points do
    block.g.append(COUNTER if area > 0.0 else CLOCKWISE)
    _centre(block, (iu, iv), centre)
    _put(block, values, (u, v), end)
