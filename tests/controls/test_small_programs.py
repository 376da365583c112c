"""Small programs of GRBL, Brother and Mach3, each by hand: end, time and dwells by closed forms of the manuals."""

import math

import pytest

from chipload.errors import Severity
from chipload.program.control import control_named
from chipload.program.gcode.modal import code_text
from control_texts import codes, dwells, ends, minutes, read

HEAD = "G21 G17 G90 G94 G54\nS1000 M3\nG0 X0. Y0. Z10.\n"
HALF = math.pi * 5.0 / 100.0
#: control, text, end [mm], time of cuts and dwells [min]
PROGRAMS = [
    ("grbl", "G1 X20. F100", (20, 0, 10), 0.2),
    ("grbl", "G20 G1 X1. F10.", (25.4, 0, 10), 0.1 * 25.4),
    ("grbl", "G91 G1 X10. F100\nX10.", (20, 0, 10), 0.2),
    ("grbl", "G2 X10. Y0. R5. F100", (10, 0, 10), HALF),
    ("grbl", "G3 X10. Y0. I5. J0. F100", (10, 0, 10), HALF),
    ("grbl", "G4 P0.5", (0, 0, 10), 0.5 / 60),
    ("grbl", "G93 G1 X10. F2", (10, 0, 10), 0.5),
    ("grbl", "G43.1 Z5.\nG1 Z0. F100", (0, 0, 0), 0.05),
    ("grbl", "G92 X5.\nG1 X10. F100", (10, 0, 10), 0.05),
    ("grbl", "G10 L20 P1 X3.\nG1 X13. F100", (13, 0, 10), 0.1),
    ("grbl", "G1 X10. A360. F100", (10, 0, 10), math.hypot(10, 360) / 100),
    ("brother", "G4 P500", (0, 0, 10), 0.5 / 60),
    ("brother", "G4 P1.", (0, 0, 10), 1.0 / 60),
    ("brother", "G4 X1.5", (0, 0, 10), 1.5 / 60),
    ("brother", "G100 T2 X10. Y5. G43 Z30. H2\nG1 Z0. F300.", (10, 5, 0), 0.1),
    ("brother", "G77 X5. Y5. Z-8. R2. I1. S500\nG80", (5, 5, 10), 20.0 / 500),
    ("brother", "G77 X5. Y5. Z-8. R2. J20 S500\nG80", (5, 5, 10), 20.0 / (500 * 1.27)),
    ("brother", "G78 X5. Y5. Z-8. R2. I1. S500\nG80", (5, 5, 10), 20.0 / 500),
    ("brother", "G81 X5. Y5. Z-8. R2. F100. K2\nG80", (5, 5, 10), 0.2),
    ("brother", "G82 X5. Z-4. R2. P0.5 F100.\nG80", (5, 0, 10), 0.06 + 0.5 / 60),
    ("brother", "M298 L3\nG1 X10. F100.", (10, 0, 10), 0.1),
    ("brother", "G68 R90.\nG1 X10. F100.\nG69", (10, 0, 10), 0.1),
    ("mach3", "G4 P2", (0, 0, 10), 2.0 / 60),
    ("mach3", "G81 X5. Z-8. R2. F100\nG80", (5, 0, 2), 0.1),
    ("mach3", "G82 X5. Z-4. R2. P1 F100\nG80", (5, 0, 2), 0.06 + 1.0 / 60),
    ("mach3", "G98 G81 X5. Z-8. R2. F100\nG80\nG0 X7.", (7, 0, 10), 0.1),
    ("mach3", "G70\nG1 X1. F10", (25.4, 0, 10), 2.54 / 25.4),
    ("mach3", "M98 P100 L2\nM30\nO100\nG91 G1 X5. F100\nM99", (10, 0, 10), 0.1),
    ("mach3", "G92 X5.\nG1 X10. F100\nG92.1", (10, 0, 10), 0.05),
    ("mach3", "G90.1\nG2 X10. Y0. I5. J0. F100", (10, 0, 10), HALF),
    ("mach3", "G61\nG1 X5. F100", (5, 0, 10), 0.05),
    ("mach3", "G93 G1 X10. F2", (10, 0, 10), 0.5),
]


@pytest.mark.parametrize(("control", "text", "end", "time"), PROGRAMS, ids=[f"{c}: {t}" for c, t, *_ in PROGRAMS])
def test_a_small_program(control, text, end, time):
    commands, findings = read(text, control, head=HEAD)
    assert findings == []
    assert ends(commands)[-1].tolist() == pytest.approx(end)
    assert minutes(commands) == pytest.approx(time, rel=1e-6)


@pytest.mark.parametrize("code", sorted(control_named("grbl").text.unread))
def test_what_a_grbl_does_not_have_is_a_finding(code):
    """Its blocks stop the program there: what a GRBL does not list as supported is not read as a LinuxCNC has it."""
    commands, findings = read(f"{code_text(code)} X1. Z-5. R2. D1 I1. F100\nG1 X9. F100", "grbl", head=HEAD)
    assert codes(findings)[0] == "nc-not-read"
    assert findings[0].severity is Severity.UNPROVEN
    assert commands.position[:, 2].min() == 10.0
    assert dwells(commands) == []


@pytest.mark.parametrize(
    ("on", "off"), [("G16", "G15"), ("G51 X2 Y2", "G50"), ("G68 A0 B0 R90", "G69")], ids=["polar", "scaled", "turned"]
)
def test_changed_coordinates_of_a_mach3_are_left_out_until_they_end(on, off):
    commands, findings = read(f"{on}\nG1 X10. Y90. F100\n{off}\nG1 X5. F100", "mach3", head=HEAD)
    assert codes(findings) == ["nc-left-out"]
    assert ends(commands)[-1].tolist() == [5, 0, 10]
    assert ends(commands)[:, 1].max() == 0.0


@pytest.mark.parametrize(
    ("control", "away"), [("grbl", "G28 G91 Z0\nG90"), ("grbl", "G53 G0 Z-3"), ("linuxcnc", "G30")]
)
def test_a_home_position_that_nobody_states_is_no_motion(control, away):
    commands, findings = read(f"G1 Z-1. F100\nG1 X20.\nG0 Z5.\n{away}\nG0 X0. Y0.", control, head=HEAD)
    assert findings == []
    assert ends(commands)[-2:].tolist() == [[20, 0, 5], [0, 0, 5]]
    at_home = read(f"#5181=4 #5182=6 #5183=90\n{away}", control, head=HEAD)[0]
    assert away != "G30" or ends(at_home)[-1].tolist() == [4, 6, 90]


@pytest.mark.parametrize("control", ["grbl", "linuxcnc", "haas", "fanuc"])
@pytest.mark.parametrize("away", ["G53 G0 Z-300.", "G53 G1 Z-5. F500.", "G20\nG53 G0 Z-4."])
def test_a_motion_down_in_the_coordinates_of_the_machine_is_no_retraction(control, away):
    _, findings = read(f"G1 Z-1. F100.\nG0 Z5.\n{away}", control, head=HEAD)
    assert [f.severity for f in findings if f.code == "nc-machine-coordinates"] == [Severity.UNPROVEN]
