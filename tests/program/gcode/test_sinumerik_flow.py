"""Jumps and loops of a Sinumerik: the order of blocks worked out by hand from the manual."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.program.gcode.reader import read_gcode
from chipload.program.gcode.sinumerik_flow import condition


def read(*lines):
    return read_gcode("\n".join(["G0 X0 Y0 Z0 F100", *lines, "M30"]), dialect="sinumerik")


def x_of(*lines):
    commands, findings = read(*lines)
    assert all(f.severity < Severity.UNPROVEN for f in findings), findings
    return commands.position[1:, 0].tolist()


@pytest.mark.parametrize(
    ("lines", "xs"),
    [
        (("GOTOF ENDE", "G1 X1", "ENDE: G1 X2"), [2]),
        (("GOTO N30", "N20 G1 X1", "N30 G1 X2"), [2]),
        (("R1=0", "AGAIN: R1=R1+1", "G1 X=R1", "IF R1<3 GOTOB AGAIN"), [1, 2, 3]),
        (("R1=5", "IF R1==5", "G1 X1", "ELSE", "G1 X2", "ENDIF", "G1 X3"), [1, 3]),
        (("R1=6", "IF R1==5", "G1 X1", "ELSE", "G1 X2", "ENDIF", "G1 X3"), [2, 3]),
        (("R1=0", "WHILE R1<>3", "R1=R1+1", "IF R1==2 GOTOF L9", "G1 X=R1", "L9:", "ENDWHILE"), [1, 3]),
        (("DEF INT I", "FOR I=2 TO 4", "G1 X=I*10", "ENDFOR", "X1"), [20, 30, 40, 1]),
        (("FOR R1=3 TO 2", "G1 X9", "ENDFOR", "G1 X1"), [1]),
        (("R1=0", "REPEAT", "R1=R1+1", "G1 X=R1", "UNTIL R1>=2", "X7"), [1, 2, 7]),
        (("R1=0", "LOOP", "R1=R1+1", "G1 X=R1", "IF (R1>1) OR (R1<0) GOTOF OUT", "ENDLOOP", "OUT:"), [1, 2]),
        (("A1: G91 G1 X1", "REPEAT A1 P=3"), [1, 2, 3, 4]),
        (("A1: G91 G1 X1", "X2", "A2: X3", "X10", "REPEATB A1 P=2", "REPEAT A1 A2 P1"),
         [1, 3, 6, 16, 17, 18, 19, 21, 24]),
        # inner loops are counted anew each time
        (("FOR R1=1 TO 2", "B1: G91 G1 X1", "REPEAT B1 P=1", "ENDFOR"), [1, 2, 3, 4]),
        # no O-words here
        (("ORIWKS", "GOTOF OUT", "G1 X1", "OUT: X2"), [2]),
        (("GOTOC NOWHERE", "G1 X1"), [1]),
        ((";IF R1==1", "MSG(\"GOTOF A\")", "G1 X1"), [1]),
    ],
)  # fmt: skip
def test_the_order_of_blocks(lines, xs):
    assert x_of(*lines) == xs


def test_a_loop_over_holes_is_the_same_as_holes_written_out():
    head = ("S600 M3", "G0 Z20")
    loop, _ = read(*head, "FOR R1=0 TO 3", "G0 X=10*R1", "CYCLE81(10,0,2,-9)", "ENDFOR")
    plain, _ = read(*head, *[line for k in range(4) for line in (f"G0 X{10 * k}", "CYCLE81(10,0,2,-9)")])
    np.testing.assert_array_equal(loop.position, plain.position)
    np.testing.assert_array_equal(loop.motion, plain.motion)


@pytest.mark.parametrize(
    ("lines", "xs", "line", "text"),
    [
        (("IF $P_TOOLNO==3 GOTOF E", "G1 X1", "E: X2"), [1, 2], 2, "its value is not known"),
        (("IF ACTUAL>3", "G1 X1", "ELSE", "G1 X2", "ENDIF"), [2], 2, "ACTUAL: its value is not known"),
        (("WHILE ACTUAL>3", "G1 X1", "ENDWHILE", "G1 X2"), [2], 2, "ACTUAL"),
        (("REPEAT", "G1 X1", "UNTIL ACTUAL>3", "G1 X2"), [1, 2], 4, "ACTUAL"),
        (("GOTOF NOWHERE", "G1 X1"), [1], 2, "GOTOF NOWHERE: there is no such label"),
        (("CASE R1 GOTOF A", "G1 X1", "A:", "B:"), [1], 2, "CASE is followed by a value and OF"),
        (("R1=1", "IF R1>0 AND R1<2", "G1 X1", "ENDIF", "X2"), [2], 3, "need brackets"),
        (("G1 X1", "GOTOS"), [1], 3, "starts the program again"),
        (("G1 X1 GOTOF E", "E: X2"), [2], 2, "GOTOF: is not read here"),
        (('CALL "SUB"', "G1 X2"), [2], 2, "SUB: calls a program that is neither"),
    ],
)
def test_what_is_not_known_is_a_gap_on_its_line(lines, xs, line, text):
    commands, findings = read(*lines)
    assert commands.position[1:, 0].tolist() == xs
    gaps = [f for f in findings if f.severity >= Severity.UNPROVEN]
    assert gaps[0].line == line
    assert text in gaps[0].text


def test_a_loop_without_end_is_refused_within_its_bound():
    with pytest.raises(InputError, match="a loop does not end"):
        read_gcode("LOOP\nG91 G1 X1 F1\nENDLOOP\nM30", dialect="sinumerik", most_blocks=1000)
    with pytest.raises(InputError, match="P=10000: must be from 0 to 9999"):
        read("A1: G1 X1", "REPEATB A1 P=10000")
    with pytest.raises(InputError, match="a loop does not end"):
        read_gcode("G1 F1\nA1: X1\nREPEATB A1 P=900\nM30", dialect="sinumerik", most_blocks=500)


@pytest.mark.parametrize(
    ("text", "holds"),
    [("1 == 1", True), ("1 <> 1", False), ("(1 < 2) AND (3 <= 2)", False), ("(1 < 2) XOR (2 > 1)", False),
     ("NOT ((1 < 2) OR (2 < 1))", False), ("0.1 == 0.1000000001", False), ("TRUE", True), ("0", False)],
)  # fmt: skip
def test_conditions(text, holds):
    assert condition(text, None, lambda t, _: float(t)) is holds
