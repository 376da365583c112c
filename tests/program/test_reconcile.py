"""What job, tool table, CL data and comments state about a cutter."""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError, Severity
from chipload.machine.machine import machine_named
from chipload.program.apt.cutters import read_cutters
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import read_tool_table
from chipload.program.read import read_program
from chipload.program.reconcile import agree
from chipload.program.setup import Setup
from chipload.program.tool_comments import stated_diameters, stated_tools

MILL = Cutter(10.0, 4, math.radians(30.0), 20.0, 30.0, 5.8e5, number=1)


@pytest.mark.parametrize(
    ("text", "stated"),
    [
        ("(T1 D=10. CR=0. - ZMIN=-5. - flat end mill)", {1: 10.0}),
        ("( TOOL: T1 = 10.0 dia. ENDMILLM1000:REG )", {1: 10.0}),
        ("; T12 | 6.0 FLAT ENDMILL | H12", {12: 6.0}),
        ("(TOOL 3 - DIA 8.5 MM)", {3: 8.5}),
        ("G20\n(T2 D=0.5 CR=0.)", {2: 12.7}),
        ("G21\n(T2 = 0.5 INCH END MILL)", {2: 12.7}),
        ("(T1 D=10.)\n(T1 D=6.)", {1: 10.0}),
        ("(Tool: 1/8 in Carbide End Mill)", {}),
        ('(tool 4 is 1" in diameter and must be defined in the tool table)', {4: 25.4}),
        ("(change tool 3 at 100 mm)", {}),
        ("T1 D10 M6", {}),
        ("( T1 | 10. FLAT ENDMILL | H1 | D1 | WEAR COMP | TOOL DIA. - 10. )", {1: 10.0}),
        ("(T3|1/4 FLAT ENDMILL|H3|D3)", {3: 6.35}),
        ("(TOOL - 3  DIA. OFF. - 3  LEN. - 3  DIA. - .5 )", {3: 0.5}),
        ("(T5 | 6. DRILL | H5)", {5: 6.0}),
        ("(T2 DIA6.5)", {2: 6.5}),
        ("(T1 H1 D31)", {}),
        ("(T1 D1)", {}),
        ("(T10 D10 MM)", {10: 10.0}),
        ("(T3 | 1/0 FLAT ENDMILL)", {}),
        ("(D=10 without a tool)", {}),
        ("(T2: D 8 MM, 3 FLUTES, OVERHANG 22 MM)", {2: 8.0}),
        ("(T4 DRILL 5 HOLES)", {}),
        ("(T6 TOOL FOR 3 SLOTS, END MILL)", {}),
    ],
)
def test_comments(text, stated):
    assert {k: v.diameter for k, v in stated_diameters(text).items()} == pytest.approx(stated)


def test_a_real_comment_with_the_cutter_that_it_states(tmp_path: Path):
    data = Path(os.environ.get("CHIPLOAD_DATA", "/nonexistent")) / "nc"
    found = [p for p in sorted(data.rglob("*.ngc")) if "TOOL: T1 = 10.0 dia." in p.read_text("utf-8", "replace")]
    if not found:
        pytest.skip("no real programs: set CHIPLOAD_DATA")
    for path in found:
        machine = machine_named(f"{path.stem.split('-')[-1]}-trunnion")
        read_program(path, machine, setup=Setup(cutters={1: MILL}))
        with pytest.raises(InputError, match=r"states 10 mm for tool 1, the \[\[cutter\]\] has 12 mm"):
            read_program(path, machine, setup=Setup(cutters={1: replace(MILL, diameter=12.0)}))


@pytest.mark.parametrize(
    ("record", "message"),
    [
        ("CUTTER/12", "CUTTER states the diameter 12 mm for tool 1, the [[cutter]] has 10 mm"),
        ("CUTTER/10,2", "CUTTER states the corner radius 2 mm for tool 1, the [[cutter]] has 0 mm"),
        ("CUTTER/10,0,5,0,0,3,20", "CUTTER states the taper 3 deg for tool 1, the [[cutter]] has 0 deg"),
    ],
)
def test_a_cutter_of_cl_data_that_is_another_is_refused(record, message):
    shapes, _ = read_cutters(f"UNITS/MM\n{record}\nLOADTL/1\nGOTO/0,0,0\nFINI")
    with pytest.raises(InputError) as caught:
        agree("part.apt", {1: MILL}, shapes=shapes)
    assert str(caught.value).startswith(f"part.apt: {message}: must agree within ")
    assert agree("part.apt", {2: replace(MILL, number=2)}, shapes=shapes) == ()


def test_cl_data_of_a_job_is_held_against_its_cutters(tmp_path: Path):
    path = tmp_path / "part.apt"
    path.write_text("UNITS/MM\nLOADTL/1\nCUTTER/6\nRAPID\nGOTO/0,0,5\nFEDRAT/60,MMPM\nGOTO/0,0,0\nFINI\n")
    with pytest.raises(InputError, match="CUTTER states the diameter 6 mm for tool 1"):
        read_program(path, machine_named("vmc"), setup=Setup(cutters={1: MILL}))
    assert len(read_program(path, machine_named("vmc"), setup=Setup(cutters={1: replace(MILL, diameter=6.0)})).program)


SIDE = "G0 X0 Y0\nF60\nG41 D1\nG1 Y20\nG1 X30\nG40\nM2"


def centre(findings_and, **options):
    commands, findings = read_gcode(SIDE, **options)
    found = {f.code: f.severity for f in findings}
    assert findings_and <= found.keys()
    # on the way along X the centre stands a radius to the left, at larger Y
    return commands.position[-1, 1] - 20.0, found


def test_what_g41_compensates_for():
    table = read_tool_table("T1 P1 D8\n")[0]
    radius, _ = centre(set(), tools=table, diameters={1: 8.0})
    assert radius == pytest.approx(4.0)
    radius, found = centre({"nc-diameter-of-cutter"}, diameters={1: 10.0})
    assert (radius, found["nc-diameter-of-cutter"]) == (pytest.approx(5.0), Severity.NOTE)
    radius, found = centre({"nc-diameter-unknown"})
    assert (radius, found["nc-diameter-unknown"]) == (0.0, Severity.UNPROVEN)
    radius, found = centre({"nc-diameter-missing"}, tools=read_tool_table("T1 P1\n")[0], diameters={1: 10.0})
    assert (radius, found["nc-diameter-missing"]) == (pytest.approx(5.0), Severity.UNPROVEN)


def test_d_of_other_dialects():
    """Fanuc's D is a register, Sinumerik's an edge: without data both mean the cutter in the spindle."""
    text = "T5 M6\n" + SIDE.replace("D1", "D31").replace("Y20", "Y20.").replace("X30", "X30.")
    commands, findings = read_gcode(text, dialect="fanuc", diameters={5: 12.0}, compensation="control")
    assert commands.position[-1, 1] == pytest.approx(26.0)
    assert max(f.severity for f in findings) is Severity.NOTE
    tools = read_tool_table("T1 P1 D3\nT5 P5 D12\n")[0]
    commands, _ = read_gcode(f"T5 M6\n{SIDE}".replace("M2", "M30"), dialect="sinumerik", tools=tools)
    assert commands.position[-1, 1] == pytest.approx(26.0)


def test_a_length_that_is_not_known_matters_where_an_axis_turns_the_tool(tmp_path: Path):
    path = tmp_path / "part.ngc"
    path.write_text("T1 M6\nG43 H1\nG0 X0 Y0 Z50\nF600\nG1 X10 C30\nY5\nM2\n")
    for machine, severity in (
        ("vmc-a", Severity.NOTE),
        ("xyzac-trunnion", Severity.NOTE),
        ("xyzbc-head-table", Severity.UNPROVEN),
    ):
        noticed = read_program(path, machine_named(machine)).findings
        assert [f.severity for f in noticed if f.code == "nc-length-unknown"] == [severity]


@pytest.mark.parametrize(("machine", "same"), [("xyzac-trunnion", True), ("xyzbc-head-table", False)])
def test_a_table_carries_the_tip_whatever_the_length(tmp_path: Path, machine, same):
    """Two lengths give one path where the rotary axes are in the table, and two where one carries the tool."""
    path = tmp_path / "part.ngc"
    axis = "A" if same else "B"
    path.write_text(f"T1 M6\nG43 H1\nG0 X0 Y0 Z50\nF600\nG1 X10 {axis}20 C30\nY5\nM2\n")
    ends = []
    for length in (10, 90):
        tools = read_tool_table(f"T1 P1 D8 Z{length}\n")[0]
        ends.append(read_program(path, machine_named(machine), tools=tools).program.p_work[-1])
    assert np.allclose(*ends, atol=1e-9) == same


def test_the_length_of_another_tool_leaves_the_result_unproven():
    tools = read_tool_table("T1 P1 D8 Z40\nT2 P2 D8 Z50\n")[0]
    _, findings = read_gcode("T1 M6\nG43 H2\nG0 Z5\nM2", tools=tools)
    assert [(f.code, f.severity) for f in findings] == [("nc-length-of-another-tool", Severity.UNPROVEN)]


@pytest.mark.parametrize(("dialect", "severity"), [("linuxcnc", Severity.UNPROVEN), ("fanuc", Severity.NOTE)])
def test_the_offset_of_another_tool_is_named_without_a_tool_table(dialect, severity):
    for h, found in (("H3", [severity]), ("H4", [])):
        _, findings = read_gcode(f"T4 M6\nG43 {h}\nG0 Z5.\nM30", dialect=dialect)
        assert [f.severity for f in findings if f.code == "nc-length-of-another-tool"] == found


@pytest.mark.parametrize("axes", ["X1. Y-.5 F800", "N10 G1 X1 y2", "C90. Z3"])
def test_a_comment_above_many_motions_describes_no_tool_of_a_later_change(axes: str):
    change, comment = "T3 M6", "(6 MM FLAT ENDMILL)"
    motions = "\n".join([axes] * 1200)
    assert stated_tools(f"{comment}\n{change}\n{motions}\n", 1.0)[3]["diameter_mm"][0] == 6.0
    assert stated_tools(f"{comment}\n{motions}\n{change}\n{motions}\nM30\n", 1.0) == {}
    # and one of its own stands among them
    assert stated_tools(f"{motions}\n{change} {comment}\n{motions}\n", 1.0)[3]["diameter_mm"][0] == 6.0
