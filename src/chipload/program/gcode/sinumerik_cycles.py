"""Sinumerik's drilling cycles as blocks of LinuxCNC's: CYCLE81 to CYCLE89.

Notation: RTP retraction plane, RFP reference plane, SDIS safety distance above it, DP final depth (absolute) or DPR
(below RFP, without sign), DTB dwell at the bottom [s]. A cycle goes at rapid to RFP + SDIS, cuts to the bottom, and
ends at rapid in RTP.

CYCLE83 drills to FDEP, or FDPR below RFP, first. Each later plunge is shorter by DAM until it is DAM, and the last two
are alike. DAM below 0 is the factor of each plunge to the one before it, MDEP the least; with 0 all are alike. VARI 0
breaks chips, going back by VRT at the feed; 1 clears them in RFP + SDIS and comes back to DIS1 above the depth so far.
DTB waits at the bottom of each, DTS in RFP + SDIS. FRF, which slows the first, is left out.

CYCLE84 taps with the pitch PIT, or that of the metric size MPIT, at the speed SST. CYCLE87 and CYCLE88 stop at the
bottom, CYCLE89 cuts on its way out. CYCLE840 taps with a floating chuck at the speed that holds; without a pitch at the
feed F, out with the spindle reversed, after DTB. SDAC is the sense of the spindle behind it.

Reference: Siemens, Sinumerik 840D sl Programming Manual Cycles, "Drilling".
"""

from __future__ import annotations

from chipload.errors import InputError
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.cycles import PeckRule
from chipload.program.gcode.words import Block

#: LinuxCNC's code of each cycle
CYCLES = {"CYCLE81": 810, "CYCLE82": 820, "CYCLE83": 830, "CYCLE84": 331, "CYCLE85": 850, "CYCLE86": 860,
          "CYCLE87": 880, "CYCLE88": 880, "CYCLE89": 890, "CYCLE840": 331}  # fmt: skip
#: argument SDIR, the sense of the spindle: 3 or 4
SENSE = {"CYCLE86": 6, "CYCLE87": 5, "CYCLE88": 6}
#: pitch [mm] of metric threads by their size
PITCHES = {
    3: 0.5, 4: 0.7, 5: 0.8, 6: 1.0, 8: 1.25, 10: 1.5, 12: 1.75, 14: 2.0, 16: 2.0, 18: 2.5, 20: 2.5, 22: 2.5, 24: 3.0,
    27: 3.0, 30: 3.5, 33: 3.5, 36: 4.0, 39: 4.0, 42: 4.5, 45: 4.5, 48: 5.0,
}  # fmt: skip
#: plunges of one hole
MOST_PLUNGES = 10_000
#: axis along the tool by plane
NORMAL = {170: "z", 180: "y", 190: "x"}


def hole_blocks(name: str, given: list[float | None], c: Controller) -> list[Block]:
    """The blocks of a cycle where the tool stands.

    Parameters
    ----------
    name : of the cycle
    given : its arguments in their places; None: not given

    Raises
    ------
    InputError
        An argument that the cycle needs is missing, or the plane is none of G17 to G19.
    """
    args = dict(enumerate([*given, *[None] * 20]))
    rtp, rfp, sdis, dp, dpr = (args[k] for k in range(5))
    if rtp is None or rfp is None or (dp is None and dpr is None):
        raise InputError(f"{name}: RTP, RFP and DP or DPR must be given")
    normal = NORMAL.get(c.state.plane)
    if normal is None:
        raise InputError(f"{name}: cycles lie in the planes of G17, G18 and G19")
    bottom = dp if dp is not None else rfp - abs(dpr or 0.0)
    r = rfp + abs(sdis or 0.0)
    code, dwell = CYCLES[name], args[5] or 0.0
    cut = Block(words={normal: bottom, "r": r}, g=[900, 990, code])
    begin = Block(words={normal: r}, g=[900, 0])
    if name in ("CYCLE82", "CYCLE86", "CYCLE88", "CYCLE89"):
        cut.words["p"] = dwell
    if name == "CYCLE87":
        cut.words["p"] = 0.0
    if name == "CYCLE83":
        _pecks(cut, args, rfp, bottom, c)
    if name == "CYCLE84":
        cut = _tap(cut, args, c, normal, bottom)
    if name == "CYCLE840":
        cut = _floating_tap(cut, args, c, normal, bottom)
    if name == "CYCLE85" and args[6] is not None:
        cut.words["f"] = args[6]
    sense = args[SENSE[name]] if name in SENSE else None
    if sense in (3.0, 4.0):
        cut.m = [int(sense or 3.0)]
    after = Block(words={normal: rtp}, g=[0])
    ends = [Block(g=[910])] if not c.state.absolute else []
    if name == "CYCLE84" and args[6] in (3.0, 4.0, 5.0):
        after.m = [int(args[6] or 5.0)]
    if name == "CYCLE840" and args[7] in (3.0, 4.0, 5.0):
        after.m = [int(args[7] or 5.0)]
    if c.state.motion == 10:
        ends.append(Block(g=[10]))
    return [begin, cut, after, *ends]


def _pecks(cut: Block, args: dict[int, float | None], rfp: float, bottom: float, c: Controller) -> None:
    first, below = args[5], args[6]
    depth = rfp - first if first is not None else abs(below) if below is not None else None
    if depth is None or depth <= 0.0:
        raise InputError("CYCLE83: FDEP or FDPR must lie below RFP")
    total, clears = rfp - bottom, args[11] == 1.0
    if (args[10] or 1.0) != 1.0:
        c.once("nc-cycle", f"CYCLE83: FRF = {args[10]:g}: the first plunge is taken at the feed of the others")
    # what the cycle takes where VRT and DIS1 are 0: 1 mm, and 0.6 mm to a depth of 30 mm, then a fiftieth, at most 7 mm
    small = 0.6 / c.state.scale if total * c.state.scale <= 30.0 else min(total / 50.0, 7.0 / c.state.scale)
    back = (args[16] or small) if clears else (args[14] or 1.0 / c.state.scale)
    heights = tuple(rfp - reached for reached in plunges(total, depth, args[7] or 0.0, args[13] or 0.0))
    pause, dwell = (max(args[9] or 0.0, 0.0) if clears else 0.0), max(args[8] or 0.0, 0.0)
    c.pecks = PeckRule(heights=heights, back=abs(back), pause=pause, dwell=dwell)
    cut.words["q"] = depth
    cut.g[-1] = 830 if clears else 730


def plunges(total: float, first: float, degression: float, least: float = 0.0) -> list[float]:
    """Depths that the plunges of CYCLE83 reach, the whole one last.

    Parameters
    ----------
    total, first : depth of the hole and of the first plunge
    degression : by which a plunge is shorter than the one before it; below 0: the factor between them
    least : shortest plunge by a factor

    >>> plunges(20.0, 5.0, 2.0)
    [5.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0]
    >>> plunges(17.0, 5.0, 2.0)
    [5.0, 8.0, 10.0, 12.0, 14.0, 15.5, 17.0]
    >>> plunges(12.0, 5.0, 0.0)
    [5.0, 10.0, 12.0]
    >>> plunges(9.0, 4.0, -0.5, 1.0)
    [4.0, 6.0, 7.0, 8.0, 9.0]
    """
    reached, last = [min(first, total)], first
    while (rest := total - reached[-1]) > 1e-9:
        if len(reached) == MOST_PLUNGES:
            raise InputError(f"CYCLE83: makes more than {MOST_PLUNGES} plunges: raise FDPR, DAM or MDEP")
        if degression > 0.0:
            last = max(last - degression, degression)
            if last == degression and degression < rest <= 2.0 * degression:
                last = 0.5 * rest
                reached.append(total - last)
        elif degression < 0.0:
            last = max(last * abs(degression), least)
        reached.append(total if last >= rest - 1e-9 else reached[-1] + last)
    return reached


def _tap(cut: Block, args: dict[int, float | None], c: Controller, normal: str, bottom: float) -> Block:
    pitch, speed = _pitch(args[7], args[8], c), args[10]
    if not pitch:
        raise InputError("CYCLE84: PIT, or the metric size MPIT, must be given")
    if speed is None:
        raise InputError("CYCLE84: SST must be given: the spindle speed of tapping")
    words = {normal: bottom, "k": abs(pitch), "s": speed}
    return Block(words=words, g=[900, 331], m=[3 if pitch > 0.0 else 4])


def _pitch(size: float | None, pitch: float | None, c: Controller) -> float:
    """Pitch [units of the text] by PIT, else by the metric size MPIT; 0: neither is given."""
    if pitch is None and size is not None:
        return PITCHES.get(round(abs(size)), 0.0) * (1.0 if size > 0.0 else -1.0) / c.state.scale
    return pitch or 0.0


def _floating_tap(cut: Block, args: dict[int, float | None], c: Controller, normal: str, bottom: float) -> Block:
    pitch = _pitch(args[9], args[10], c)
    if pitch:
        sense = [] if c.state.sense else [3 if pitch > 0.0 else 4]
        return Block(words={normal: bottom, "k": abs(pitch)}, g=[900, 331], m=sense)
    cut.g[-1] = 840 if c.state.sense >= 0 else 740
    cut.words["p"] = args[5] or 0.0
    cut.m = [] if c.state.sense else [3]
    return cut
