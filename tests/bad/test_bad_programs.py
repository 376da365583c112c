"""Programs that must be refused, each with its message; LinuxCNC refuses each of them too."""

import pytest

from canonical import Refused, run_canonical
from chipload.errors import InputError
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.tools import read_tool_table
from rs274 import MISSING, rs274_installed

TABLE = "T1 P1 D2 Z3\nT2 P2 D4 Z5\n"
BAD = [
    ("G1 X1", 1, "G1: the feed is 0 or was never set: give F"),
    ("G0 X1.5.6", 1, "number 1.5....: has two decimal points"),
    ("G0 X", 1, "the block ends where a value is expected: complete it"),
    ("G0 X1 Y1 X2", 1, "X: appears twice in one block"),
    ("G0 G1 X1 F1", 1, "G0 and G1: exclude each other in one block"),
    ("G90 G91", 1, "G90 and G91: exclude each other in one block"),
    ("M3 M4 S5", 1, "M3 and M4: exclude each other in one block"),
    ("M0 M3 M8 M48 M62 P1 S5", 1, "5 M codes: a block has at most 4"),
    ("X1", 1, "axes are given and no code that moves them is active: write G0 or G1"),
    ("G80 X1", 1, "G80: ends the motion and takes no axes: write G0 or G1"),
    ("G92 X1 G0", 1, "G92 and G0: both use the axes: write two blocks"),
    ("G12", 1, "G12: is not a code of LinuxCNC: remove it, or read the text in its own dialect"),
    ("G1.05 X1", 1, "G1.05: there is no such code"),
    ("M200", 1, "M200: is not a code of LinuxCNC: remove it, or read the text in its own dialect"),
    ("M3.5", 1, "code M 3.5: must be a whole number"),
    ("N-1 G0", 1, "'n-1g0': N is followed by a whole number, 0 or more"),
    ("G0 X1 N5", 1, "character 'n': does not begin a word"),
    ("!G0", 1, "character '!': does not begin a word"),
    ("G0 X1 (a (b) )", 1, "a comment within a comment: write [ ] inside"),
    ("G0 X1 (a", 1, "a comment is not closed by )"),
    ("G0 X[1", 1, "an expression is not closed by ]"),
    ("G0 X[1/0]", 1, "1 / 0: divides by zero"),
    ("G0 XSQRT[-1]", 1, "SQRT[-1]: the argument must be 0 or more"),
    ("G0 XACOS[2]", 1, "ACOS[2]: the argument must be from -1 to 1"),
    ("G0 XATAN[1]", 1, "ATAN[y]: /[x] is missing after it"),
    ("G0 X[[0-8]**[1/3]]", 1, "-8 ** 0.333333: a negative number takes integer powers only"),
    ("G0 X#<a>", 1, "parameter #<a>: is read before it is set: assign it first, or state it in program.parameters"),
    ("#0=5", 1, "parameter #0: the number must be from 1 to 5601"),
    ("#5420=1", 1, "parameter #5420: is the controller's own and cannot be assigned"),
    ("#1 5", 1, "#15: = is missing after it"),
    ("G4", 1, "G4: P is missing: the time [s], 0 or more"),
    ("G0 X1 R1", 1, "R1: no code of the block uses it: remove it"),
    ("G40 D1", 1, "D1: no code of the block uses it: remove it"),
    ("G0 X1 F-1", 1, "F-1: a feed must be 0 or more"),
    ("G0 X1 S-1", 1, "S-1: a spindle speed must be 0 or more"),
    ("T9 M6", 1, "T9: tool 9 is not in the tool table: add it there"),
    ("G43 H9", 1, "H9: tool 9 is not in the tool table: add it there"),
    ("F10\nG2 X1", 2, "G2: neither R nor I, J, K: an arc needs its radius or its centre"),
    ("F10\nG2 X1 I1 R1", 2, "R with I, J or K: an arc has a radius or a centre, not both"),
    ("F10\nG2 X0 Y0 R1", 2, "arc by radius that ends where it starts: give its centre by I, J, K"),
    ("F10\nG2 X10 R1", 2, "arc of radius 1 mm over a chord of 10 mm: must be 5 mm or more"),
    ("F10\nG2 X1 K1", 2, "K: is not a coordinate of the arc's plane"),
    (
        "F10\nG3 X5 I1",
        2,
        "arc that starts 1 mm from its centre and ends 4 mm from it: must agree within 0.02828 mm or 0.1 %: "
        "correct its centre or its end",
    ),
    ("F10\nG81 X1 Z-1", 2, "G81: R is missing: where feeding begins"),
    ("F10\nG81 X1 R1", 2, "G81: Z is missing: the bottom of the hole"),
    ("F10\nG81 X1 Z2 R1", 2, "R1: lies below the bottom of the hole, 2: raise R"),
    ("F10\nG83 X1 Z-2 R1", 2, "G83: Q is missing: the depth of a peck"),
    ("F10\nG84 X1 Z-2 R1", 2, "G84: the spindle does not turn: start it by M3"),
    ("F10\nG81 X1 Z-2 R1 A5", 2, "A: is not allowed in a canned cycle"),
    ("G93 G1 X1 F10\nY1", 2, "G1: each feed by inverse time (G93) needs its own F"),
    ("G95 G1 X1 F0.1", 1, "G1: feed per revolution (G95) and no spindle speed: give S"),
    ("G91 G53 G0 X1", 1, "G53: goes with G90 only"),
    ("G10 L2 P10 X1", 1, "G10 L2: P must be from 0 to 9"),
    ("G10 P1 X1", 1, "G10: L is missing or none of 0, 1, 2, 10, 11, 20"),
    ("G92", 1, "G92: needs at least one axis"),
    ("G41.1 D1\nG18", 2, "G18: not while cutter compensation is on: write G40 before"),
    ("G19 G41.1 D1", 1, "G41.1: compensation lies in the planes of G17 and G18"),
    ("F1\nG5 X1 Y1 I1 P1 Q1", 2, "G5: give both I and J, or neither"),
    ("G5.3", 1, "G5.3: no spline is open: begin it by G5.2"),
    ("O1 call", 1, "o1 call: there is no o1 sub in this text"),
    ("O1 sub\nO1 call\nO1 endsub\nO1 call", 2, "o1: calls are nested deeper than 10"),
    ("O1 foo", 1, "o1 foo: no keyword of an O-word follows the label"),
    ("O1 if 1", 1, "o1 if: [ is missing after it"),
    ("O1 endif", 1, "o1 endif: if is missing before it"),
    ("G33 Z1 K1", 1, "G33: the spindle does not turn: start it by M3 or M4"),
    ("S5 M3\nG33.1 Z1", 2, "G33.1: K is missing: the distance for each revolution of the spindle"),
    ("G0 X1\n%", 2, "%: ends a text that begins with %, and this one does not: remove it"),
]


def _tools():
    return read_tool_table(TABLE)[0]


@pytest.mark.parametrize(("text", "line", "message"), BAD, ids=[x[0].replace("\n", " | ") for x in BAD])
def test_refused_with_its_message(text, line, message):
    with pytest.raises(InputError) as caught:
        read_gcode(f"{text}\nM2\n", name="part.ngc", tools=_tools())
    assert str(caught.value) == f"part.ngc: line {line}: {message}"


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
@pytest.mark.parametrize("text", [x[0] for x in BAD], ids=[x[0].replace("\n", " | ") for x in BAD])
def test_linuxcnc_refuses_it_too(text):
    with pytest.raises(Refused):
        run_canonical(f"{text}\nM2\n", table=TABLE)


def test_a_text_without_an_end_is_refused():
    with pytest.raises(InputError, match=r"^program: line 1: the text ends without M2, M30 or %: write M2 as its last"):
        read_gcode("G0 X1")


def test_an_endless_loop_is_refused():
    with pytest.raises(InputError, match="more than 1000 blocks: a loop does not end"):
        read_gcode("O1 while [1]\nO1 endwhile\nM2", most_blocks=1000)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"dialect": "heidenhain"},
            "control = heidenhain: its texts are not RS-274: must be one of linuxcnc, fanuc, sinumerik",
        ),
        ({"units": "cm"}, "units = 'cm': must be mm or inch"),
        ({"start": (0.0, 0.0)}, "start: must be nine finite numbers, X Y Z A B C U V W"),
        ({"parameters": {0: 1.0}}, "parameter #0: the number must be from 1 to 5601"),
        ({"most_blocks": 0}, "most_blocks = 0: must be 1 or more"),
    ],
)
def test_bad_options(options, message):
    with pytest.raises(InputError) as caught:
        read_gcode("M2", **options)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("T1 P1 X", "table: line 1: 'X': a letter with its number is expected"),
        ("T1 T2", "table: line 1: T appears twice"),
        ("P1", "table: line 1: T is missing: the number of the tool"),
        ("T1\nT1", "table: line 2: tool 1 appears twice"),
        ("T1 Q12", "table: line 1: Q12: must be from 0 to 9"),
        ("T1.5", "table: line 1: T1.5: must be a whole number"),
        ("T1 S2", "table: line 1: word S: must be one of T P D I J Q X Y Z A B C U V W"),
    ],
)
def test_bad_tool_table(text, message):
    with pytest.raises(InputError) as caught:
        read_tool_table(text, name="table")
    assert str(caught.value) == message
