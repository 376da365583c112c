"""One block: words, expressions, parameters, and what labels and findings it leaves."""

import math

import pytest

from chipload.errors import InputError, Severity
from chipload.program.gcode.expression import DEEPEST, read_value
from chipload.program.gcode.parameters import Parameters
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.words import bare, read_block


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("[1+2*3**2]", 19.0),
        ("[2**3**2]", 64.0),
        ("[10/4/5]", 0.5),
        ("[7mod4--1]", 4.0),
        ("[-7mod4]", 1.0),
        ("[7mod-4]", 3.0),
        ("[2lt3+1]", 1.0),
        ("[1eq1and0gt1or1]", 1.0),
        ("[5xor5]", 0.0),
        ("[1eq1.00009]", 1.0),
        ("[1ge1.00001]", 0.0),
        ("-[2+3]", -5.0),
        ("--1", 1.0),
        ("sin[30]", 0.5),
        ("atan[1]/[0]", 90.0),
        ("atan[0-1]/[-1]", -135.0),
        ("fix[-1.5]", -2.0),
        ("fup[-1.5]", -1.0),
        ("round[-1.5]", -2.0),
        ("round[2.5]", 3.0),
        ("sqrt[ln[exp[4]]]", 2.0),
        ("acos[0.5]", 60.0),
        ("##1", 7.0),
        ("#[#1-3]", 6.0),
        ("#<deep>", 0.25),
        ("exists[#<deep>]", 1.0),
        ("exists[#<_no>]", 0.0),
    ],
)
def test_value(text, value):
    parameters = Parameters({1: 5.0, 2: 6.0, 5: 7.0})
    parameters.assign("deep", 0.25)
    got, end = read_value(text, 0, parameters)
    assert got == pytest.approx(value, abs=1e-12)
    assert end == len(text)


def test_nesting_is_bounded():
    assert read_value("[" * DEEPEST + "1" + "]" * DEEPEST, 0, Parameters())[0] == 1.0
    with pytest.raises(InputError, match=f"nested deeper than {DEEPEST}"):
        read_value("[" * (DEEPEST + 1) + "1", 0, Parameters())


def test_spaces_case_and_comments_mean_nothing():
    text, comments = bare("  n0020 G 0 x 1 0 . 5 (to the left) Y -.5; and ( on")
    block = read_block(text, comments, Parameters())
    assert block.number == 20
    assert block.g == [0]
    assert block.words == {"x": 10.5, "y": -0.5}
    assert comments == ["to the left", " and ( on"]


def test_an_assignment_holds_from_the_next_block():
    commands, _ = read_gcode("#1=5\n#1=6 G0 X#1\nY#1\n#<a b>=[3] #3=1\nZ#<AB> X#3\nM2")
    assert commands.position[:, :3].tolist() == [[5.0, 0.0, 0.0], [5.0, 6.0, 0.0], [1.0, 6.0, 3.0]]


def test_a_parameter_read_before_it_is_set_is_noted():
    _, findings = read_gcode("G0 X#7\nM2")
    assert [(x.code, x.line) for x in findings] == [("nc-parameter-unset", 1)]


def test_parameters_mirror_the_state():
    text = (
        "G20 G91 G55 G0 X1 Y2\nF30 S50 M3\n(debug, #5420 #<_y> #5220 #<_metric> #<_incremental> #<_feed> #<_rpm>)\nM2"
    )
    _, findings = read_gcode(text)
    said = [x.text for x in findings if x.code == "nc-message"]
    assert said == ["1.000000 2.000000 2.000000 0.000000 1.000000 30.000000 50.000000"]


def test_rows_carry_line_label_spindle_tool_and_feed():
    text = "G21 (start)\nT3 M6\nS600 M4\nG0 X1\n(cut)\nG1 X2 F120\nA90 F60\nX3 A0\nM2"
    commands, findings = read_gcode(text)
    assert commands.line.tolist() == [4, 6, 7, 8]
    assert [commands.labels[k] for k in commands.label] == ["start", "cut", "cut", "cut"]
    assert commands.tool.tolist() == [3, 3, 3, 3]
    assert commands.spindle == pytest.approx([-20.0 * math.pi] * 4)
    # A alone turns at 60 deg/min; with X it is the length that is fed
    assert commands.feed == pytest.approx([0.0, 2.0, math.radians(1.0), 1.0])
    assert commands.position[2, 3] == pytest.approx(0.5 * math.pi)
    assert [x.code for x in findings] == ["nc-tool-unknown"]


def test_inverse_time_becomes_a_speed_by_the_length():
    text = "G93 G1 X3 Y4 F2\nA9 F2\nG2 X3 Y4 I5 F1\nM2"
    commands, _ = read_gcode(text)
    # 5 mm in half a minute; 9 deg in half a minute; a whole turn of radius 5 in a minute
    assert commands.feed == pytest.approx([10.0 / 60.0, math.radians(18.0) / 60.0, 10.0 * math.pi / 60.0])


def test_feed_for_each_turn():
    commands, _ = read_gcode("G95 S300 M3 G1 X1 F0.2\nM2")
    assert commands.feed == pytest.approx([1.0])


def test_f_is_read_before_the_units_of_its_block():
    commands, findings = read_gcode("G20 F60 G1 X1\nF60 X2\nM2")
    assert commands.feed == pytest.approx([1.0, 25.4])
    assert [x.code for x in findings] == ["nc-feed-before-units"]


def test_tip_control():
    commands, _ = read_gcode("G0 X1\nM428\nX2\nM429\nX3\nG43.4 H0\nX4\nG49\nX5\nM2")
    assert commands.tcp.tolist() == [False, True, False, True, False]


def test_start_and_parameters():
    parameters = {5220: 2.0, 5241: 1.0, 5250: 90.0}
    start = [1.0, 2.0, 0.0, math.pi, 0.0, 0.0, 0.0, 0.0, 0.0]
    commands, _ = read_gcode("G91 G0 X1\nM2", start=start, parameters=parameters)
    # (1, 2) of the machine is 2 along Y of the machine from the origin: X 2 of the turned coordinates
    assert commands.position[0, :4] == pytest.approx([3.0, 0.0, 0.0, math.pi])
    assert commands.machine()[0, :3] == pytest.approx([1.0, 3.0, 0.0])


def test_lenient_reading_keeps_unknown_words_as_findings():
    commands, findings = read_gcode("G0 X1\nG12.3 X5\nM777\nG0 X2", lenient=True)
    assert commands.position[:, 0].tolist() == [1.0, 2.0]
    assert [x.code for x in findings] == ["nc-unknown-word", "nc-unknown-word", "nc-no-end"]
    assert {x.severity for x in findings} == {Severity.UNPROVEN}


@pytest.mark.parametrize("end", ["", "M2\n"])
def test_a_curve_that_is_open_at_the_end_ends_a_lenient_reading(end):
    commands, findings = read_gcode(f"F100\nG0 X0 Y0\nG5.2 X21 Y1 L3 P1\nX22 Y2 P2\nX23 Y4 P1\n{end}", lenient=True)
    assert len(commands.position) == 1
    assert "nc-not-read" in [x.code for x in findings]


def test_an_oriented_spindle_stands_still():
    commands, findings = read_gcode("S1000 M3\nG1 X1 F100\nM19\nG1 X2\nM3\nG1 X3\nM2")
    assert commands.spindle.tolist() == pytest.approx([x * math.tau * 1000.0 / 60.0 for x in (1.0, 0.0, 1.0)])
    assert findings == ()


def test_what_does_not_concern_the_path_is_noted_once():
    _, findings = read_gcode("M8\nM9\nM8\nM48\nM62 P1\nM100 P1\nM0\nG0 X1\nM2")
    codes = [x.code for x in findings]
    assert codes == ["nc-coolant", "nc-coolant", "nc-override", "nc-output", "nc-user-code", "nc-stop"]
