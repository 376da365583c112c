"""Programs in the manner of CAM systems and shops for several controllers; motions by hand from the manuals."""

import math

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.commands import DWELL, LINE, RAPID
from chipload.program.gcode.reader import read_gcode
from rs274 import MISSING, rs274_installed, run_rs274


def fanuc(*lines, **options):
    return read_gcode("\n".join([*lines, "M30"]), dialect="fanuc", **options)


def sinumerik(*lines):
    return read_gcode("\n".join([*lines, "M30"]), dialect="sinumerik")


def unproven(findings):
    return [(f.code, f.line) for f in findings if f.severity is Severity.UNPROVEN]


def machine(commands):
    """(n, 3) where the machine goes."""
    return commands.machine()[:, :3]


# -- Fanuc -----------------------------------------------------------------------------------------------------------


def test_thread_cutting_has_its_lead_in_f():
    """600 rpm are ten turns a second of 1.5 mm."""
    commands, findings = fanuc("G0 X0. Y0. Z5. S600 M3", "G33 Z-9. F1.5", "G0 Z5.")
    assert commands.motion.tolist() == [RAPID, LINE, RAPID]
    assert commands.position[:, 2].tolist() == [5.0, -9.0, 5.0]
    assert commands.feed[1] == pytest.approx(15.0)
    assert unproven(findings) == []


def test_back_boring():
    """Aside by Q, down to R, back, up to Z with the spindle on, a pause, aside, out and back; the level is 10."""
    commands, findings = fanuc(
        "G0 X20. Y5. Z10. S600 M3 F60.", "G98 G87 X20. Y5. Z-5. R-20. Q3. P250", "G80", "G0 X0."
    )  # fmt: skip
    np.testing.assert_allclose(
        commands.position[1:, :3],
        [[20, 5, 10], [17, 5, 10], [17, 5, -20], [20, 5, -20], [20, 5, -5], [20, 5, -5], [17, 5, -5], [17, 5, 10],
         [20, 5, 10], [0, 5, 10]],
    )  # fmt: skip
    assert commands.motion[1:].tolist() == [RAPID, RAPID, RAPID, RAPID, LINE, DWELL, RAPID, RAPID, RAPID, RAPID]
    assert commands.feed[commands.motion == DWELL].tolist() == [0.25]
    assert (commands.spindle[1:] > 0).tolist() == [True, False, False, False, True, True, False, False, False, True]
    assert unproven(findings) == [("nc-back-boring", 2)]


def test_turned_coordinates():
    """G68 about (10, 4) by 90 degrees: (20, 4) becomes (10, 14); a work offset lies beneath it."""
    commands, findings = fanuc("G0 X0. Y0. Z0.", "G68 X10. Y4. R90.", "X20. Y4.", "G91 X1.", "G90 G69", "X20. Y4.")
    np.testing.assert_allclose(machine(commands)[1:], [[10, 14, 0], [10, 15, 0], [20, 4, 0]], atol=1e-9)
    assert unproven(findings) == []
    lines = ("G0 X0. Y0. Z0.", "G68 X0. Y0. R90.", "G55 X5. Y0.", "G69 X5. Y0.")
    commands, _ = fanuc(*lines, origins={2: ((100.0, *[0.0] * 8), 0.0), 1: ((0.0,) * 9, 0.0)})
    np.testing.assert_allclose(machine(commands)[1:], [[100, 5, 0], [105, 0, 0]], atol=1e-9)


@pytest.mark.parametrize(
    ("on", "off"),
    [("G68.2 X0. Y0. Z0. I0. J30. K0.", "G69"),
     ("G7.1 C50.", "G7.1 C0"), ("G12.1", "G13.1")],
)  # fmt: skip
def test_motions_in_coordinates_that_are_not_read_are_left_out_until_they_end(on, off):
    commands, findings = fanuc("G0 X0. Y0. Z0.", on, "G1 X5. F60.", "Y5.", off, "X3.")
    assert commands.position[:, :2].tolist() == [[0.0, 0.0], [3.0, 0.0]]
    # the code of motion lasts although its motion was left out
    assert commands.motion.tolist() == [RAPID, LINE]
    assert [line for _, line in unproven(findings)] == [2]


def test_macro_statements_against_python():
    text = """
    #1=3.(FIRST)
    #2=#1/2.+1.
    G0X0Y0Z0
    WHILE[#1GT0]DO1
    IF[#1EQ2.]GOTO7
    X[#1*10.]Y#2
    N7#1=#1-1.
    END1
    IF[#1LT1.]THEN#3=5.
    X#3
    GOTO20
    X999.
    N20IF[#33EQ#0]GOTO30
    X999.
    N30Y#5002
    X#4006
    """
    commands, findings = fanuc(*(line.strip() for line in text.strip().splitlines()))
    want = [(0.0, 0.0)]
    want += [(10.0 * n, 2.5) for n in (3, 2, 1) if n != 2]
    want += [(5.0, 2.5), (5.0, 2.5), (21.0, 2.5)]
    np.testing.assert_allclose(commands.position[:, :2], want)
    assert unproven(findings) == []


def test_a_macro_has_parameters_of_its_own():
    commands, findings = fanuc(
        "#1=9.", "G0 X0 Y0", "G65 P100 A1. B2. L2", "X#1", "G65 P9999 Z3.", "X8.", "M30",
        "O0100", "IF[#3NE#0]GOTO5", "G91 X#1 Y#2", "G90", "N5 M99",
    )  # fmt: skip
    assert commands.position[:, :2].tolist() == [[0, 0], [1, 2], [2, 4], [9, 4], [8, 4]]
    assert unproven(findings) == [("nc-not-read", 5)]


def test_subprograms_by_number_and_by_block():
    commands, findings = fanuc(
        "G0 X0 Y0", "M97 P50 L2", "M98 P7", "M98 P9", "X9.", "M30", "N50 G91 Y1.", "G90 M99", "O7", "X4.", "M99"
    )  # fmt: skip
    assert commands.position[:, :2].tolist() == [[0, 0], [0, 1], [0, 2], [4, 2], [9, 2]]
    assert unproven(findings) == [("nc-call", 4)]


def test_an_alarm_ends_the_program():
    commands, findings = fanuc("G0 X1.", "IF[1EQ2]THEN#3000=1(NO)", "X2.", "#3000=1(TOOL MISSING)", "X3.")
    assert commands.position[:, 0].tolist() == [1.0, 2.0]
    assert unproven(findings) == [("nc-alarm", 4)]


def test_retractions_to_where_only_the_machine_knows_are_left_out():
    commands, findings = fanuc("G0 X1. Y1. Z5.", "G91 G28 Z0.", "G28 X0. Y0.", "G90 G53 X0. Y0.", "X2.")
    assert commands.position[:, :3].tolist() == [[1, 1, 5], [2, 1, 5]]
    assert unproven(findings) == []
    commands, findings = fanuc("G0 X1. Y1. Z5.", "G53 X0. Y0.", "X2.")
    assert unproven(findings) == [("nc-machine-coordinates", 2)]
    known = {1: ((10.0, 20.0, 30.0, *[0.0] * 6), 0.0)}
    commands, findings = fanuc("G0 X1. Y1. Z5.", "G53 Z0.", "G91 G28 Z0.", "G90 X2.", origins=known)
    np.testing.assert_allclose(machine(commands)[:, 2], [35, 0, 0, 0, 0])


def test_headers_of_posts():
    """As of CAM systems and macros: nothing of it leaves the program unproven, and the path is that of the G1."""
    commands, findings = fanuc(
        "%", ":1234", "(T1 D=10. CR=0. - ZMIN=-5. - FLAT END MILL)", "N10 G90 G94 G17 G49 G40 G80", "N15 G21",
        "N20 G28 G91 Z0.", "N25 G90", "N30 T1 M06", "N35 S5000 M03", "G10 L2 P1 X0. Y0. Z0.", "G10 L20 P3 X1. Y2. Z3.",
        "N45 G54",
        "G154 P3", "N50 M08", "G187 P2 E0.05", "G5.1 Q1", "N55 G00 X15. Y-7.", "N60 G43 Z15. H01",
        "/2 N65 G01 Z1. F333.", "G61.1", "M29 S500", "G0 Z15. M9", "G5.1 Q0", "N115 G28 G91 Z0.", "G28 X0. Y0.",
        "M6 T2",
    )  # fmt: skip
    assert unproven(findings) == []
    np.testing.assert_allclose(machine(commands)[:3, :3], [[16, -5, 0], [16, -5, 18], [16, -5, 4]])


# -- LinuxCNC's dialect, read for others ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "lines",
    [
        ("(Mach3)", "N10G00G21G17G90G40G49G80", "N20G71G91.1", "N30T1M06", "N90X0.000Y0.000F1000.0", "X1."),
        ("G21", "$H", "G0 X0 Y0", "G2 X0 Y0 I5 F100", "G0 X1"),
        ("G17 G54 G40 G49 G80 G90", "G21", "G0 X0 Y0 Z0", "G2 X10 Y10 Z0 I10 J0 K0.000 F400.0", "G0 X1"),
    ],
)
def test_posts_of_mach3_grbl_and_freecad(lines):
    text = "\n".join([*lines, "M30"])
    commands, findings = read_gcode(text, lenient=True)
    assert commands.position[-1, 0] == 1.0
    assert unproven(findings) == []
    with pytest.raises(InputError):
        read_gcode(text)


# -- Sinumerik -------------------------------------------------------------------------------------------------------


def test_shifted_and_turned_coordinates():
    """By hand: TRANS replaces, ATRANS and AROT go on within; without axes they end."""
    commands, findings = sinumerik(
        "G0 X0 Y0 Z0", "TRANS X10 Y5", "X1 Y0", "AROT RPL=90", "X1 Y0", "ATRANS X2", "X1 Y0", "ROT Z90", "X1 Y0",
        "TRANS X1", "X0 Y0", "TRANS", "X1 Y0",
    )  # fmt: skip
    np.testing.assert_allclose(
        machine(commands)[1:, :2], [[11, 5], [10, 6], [10, 8], [0, 1], [1, 0], [1, 0]], atol=1e-9
    )
    assert unproven(findings) == []


@pytest.mark.parametrize(
    ("on", "off"),
    [
        ("ROT X30", "ROT"),
        ('CYCLE800(1,"TC1",100000,57,0,0,0,0,30,0,0,0,0,1,0)', "CYCLE800()"),
    ],
)
def test_frames_that_are_not_read(on, off):
    commands, findings = sinumerik("G0 X0 Y0 Z0", on, "X5", off, "X3")
    assert commands.position[:, 0].tolist() == [0.0, 3.0]
    assert unproven(findings) == [("nc-left-out", 2)]


def test_a_plane_that_is_not_swivelled_changes_nothing():
    commands, findings = sinumerik('CYCLE800(1,"TC1",100000,57,0,0,0,0,0,0,0,0,0,1,0)', "G0 X3")
    assert len(commands) == 1
    assert unproven(findings) == []


def test_names_and_dwells():
    commands, findings = sinumerik(
        "DEF REAL _A=1.5, B2", "DEF INT N=3", "G0 X=_A*2 S600", "_A=N+B2", "G0 X=_A", "G4 S20", "G0 Z=_ZHOME D0", "X4"
    )  # fmt: skip
    assert commands.position[:, 0].tolist() == [3.0, 3.0, 3.0, 4.0]
    # twenty turns at ten a second
    assert commands.feed[commands.motion == DWELL].tolist() == [2.0]
    assert unproven(findings) == [("nc-not-read", 7)]


@pytest.mark.parametrize("block", ["L100", "SUB1", "G1 X9 A3=0 B3=0 C3=1 F5", "POCKET3(15,0,5,-5,20,10)"])
def test_calls_and_vectors_are_left_out(block):
    commands, findings = sinumerik("G0 X1", block, "X2")
    assert commands.position[:, 0].tolist() == [1.0, 2.0]
    assert [line for _, line in unproven(findings)] == [2]


def test_tapping_with_a_floating_chuck():
    """RFP 0, SDIS 2, RTP 10, bottom -9; 600 rpm of 1.25 mm, by pitch and by size; without them at F."""
    for arguments, feed in (("0,0,4,0,,1.25", 12.5), ("0,0,4,0,8,", 12.5), ("0.5,4,3,1,,", 5.0)):
        commands, findings = sinumerik("G0 X0 Y0 Z20 S600 M3 F300", f"CYCLE840(10,0,2,-9,,{arguments})")
        fed = commands.motion == LINE
        assert commands.position[fed, 2].tolist() == [-9.0, 2.0]
        assert commands.feed[fed].tolist() == pytest.approx([feed, feed])
        assert np.sign(commands.spindle[fed]).tolist() == [1.0, -1.0]
        assert commands.position[-1, 2] == 10.0
        assert unproven(findings) == []


# -- beside LinuxCNC -------------------------------------------------------------------------------------------------


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
def test_turned_coordinates_and_macros_beside_rs274():
    """The same holes by G68 and a loop of a Fanuc, and by LinuxCNC's rotation of the work offset and O-words."""
    turned, _ = fanuc(
        "G21 F60. S100 M3", "G0 X0 Y0 Z5.", "G68 X0 Y0 R30.", "#1=1.", "WHILE[#1LE3.]DO1", "G0 X[#1*10.] Y0", "G1 Z-1.",
        "G0 Z5.", "#1=#1+1.", "END1", "G69",
    )  # fmt: skip
    text = "G21 F60 S100 M3\nG10 L2 P1 X0 Y0 Z0 R30\nG0 X0 Y0 Z5\n#1=1\no1 while [#1 LE 3]\nG0 X[#1*10] Y0\nG1 Z-1\n"
    text += "G0 Z5\n#1=[#1+1]\no1 endwhile\nM2\n"
    # canonical positions lie in the turned coordinates
    want = np.array([m.end for m in run_rs274(text)])
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    there = np.column_stack([c * want[:, 0] - s * want[:, 1], s * want[:, 0] + c * want[:, 1], want[:, 2]])
    np.testing.assert_allclose(machine(turned), there, atol=2e-4)
