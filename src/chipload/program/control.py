"""Profiles of NC controls: what a control reads in its own way, one TOML file each in ``controls/``.

Notation: codes of G are in tenths. A file may name another one with ``inherits`` and state only what differs. The
readers stay by language (RS-274, Fanuc, Sinumerik, conversational); a profile sets what they look up. ``ask`` names the
values that a setting of the machine decides, so that the profile's value is the usual one.

Sources: the ``source`` of each file.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from chipload.errors import InputError

#: folder of the profiles
FOLDER = Path(__file__).parent / "controls"
#: order of lists, and of controls that a text shows equally well; one that is not named here comes behind them
_ORDER = (
    "linuxcnc", "fanuc", "haas", "sinumerik", "heidenhain", "mazak", "okuma", "mitsubishi", "brother", "grbl", "mach3",
)  # fmt: skip
#: profiles by the word of a job: every file of the folder is one
CONTROLS = tuple(
    sorted((path.stem for path in FOLDER.glob("*.toml")), key=lambda x: (_ORDER.index(x) if x in _ORDER else 99, x))
)


@dataclass(frozen=True)
class UnitRule:
    """``at_start``: unit of lengths before the text states one, ``mm``, ``inch`` or ``setting`` (of the machine)."""

    at_start: str


@dataclass(frozen=True)
class ModalRules:
    """Modal groups and the state at power-on.

    Parameters
    ----------
    cycle_group : cycles and G80 are a group of their own; G0 to G3 stay active behind them
    once_with_motion : a code that acts once (G28, G92) may stand beside G0 to G3, which then only becomes active
    last_code_wins : of two codes of one group in a block the last one counts; else they exclude each other
    motion_at_start : code of motion at power-on, 800 for none
    old_level_at_start : cycles return to the level where they began (G98)
    distance_at_start : G90 is active at power-on for certain
    """

    cycle_group: bool
    once_with_motion: bool
    last_code_wins: bool
    motion_at_start: int
    old_level_at_start: bool
    distance_at_start: bool


@dataclass(frozen=True)
class NumberRules:
    """Numbers without a decimal point.

    Parameters
    ----------
    increment_letters : words whose numbers count in least increments where they have no point
    point : ``increment``, or ``whole`` where a number without a point counts in whole units (calculator type)
    feed_increment : so does F
    increment_mm, increment_inch, increment_deg : the least increment
    """

    increment_letters: str
    point: str
    feed_increment: bool
    increment_mm: float
    increment_inch: float
    increment_deg: float


@dataclass(frozen=True)
class DwellWord:
    """Seconds in a unit of a dwell: of a number without a decimal point, and of one with it."""

    whole_s: float
    point_s: float


@dataclass(frozen=True)
class CycleRules:
    """Canned cycles.

    Parameters
    ----------
    repeat_letter : word that repeats a cycle
    zero_repeats : 0 states the cycle and drills no hole
    dwell_optional : P may be missing
    starts_spindle : ``none``, ``tapping``, or ``all``: cycles that start a spindle at rest
    peck_letters : I, J and K of G73 and G83 are pecks that become shorter
    circles : G12 and G13 with I mill circular pockets; G70 to G72 with I and L are patterns of holes
    feeds_to_r : G74, G84 and G89 go at their feed up to R, then at rapid to the level of G98; else at feed to there
    keeps_data : another cycle takes R, the bottom, Q and P of the one before it; else it states them
    keeps_places : a cycle keeps the places of R and its bottom where G90 and G91 change; else their values
    """

    repeat_letter: str
    zero_repeats: bool
    dwell_optional: bool
    starts_spindle: str
    peck_letters: bool
    circles: bool
    feeds_to_r: bool
    keeps_data: bool
    keeps_places: bool


@dataclass(frozen=True)
class MacroRules:
    """Macros and variables.

    Parameters
    ----------
    system_variables : family of system variables, ``fanuc`` or empty
    packed_calls : M98 P51234 calls O1234 five times
    highest_variable : greatest number of a variable
    arguments : variable of each word of G65
    tool_variables : first variable of a row by number, and the kind of tool offset that it holds
    probing : program of a probe by its number: ``move``, ``measure`` or ``switch``
    """

    system_variables: str
    packed_calls: bool
    highest_variable: int
    arguments: Mapping[str, int]
    tool_variables: Mapping[int, str]
    probing: Mapping[int, str]


@dataclass(frozen=True)
class OffsetRules:
    """Tool and work offsets.

    Parameters
    ----------
    names_tools : H and D name a tool, not a row of offsets
    kept_in_parameters : origins of the work offsets stand in parameters, so that unset ones are 0
    length_with_tool : a tool brings its length, without G43
    offset_holds : what an offset for G41 holds: ``diameter`` of the tool, or ``unknown``: it, or wear alone
    work_codes : patterns of the codes of work offsets, with a number
    work_bases : by pattern, what added to that number is the number of the work offset, 1 for G54
    work_names : the codes, for messages; empty: there are none
    """

    names_tools: bool
    kept_in_parameters: bool
    length_with_tool: bool
    offset_holds: str
    work_codes: tuple[str, ...]
    work_bases: tuple[int, ...]
    work_names: str


@dataclass(frozen=True)
class CompensationRules:
    """Cutter compensation.

    Parameters
    ----------
    square_entry : the first motion ends square to the start of the contour; else at the offset of its own end
    outside_corner : ``circle`` round the corner, or ``intersection`` of the two offsets
    again : G41 or G42 may be repeated while one is active
    planes : codes of the planes in which it is read
    """

    square_entry: bool
    outside_corner: str
    again: bool
    planes: tuple[int, ...]


@dataclass(frozen=True)
class FeedRule:
    """Time of a cut (G94) on which a rotary axis moves.

    ``rotary``: ``linear first``, F over X Y Z where one of them moves, else in degrees; ``sum``, root of
    mm^2 + deg^2 over F; ``diameter``, degrees as lengths on a diameter.
    """

    rotary: str


@dataclass(frozen=True)
class TextRules:
    """Text and words.

    Parameters
    ----------
    refuses_unknown : a code that the control does not have stops the program
    longest_line : characters of a line; 0: no limit
    o_words : O begins a number or a statement
    program_number : programs begin with % and an O number
    user_tasks : statements are those of an Okuma: VC1, CALL O, RTS, IF [ ] N
    unread : codes that are known and not read: what they do
    unread_until : codes that change the coordinates in a way that is not read, and those that end it
    codes : codes that mean something else: the code that they are read as, ``idle`` or ``unread``
    no_corners : codes whose block has words behind a comma that make no corner
    bare_chamfers : C of G1 without a comma is a chamfer on a machine without an axis C
    """

    refuses_unknown: bool
    longest_line: int
    o_words: bool
    program_number: bool
    user_tasks: bool
    unread: Mapping[int, str]
    unread_until: Mapping[int, int]
    codes: Mapping[int, str]
    no_corners: tuple[int, ...]
    bare_chamfers: bool


@dataclass(frozen=True)
class LineRules:
    """Form of the lines of a text.

    Parameters
    ----------
    form : ``blocks`` of words with G codes, or ``conversational``
    numbered : lines begin with their number, without gaps
    comment : what stands around a comment that may follow a block
    parameter : pattern of the name of a parameter, in lower case; a group is its number, or its name
    parameter_example : for messages
    override_on : block from which the override of the feed acts that a program outside gives; empty: none
    """

    form: str
    numbered: bool
    comment: tuple[str, str]
    parameter: str
    parameter_example: str
    override_on: str


@dataclass(frozen=True)
class Evidence:
    """Patterns by which a text shows its control: names in comments, decisive words, and hints."""

    names: tuple[str, ...]
    decisive: tuple[str, ...]
    hints: tuple[str, ...]


@dataclass(frozen=True)
class ControlSettings:
    """What a job states about its control beyond the name; None: as the profile has it.

    Parameters
    ----------
    point : ``increment`` or ``whole``
    feed_point : ``increment`` or ``whole``, of F
    dwell_s : seconds in a unit of a dwell's P
    rotary_diameter_mm : diameter at which degrees become lengths (Haas Settings 34 and 79)
    """

    point: str | None = None
    feed_point: str | None = None
    dwell_s: float | None = None
    rotary_diameter_mm: float | None = None


@dataclass(frozen=True)
class Control:
    """A control.

    Parameters
    ----------
    name, title : word of a job, and the controls that are meant
    language : of its texts: ``linuxcnc``, ``fanuc``, ``sinumerik`` or ``heidenhain``
    source : manuals
    ask : values that a setting of the machine decides
    settings : what the job states
    """

    name: str
    title: str
    language: str
    source: str
    ask: tuple[str, ...]
    unit: UnitRule
    modal: ModalRules
    numbers: NumberRules
    dwell: Mapping[str, DwellWord]
    cycles: CycleRules
    macros: MacroRules
    offsets: OffsetRules
    compensation: CompensationRules
    feed: FeedRule
    text: TextRules
    lines: LineRules
    evidence: Evidence
    settings: ControlSettings = ControlSettings()

    def with_settings(self, settings: ControlSettings) -> Control:
        """The control as a job states it."""
        numbers, dwell = self.numbers, dict(self.dwell)
        for key, value in (("point", settings.point), ("feed_point", settings.feed_point)):
            if value not in (None, "increment", "whole"):
                raise InputError(f"program.settings.{key} = {value!r}: must be increment or whole")
        if settings.point is not None:
            numbers = replace(numbers, point=settings.point)
        if settings.feed_point is not None:
            numbers = replace(numbers, feed_increment=settings.feed_point == "increment")
        if settings.dwell_s is not None:
            dwell["p"] = DwellWord(settings.dwell_s, settings.dwell_s)
        return replace(self, numbers=numbers, dwell=MappingProxyType(dwell), settings=settings)


_RECORDS: dict[str, Any] = {
    "unit": UnitRule,
    "modal": ModalRules,
    "numbers": NumberRules,
    "cycles": CycleRules,
    "macros": MacroRules,
    "offsets": OffsetRules,
    "compensation": CompensationRules,
    "feed": FeedRule,
    "text": TextRules,
    "lines": LineRules,
    "evidence": Evidence,
}
_OPTIONAL: dict[str, Any] = {"arguments": {}, "tool_variables": {}, "probing": {}}


@cache
def control_named(name: str) -> Control:
    """The profile of a control.

    Raises
    ------
    InputError
        There is none of that name.

    >>> control_named("haas").dwell["p"], control_named("haas").language
    (DwellWord(whole_s=0.001, point_s=1.0), 'fanuc')
    """
    if name not in CONTROLS:
        raise InputError(f"control = {name!r}: must be one of {', '.join(CONTROLS)}")
    data = _read(name)
    made = {key: _record(name, key, kind, data.pop(key)) for key, kind in _RECORDS.items()}
    dwell = {letter: DwellWord(**words) for letter, words in data.pop("dwell").items()}
    ask = tuple(data.pop("ask"))
    return Control(name=name, ask=ask, dwell=MappingProxyType(dwell), **data, **made)


def is_cl_data(dialect: str) -> bool:
    """Whether a text is CL data, which is written for no control.

    >>> is_cl_data("apt"), is_cl_data("haas")
    (True, False)
    """
    return dialect not in CONTROLS


def _read(name: str) -> dict[str, Any]:
    """The tables of a file over those that it inherits."""
    own = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    base = own.pop("inherits", None)
    return own if base is None else _overlay(_read(base), own)


def _overlay(base: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    out = dict(base)
    for key, value in own.items():
        known = out.get(key)
        out[key] = _overlay(known, value) if isinstance(known, dict) and isinstance(value, dict) else value
    return out


def _record(name: str, table: str, kind: Any, values: dict[str, Any]) -> Any:
    """A record of a table, with lists as tuples and numbers of codes as numbers."""
    given = {**{f.name: _OPTIONAL[f.name] for f in fields(kind) if f.name in _OPTIONAL}, **values}
    if given.keys() != {f.name for f in fields(kind)}:
        wrong = sorted(given.keys() ^ {f.name for f in fields(kind)})
        raise InputError(f"controls/{name}.toml: {table}: {', '.join(wrong)}: missing or not known")
    for key, value in given.items():
        if isinstance(value, list):
            given[key] = tuple(value)
        elif isinstance(value, dict):
            # an empty value takes away what was inherited
            given[key] = MappingProxyType({int(k) if k.isdigit() else k: v for k, v in value.items() if v != ""})
    return kind(**given)
