"""The ``[[cutter]]`` table of a draft: values that sources state, and guesses for the rest, by the kind of the tool."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

from chipload.cutter.bodies import cylinder, tap_core
from chipload.jobs.drafts.draft import DraftTable, Entry
from chipload.program.tapping import COARSE
from chipload.program.tool_words import Stated, ToolKind, kind_of

#: keys that a cutter has, in the order of the file
KEYS = (
    "diameter_mm", "corner_radius_mm", "barrel_radius_mm", "corner_e_mm", "bottom_deg", "taper_deg",
    "flutes", "helix_deg", "flute_length_mm",
    "overhang_mm", "shank_diameter_mm", "modulus_gpa", "tool_material", "body_mm", "thread_pitch_mm",
)  # fmt: skip
#: keys of a tool that is a body: nothing else has an effect
BODY_KEYS = ("flute_length_mm", "overhang_mm", "body_mm", "thread_pitch_mm")
#: kinds that are checked as bodies, whose chips are not simulated
BODIES = (ToolKind.TAP, ToolKind.THREAD_MILL, ToolKind.DOVETAIL, ToolKind.LOLLIPOP, ToolKind.PROBE)
#: half a point's complement [deg] of each kind that has a point, and why
POINTS = {
    ToolKind.DRILL: (31.0, "a point of 118 deg, usual for drills"),
    ToolKind.SPOT: (45.0, "a point of 90 deg"),
    ToolKind.CHAMFER: (45.0, "a point of 90 deg, usual for chamfers"),
    ToolKind.COUNTERSINK: (45.0, "a point of 90 deg"),
}
#: teeth of kinds whose number is usual
TEETH = {ToolKind.DRILL: 2, ToolKind.SPOT: 2, ToolKind.REAMER: 6, ToolKind.BORING: 1, ToolKind.COUNTERSINK: 3}
#: width of a tooth of a face mill, and height of its inserts over the diameter, at most [mm]
FACE_TOOTH_MM, FACE_HEIGHT, FACE_HEIGHT_MM = 12.0, 0.2, 10.0


def cutter_table(
    number: int, sources: Iterable[Stated], deepest: float = 0.0, motions: Stated | None = None
) -> DraftTable:
    """Return the table of a tool; the first source that states a key determines its value.

    Parameters
    ----------
    sources : what is stated, the surest first
    deepest : how far below the top of the stock the tool cuts [mm]
    motions : what the motions of the tool show: its kind, the pitch of a tap; a guess where no source states it
    """
    stated: Stated = {}
    for source in sources:
        for key, value in source.items():
            stated.setdefault(key, value)
    by_motion = dict(motions or {})
    name = str(stated["name"][0]) if "name" in stated else ""
    kind = stated["kind"][0] if "kind" in stated else kind_of(name) or by_motion.get("kind", (None, ""))[0]
    guessed: Stated = {k: v for k, v in by_motion.items() if k != "kind" and k not in stated}
    keys: tuple[str, ...] = KEYS
    if kind in BODIES and "body_mm" not in stated:
        guessed |= _body(kind, stated, guessed, deepest)
        keys = BODY_KEYS
    else:
        guessed |= _guesses(stated, kind, deepest, name, by_motion.get("kind", (None, ""))[1])
        guessed.pop("thread_pitch_mm", None)
    entries = [Entry("number", number)]
    if name:
        entries.append(Entry("name", name[:80]))
    elif kind is not None and "kind" in by_motion:
        entries.append(Entry("name", kind.value, by_motion["kind"][1], True))
    for key in keys:
        if key in stated:
            entries.append(Entry(key, stated[key][0], stated[key][1]))
        elif key in guessed:
            entries.append(Entry(key, *guessed[key], not (key == "body_mm" and "diameter_mm" in stated)))
    entries += [
        Entry("holder_mm", *stated["holder_mm"])
        if "holder_mm" in stated
        else Entry("holder_mm", note="length and diameter of its parts: collisions", example="[[30.0, 25.0]]"),
        Entry("gullet_mm2", note="area between two teeth: room for chips", example="8.0"),
    ]
    return DraftTable("cutter", tuple(entries), repeated=True)


def _body(kind: ToolKind, stated: Stated, guessed: Stated, deepest: float) -> Stated:
    """Guess the profile of a tool whose chips are not simulated: of a tap its core."""
    pitch, _ = stated.get("thread_pitch_mm", guessed.get("thread_pitch_mm", (None, "")))
    if "diameter_mm" in stated:
        d, of = stated["diameter_mm"]
    elif kind is ToolKind.TAP and pitch is not None:
        # of a coarse thread, else of a thread as fine as is usual
        d = next((size for size, coarse in COARSE.items() if abs(coarse - pitch) < 0.02 * pitch), round(6.0 * pitch, 1))
        of = "a coarse thread of this pitch"
    else:
        d, of = 6.0 if kind is ToolKind.PROBE else 10.0, "no file states it"
    high = float(stated.get("flute_length_mm", (round(max(2.5 * d, deepest + 1.0), 3), ""))[0])
    core = kind is ToolKind.TAP and pitch is not None and 0.0 < pitch < 0.5 * d
    profile = tap_core(d, pitch, high) if core else cylinder(d, high)
    what = f"the core of a thread of {d:.4g} mm" if core else f"a cylinder of {d:.4g} mm"
    out: Stated = {
        "body_mm": ([[round(r, 6), z] for r, z in profile], f"{what}, {of}; {kind.value}: its chips are not simulated")
    }
    if "flute_length_mm" not in stated:
        out["flute_length_mm"] = (high, "no file states it")
    if "overhang_mm" not in stated:
        out["overhang_mm"] = (round(high + max(d, 5.0), 3), "no file states it; flutes and one diameter")
    return out


def _guesses(
    stated: Mapping[str, tuple[Any, str]], kind: ToolKind | None, deepest: float, name: str, why: str
) -> dict[str, tuple[Any, str]]:
    """Return guesses for the required keys of a cutter."""
    out: dict[str, tuple[Any, str]] = {}
    if "body_mm" in stated:
        body = stated["body_mm"][0]
        if "overhang_mm" not in stated:
            length = round(body[-1][1] + max(2.0 * max(r for r, _ in body), 5.0), 3)
            out["overhang_mm"] = (length, "no file states it; the body and one diameter")
        return out
    if "diameter_mm" not in stated:
        out["diameter_mm"] = stated.get("number_mm") or _of_name(name, why)
    own = float(stated.get("diameter_mm", out.get("diameter_mm", (10.0, "")))[0])
    d = float(stated.get("shank_diameter_mm", (own, ""))[0])
    face = kind is ToolKind.FACE
    if kind in TEETH:
        out["flutes"] = (TEETH[kind], f"no file states them; usual for a {kind.value}")
    elif face:
        out["flutes"] = (max(2, round(d / FACE_TOOTH_MM)), "no file states them; one for each 12 mm of the diameter")
    else:
        out["flutes"] = (2 if d < 4.0 else 3, "no file states them; a common number")
    if kind in POINTS and "corner_radius_mm" not in stated and "taper_deg" not in stated:
        out["bottom_deg"] = POINTS[kind]
    if kind is ToolKind.BALL and "diameter_mm" not in stated:
        out["corner_radius_mm"] = (0.5 * own, "a ball nose")
    straight = kind in (ToolKind.FACE, ToolKind.REAMER, ToolKind.BORING, ToolKind.COUNTERSINK, ToolKind.CHAMFER)
    out["helix_deg"] = (
        (0.0, f"no file states it; usual for a {kind.value}")
        if straight and kind is not None
        else (30.0, "no file states it; usual for end mills")
    )
    longest = float(stated["overhang_mm"][0]) if "overhang_mm" in stated else 3000.0
    if "flute_length_mm" in stated:
        flute = float(stated["flute_length_mm"][0])
    else:
        usual = min(FACE_HEIGHT * d, FACE_HEIGHT_MM) if face else 2.5 * d
        if kind in (ToolKind.CHAMFER, ToolKind.COUNTERSINK):
            angle = float(stated.get("bottom_deg", out.get("bottom_deg", (45.0, "")))[0])
            usual = 0.5 * d * math.tan(math.radians(angle)) + 0.1 * d
        flute = min(round(max(usual, 0.0 if face else deepest + 1.0), 3), longest)
        reason = "2.5 times the diameter" if usual == 2.5 * d else f"usual for a {kind.value if kind else ''}"
        if flute > usual + 1e-3:
            reason = "as deep as the program cuts, and 1 mm"
        out["flute_length_mm"] = (flute, f"no file states it; {reason}")
    if "overhang_mm" not in stated:
        if face:
            out["overhang_mm"] = (round(max(flute, min(d, 50.0)), 3), "no file states it; as high as usual")
        else:
            above = "one diameter" if d >= 5.0 else "5 mm"
            out["overhang_mm"] = (round(flute + max(d, 5.0), 3), f"no file states it; flutes and {above}")
    steel = kind is ToolKind.FACE
    out["modulus_gpa"] = (
        (210.0, "no file states it; a body of steel with inserts")
        if steel
        else (580.0, "no file states it; carbide; high-speed steel has 210")
    )
    return out


def size_of_name(name: str) -> float | None:
    """Diameter [mm] by the only number of a name; None: it has none or several, or it is none of a tool.

    >>> size_of_name("FRAESER_16"), size_of_name("EM12R1")
    (16.0, None)
    """
    numbers = [float(n) for n in re.findall(r"[0-9]+(?:\.[0-9]+)?", name)]
    return numbers[0] if len(numbers) == 1 and 0.1 <= numbers[0] <= 100.0 else None


def _of_name(name: str, why: str) -> tuple[float, str]:
    """Diameter [mm] by the only number of a name, else a usual one."""
    own = size_of_name(name)
    if own is not None:
        return own, f"the number in its name, {name[:50]}"
    return 10.0, f"no file states it{f'; {why}' if why else ''}"
