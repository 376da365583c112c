"""Slots, faces and spigots of a Sinumerik: LONGHOLE, SLOT1, SLOT2 on a circle, CYCLE71, CYCLE76 and CYCLE77.

Notation: NUM slots about CPA, CPO, the first at STA1, INDA [deg] between them, 0: evenly all round. RTP, RFP, SDIS and
DP, or DPR below RFP, are the heights of a pocket; FFD feed down, FFP1 along, MID at most a pass.

* LONGHOLE: as wide as the tool and LENG long, outwards from RAD, so that the middle of the tool goes from RAD + r to
  RAD + LENG - r, down at either end in turn.
* SLOT1: LENG long and WID wide with round ends, outwards from RAD. SLOT2: WID wide along the circle RAD over AFSL
  [deg]. Both: FAL allowance of the wall, FALD of the floor (SLOT1); VARI 0 roughs and finishes, 1 roughs, 2 finishes
  the wall, at most MIDF a pass at the feed FFP2; CDIR as of a pocket.
* CYCLE71: a face from PA, PO over LENG and WID (their signs count), turned by STA; MIDA most between the passes, 0: 0.8
  diameters; FDP beyond the face, FALD left on the floor; VARI tens 1 along the first axis one way, 2 along the second,
  3 and 4 the same to and fro.

* CYCLE76: a spigot of LENG x WID with corners CRAD about PA, PO, turned by STA, out of a blank of AP1 x AP2. CYCLE77:
  one of the diameter PRAD out of the diameter AP1. Without AP1 the allowance FAL alone stands about it. VARI 1 roughs,
  2 finishes.

Reference: Siemens, SINUMERIK 840D sl Programming Manual Cycles, "Milling cycles". The order of the arguments up to the
angle agrees with the reader of another public program, ncplot7py; the rest of it, and that RAD is where a slot begins
(LONGHOLE, SLOT1), or its middle line (SLOT2), are from memory.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from chipload.program.commands import LINE, RAPID
from chipload.program.face_cycles import FaceCycle, face_steps
from chipload.program.gcode.dialect import NotReadError
from chipload.program.gcode.sinumerik_pockets import USUAL_STEP, begin_cycle, carry_out, named_values, pass_sense
from chipload.program.pocket_cycles import PocketCycle, Step, finish, levels, rough, stud
from chipload.program.slot_cycles import ArcSlot, arc_slot_steps

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller

_HEIGHTS = "RTP RFP SDIS DP DPR NUM"
_FACE = "RTP RFP SDIS DP PA PO LENG WID STA"
_SPIGOT = "MID FAL FALD FFP1 FFD CDIR VARI"
_LAST = "CPA CPO RAD STA1 INDA FFD FFP1 MID CDIR FAL VARI MIDF FFP2 SSF"
#: arguments of each cycle
SLOTS = {
    "LONGHOLE": tuple(f"{_HEIGHTS} LENG CPA CPO RAD STA1 INDA FFD FFP1 MID".split()),
    "SLOT1": tuple(f"{_HEIGHTS} LENG WID {_LAST} FALD STA2 DP1".split()),
    "SLOT2": tuple(f"{_HEIGHTS} AFSL WID {_LAST} FFCP".split()),
    "CYCLE71": tuple(f"{_FACE} MID MIDA FDP FALD FFP1 VARI FDP1".split()),
    "CYCLE76": tuple(f"RTP RFP SDIS DP DPR LENG WID CRAD PA PO STA {_SPIGOT} AP1 AP2".split()),
    "CYCLE77": tuple(f"RTP RFP SDIS DP DPR PRAD PA PO {_SPIGOT} AP1".split()),
}
_NEEDED = {
    "LONGHOLE": ("RTP", "RFP", "NUM", "LENG", "CPA", "CPO", "RAD", "STA1"),
    "SLOT1": ("RTP", "RFP", "NUM", "LENG", "WID", "CPA", "CPO", "RAD", "STA1"),
    "SLOT2": ("RTP", "RFP", "NUM", "AFSL", "WID", "CPA", "CPO", "RAD", "STA1"),
    "CYCLE71": ("RTP", "RFP", "DP", "PA", "PO", "LENG", "WID", "MID"),
    "CYCLE76": ("RTP", "RFP", "LENG", "WID", "PA", "PO"),
    "CYCLE77": ("RTP", "RFP", "PRAD", "PA", "PO"),
}
_ANGLES = frozenset({"STA1", "INDA", "AFSL", "STA", "STA2", "NUM", "VARI", "CDIR", "SSF"})
#: cycles at one place
ONE_PLACE = ("CYCLE71", "CYCLE76", "CYCLE77")
#: most slots of one cycle
MOST_SLOTS = 1000


def mill_slots(name: str, arguments: list[float | None], c: Controller) -> None:
    """Carry out a cycle.

    Raises
    ------
    NotReadError
        An argument that it needs is missing, the plane is not that of G17, or the tool's diameter is not known.
    """
    values = named_values(name, SLOTS[name], _NEEDED[name], arguments, c, _ANGLES)
    radius = begin_cycle(name, values, c)
    if "DP" not in values:
        if "DPR" not in values:
            raise NotReadError(f"{name}: DP or DPR must be given")
        values["DP"] = values["RFP"] - abs(values["DPR"])
    if name in ONE_PLACE:
        turn = cmath.rect(1.0, math.radians(values.get("STA", 0.0)))
        steps = _face(values, radius, c) if name == "CYCLE71" else _spigot(values, radius, c)
        carry_out(steps, complex(values["PA"], values["PO"]), turn, values, c)
        return
    count = round(values["NUM"])
    if not 1 <= count <= MOST_SLOTS:
        raise NotReadError(f"{name}: NUM = {values['NUM']:g}: must be from 1 to {MOST_SLOTS}")
    middle, between = complex(values["CPA"], values["CPO"]), values.get("INDA") or 360.0 / count
    for k in range(count):
        turn = cmath.rect(1.0, math.radians(values["STA1"] + k * between))
        if name == "LONGHOLE":
            carry_out(_long_hole(values, radius, c), middle, turn, values, c)
        elif name == "SLOT1":
            place = middle + turn * (values["RAD"] + 0.5 * values["LENG"])
            carry_out(_straight_slot(values, radius, c), place, turn, values, c)
        else:
            carry_out(_arc_slot(values, radius, c), middle, turn, values, c)


def _feeds(values: dict[str, float], c: Controller) -> tuple[float, float]:
    """Feed along and down, as the state has them."""
    feed = values.get("FFP1") or c.state.feed
    if not feed > 0.0:
        raise NotReadError("FFP1, the feed, must be given")
    return feed, values.get("FFD") or feed


def _clear(values: dict[str, float]) -> float:
    return values["RFP"] + abs(values.get("SDIS", 0.0))


def _passes(values: dict[str, float], left: float = 0.0) -> list[float]:
    most = abs(values.get("MID", 0.0)) or values["RFP"] - values["DP"]
    return levels(values["RFP"], values["DP"] + left, most, even=True)


def _long_hole(values: dict[str, float], radius: float, c: Controller) -> Iterator[Step]:
    feed, down = _feeds(values, c)
    ends = [values["RAD"] + radius, values["RAD"] + values["LENG"] - radius]
    if ends[1] < ends[0]:
        raise NotReadError(f"LONGHOLE: LENG = {values['LENG']:g} mm: must be at least the diameter of the tool")
    none = (0.0, 0.0)
    yield RAPID, ends[0], 0.0, _clear(values), 0.0, none, 0
    for k, z in enumerate(_passes(values)):
        here, there = ends[k % 2], ends[1 - k % 2]
        yield LINE, here, 0.0, z, down, none, 0
        yield LINE, there, 0.0, z, feed, none, 0
        last = there
    yield RAPID, last, 0.0, _clear(values), 0.0, none, 0


def _straight_slot(values: dict[str, float], radius: float, c: Controller) -> Iterator[Step]:
    feed, down = _feeds(values, c)
    a, b = 0.5 * values["LENG"], 0.5 * values["WID"]
    slot = PocketCycle(a, b, min(a, b), radius, USUAL_STEP * 2.0 * radius, pass_sense(values), feed, down)
    kind, wall, floor = _parts(values)
    if kind != 2:
        yield from rough(slot, wall, _clear(values), _passes(values, floor))
    if kind == 2 or (kind == 0 and wall + floor > 0.0):
        fine = replace(slot, feed=values.get("FFP2") or feed)
        if floor > 0.0:
            yield from rough(fine, wall, _clear(values), [values["DP"]])
        yield from finish(fine, _clear(values), _finish_levels(values))


def _arc_slot(values: dict[str, float], radius: float, c: Controller) -> Iterator[Step]:
    feed, down = _feeds(values, c)
    sweep, step = math.radians(values["AFSL"]), USUAL_STEP * 2.0 * radius
    slot = ArcSlot(values["RAD"], 0.0, sweep, values["WID"], radius, step, pass_sense(values), feed, down)
    kind, wall, _ = _parts(values)
    if kind != 2:
        yield from arc_slot_steps(slot, wall, _clear(values), _passes(values))
    if kind == 2 or (kind == 0 and wall > 0.0):
        fine = replace(slot, feed=values.get("FFP2") or feed)
        yield from arc_slot_steps(fine, 0.0, _clear(values), _finish_levels(values), wall_only=True)


def _parts(values: dict[str, float]) -> tuple[int, float, float]:
    """VARI and the allowances of wall and floor."""
    return round(values.get("VARI", 0.0)) % 10, abs(values.get("FAL", 0.0)), abs(values.get("FALD", 0.0))


def _finish_levels(values: dict[str, float]) -> list[float]:
    most = abs(values.get("MIDF", 0.0)) or values["RFP"] - values["DP"]
    return levels(values["RFP"], values["DP"], most, even=True)


def _face(values: dict[str, float], radius: float, c: Controller) -> Iterator[Step]:
    feed, _ = _feeds(values, c)
    way = round(values.get("VARI", 31.0)) // 10 % 10
    if way not in (1, 2, 3, 4):
        raise NotReadError(f"CYCLE71: VARI = {values.get('VARI', 31.0):g}: must be 11 to 42")
    turned = way in (2, 4)
    length, width = (values["WID"], values["LENG"]) if turned else (values["LENG"], values["WID"])
    step = values.get("MIDA") or 2.0 * USUAL_STEP * radius
    face = FaceCycle(length, width, radius, step, abs(values.get("FDP", 0.0)), way < 3, False, feed, feed)
    last = round(values.get("VARI", 31.0)) % 10 == 2
    passes = [values["DP"]] if last else _passes(values, abs(values.get("FALD", 0.0)))
    for kind, x, y, z, rate, centre, turns in face_steps(face, _clear(values), passes):
        yield kind, *((y, x) if turned else (x, y)), z, rate, centre, turns


def _spigot(values: dict[str, float], radius: float, c: Controller) -> Iterator[Step]:
    feed, down = _feeds(values, c)
    kind, wall, floor = _parts({"VARI": 1.0, **values})
    if "PRAD" in values:
        a = b = corner = 0.5 * abs(values["PRAD"])
        blank = (0.5 * abs(values.get("AP1", 0.0)),) * 3
    else:
        a, b, corner = 0.5 * abs(values["LENG"]), 0.5 * abs(values["WID"]), abs(values.get("CRAD", 0.0))
        blank = (0.5 * abs(values.get("AP1", 0.0)), 0.5 * abs(values.get("AP2", 0.0)), 0.0)
    around = (a + wall, b + wall, corner + wall)
    if kind == 2 or blank[0] < around[0] or blank[1] < around[1]:
        blank = around
    # climb milling goes clockwise about a spigot
    sense = 1 if round(values.get("CDIR", 0.0)) in (1, 3) else -1
    spigot = PocketCycle(a, b, corner, radius, 2.0 * USUAL_STEP * radius, sense, feed, down)
    passes = _passes(values, floor if kind != 2 else 0.0)
    last: Step | None = None
    for last in stud(spigot, blank, wall if kind != 2 else 0.0, _clear(values), passes):
        yield last
    if last is not None:
        yield RAPID, last[1], last[2], _clear(values), 0.0, (0.0, 0.0), 0
