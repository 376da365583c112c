"""Drafts of jobs that simulate a program: NC text or CL data, with data from the project that contains it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import cutter_from_table
from chipload.errors import Finding, InputError, Severity, group_findings
from chipload.files import decode_text, read_regular
from chipload.jobs.drafts.comments import SIZE_ALONE, Box, Header, read_header
from chipload.jobs.drafts.cutters import cutter_table, size_of_name
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry, relative
from chipload.jobs.drafts.setups import lines_of_setups, setup_tables
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.program.apt.reader import apt_text
from chipload.program.control import is_cl_data
from chipload.program.gcode.reader import gcode_text
from chipload.program.heidenhain.din_iso import conversational
from chipload.program.left_out import LEFT_OUT
from chipload.program.lines_of import UNSET, reading_of_lines
from chipload.program.missing_axes import MISSING_AXIS
from chipload.program.motions import bounds, lengths
from chipload.program.program import DWELL, RAPID, Program
from chipload.program.read import ENDINGS, ProgramReading, read_program, read_tools
from chipload.program.recognise import recognise
from chipload.program.reconcile import unit_mm
from chipload.program.setup import Setup
from chipload.program.tapping import tapping_motions
from chipload.program.tilt import NO_ROTARY
from chipload.program.tool_words import Stated, ToolKind
from chipload.units import mm_s_from_mm_min, rpm_from_rad_s

#: machines that a program is read for where none is stated: the first that has its axes
MACHINES = ("vmc", "vmc-a", "hmc-b", "xyzbc-trunnion", "xyzac-trunnion", "xyzbc-head-table")
#: those with one rotary axis: CL data, which state vectors, are read for more
ONE_ROTARY = ("vmc-a", "hmc-b")
#: language of programs that show nothing
MACHINES_LANGUAGE = "linuxcnc"
#: NC texts longer than this are read in one dialect only [bytes]
LONG = 3_000_000
#: feed of cuts that the draft takes where the text states none [mm/min]
FEED_MM_MIN = 300.0
#: cutting speed that the draft takes where the text never starts the spindle [m/min]
SPEED_M_MIN = 150.0
#: material over and around the motions in a guessed block [mm]
ALLOWANCE_MM = 1.0
#: steps that a guessed step length aims at
STEPS = 8_000
#: thickness of layers in smallest diameters, and most layers where cutters come
LAYER, LAYERS = 0.05, 60
#: what the finding on a cut says that no feed precedes
NO_FEED = "the feed is 0 or was never set"
#: findings that are listed in the draft
LISTED = 8
#: ends of the codes of findings that do not concern the motions
PLAIN = ("-unused", "-unknown", "-coolant")
_LARGEST = 500_000_000
#: the first speed of a text, outside its comments
_SPEED = re.compile(r"(?<![A-Z_<\[])S\s*([0-9]+(?:\.[0-9]*)?)(?![0-9A-Z])", re.IGNORECASE)
_COMMENTS = re.compile(r"\([^()\n]*\)|;[^\n]*")


@dataclass(frozen=True)
class Known:
    """Data of a program that a project or the caller states.

    Parameters
    ----------
    cutters : by tool number
    stock : corners of a block [mm], and where it stands
    machine : a shipped name or a file
    tools : a tool table
    text : of the program, where it is not yet a file
    origin : the file that all this stands in, for the title
    """

    cutters: Mapping[int, Stated] = field(default_factory=dict)
    stock: tuple[Box, str] | None = None
    machine: str | None = None
    tools: Path | None = None
    text: str | None = None
    origin: str = ""


@dataclass(frozen=True, eq=False)
class _Chosen:
    """Reading of a program: machine, dialect (None: by ending or machine), feed [mm/min] before the first F."""

    machine: Machine
    dialect: str | None
    feed: float | None
    reading: ProgramReading


def draft_program(path: Path, folder: Path, known: Known | None = None) -> Draft:
    """Return the draft of a job that simulates a program.

    Parameters
    ----------
    folder : of the job, to which file names are relative

    Raises
    ------
    InputError
        The program cannot be read for any machine that comes with chipload.
    """
    known = known or Known()
    chosen = _read(path, known)
    kind = chosen.dialect or ENDINGS.get(path.suffix.lower())
    apt = kind is not None and is_cl_data(kind)
    text = conversational(known.text if known.text is not None else _text(path, apt))
    header = read_header(text, apt, unit_mm(text, chosen.reading.unit))
    if any(f.code in (*LEFT_OUT, "nc-diameter-unknown") for f in chosen.reading.findings):
        # cycles of a pocket and compensation need the diameters
        cutters = _cutters(chosen.reading.program, known, header)
        chosen = _read(path, known, cutters) if cutters else chosen
    program = chosen.reading.program
    if not float(lengths(program).sum()) > 0.0:
        left_out = next((f": {f}" for f in chosen.reading.findings if f.severity >= Severity.UNPROVEN), "")
        raise InputError(f"{path.name}: no motion that can be read: nothing to simulate{left_out}")
    setups = lines_of_setups(chosen.reading, text)
    first = reading_of_lines(chosen.reading, setups[0], setups[1:]).program if setups else program
    block, stock_entries = _stock(first, known, header)
    cuts = _rows_at_feed(program)
    used = set(np.unique(program.tool[cuts]).tolist()) | _tools_left_out(program, chosen.reading.findings)
    numbers = sorted(used) or [int(program.tool[-1])]
    deepest = {
        n: block[1][2] - float(program.p_work[cuts & (program.tool == n), 2].min(initial=block[1][2])) for n in numbers
    }
    sizes = [_size(next((s for s in _stated_values(n, known, header) if s), {})) for n in numbers]
    motions = {n: _kind_by_motions(program, cuts & (program.tool == n)) for n in numbers}
    tables = [
        _program_table(path, folder, chosen, known, min(sizes), text, bool(setups)),
        _machine_table(chosen, known),
        DraftTable(
            "stock", (*stock_entries, _layer(deepest, sizes)), note="the block that the program starts from [mm]"
        ),
        _material_table(header),
        *(cutter_table(n, _stated_values(n, known, header), deepest[n], motions[n]) for n in numbers),
        _operation_table(program, cuts, sizes),
        *setup_tables(chosen.reading, text, setups, block),
        _limits_table(chosen.machine),
    ]
    found = [f for f in chosen.reading.findings if f.severity >= Severity.UNPROVEN]
    rest = [f for f in chosen.reading.findings if f not in found and not f.code.endswith(PLAIN)]
    # a speed is guessed where the spindle rests
    violations = [f for f in chosen.reading.violations if f.code != "machine-spindle-off"]
    notes = [text for _, text in group_findings((*found, *violations, *rest))][:LISTED]
    origin = known.origin or path.name
    return Draft(
        f"Simulate {origin}: chips, forces, torque and collisions of the program in its stock.",
        tuple(tables),
        tuple(notes),
    )


def _stated_values(number: int, known: Known, header: Header) -> list[Stated]:
    """Return the stated values of a tool, the most reliable source first."""
    stated = header.cutters.get(number, {})
    if number == 0 and len(header.cutters) == 1:  # a text without a change of tools cuts with the one that it names
        (stated,) = header.cutters.values()
    return [known.cutters.get(number, {}), _of_table(known.tools, number), stated]


def _kind_by_motions(program: Program, cuts: np.ndarray) -> Stated:
    """What the cuts of a tool show: one that turns back in its holes taps, one that only goes along its axis drills."""
    rows = np.flatnonzero(cuts)
    tapping = tapping_motions(program)
    own = np.isin(tapping.rows, rows)
    if own.any():
        pitch = float(f"{tapping.pitch[own][0]:.5g}")
        why = "it taps: the spindle turns back at the bottom of the hole"
        return {"kind": (ToolKind.TAP, why), "thread_pitch_mm": (pitch, f"feed over speed; {why}")}
    moves = program.p_work[rows] - program.p_work[np.maximum(rows - 1, 0)]
    across = moves - (moves * program.axis[rows]).sum(axis=1)[:, None] * program.axis[rows]
    along = np.linalg.norm(moves, axis=1)
    if len(rows) and along.max() > 1e-6 and np.linalg.norm(across, axis=1).max() < 1e-6:
        return {"kind": (ToolKind.DRILL, "it cuts along its axis only")}
    return {}


def _cutters(program: Program, known: Known, header: Header) -> dict[int, Cutter]:
    """The tools of a program whose diameter is stated, or in their name, for the compensation of its path."""
    out: dict[int, Cutter] = {}
    cuts = _rows_at_feed(program)
    for n in (int(n) for n in np.unique(program.tool)):
        sources = _stated_values(n, known, header)
        names = [str(source["name"][0]) for source in sources if "name" in source]
        if any("diameter_mm" in source for source in sources) or any(size_of_name(name) for name in names):
            entries = cutter_table(n, sources, motions=_kind_by_motions(program, cuts & (program.tool == n))).entries
            out[n] = cutter_from_table({e.key: e.value for e in entries if e.value is not None})
    return out


def _text(path: Path, apt: bool) -> str:
    try:
        return apt_text(path) if apt else gcode_text(path)
    except InputError:
        return decode_text(read_regular(path, path.name, _LARGEST))


def _read(path: Path, known: Known, cutters: Mapping[int, Cutter] | None = None) -> _Chosen:
    """The reading with the least that is left unproven, on the first machine that lacks the fewest axes."""
    ending = path.suffix.lower()
    size = len(known.text) if known.text is not None else path.stat().st_size if path.is_file() else 0
    groups: tuple[tuple[str | None, ...], ...] = ((None,),)
    if ENDINGS.get(ending, "") is None and size <= LONG:
        # CL data and conversational programs are named .txt too
        groups = ((None,), ("heidenhain", "apt"))
    elif ending not in ENDINGS:
        text = known.text if known.text is not None else _text(path, apt=False)
        named = recognise(text, MACHINES_LANGUAGE).control.name
        groups = (tuple(dict.fromkeys((named, "linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"))),)
    setup = Setup(cutters=cutters or {})
    refused: list[tuple[Machine, InputError]] = []
    without: tuple[int, _Chosen] | None = None
    for name in MACHINES if known.machine is None else (known.machine,):
        machine = read_machine(name) if name.lower().endswith(".toml") else machine_named(name)
        for dialects in groups:
            chosen = _best(path, known, machine, dialects, setup, refused)
            if chosen is None or (name in ONE_ROTARY and chosen.reading.recognition is None):
                continue
            # its axes and its tilted planes need another machine
            lacking = sum(f.code in (NO_ROTARY, MISSING_AXIS) for f in chosen.reading.findings)
            if not lacking:
                return chosen
            if without is None or lacking < without[0]:
                without = lacking, chosen
    if without is not None:
        return without[1]
    raise _refusal(path, refused)


def _refusal(path: Path, refused: Sequence[tuple[Machine, InputError]]) -> InputError:
    """Why no machine reads a program: the first reason."""
    why = str(refused[0][1]).removeprefix(f"{path.name}: ")
    why = why.removeprefix("no motion: nothing to check: ").removesuffix(": the block is left out (nc-not-read)")
    if "does not begin a word" in why:
        return InputError(f"{path.name}: neither NC text nor CL data nor a table with a heading of its columns: {why}")
    return refused[0][1]


def _best(
    path: Path,
    known: Known,
    machine: Machine,
    dialects: Sequence[str | None],
    setup: Setup,
    refused: list[tuple[Machine, InputError]],
) -> _Chosen | None:
    """The reading with the fewest gaps by one of the dialects; ``refused`` takes why others do not read it."""
    tools = read_tools(known.tools) if known.tools is not None else None
    best: tuple[int, _Chosen] | None = None
    for dialect in dialects:
        for feed in (None, FEED_MM_MIN):
            try:
                own = None if feed is None else mm_s_from_mm_min(feed)
                reading = read_program(
                    path, machine, dialect=dialect, tools=tools, feed=own, text=known.text, setup=setup
                )
            except InputError as err:
                refused.append((machine, err))
                if "feed" not in str(err):
                    break
                continue
            if feed is None and any(NO_FEED in f.text for f in reading.findings):
                continue
            gaps = sum(f.severity >= Severity.UNPROVEN for f in reading.findings)
            if best is None or gaps < best[0]:
                best = (gaps, _Chosen(machine, dialect, feed, reading))
            break
        if best is not None and best[0] == 0:
            break
    return None if best is None else best[1]


def _tools_left_out(program: Program, findings: Sequence[Finding]) -> set[int]:
    """Tools in whose blocks a cycle or a motion is left out: they cut, though not here."""
    lines = {f.line for f in findings if f.code in LEFT_OUT and f.line >= int(program.line[0])}
    order = np.argsort(program.line, kind="stable")
    at = np.searchsorted(program.line[order], sorted(lines), "right") - 1
    return set(program.tool[order][at].tolist()) - {0}


def _rows_at_feed(program: Program) -> np.ndarray:
    """(n,) whether each row moves at a feed."""
    return np.asarray((program.motion != RAPID) & (program.motion != DWELL))


def _stock(program: Program, known: Known, header: Header) -> tuple[Box, tuple[Entry, ...]]:
    """The block, and its entries."""
    for stated in (known.stock, header.stock):
        if stated is not None:
            (low, high), where = stated
            if where == SIZE_ALONE:
                low, high = _place_of_size(program, (low, high))
            sure = where == "WORKPIECE" or where.startswith(("BLK", "workpiece", "stock of", "stockMin"))
            note = f"{where}" if sure else f"{where}: check it against the program's zero"
            return (low, high), (
                Entry("low_mm", list(low), note, not sure), Entry("high_mm", list(high), note, not sure)
            )  # fmt: skip
    lowest, highest, why = _block_around(program)
    box = (
        (float(lowest[0]), float(lowest[1]), float(lowest[2])),
        (float(highest[0]), float(highest[1]), float(highest[2])),
    )
    return box, (Entry("low_mm", list(box[0]), why, True), Entry("high_mm", list(box[1]), why, True))


def _place_of_size(program: Program, box: Box) -> Box:
    """The block of a stated size, from its lower corner or about its middle: as the middle of its cuts lies nearer."""
    low, high = box
    cuts = program.p_work[_rows_at_feed(program)]
    if not len(cuts):
        return low, high
    middle, half = 0.5 * (cuts[:, :2].min(axis=0) + cuts[:, :2].max(axis=0)), (0.5 * high[0], 0.5 * high[1])
    if np.linalg.norm(middle) >= np.linalg.norm(middle - half):
        return low, high
    return (-half[0], -half[1], low[2]), (half[0], half[1], high[2])


def _block_around(program: Program) -> tuple[np.ndarray, np.ndarray, str]:
    """Corners of a block around the motions below the clearance."""
    low, high = bounds(program)
    cuts = _rows_at_feed(program)
    rapid = (program.motion == RAPID) & (
        np.hypot(*np.diff(program.p_work[:, :2], axis=0, prepend=program.p_work[:1, :2]).T) > 1e-9
    )
    clearance = float(program.p_work[rapid, 2].min()) if rapid.any() else math.inf
    below = cuts & (low[:, 2] < clearance - 1e-6)
    if not below.any():
        below = cuts if cuts.any() else np.ones(len(program), dtype=np.bool_)
    lowest, highest = low[below].min(axis=0), high[below].max(axis=0)
    level = below & (np.hypot(*(high - low)[:, :2].T) > 1e-9)
    top = float(low[level, 2].max()) if level.any() else float(highest[2])
    if top < 0.0 <= clearance:
        top = 0.0
    elif clearance < math.inf:
        top = min(top, clearance)
    if top <= lowest[2] + 1e-6:
        top = float(lowest[2]) + ALLOWANCE_MM
    corner_low = np.array([lowest[0] - ALLOWANCE_MM, lowest[1] - ALLOWANCE_MM, lowest[2] - ALLOWANCE_MM]).round(3)
    corner_high = np.array([highest[0] + ALLOWANCE_MM, highest[1] + ALLOWANCE_MM, top]).round(3)
    return corner_low, corner_high, f"box of the centre path below the rapids, {ALLOWANCE_MM:g} mm more"


def _size(stated: Stated) -> float:
    """The size of a cutter [mm]: of a tapered one its shank."""
    return float(stated.get("shank_diameter_mm" if "taper_deg" in stated else "diameter_mm", (10.0, ""))[0])


def _layer(deepest: Mapping[int, float], sizes: Sequence[float]) -> Entry:
    """Thickness of the layers: a share of the smallest cutter, and not more than a number of them."""
    layer = max(LAYER * min(sizes), max(deepest.values()) / LAYERS, 0.01)
    return Entry("layer_mm", float(f"{layer:.2g}"), "layers of the simulation; smaller: finer and slower")


def _of_table(tools: Path | None, number: int) -> Stated:
    """Return the values that a tool table states about a tool."""
    if tools is None:
        return {}
    tool = read_tools(tools).tools.get(number)
    if tool is None or tool.diameter == 0.0:
        return {}
    own: Stated = {"diameter_mm": (abs(tool.diameter), f"D of {tools.name}")}
    if tool.comment:
        own["name"] = (tool.comment, tools.name)
    return own


def _program_table(
    path: Path, folder: Path, chosen: _Chosen, known: Known, smallest: float, text: str, setups: bool
) -> DraftTable:
    entries = [Entry("file", path.name if known.text is not None else relative(path, folder))]
    if chosen.dialect is not None:
        entries.append(Entry("dialect", chosen.dialect, "the one that leaves the fewest words unread", True))
    elif chosen.reading.recognition is not None and not chosen.reading.recognition.stated:
        found = chosen.reading.recognition
        # another control that may be meant reads the text in the same way, or not
        matters = any(f.code == "nc-control" and f.severity >= Severity.UNPROVEN for f in chosen.reading.findings)
        entries.append(Entry("control", found.control.name, ", ".join(found.reasons), matters))
    else:
        entries.append(Entry("dialect", note="else by the ending of the file and the machine", example='"fanuc"'))
    entries += _guesses(chosen.reading)
    if known.tools is not None:
        entries.append(Entry("tools", relative(known.tools, folder)))
    else:
        entries.append(Entry("tools", note="LinuxCNC tool table: lengths, diameters", example='"shop.tbl"'))
    if chosen.feed is not None:
        entries.append(Entry("feed_mm_min", chosen.feed, "the text cuts before it states a feed", True))
    speed = _speed(chosen, smallest, text)
    if speed is not None:
        entries.append(Entry("speed_rpm", speed[0], f"the text cuts with the spindle at rest; {speed[1]}", True))
    return DraftTable(
        "program",
        (*entries, _work_offsets(chosen.reading, setups)),
        note="the program; lengths here are in mm, whatever unit it has",
    )


def _work_offsets(reading: ProgramReading, setups: bool) -> Entry:
    """The origins of the work offsets: a question where several are used between two stops."""
    example = "{ G54 = [0.0, 0.0, 0.0] }"
    unset = [f.text.split(":")[0] for f in reading.findings if f.code == UNSET and f.severity >= Severity.UNPROVEN]
    if setups or not unset:
        return Entry("work_offsets", note="origins in the machine", example=example)
    named = ", ".join(unset[:4])
    return Entry("work_offsets", None, f"do {named} hold equal parts, or sides of one; where are they", True, example)


def _guesses(reading: ProgramReading) -> list[Entry]:
    """What the reader guessed about unit, tool table and compensation: the keys that confirm it."""
    guesses: dict[str, tuple[str, Callable[[str], str], str]] = {
        "nc-unit": ("unit", lambda _: reading.unit, "the program states none"),
        "nc-tools-unit": ("tools_unit", lambda _: "inch", "its diameters agree with the program as inches"),
        "nc-compensation-wear": ("compensation", lambda _: "wear", "the cutter does not fit beside the contour"),
        "nc-compensation-unstated": ("compensation", lambda _: "control", "the offset of D holds the cutter's radius"),
    }
    out: dict[str, Entry] = {}
    for finding in reading.findings:
        if finding.code in guesses:
            key, value, reason = guesses[finding.code]
            out.setdefault(key, Entry(key, value(finding.text), reason, True))
    return list(out.values())


def _speed(chosen: _Chosen, smallest: float, text: str) -> tuple[float, str] | None:
    """Spindle speed [rpm] for a program that cuts with the spindle at rest, and its reason; None: it never does."""
    program = chosen.reading.program
    first = int(np.argmax(program.spindle != 0.0)) if program.spindle.any() else len(program)
    if not _rows_at_feed(program)[:first].any():
        return None
    low, high = rpm_from_rad_s(chosen.machine.spindle_min), rpm_from_rad_s(chosen.machine.spindle_max)
    # a tool change stops the spindle that was started before it
    own = next((float(hit[1]) for hit in _SPEED.finditer(_COMMENTS.sub(" ", text)) if float(hit[1]) > 0.0), None)
    wanted = 1000.0 * SPEED_M_MIN / (math.pi * smallest) if own is None else own
    speed = round(min(max(float(f"{wanted:.2g}") if own is None else own, low), high), 3)
    why = f"S{own:g} of the text" if own is not None else f"{SPEED_M_MIN:g} m/min"
    return speed, why if low <= wanted <= high else f"{why}, as far as the spindle of {chosen.machine.name} turns"


def _machine_table(chosen: _Chosen, known: Known) -> DraftTable:
    machine = chosen.machine
    if known.machine is not None:
        key = "file" if known.machine.lower().endswith(".toml") else "name"
        return DraftTable("machine", (Entry(key, known.machine),))
    axes = "".join(a.letter for a in machine.chain.axes)
    note = f"the first shipped one with the axes {axes}; chipload machines lists all"
    short = [f.text.split(":")[0] for f in chosen.reading.violations if f.code == "machine-limit"]
    if short:
        note += f"; too small: {short[0]}"
    return DraftTable("machine", (Entry("name", machine.name, note, True),))


def _material_table(header: Header) -> DraftTable:
    if header.material is not None:
        name, where = header.material
        entry = Entry("name", name, f"by the comment ({where}); chipload materials lists all", True)
    else:
        own = header.unknown_material
        why = f"no shipped material is like {own}" if own else "the file names no material"
        entry = Entry("name", "al7075-t6", f"{why}; chipload materials lists all", True)
    return DraftTable("material", (entry,))


def _operation_table(program: Program, cuts: np.ndarray, sizes: Sequence[float]) -> DraftTable:
    length = float(lengths(program)[cuts].sum())
    step = max(0.125 * min(sizes, default=10.0), length / STEPS, 0.1)
    step = min(float(f"{step:.2g}"), 100.0)
    return DraftTable(
        "operation",
        (
            Entry("kind", "simulate"),
            Entry("step_mm", step, "longest step; smaller: finer and slower"),
        ),
        repeated=True,
    )


def _limits_table(machine: Machine) -> DraftTable:
    entries: list[Entry] = []
    if machine.torque is not None:
        entries.append(Entry("torque_nm", machine.torque / 1000.0, f"of the spindle of {machine.name}"))
    if machine.power_w is not None:
        entries.append(Entry("power_w", float(machine.power_w), f"of the spindle of {machine.name}"))
    if not entries:
        entries.append(Entry("force_n", 1000.0, "no limit is stated anywhere", True))
    else:
        entries.append(Entry("force_n", note="on the cutter", example="800.0"))
    entries.append(Entry("deflection_um", note="with [stiffness]; see docs/jobs.md", example="30.0"))
    return DraftTable("limits", tuple(entries), note="what must not be exceeded; further checks are made by default")
