"""A page for each control: its rules, the codes that are read and those that are not, made from profile and readers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

from chipload.program.control import CONTROLS, Control, control_named
from chipload.program.gcode import coordinates, fanuc, haas_cycles, interpolation_codes
from chipload.program.gcode.dialect import UNREAD
from chipload.program.gcode.modal import GROUPS, M_GROUPS, code_text
from chipload.program.gcode.sinumerik import NO_MEANING, PLAIN, SAME, SYNCHRONISED
from chipload.program.gcode.sinumerik_cycles import CYCLES as NAMED_CYCLES
from chipload.program.gcode.sinumerik_flow import CLOSES
from chipload.program.gcode.sinumerik_patterns import PATTERNS
from chipload.program.gcode.sinumerik_pockets import POCKETS
from chipload.program.gcode.sinumerik_points import POINT_WORDS, POLES
from chipload.program.gcode.sinumerik_slots import SLOTS
from chipload.program.gcode.sinumerik_words import CONTOUR_FEEDS, CORNER_FEEDS, CORNERS, CURVES, IDLE, PLACED
from chipload.program.gcode.sinumerik_words import UNREAD as UNREAD_WORDS
from chipload.program.heidenhain import cycles, q_cycles, switches

HEAD = """# {title}

A job names this control by `program.control = "{name}"`; [how to state your control](../how-to/control.md) says what
else a job can state. This page is made from `src/chipload/program/controls/{name}.toml` and from the tables of its
reader by `make reference`.

Sources: {source}.
"""
#: what a block with an unread word is
_LEFT_OUT = "A block with one of these is a finding with its line, and the result is unproven."
_GROUPS = {
    "once": "act once",
    "motion": "motions and cycles",
    "none": "end of a cycle",
    "plane": "planes",
    "distance": "distances",
    "centre": "centres of arcs",
    "feed": "feed",
    "units": "units",
    "compensation": "cutter compensation",
    "length": "tool length, tip control",
    "retract": "return level of cycles",
    "offset": "work offsets",
    "path": "path control",
    "spindle": "spindle",
    "lathe": "diameters (lathe)",
}
_ROTARY = {
    "linear first": "over X Y Z where one of them moves, else in degrees",
    "sum": "root of mm^2 + deg^2 over F",
    "diameter": "degrees as lengths on a diameter (program.settings.rotary_diameter_mm)",
}
_STARTS = {"none": "no cycle", "tapping": "tapping cycles", "all": "every cycle, where the spindle rests"}
_UNIT = {"mm": "mm", "inch": "inch", "setting": "a setting of the machine: unproven until stated"}
_CIRCLES = "patterns of holes, circular pockets"
#: more codes that the Fanuc reader carries out, by what they do
_FANUC = {
    "polar, scaled and mirrored coordinates": (coordinates.POLAR, coordinates.NO_POLAR, coordinates.SCALED,
                                               coordinates.UNSCALED, *coordinates.MIRRORED, *coordinates.UNMIRRORED),
    "polar and cylindrical interpolation": (*interpolation_codes.POLAR, *interpolation_codes.NO_POLAR,
                                            interpolation_codes.CYLINDER, interpolation_codes.MAPPED),
    "turned coordinates, tilted planes": (fanuc.TURNED, fanuc.UNTURNED, *fanuc.TILTED, *fanuc.ALIGN,
                                          fanuc.HAAS_UNTILTED),
    "macros": (650, 660, 670),
    "rigid tapping": tuple(fanuc.TAPPING),
    "probing": (fanuc.SKIP,),
    "more work offsets, tip control": (fanuc.EXTENDED, fanuc.HAAS_EXTENDED, fanuc.HAAS_TIP),
    _CIRCLES: (haas_cycles.CIRCLE, haas_cycles.ARC_OF_HOLES, haas_cycles.LINE_OF_HOLES,
               *haas_cycles.POCKETS),
}  # fmt: skip


def control_pages() -> dict[str, str]:
    """The text of each page by the name of its file."""
    return {f"controls/{name}.md": control_page(name) for name in CONTROLS}


def control_page(name: str) -> str:
    """The text of the page of a control."""
    control = control_named(name)
    words = _READERS[control.language](control)
    return HEAD.format(title=control.title, name=name, source=control.source) + "\n".join(
        ["", "## Rules", "", *_table(("rule", "value"), _rules(control)), "", *words, ""]
    )


def _rules(control: Control) -> list[tuple[str, str]]:
    modal, cycles_of, offsets = control.modal, control.cycles, control.offsets
    rows = [
        ("unit before the text states one", _UNIT[control.unit.at_start]),
        ("numbers without a decimal point", _numbers(control)),
        ("F without a decimal point", "least increments" if control.numbers.feed_increment else "whole units"),
        *((f"dwell, {letter.upper()}", _dwell(control, letter)) for letter in sorted(control.dwell)),
        ("F with a rotary axis (G94)", _ROTARY[control.feed.rotary]),
        ("spindle started by", _STARTS[cycles_of.starts_spindle]),
    ]
    if control.lines.form == "blocks":
        rows += [
            ("motion at power-on", code_text(modal.motion_at_start) if modal.motion_at_start != 800 else "none"),
            ("after G80", "G0 to G3 as before the cycle" if modal.cycle_group else "no motion is active"),
            ("cycles return to", "where they began (G98)" if modal.old_level_at_start else "R (G99)"),
            ("repeats of a cycle", cycles_of.repeat_letter.upper()),
            ("R, Z, Q and P of a cycle", "last for other cycles" if cycles_of.keeps_data else "of one cycle alone"),
            ("R and Z of a cycle where G90 and G91 change", "keep places" if cycles_of.keeps_places else "keep values"),
            ("G74, G84, G89 go out at their feed", f"to {'R, then at rapid' if cycles_of.feeds_to_r else 'the level'}"),
            ("P of a cycle with a dwell", "may be missing" if cycles_of.dwell_optional else "must be there"),
        ]
    if control.macros.system_variables:
        variables = sorted(control.macros.tool_variables.items())
        rows += [
            ("calls M98", "P51234: five times O1234" if control.macros.packed_calls else "P, and L for repeats"),
            ("arguments of G65", " ".join(f"{x.upper()}{n}" for x, n in sorted(control.macros.arguments.items()))),
            ("tool offsets as variables", ", ".join(f"#{n} on: {kind}" for n, kind in variables) or "none"),
        ]
    rows += [
        ("work offsets", offsets.work_names or "datum shifts and presets"),
        ("an offset for G41 holds", _holds(control)),
        ("first motion of G41", "square to the contour" if control.compensation.square_entry else "to its own end"),
        ("outside corners of G41", _corner(control)),
        ("C of G1 without a comma", _bare(control)),
        ("parameters", control.lines.parameter_example),
        ("a code that the control does not have", "refused" if control.text.refuses_unknown else "a finding"),
        ("a setting of the machine decides", ", ".join(f"`{x}`" for x in control.ask) or "nothing of this"),
    ]
    return rows


def _holds(control: Control) -> str:
    known = control.offsets.offset_holds == "diameter"
    return "the diameter of the tool" if known else "radius or wear alone: asked (program.compensation)"


def _corner(control: Control) -> str:
    return "an arc" if control.compensation.outside_corner == "circle" else "the crossing of the two offsets"


def _bare(control: Control) -> str:
    return "a chamfer, on a machine without an axis C" if control.text.bare_chamfers else "the axis C"


def _numbers(control: Control) -> str:
    numbers = control.numbers
    if not numbers.increment_letters:
        return "whole units"
    letters = " ".join(numbers.increment_letters.upper())
    usual = "" if numbers.point == "increment" else ", usually whole units"
    return (
        f"{letters}: least increments, {numbers.increment_mm:g} mm, {numbers.increment_inch:g} in, "
        f"{numbers.increment_deg:g} deg{usual} (program.settings.point)"
    )


def _dwell(control: Control, letter: str) -> str:
    whole, point = control.dwell[letter].whole_s, control.dwell[letter].point_s
    names = {1.0: "s", 0.001: "ms"}
    unit, other = (names.get(value, f"{value:g} s") for value in (whole, point))
    return unit if unit == other else f"{unit} without a decimal point, {other} with one"


def _blocks(control: Control, family: bool = False) -> list[str]:
    """Codes of a language of G codes; ``family``: of those that read like a Fanuc."""
    unread = dict(control.text.unread)
    changed = {code: to for code, to in control.text.codes.items() if code not in unread}
    left = dict.fromkeys(UNREAD, "threading cycles of a lathe")
    if family:
        left |= dict.fromkeys(fanuc.LEFT_OUT, "splines")
        left |= dict(fanuc.CHANGED) | dict(fanuc.NOT_READ)
        left |= {code: what for code, (_, what) in fanuc.NOT_READ_WITH.items()}
        if 1500 not in unread:
            left[1500] = "pockets"
    left = {code: what for code, what in left.items() if not (family and code == 760)} | unread
    left |= {code: "another meaning here" for code, to in changed.items() if to == "unread"}
    left |= {code: f"changed coordinates, until {code_text(end)}" for code, end in control.text.unread_until.items()}
    other = left.keys() | changed.keys() | set(control.text.unread_until.values())
    silent = fanuc.IDLE if family else frozenset[int]()
    rows = [(_GROUPS[name], _codes(set(codes) - other - silent)) for name, codes in GROUPS.items()]
    if family:
        own = {what: codes for what, codes in _FANUC.items() if control.cycles.circles or what != _CIRCLES}
        rows += [(what, _codes(set(codes) - other)) for what, codes in own.items()]
    if control.text.user_tasks:
        rows.append(
            ("user tasks", "VC1 (taken as #501), local names, X=VC1*2, CALL O Q, RTS, MODIN, MODOUT, IF [ ] N, GOTO N")
        )
    rows.append(("M codes", " ".join(f"M{m}" for m in sorted(m for codes in M_GROUPS.values() for m in codes))))
    out = ["## Codes that are read", "", *_table(("what", "codes"), [row for row in rows if row[1]])]
    if changed:
        names = {
            "idle": "without effect", "unread": "not read", "change": "change of the tool and approach",
            "tap": "G84 by the pitch I or J", "tap left": "G74 by the pitch I or J", "offset": "work offset by H",
            "level": "level to which cycles with M53 go back", "home": "retraction to a position of the machine",
        }  # fmt: skip
        names |= {f"offset {number}": f"G154 P{number - 9}" for number in range(10, 110)}
        taken = [(code_text(code), names.get(to) or code_text(int(to))) for code, to in sorted(changed.items())]
        out += ["", "## Codes with another meaning", "", *_table(("code", "taken as"), taken)]
    if family:
        idle = fanuc.IDLE - left.keys() - {code for codes in _FANUC.values() for code in codes}
        out += ["", "## Noted, without effect on the path", "", _codes(idle)]
    out += [
        "",
        "## Codes that are not read",
        "",
        _LEFT_OUT,
        "",
    ]
    out += _table(("code", "what it does"), [(code_text(code), what) for code, what in sorted(left.items())])
    return out


def _sinumerik(control: Control) -> list[str]:
    codes = sorted({*(10 * g for g in PLAIN), *(10 * g for g in SAME), *(10 * g for g in SYNCHRONISED)})
    rows = [
        ("G codes", _codes(codes)),
        ("cycles", " ".join((*NAMED_CYCLES, "CYCLE800", "MCALL"))),
        ("coordinates", " ".join((*PLACED, "MIRROR", "AMIRROR", "SCALE", "ASCALE", "TRAORI", "TRAFOOF"))),
        ("points and arcs", f"{_codes(10 * g for g in POLES)} {' '.join(sorted(POINT_WORDS))} CR TURN CIP CT"),
        ("patterns of holes", " ".join(PATTERNS)),
        ("pockets, slots and faces, on ways of their own", " ".join((*POCKETS, *SLOTS))),
        ("values", "R[ ], fields, DIV MOD TRUNC ROUND POT ATAN2 MINVAL MAXVAL BOUND, TRUE FALSE, DEFINE AS"),
        ("subprograms", "L100 P3, NAME P2, NAME(1, 2), CALL, EXTCALL: %_N_NAME_SPF or PROC in the text, NAME.SPF"),
        ("corners", " ".join((*CORNERS, *CORNER_FEEDS, "G450 G451"))),
        ("feed of arcs beside a contour", " ".join(CONTOUR_FEEDS)),
        (
            "jumps and loops",
            " ".join((*(f"{a} {b}" for b, a in CLOSES.items()), "ELSE REPEATB GOTO GOTOB GOTOF GOTOS")),
        ),
    ]
    silent = " ".join(f"G{g}" for g in sorted(NO_MEANING))
    left = [(" ".join(sorted(CURVES)), "the motion of the block is left out")]
    left += [("KONT", "the way round the contour at its start and end")]
    left += [(name, what) for name, what in sorted(UNREAD_WORDS.items())]
    return [
        "## Words that are read", "", *_table(("what", "words"), rows), "",
        "## Noted, without effect on the path", "", f"{silent} {' '.join(sorted(IDLE))}", "",
        "## Words that are not read", "", _LEFT_OUT,
        "", *_table(("word", "what is done instead"), left),
    ]  # fmt: skip


def _heidenhain(control: Control) -> list[str]:
    own = {1, 7, 9, 19, 247, 220, 221, *cycles.CHANGES, *q_cycles.CYCLES, *cycles.MILLING}
    rows = [
        ("motions", "L LN LP C CR CT CP CC RND CHF, RL RR R0"),
        ("approach and departure", "APPR and DEP with LT, LN, CT, LCT"),
        ("planes", "PLANE SPATIAL, EULER, VECTOR, RELATIV, AXIAL, RESET with TURN, MOVE, STAY; FUNCTION TCPM"),
        ("cycles", " ".join(map(str, sorted(own)))),
        ("subprograms, parameters", "LBL, CALL LBL, REP, CALL PGM, Q, QL, QR, formulas, FN"),
        (
            "DIN/ISO (%NAME G71)",
            "G00 to G03, G05 to G07, G10 to G13, G15, G16, G17 to G20, G24, G25, G28 to G31, G38, G40 to G42, G51, "
            "G54, G70 to G73, G79, G80, G83, G90, G91, G98, G99, G200 on as their cycles, I J K, L1,0, D00 to D13",
        ),
        ("M functions", " ".join(f"M{m}" for m in switches.KNOWN)),
    ]
    left = sorted(q_cycles.LEFT_OUT - own)
    return [
        "## Words that are read", "", *_table(("what", "words"), rows), "",
        "## Noted, without effect on the path", "",
        f"Cycles {' '.join(map(str, sorted(cycles.SILENT)))}; {' '.join(f'M{m}' for m in switches.SILENT)}", "",
        "## Words that are not read", "",
        "What such a cycle cuts is left out: a finding with its line, and the result is unproven.", "",
        f"Cycles {_ranges(left)}; PLANE PROJECTED and POINTS; contours by FK and by SL cycles; "
        "M97, M98, M114 and M130.",
    ]  # fmt: skip


def _codes(codes: Iterable[int]) -> str:
    return " ".join(code_text(code) for code in sorted(set(codes)))


def _ranges(numbers: Iterable[int]) -> str:
    """Numbers with those that follow one another together.

    >>> _ranges([2, 3, 4, 12, 15, 16])
    '2 to 4, 12, 15, 16'
    """
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{r[0]} to {r[-1]}" if len(r) > 2 else ", ".join(map(str, r)) for r in runs)


def _table(head: tuple[str, str], rows: Iterable[tuple[str, str]]) -> list[str]:
    return [f"| {head[0]} | {head[1]} |", "|---|---|", *(f"| {a} | {b} |" for a, b in rows)]


_READERS: dict[str, Callable[[Control], list[str]]] = {
    "linuxcnc": _blocks,
    "fanuc": partial(_blocks, family=True),
    "sinumerik": _sinumerik,
    "heidenhain": _heidenhain,
}
