"""What moves the coordinates: G10, G28, G30, G43, G49, G52, G54 to G59.3 and G92, and going to stored points.

Notation: M position of the machine's axes; p in the coordinates of the text; the datum leads from one to the other.
Axes are by index. The table of tools and the parameters keep what the program sets.

Reference: LinuxCNC 2.9, "Coordinate Systems", "G10", "G28", "G43", "G92".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError, Severity
from chipload.program.commands import ARC, LINE, RAPID, Commands
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.frames import without_frame
from chipload.program.gcode.modal import code_text
from chipload.program.gcode.state import LINEAR, ZERO, Nine, nine, put
from chipload.program.gcode.words import Block

Axes = Mapping[int, float]
#: offsets that differ by less are one [mm]
SAME_MM = 1e-6


def select(c: Controller, code: int) -> None:
    """G54 to G59.3."""
    number = (code - 530) // 10 if code < 591 else 6 + code % 10
    datum = c.state.datum
    if number == datum.number:
        _require_stated(c, code_text(code), number)
        return
    c.not_compensated(code_text(code))
    choose(c, code_text(code), number)


def choose(c: Controller, name: str, number: int) -> None:
    """The coordinates of a work offset of any number; one whose origin is not stated counts as the machine's."""
    _require_stated(c, name, number)
    offset, rotation = c.work_offset(number) if 1 <= number < 10 or number in c.origins else (ZERO, 0.0)
    with without_frame(c):
        c.rebase(replace(c.state.datum, number=number, offset=offset, rotation=rotation))


def _require_stated(c: Controller, name: str, number: int) -> None:
    if number > 1 and number not in c.stated_offsets:
        c.unset_offsets.setdefault(number, (c.line, name))


def note_unset_offsets(c: Controller) -> None:
    """Findings on the work offsets without an origin: where several are used, nothing says how they lie."""
    used = {frame.number for frame in c.track.used_frames() if frame.number > 0}
    severity = Severity.UNPROVEN if len(used) > 1 else Severity.NOTE
    for line, name in c.unset_offsets.values():
        reason = "its origin is not known and is taken as the machine's: state it in program.work_offsets"
        c.findings.once("nc-offset-unset", line, f"{name}: {reason}", severity)


def with_stated_offsets(c: Controller, commands: Commands) -> Commands:
    """The commands with the work offsets marked whose origin is stated."""
    return replace(commands, frames=tuple(replace(f, stated=f.number in c.stated_offsets) for f in commands.frames))


def note_missing_lengths(c: Controller, commands: Commands) -> None:
    """Findings on tools that cut without the length that the tool table states, or without a length offset in a text
    that gives one to another tool.
    """
    if c.control.offsets.length_with_tool:
        return
    cuts = (commands.motion == LINE) | (commands.motion == ARC)
    _note_stated_lengths(c, commands, cuts)
    for number in np.unique(commands.tool[cuts]).tolist() if c.with_length else ():
        if number > 0 and number not in c.with_length:
            line = int(commands.line[cuts & (commands.tool == number)][0])
            reason = "no length offset (G43) is given for it: the machine would move it with that of another tool"
            c.findings.once("nc-length-missing", line, f"tool {number} cuts and {reason}", Severity.UNPROVEN)


def _note_stated_lengths(c: Controller, commands: Commands, cuts: NDArray[np.bool_]) -> None:
    """Findings on tools that cut, or go down in a rapid, without the length that the tool table states for them.

    An offset that is neither 0 nor that of another tool may be meant: wear, G43.1, G43.2.
    """
    table = {n: np.array(t.offset[:3]) for n, t in (c.tools or {}).items() if any(t.offset[:3])}
    used = [n for n in np.unique(commands.tool).tolist() if n in table]
    if not used:
        return
    z = commands.position[:, 2]
    same = (np.diff(commands.frame, prepend=-1) == 0) & (np.diff(commands.tool, prepend=-1) == 0)
    down = (commands.motion == RAPID) & same & (np.diff(z, prepend=z[:1]) < 0.0)
    for number in used:
        others = [np.zeros(3), *(at for n, at in table.items() if n != number)]
        wrong = np.array([
            f.number > 0 and not _is(f.tool[:3], table[number]) and any(_is(f.tool[:3], at) for at in others)
            for f in commands.frames
        ])  # fmt: skip
        rows = np.flatnonzero((cuts | down) & (commands.tool == number) & wrong[commands.frame])
        if len(rows):
            active, own = commands.frames[commands.frame[rows[0]]].tool, table[number]
            lower = float(own[2] - active[2])
            place = f"the tip is {abs(lower):g} mm {'lower' if lower > 0.0 else 'higher'}" if lower else "it is beside"
            c.findings.add(
                "nc-length-missing",
                int(commands.line[rows[0]]),
                f"tool {number} moves without its length, Z{own[2]:g} of the tool table (active is Z{active[2]:g}): "
                f"{place} than is simulated: write G43 H{number} after the tool change, or take the length out of the "
                "table",
                Severity.UNPROVEN,
            )


def _is(offset: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether two offsets are one."""
    return bool(np.abs(offset - other).max() <= SAME_MM)


def probe_motion(c: Controller, code: str, name: str, ends: str) -> None:
    """A motion that a probe or a signal ends: the position after it, and what it measures, is not known."""
    c.leave_out(
        code,
        f"{name}: the motion ends where {ends}; it is taken to its programmed end: the position after it, and all that "
        "the program derives from it, is not known: leave the probing out and state the offsets that it sets in "
        "program.work_offsets or program.parameters",
    )


def note_machine_coordinates(c: Controller, name: str) -> None:
    """A finding on a motion in the machine's coordinates under a work offset without an origin."""
    number = c.state.datum.number
    if number > 0 and number not in c.stated_offsets:
        c.once(
            "nc-machine-coordinates",
            f"{name}: moves in the machine's coordinates, where the origin of {_offset_name(number)} is not known: "
            f"it is taken as the machine's: state it in program.work_offsets",
            Severity.UNPROVEN,
        )


def _offset_name(number: int) -> str:
    return f"G{53 + number}" if number < 7 else f"G59.{number - 6}" if number < 10 else f"work offset {number}"


def set_data(c: Controller, block: Block, axes: Axes) -> None:
    """G10."""
    words = block.words
    kind = integer_of(words.get("l", -1.0), "L")
    if kind in (2, 20):
        with without_frame(c):
            _set_work_offset(c, block, axes, kind)
    elif kind in (1, 10, 11):
        _set_tool(c, block, axes, kind)
    elif kind != 0:
        raise InputError("G10: L is missing or none of 0, 1, 2, 10, 11, 20")


def _number(block: Block, most: int, what: str) -> int:
    number = int(block.words["p"]) if "p" in block.words else -1
    if not 0 <= number <= most:
        raise InputError(f"{what}: P must be from 0 to {most}")
    return number


def _set_work_offset(c: Controller, block: Block, axes: Axes, kind: int) -> None:
    words, state = block.words, c.state
    if "i" in words or "j" in words:
        raise InputError(f"G10 L{kind}: takes no I and J")
    number = _number(block, 9, f"G10 L{kind}") or state.datum.number
    active = number == state.datum.number
    if active:
        c.not_compensated("G10 of the active work offset")
    offset, rotation = (state.datum.offset, state.datum.rotation) if active else c.work_offset(number)
    if kind == 20:
        if "r" in words:
            raise InputError("G10 L20: takes no R")
        datum = replace(state.datum, number=number, offset=offset, rotation=rotation)
        machine = state.datum.to_machine(state.at)
        wanted = replace(datum, offset=ZERO).to_machine(put(datum.from_machine(machine), dict(axes)))
        moved = nine([m - w for m, w in zip(machine, wanted, strict=True)])
        # the rotation carries X into Y; the other axes keep theirs
        turned = {0, 1} if rotation and not {0, 1}.isdisjoint(axes) else set()
        offset = put(offset, {k: moved[k] for k in turned | axes.keys()})
    else:
        offset = put(offset, dict(axes))
        rotation = words.get("r", rotation)
    c.stated_offsets.add(number)
    c.store(5201 + 20 * number, offset)
    c.parameters.numbered[5210 + 20 * number] = rotation
    if active:
        c.rebase(replace(state.datum, offset=offset, rotation=rotation))


def _set_tool(c: Controller, block: Block, axes: Axes, kind: int) -> None:
    words, state = block.words, c.state
    if "p" not in words:
        raise InputError(f"G10 L{kind}: P is missing: the number of the tool")
    number = integer_of(words["p"], "P")
    tool = c.find_tool(number, "P")
    offset = nine([math.degrees(x) if 3 <= k < 6 else x for k, x in enumerate(tool.offset)])
    if kind == 1:
        offset = put(offset, dict(axes))
    else:
        machine = state.datum.to_machine(state.at)
        datum = replace(state.datum, length=offset)
        if kind == 11:
            origin, rotation = c.work_offset(9)
            datum = replace(datum, offset=origin, rotation=rotation, shift=ZERO)
        wanted = replace(datum, length=ZERO).to_machine(put(datum.from_machine(machine), dict(axes)))
        offset = nine([m - w for m, w in zip(machine, wanted, strict=True)])
    changed = replace(tool, offset=tuple(math.radians(x) if 3 <= k < 6 else x for k, x in enumerate(offset)))
    if "r" in words:
        changed = replace(changed, diameter=2.0 * words["r"] * state.scale)
    if "i" in words:
        changed = replace(changed, front=math.radians(words["i"]))
    if "j" in words:
        changed = replace(changed, back=math.radians(words["j"]))
    if "q" in words:
        orientation = integer_of(words["q"], "Q")
        if not 0 <= orientation <= 9:
            raise InputError(f"Q{orientation}: the orientation of a tool must be from 0 to 9")
        changed = replace(changed, orientation=orientation)
    if c.tools is None:
        c.tools = {}
        c.strict_tools = False
    c.tools[number] = changed


def length_offset(c: Controller, block: Block, code: int, axes: Axes) -> None:
    """G43, G43.1, G43.2, G43.4 and G49."""
    state = c.state
    c.not_compensated(code_text(code))
    old = state.datum.length
    if code == 434:
        state.tcp = state.tcp_by_length = True
        c.once("nc-tip", "G43.4: tip control by a length is taken as Fanuc's")
        c.changed()
        code = 430
    elif state.tcp_by_length:
        state.tcp = state.tcp_by_length = False
        c.changed()
    named = "h" in block.words
    if code == 430 and named and block.words["h"] == 0.0 and not c.control.offsets.names_tools:
        # H0 is no register: it takes the length away
        code = 490
    if code == 490:
        new = ZERO
    elif code == 431:
        new = put(old, dict(axes))
    else:
        if code == 432 and not named:
            raise InputError("G43.2: H is missing: the tool whose offset is added")
        number = integer_of(block.words.get("h", 0.0), "H")
        if number == 0 and code == 430:
            number = state.tool
        tool = c.find_tool(number, "H")
        c.with_length |= {number, state.tool}
        _check_length(c, code, number)
        length = nine([math.degrees(x) if 3 <= k < 6 else x for k, x in enumerate(tool.offset)])
        if number:
            length = put(length, {2: c.tool_rows.length(number, length[2])})
        new = nine([a + b for a, b in zip(old, length, strict=True)]) if code == 432 else length
    c.rebase(replace(state.datum, length=new))


def _check_length(c: Controller, code: int, number: int) -> None:
    """Findings on a length that is not known or is another tool's."""
    if number == 0:
        return
    known, tool = number in (c.tools or {}), c.state.tool
    if c.tools is None:
        c.once(
            "nc-length-unknown",
            "G43: no tool length is stated, each is taken as 0: state Z of the tools in a tool table (program.tools)",
        )
    elif not known:
        c.once(
            "nc-length-unknown",
            f"{code_text(code)} H{number}: the length of tool {number} is unknown and is taken as 0: state Z of tool "
            f"{number} in a tool table (program.tools)",
        )
    if code == 430 and number != tool and (known or tool != 0):
        # H names a tool for LinuxCNC, an offset register for the others, which by custom has the number of its tool
        own = c.control.offsets.names_tools
        c.once(
            "nc-length-of-another-tool",
            f"G43 H{number}: tool {tool} is in the spindle: "
            + (f"the length of tool {number} is taken for it" if own else f"check that offset {number} is its length"),
            Severity.UNPROVEN if own else Severity.NOTE,
        )


def shift(c: Controller, code: int, axes: Axes) -> None:
    """G52, G92 and G92.1 to G92.3."""
    with without_frame(c):
        _shift(c, code, axes)


def _shift(c: Controller, code: int, axes: Axes) -> None:
    state, numbered = c.state, c.parameters.numbered
    c.not_compensated(code_text(code))
    datum = state.datum
    if code in (520, 920):
        if not axes:
            raise InputError(f"{code_text(code)}: needs at least one axis")
        if code == 520:
            new = put(datum.shift, dict(axes))
        else:
            new = put(datum.shift, {k: state.at[k] + datum.shift[k] - value for k, value in axes.items()})
        numbered[5210] = 1.0
        c.store(5211, new)
    elif code == 923:
        new = c.stored(5211)
        numbered[5210] = 1.0
    else:
        new = ZERO
        numbered[5210] = 0.0
        if code == 921:
            c.store(5211, ZERO)
    c.rebase(replace(datum, shift=new))


def in_machine_unknown(c: Controller, name: str, axes: Axes, towards_work: bool = False) -> bool:
    """Whether a motion in the machine's coordinates is left out, as where they lie is not known; a finding says so.

    A strict LinuxCNC takes the offsets and home positions of its parameters, unset ones as 0; so does one whose
    parameters state any. A motion along Z is a retraction; one in X and Y before it, or ``towards_work``, may go
    through the work, which stays unproven.
    """
    number = c.state.datum.number
    stated = c.strict or any(5161 <= k < 5390 for k in c.parameters.numbered)
    if (
        (c.control.offsets.kept_in_parameters and stated)
        or number in c.stated_offsets
        or number == 0
        or not any(k in LINEAR for k in axes)
    ):
        return False
    here = c.state.at
    if towards_work or (set(axes) & {0, 1} and 2 not in axes and c.retracted != here):
        c.once(
            "nc-machine-coordinates",
            f"{name}: moves in the machine's coordinates, where the origin of {_offset_name(number)} is not known: "
            "the motion is left out: state it in program.work_offsets",
            Severity.UNPROVEN,
        )
    else:
        c.note(
            "nc-machine-retraction",
            f"{name}: a retraction to a position of the machine is left out: state "
            f"{_offset_name(number)} in program.work_offsets to have it",
        )
    if 2 in axes and not towards_work:
        c.retracted = here
    return True


def go_home(c: Controller, code: int, axes: Axes, end: Nine) -> None:
    """G28 and G30: by way of ``end`` to the stored point, those axes alone that the block gives."""
    state = c.state
    c.not_compensated(code_text(code))
    if in_machine_unknown(c, code_text(code), axes or dict.fromkeys(range(3), 0.0)):
        if end != state.at:
            c.straight(RAPID, end)
            c.retracted = state.at if c.retracted is not None else None
        return
    first = 5161 if code == 280 else 5181
    if not any(first + k in c.parameters.numbered for k in range(9)):
        c.once(
            "nc-point-unset",
            f"{code_text(code)}: parameters #{first} to #{first + 8} are not set: it goes to the machine's origin: "
            "state them in program.parameters",
        )
    note_machine_coordinates(c, code_text(code))
    c.straight(RAPID, end)
    home = c.position(c.stored(first))
    c.straight(RAPID, put(end, {k: home[k] for k in (axes or range(9))}))


def keep_point(c: Controller, code: int) -> None:
    """G28.1 and G30.1."""
    c.store(5161 if code == 281 else 5181, c.machine_position())
