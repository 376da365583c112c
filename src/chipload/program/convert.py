"""Conversion of a program for another machine, or to CL data.

What the motions do not say goes along by its line: coolant and stops as words, all else as comments, so that nothing is
lost without a trace.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, InputError
from chipload.machine.machine import Machine
from chipload.program.apt.writer import write_apt
from chipload.program.gcode.writer import write_commands
from chipload.program.program import Program
from chipload.program.release import NOT_SIMULATED
from chipload.program.to_axes import to_axes
from chipload.program.to_work import TOLERANCE_MM

#: endings of CL data and of NC text that can be written
CL_DATA, NC_TEXT = (".apt", ".cls"), (".ngc", ".nc", ".tap", ".cnc", ".gcode")
#: findings whose words go along
CARRIED = ("nc-coolant", "nc-stop", "nc-output", "nc-user-code", "nc-unknown-word", "apt-unknown", "heidenhain-unknown")
_WORDS = {"nc-coolant", "nc-stop"}
#: records of CL data that are words of a controller
_RECORDS = {
    "COOLNT/FLOOD": "M8",
    "COOLNT/ON": "M8",
    "COOLNT/MIST": "M7",
    "COOLNT/OFF": "M9",
    "STOP": "M0",
    "OPSTOP": "M1",
}


def carry_findings(findings: tuple[Finding, ...]) -> tuple[tuple[int, str], ...]:
    """(line, block) of what the motions do not say: `M8`, `M0`, else a comment.

    >>> carry_findings((Finding("nc-coolant", 6, "M8: coolant"), Finding("nc-output", 9, "M62: an output")))
    ((6, 'M8'), (9, '(line 9 has M62: an output)'))
    """
    out = []
    for f in sorted(findings, key=lambda f: f.line):
        word = re.match(r"M(0|1|7|8|9)\b", f.text) if f.code in _WORDS else None
        if f.code == "apt-unused" and f.text in _RECORDS:
            out.append((f.line, _RECORDS[f.text]))
        elif f.code in CARRIED:
            out.append((f.line, word[0] if word else f"(line {f.line} has {f.text})"))
    return tuple(out)


def convert_program(
    program: Program,
    noticed: tuple[Finding, ...],
    machine: Machine,
    ending: str,
    *,
    title: str,
    cutters: Mapping[int, Cutter] | None = None,
    tool_lengths: Mapping[int, float] | None = None,
    tcp: bool = False,
    tolerance: float = TOLERANCE_MM,
) -> tuple[str, tuple[Finding, ...]]:
    """The text of a program for a machine, and what the machine does not give.

    Parameters
    ----------
    noticed : by the reader: what goes along
    ending : of the file: ``.ngc`` and others for NC text, ``.apt`` for CL data
    cutters : by number, of CL data; None: not known
    tool_lengths : [mm] by number, on a machine with rotary axes
    tcp : whether the controller is told the tip while rotary axes move
    tolerance : how far the tip may leave its path where a move with rotary axes is cut up [mm]

    Raises
    ------
    InputError
        The ending is not known, or the machine cannot do what the program asks.
    """
    ending = ending.lower()
    if ending in CL_DATA:
        return write_apt(program, cutters, title=title, release=NOT_SIMULATED), ()
    if ending not in NC_TEXT:
        known = " ".join((*NC_TEXT, *CL_DATA))
        raise InputError(f"the ending {ending or 'none'} cannot be written: must be one of {known}")
    commands, findings = to_axes(program, machine, tool_lengths=tool_lengths, tcp=tcp, tolerance=tolerance)
    text = write_commands(commands, machine, title=title, release=NOT_SIMULATED, words=carry_findings(noticed))
    return text, findings
