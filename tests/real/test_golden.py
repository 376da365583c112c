"""Programs of LinuxCNC's own tests and real programs: the motions that LinuxCNC prints for them."""

import os
import re
from pathlib import Path

import pytest

from canonical import Refused, compare_commands, parse_canonical, run_canonical
from chipload.errors import InputError
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import read_tool_table
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
}


def _golden():
    if not GOLDEN.is_dir():
        return []
    texts = [path for path in sorted(GOLDEN.rglob("*.ngc"))]
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
    try:
        (commands, _), table = _read(path, text)
    except InputError as error:
        commands, table, refused = None, TABLE, str(error)
        assert refused.startswith(f"{path.name}: line ")
    name = str(path.relative_to(DATA))
    try:
        printed = run_canonical(text, table=table)
    except Refused as error:
        if name in OURS_ALONE:
            assert commands is not None
            assert len(commands) > 0 or "g64" in name
            return
        assert commands is None, f"rs274 refuses it: {error}"
        return
    assert commands is not None, refused
    motions, _ = parse_canonical(printed)
    surface = "G96" in text
    assert compare_commands(motions, commands, spindle=not surface) > 0 or len(motions) == 0


@pytest.mark.skipif(not DATA.is_dir(), reason="no programs")
@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
@pytest.mark.parametrize("name", ["boat-xyzac", "boat-xyzbc"])
def test_boat_without_the_machines_own_code(name):
    """M428 and M429 set nothing but tip control: without them rs274 takes the text, and our motions stay the same."""
    path = DATA / "linuxcnc_5axis" / f"{name}.ngc"
    text = path.read_text()
    (commands, _), table = _read(path, text)
    motions, _ = parse_canonical(run_canonical(re.sub("M42[89]", "", text), table=table))
    assert compare_commands(motions, commands) > 1800
    assert commands.tcp.all()
