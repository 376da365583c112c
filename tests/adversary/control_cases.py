"""The same faults in the languages of several controls: each slot of the base job, written once more."""

from __future__ import annotations

from adversary.base import Case, Change, changes, program, stated

FANUC = (
    "O1\nG21 G90 G17 G94\nG54\nT1 M6\nS6000 M3\nG0 X-10. Y20.\nG43 H1 Z10.\nZ-2.\nG1 X{x} F900.\n{then}M30\n",
    {"up": "G0 Z10.\n", "stop": "M5\n", "dwell": "G4 X3.\n", "wait": "M0\n", "on": "G1 X70.\n", "rapid": "G0 X70.\n"},
)
SINUMERIK = (
    "G71 G90 G17 G94 G54\nT1 D1\nM6\nS6000 M3\nG0 X-10 Y20 Z10\nG0 Z-2\nG1 X{x} F900\n{then}M30\n",
    {"up": "G0 Z10\n", "stop": "M5\n", "dwell": "G4 F3\n", "wait": "M0\n", "on": "G1 X70\n", "rapid": "G0 X70\n"},
)
HEIDENHAIN = (
    "BEGIN PGM P MM\nTOOL CALL 1 Z S6000\nL Z+10 R0 FMAX M3\nL X-10 Y+20 R0 FMAX\nL Z-2 R0 FMAX\nL X{x} R0 F900\n"
    "{then}END PGM P MM\n",
    {"up": "L Z+10 R0 FMAX\n", "stop": "M5\n", "dwell": "CYCL DEF 9.0 DWELL TIME\nCYCL DEF 9.1 DWELL 3\n",
     "wait": "STOP\n", "on": "L X+70 R0 F900\n", "rapid": "L X+70 R0 FMAX\n"},
)  # fmt: skip
LANGUAGES = {"fanuc": FANUC, "sinumerik": SINUMERIK, "heidenhain": HEIDENHAIN}
#: what happens in the middle of the slot: words, what is wrong, state, finding
FAULTS = {
    "rapid": (("rapid", "up"), "a rapid goes on through the block", "exceeds", "rapid-cuts"),
    "end": ((), "the program ends in the slot", "exceeds", "ends-in-cut"),
    "stop": (("stop", "up"), "the spindle is stopped in the slot", "exceeds", "spindle-stopped-in-cut"),
    "dwell": (("dwell", "on", "up"), "a dwell of 3 s in the slot", "unproven", "dwell-in-cut"),
    "wait": (("wait", "on", "up"), "the program waits in the slot", "unproven", "stop-in-cut"),
}


def written(language: str, x: str, *words: str) -> Change:
    """The slot to X in a language, and what follows."""
    text, known = LANGUAGES[language]
    return changes(
        stated("program", dialect=language), program(text.format(x=x, then="".join(known[word] for word in words)))
    )


CASES = (
    *(
        Case(f"{language}-{name}", f"{wrong} ({language})", written(language, x, *words), state, found)  # type: ignore[arg-type]
        for language, x in (("fanuc", "30."), ("sinumerik", "30"), ("heidenhain", "+30"))
        for name, (words, wrong, state, found) in FAULTS.items()
    ),
    *(
        Case(f"{language}-slot", f"nothing: the slot ({language})", written(language, x, "up"), "holds", "")
        for language, x in (("fanuc", "70."), ("sinumerik", "70"), ("heidenhain", "+70"))
    ),
)
