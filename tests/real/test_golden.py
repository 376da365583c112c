"""Programs of LinuxCNC's own tests and real programs: the motions that LinuxCNC prints for them."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from canonical import Refused, compare_commands, parse_canonical, run_canonical
from chipload.errors import InputError
from chipload.machine.machine import machine_named
from chipload.program.commands import ARC as COMMAND_ARC
from chipload.program.commands import LINE as COMMAND_LINE
from chipload.program.commands import extents, spirals
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import read_tool_table
from chipload.program.motions import lengths
from chipload.program.program import ARC_CCW, ARC_CW, LINE
from chipload.program.to_work import to_work
from rs274 import MISSING, rs274_installed

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data")) / "nc"
GOLDEN = DATA / "linuxcnc_golden"
TABLE = "".join(f"T{n} P{n} D{n / 100}\n" for n in range(1, 100))
#: read by us and refused by rs274 as it stands alone
OURS_ALONE = {
    "linuxcnc_golden/interp/g64-r-planner/test.ngc": "G64 R is newer than the rs274 that is tested against",
    "linuxcnc_3axis/cone.ngc": "W is an axis of the machine that it was written for",
    "linuxcnc_5axis/boat-xyzac.ngc": "M428 is a code of the machine that it was written for",
    "linuxcnc_5axis/boat-xyzbc.ngc": "M428 is a code of the machine that it was written for",
    "linuxcnc_5axis/impeller-7bl-xyzac.ngc": "M428 is a code of the machine that it was written for",
}


def _golden():
    if not GOLDEN.is_dir():
        return []
    texts = sorted(GOLDEN.rglob("*.ngc"))
    return [(path, beside) for path in texts for beside in (path.parent / "expected", Path(f"{path}.expected"))
            if beside.is_file()]  # fmt: skip


def _programs():
    kinds = {".ngc", ".nc", ".gcode"}
    return [path for path in sorted(DATA.rglob("*")) if path.suffix in kinds] if DATA.is_dir() else []


def _read(path, text):
    own = path.parent / "test.tbl"
    table = own.read_text() if own.is_file() else TABLE
    tools, _ = read_tool_table(table, units="inch")
    # lengths of a machine without a file of its own are inches, its programs begin in mm
    return read_gcode(text, name=path.name, tools=tools, machine_units="inch", folder=path.parent), table


@pytest.mark.skipif(not GOLDEN.is_dir(), reason="no golden programs")
@pytest.mark.parametrize(("path", "expected"), _golden(), ids=lambda x: str(x.relative_to(GOLDEN)))
def test_golden(path, expected):
    (commands, findings), _ = _read(path, path.read_text())
    motions, messages = parse_canonical(expected.read_text())
    assert compare_commands(motions, commands) == len(commands)
    said = [" ".join(x.text.split()) for x in findings if x.code == "nc-message"]
    wanted = [" ".join(x.replace("-0.000000", "0.000000").split()) for x in messages]
    assert list(dict.fromkeys(said)) == list(dict.fromkeys(wanted))


@pytest.mark.skipif(not DATA.is_dir(), reason="no programs")
@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
@pytest.mark.parametrize("path", _programs(), ids=lambda x: str(x.relative_to(DATA)))
def test_real_program_against_rs274(path):
    text = path.read_bytes().decode("utf-8", "replace")
    commands, table, refused = None, TABLE, ""
    try:
        (commands, _), table = _read(path, text)
    except InputError as error:
        refused = str(error)
    assert commands is not None or refused.startswith(f"{path.name}: line ")
    try:
        printed = run_canonical(text, table=table)
    except Refused:
        printed = None
    if str(path.relative_to(DATA)) in OURS_ALONE:
        assert printed is None
        assert commands is not None, refused
        return
    assert (commands is None) == (printed is None), refused
    if commands is not None:
        motions, _ = parse_canonical(printed)
        # S of G96 is no spindle speed here
        compare_commands(motions, commands, spindle="G96" not in text)


@pytest.mark.skipif(not DATA.is_dir(), reason="no programs")
@pytest.mark.parametrize("path", _programs(), ids=lambda x: str(x.relative_to(DATA)))
def test_what_is_read_has_a_way_in_the_workpiece(path):
    """As long as that of the axes where no rotary axis moves; LinuxCNC takes arcs whose radii differ by 1e-3."""
    try:
        commands, _ = _read(path, path.read_bytes().decode("utf-8", "replace"))[0]
    except InputError:
        return
    others = commands.position[:, 3:]
    if len(commands) == 0 or np.ptp(others, axis=0).any():
        return
    program, _ = to_work(commands, machine_named("vmc"))
    at = np.isin(program.motion, (LINE, ARC_CW, ARC_CCW))
    own = extents(commands)[np.isin(commands.motion, (COMMAND_LINE, COMMAND_ARC))].sum()
    # an arc with two radii is counted by its first one
    assert lengths(program)[at].sum() == pytest.approx(own, rel=1e-3 if spirals(commands, 1e-6).any() else 1e-9)


@pytest.mark.skipif(not DATA.is_dir(), reason="no programs")
@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
@pytest.mark.parametrize(("name", "count"), [("boat-xyzac", 1800), ("boat-xyzbc", 1800), ("impeller-7bl-xyzac", 4400)])
def test_program_without_the_machines_own_code(name, count):
    """M428 and M429 set nothing but tip control: without them rs274 takes the text, and our motions stay the same."""
    path = DATA / "linuxcnc_5axis" / f"{name}.ngc"
    text = path.read_text()
    (commands, _), table = _read(path, text)
    motions, _ = parse_canonical(run_canonical(re.sub("M42[89]", "", text), table=table))
    assert compare_commands(motions, commands) > count
    assert commands.tcp.all()
