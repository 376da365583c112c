"""Which control, which unit: by what a text shows. Texts are written for this test; what is right is what they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from chipload.errors import InputError, Severity
from chipload.machine.machine import machine_named
from chipload.program.gcode.tools import read_tool_table
from chipload.program.read import read_program
from chipload.program.recognise import recognise
from chipload.program.setup import Setup, StatedControl

VMC = machine_named("vmc")
ISO = "%\nO0012\nG21 G90 G17 G94 G54\nT1 M6\nS1000 M3\nG0 X0. Y0. Z5.\nG1 Z-1. F100.\n{}\nM30\n%\n"


@pytest.mark.parametrize(
    ("text", "control"),
    [
        ("G21 G90\nG64 P0.01\nG0 X1 Y2\nM2", "linuxcnc"),
        ("o100 sub\nG1 X#1\no100 endsub\nM2", "linuxcnc"),
        (ISO.format("G154 P3"), "haas"),
        (ISO.format("(HAAS VF2)"), "haas"),
        (ISO.format("G187 P1"), "haas"),
        (ISO.format("G05.1 Q1"), "fanuc"),
        (ISO.format("X1."), "fanuc"),
        (ISO.format("G100 T2"), "brother"),
        (ISO.format("G15 H2\nG56 H1"), "okuma"),
        ('N10 G17 G90 G710\nT="MILL_6"\nM6\nG1 X=AC(10) F100\nM30', "sinumerik"),
        ("MCALL CYCLE81(10,0,2,-5)\nX10\nMCALL\nM30", "sinumerik"),
        ("0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S1000\n2 L X+0 FMAX\n3 END PGM A MM", "heidenhain"),
        ("$H\nG21 G90\nG0 X1\nM30", "grbl"),
        ("(POSTED FOR MACH3)\nG21 G90\nG0 X1\nM30", "mach3"),
    ],
)
def test_the_control_of_a_text(text, control):
    assert recognise(text, "linuxcnc").control.name == control


def read(tmp_path, text, ending=".nc", tools=None, **stated):
    path = tmp_path / f"part{ending}"
    path.write_text(text)
    reading = read_program(path, VMC, tools=tools, setup=Setup(control=StatedControl(**stated)))
    gaps = [f.code for f in reading.findings if f.severity >= Severity.UNPROVEN and "length" not in f.code]
    return reading, gaps


def test_a_guess_that_changes_the_time_is_unproven(tmp_path: Path):
    """F counts degrees and mm together on a Fanuc; on a Haas by a diameter that a setting states."""
    reading, gaps = read(tmp_path, ISO.format("G4 P500\nX1."))
    assert (reading.recognition.control.name, gaps) == ("fanuc", [])
    reading, gaps = read(tmp_path, ISO.format("(HAAS VF2)\nG4 P2."))
    assert (reading.recognition.control.name, gaps) == ("haas", [])
    _, gaps = read(tmp_path, ISO.format("G4 P2."))
    assert gaps == []  # a point in a dwell speaks against milliseconds; Haas and Brother take it as seconds


def test_what_is_stated_counts(tmp_path: Path):
    reading, gaps = read(tmp_path, ISO.format("(HAAS VF2)\nG4 P500"), name="fanuc")
    assert (reading.recognition.control.name, reading.recognition.stated, gaps) == ("fanuc", True, [])


@pytest.mark.parametrize(("unit", "x"), [("mm", 2.0), ("inch", 50.8)])
def test_a_unit_that_is_not_written(tmp_path: Path, unit, x):
    text = (
        "%\nO3\nG90 G94 G17 G40\nT1 M6\nS5000 M3\nG54\nG0 X0. Y0.\nG43 Z1. H1\nG1 Z-.1 F10.\nX2. F20.\nG0 Z1.\nM30\n%\n"
    )
    _, gaps = read(tmp_path, text, name="haas")
    assert gaps == ["nc-unit"]
    reading, gaps = read(tmp_path, text, name="haas", unit=unit)
    assert (reading.program.p_work[:, 0].max(), gaps) == (pytest.approx(x), [])
    reading, gaps = read(tmp_path, text.replace("G17", "G17 G21"), name="haas", unit="inch")
    assert (reading.program.p_work[:, 0].max(), gaps) == (pytest.approx(2.0), [])


INCH = """%
O1
(T1 D=2. CR=0. - FACE MILL)
(T2 D=0.5 CR=0. - FLAT END MILL)
G20 G90 G17 G94 G54
T2 M6
S900 M3
G0 X0. Y0.
G43 H2 Z1.
G1 Z-.1 F9.
G41 D2 X1. Y0.
Y1.
G40 X0.
G0 Z1.
M30
%
"""


def test_a_tool_table_of_inches(tmp_path: Path):
    table = read_tool_table("T1 P1 Z2.5 D2.0\nT2 P2 Z3.25 D0.5\n")[0]
    reading, gaps = read(tmp_path, INCH, tools=table, name="haas")
    assert gaps == ["nc-tools-unit"]
    # the path is compensated by a quarter of an inch
    assert reading.program.p_work[-3, 0] == pytest.approx(25.4 - 6.35)
    reading, gaps = read(tmp_path, INCH, tools=table, name="haas", tools_unit="inch")
    assert (reading.program.p_work[-3, 0], gaps) == (pytest.approx(25.4 - 6.35), [])
    millimetres = read_tool_table("T1 P1 Z63.5 D50.8\nT2 P2 Z82.55 D12.7\n")[0]
    reading, gaps = read(tmp_path, INCH, tools=millimetres, name="haas")
    assert (reading.program.p_work[-3, 0], gaps) == (pytest.approx(25.4 - 6.35), [])


def test_what_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match=r"program.unit = 'cm': must be one of mm, inch"):
        StatedControl(unit="cm")
    path = tmp_path / "part.nc"
    path.write_text(ISO.format(""))
    with pytest.raises(
        InputError, match=r"program.control = 'haas' and dialect = 'sinumerik': haas is fanuc: state one"
    ):
        read_program(path, VMC, dialect="sinumerik", setup=Setup(control=StatedControl("haas")))


def test_probing_at_rest_is_no_cut(tmp_path: Path):
    text = "G21 G90 G17 G94\nT20 M6\nG43 H20\nG0 X0 Y0 Z5\nG38.2 Z-5 F50\nG0 Z5\n"
    text += "T1 M6\nG43 H1\nS1000 M3\nG1 Z-1 F100\nM2\n"
    reading, gaps = read(tmp_path, text, ending=".ngc")
    assert [f.code for f in reading.violations] == []
    assert gaps == ["nc-probe"]
    reading, _ = read(tmp_path, text.replace("G38.2", "G1"), ending=".ngc")
    assert [f.code for f in reading.violations] == ["machine-spindle-off"]


@pytest.mark.parametrize(
    "head", ["<COVER-PLATE>", "<COVER-PLATE> (OP 10)", "O0028(TEST ; NO COMMENT (WITHIN ONE)", "O28 (A (B (C)"]
)
def test_names_and_comments_of_a_program_are_no_gaps(tmp_path, head):
    """A name in <> instead of O, and a comment that ends at its first ): nothing is left out."""
    path = tmp_path / "a.nc"
    path.write_text(f"%\n{head}\nG21 G90 G17 G54\nT1 M6\nS1000 M3\nG0 X0. Y0.\nG43 H1 Z5.\nG1 Z-1. F100.\nM30\n%\n")
    reading = read_program(path, VMC)
    assert [f.text for f in reading.findings if f.severity is not Severity.NOTE] == []
    assert reading.program.p_work[-1].tolist() == [0.0, 0.0, -1.0]
    if head.startswith("<"):
        assert reading.recognition.control.name == "fanuc"


def test_a_control_that_would_cut_at_thousandths_of_the_feed_is_not_the_one(tmp_path: Path):
    """F50 beside F100.: a Haas would cut at 0.05 mm/min, which nobody programs."""
    (tmp_path / "part.nc").write_text(ISO.format("G1 X10. F50"))
    reading = read_program(tmp_path / "part.nc", VMC)
    found = [f for f in reading.findings if f.code == "nc-control"]
    assert [f.severity for f in found] == [Severity.NOTE]
    assert "Haas NGC would cut at 0.05 mm/min" in found[0].text
    assert reading.commands.feed.max() * 60.0 == pytest.approx(100.0)
