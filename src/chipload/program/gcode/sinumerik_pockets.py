"""POCKET3 and POCKET4 of a Sinumerik: rectangular and circular pockets.

Notation: POCKET3(RTP, RFP, SDIS, DP, LENG, WID, CRAD, PA, PO, STA, MID, FAL, FALD, FFP1, FFD, CDIR, VARI, MIDA, AP1,
AP2, AD, RAD1, DP1): retraction, reference, clearance, depth; length, width and corner radius; the middle PA, PO and the
angle STA of the length; MID at most a pass, FAL and FALD allowances of wall and floor; feeds along and down; CDIR 0
climb, 1 conventional, 2 clockwise, 3 counter-clockwise; VARI 1 roughing, 2 finishing, tens 0 and 1 straight down, 2 on
a helix of RAD1 and DP1, 3 to and fro, which is taken as straight down; MIDA the step, 0: 0.8 diameters. POCKET4 has the
radius PRAD in place of length, width and corner, no STA and no AP2. What is milled before (AP1, AP2, AD) is left out.

Reference: Siemens, SINUMERIK 840D sl Programming Manual Cycles, "Milling cycles".
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from chipload.program.commands import ARC, RAPID
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.state import put
from chipload.program.pocket_cycles import PocketCycle, Step, finish, levels, rough

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller

_RECTANGLE = "RTP RFP SDIS DP LENG WID CRAD PA PO STA MID FAL FALD FFP1 FFD CDIR VARI MIDA AP1 AP2 AD RAD1 DP1"
_CIRCLE = "RTP RFP SDIS DP PRAD PA PO MID FAL FALD FFP1 FFD CDIR VARI MIDA AP1 AD RAD1 DP1"
#: arguments of each cycle
POCKETS = {"POCKET3": tuple(_RECTANGLE.split()), "POCKET4": tuple(_CIRCLE.split())}
#: step of a cycle without MIDA, in diameters
USUAL_STEP = 0.8
_NUMBERS = frozenset({"STA", "CDIR", "VARI"})


def mill_pocket(name: str, arguments: list[float | None], c: Controller) -> None:
    """Carry out a cycle.

    Raises
    ------
    NotReadError
        An argument that it needs is missing, the plane is not that of G17, or the tool's diameter is not known.
    """
    values = named_values(name, POCKETS[name], _argument_names(name), arguments, c, _NUMBERS)
    radius = begin_cycle(name, values, c)
    place, turn = complex(values["PA"], values["PO"]), cmath.rect(1.0, math.radians(values.get("STA", 0.0)))
    carry_out(_steps(name, values, radius, c), place, turn, values, c)


def _argument_names(name: str) -> tuple[str, ...]:
    return "RTP", "RFP", "DP", "PA", "PO", "MID", *(("PRAD",) if name == "POCKET4" else ("LENG", "WID"))


def named_values(
    name: str,
    names: tuple[str, ...],
    needed: tuple[str, ...],
    arguments: list[float | None],
    c: Controller,
    numbers: frozenset[str],
) -> dict[str, float]:
    """Arguments of a cycle by their names, lengths and feeds in mm.

    Parameters
    ----------
    names : in their order
    needed : those without which it is not read
    numbers : angles and numbers, which no unit changes

    Raises
    ------
    NotReadError
        An argument that it needs is missing.
    """
    scale = c.state.scale
    values = {
        key: value * (1.0 if key in numbers else scale)
        for key, value in zip(names, arguments, strict=False)
        if value is not None
    }
    if missing := [key for key in needed if key not in values]:
        raise NotReadError(f"{name}: {', '.join(missing)} must be given")
    return values


def begin_cycle(name: str, values: dict[str, float], c: Controller) -> float:
    """Radius of the tool [mm] at the beginning of a cycle, and the finding on its way.

    Raises
    ------
    NotReadError
        The plane is not that of G17, the coordinates are changed, or the tool's diameter is not known.
    """
    state = c.state
    if state.plane != 170 or c.scaled is not None or state.compensation != 400:
        raise NotReadError(f"{name}: pockets lie in G17, without G41, G42, MIRROR and SCALE")
    diameter = c.diameters.get(state.tool) or c.find_tool(state.tool, "T").diameter
    if not diameter > 0.0:
        raise NotReadError(
            f"{name}: the diameter of tool {state.tool} is not known: state a [[cutter]] with its number"
        )
    c.leave_out(
        "nc-pocket-path",
        f"{name}: the way of the tool is the control's own: rings or passes of its step are taken; its wall, floor and "
        "passes are those of the cycle",
    )
    return 0.5 * diameter


def carry_out(steps: Iterator[Step], place: complex, turn: complex, values: dict[str, float], c: Controller) -> None:
    """Carry out the steps of a cycle about its place, from RTP and back there; feeds as the state has them."""
    state = c.state
    before = state.feed, state.feed_turning
    todo = list(steps)
    first = place + turn * complex(*todo[0][1:3])
    clear = values["RFP"] + abs(values.get("SDIS", 0.0))
    if state.at[2] < values["RTP"]:
        c.straight(RAPID, put(state.at, {2: values["RTP"]}))
    c.straight(RAPID, put(state.at, {0: first.real, 1: first.imag}))
    c.straight(RAPID, put(state.at, {2: clear}))
    for kind, x, y, z, feed, centre, turns in todo:
        at = place + turn * complex(x, y)
        state.feed = state.feed_turning = feed or before[0]
        c.changed()
        end = put(state.at, {0: at.real, 1: at.imag, 2: z})
        if kind == ARC:
            middle = place + turn * complex(*centre)
            c.arc(end, (middle.real, middle.imag), turns)
        elif end != state.at:
            c.straight(kind, end)
    state.feed, state.feed_turning = before
    c.changed()
    c.straight(RAPID, put(state.at, {2: values["RTP"]}))


def pass_sense(values: dict[str, float]) -> int:
    """Sense of a pass along a wall by CDIR: 1 counter-clockwise, which is climb milling."""
    return -1 if round(values.get("CDIR", 0.0)) in (1, 2) else 1


def _steps(name: str, values: dict[str, float], radius: float, c: Controller) -> Iterator[Step]:
    """Steps of roughing or finishing in the coordinates of the pocket, feeds in mm/min as the state has them."""
    vari = round(values.get("VARI", 1.0))
    clear = values["RFP"] + abs(values.get("SDIS", 0.0))
    feed = values.get("FFP1") or c.state.feed
    if not feed > 0.0:
        raise NotReadError(f"{name}: FFP1, the feed, must be given")
    a, b, corner = (
        (values["PRAD"],) * 3
        if name == "POCKET4"
        else (0.5 * abs(values["LENG"]), 0.5 * abs(values["WID"]), abs(values.get("CRAD", 0.0)))
    )
    helix = vari // 10 % 10 == 2
    pocket = PocketCycle(
        a,
        b,
        corner,
        radius,
        values.get("MIDA") or 2.0 * USUAL_STEP * radius,
        pass_sense(values),
        feed,
        values.get("FFD") or feed,
        abs(values.get("RAD1", 0.0)) if helix else 0.0,
        abs(values.get("DP1", 0.0)) if helix else 0.0,
    )
    allowance, floor = abs(values.get("FAL", 0.0)), abs(values.get("FALD", 0.0))
    if vari % 10 == 2:
        yield from finish(pocket, clear, levels(values["RFP"], values["DP"], abs(values["MID"]), even=True))
    else:
        yield from rough(
            pocket, allowance, clear, levels(values["RFP"], values["DP"] + floor, abs(values["MID"]), even=True)
        )
