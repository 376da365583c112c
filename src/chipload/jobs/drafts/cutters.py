"""The ``[[cutter]]`` table of a draft: values that sources state, and guesses for the rest."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from chipload.jobs.drafts.comments import Stated
from chipload.jobs.drafts.draft import DraftTable, Entry

#: keys that a cutter has, in the order of the file
KEYS = (
    "diameter_mm", "corner_radius_mm", "barrel_radius_mm", "corner_e_mm", "bottom_deg", "taper_deg",
    "flutes", "helix_deg", "flute_length_mm",
    "overhang_mm", "shank_diameter_mm", "modulus_gpa", "tool_material", "body_mm", "thread_pitch_mm",
)  # fmt: skip


def cutter_table(number: int, sources: Iterable[Stated], deepest: float = 0.0) -> DraftTable:
    """Return the table of a tool; the first source that states a key determines its value.

    Parameters
    ----------
    sources : what is stated, the surest first
    deepest : how far below the top of the stock the tool cuts [mm]
    """
    stated: dict[str, tuple[Any, str]] = {}
    for source in sources:
        for key, value in source.items():
            stated.setdefault(key, value)
    guessed = _guesses(stated, deepest)
    entries = [Entry("number", number)]
    if "name" in stated:
        entries.append(Entry("name", str(stated["name"][0])[:80]))
    for key in KEYS:
        if key in stated:
            entries.append(Entry(key, stated[key][0], stated[key][1]))
        elif key in guessed:
            entries.append(Entry(key, *guessed[key], True))
    entries += [
        Entry("holder_mm", *stated["holder_mm"])
        if "holder_mm" in stated
        else Entry("holder_mm", note="length and diameter of its parts: collisions", example="[[30.0, 25.0]]"),
        Entry("gullet_mm2", note="area between two teeth: room for chips", example="8.0"),
    ]
    return DraftTable("cutter", tuple(entries), repeated=True)


def _guesses(stated: Mapping[str, tuple[Any, str]], deepest: float) -> dict[str, tuple[Any, str]]:
    """Return guesses for the required keys of a cutter."""
    out: dict[str, tuple[Any, str]] = {}
    if "body_mm" in stated:
        body = stated["body_mm"][0]
        if "overhang_mm" not in stated:
            length = round(body[-1][1] + max(2.0 * max(r for r, _ in body), 5.0), 3)
            out["overhang_mm"] = (length, "no file states it; the body and one diameter")
        return out
    if "diameter_mm" not in stated:
        name = str(stated["name"][0]) if "name" in stated else ""
        numbers = [float(n) for n in re.findall(r"[0-9]+(?:\.[0-9]+)?", name)]
        if len(numbers) == 1 and 0.1 <= numbers[0] <= 100.0:
            out["diameter_mm"] = (numbers[0], f"the number in its name, {name[:50]}")
        else:
            out["diameter_mm"] = (10.0, "no file states it")
    d = float(stated.get("shank_diameter_mm", stated.get("diameter_mm", out.get("diameter_mm", (10.0, ""))))[0])
    drill = re.search(r"DRILL|BOHRER|FORET", str(stated["name"][0]) if "name" in stated else "", re.IGNORECASE)
    out["flutes"] = (2 if d < 4.0 or drill else 3, "no file states them; a common number")
    if drill and "corner_radius_mm" not in stated:
        spot = re.search(r"SPOT|CENT(?:ER|RE)|NC.?DRILL|ZENTRIER|ANBOHR", str(stated["name"][0]), re.IGNORECASE)
        out["bottom_deg"] = (45.0, "a point of 90 deg") if spot else (31.0, "a point of 118 deg, usual for drills")
    out["helix_deg"] = (30.0, "no file states it; usual for end mills")
    longest = float(stated["overhang_mm"][0]) if "overhang_mm" in stated else 3000.0
    if "flute_length_mm" in stated:
        flute = float(stated["flute_length_mm"][0])
    else:
        flute = min(round(max(2.5 * d, deepest + 1.0), 3), longest)
        reason = "2.5 times the diameter" if flute <= 2.5 * d else "as deep as the program cuts, and 1 mm"
        out["flute_length_mm"] = (flute, f"no file states it; {reason}")
    if "overhang_mm" not in stated:
        above = "one diameter" if d >= 5.0 else "5 mm"
        out["overhang_mm"] = (round(flute + max(d, 5.0), 3), f"no file states it; flutes and {above}")
    out["modulus_gpa"] = (580.0, "no file states it; carbide; high-speed steel has 210")
    return out
