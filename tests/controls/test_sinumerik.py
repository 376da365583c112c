"""Cycles and coordinates of a Sinumerik. Oracle: points and times by hand."""

import numpy as np
import pytest

from chipload.program.commands import ARC, LINE
from chipload.program.gcode.reader import read_gcode
from control_texts import codes, dwells, ends, read

HEAD = "G71 G17 G90 G94 G54\nT1 M6\nS1000 M3\nG0 X0 Y0 Z10\n"


def si(body):
    return read(body, "sinumerik", head=HEAD)


@pytest.mark.parametrize(
    ("cycle", "pause", "cuts_out"),
    [
        ("CYCLE87(10,0,2,-5,,3)", [], False),
        ("CYCLE88(10,0,2,-5,,1.5,3)", [1.5], False),
        ("CYCLE89(10,0,2,-5,,1.5)", [1.5], True),
    ],
)
def test_bores(cycle, pause, cuts_out):
    commands, findings = si(f"F100\n{cycle}")
    assert findings == []
    assert [x for x in dwells(commands) if x] == pause
    cuts = commands.motion == LINE
    assert commands.position[cuts, 2].tolist() == ([-5, 2] if cuts_out else [-5])
    assert commands.spindle[cuts][0] == pytest.approx(104.719755)


def test_mirror_and_scale():
    body = "{frame}\nG1 X20 Y5 F100\nG3 X30 Y15 CR=10\n{end}\nG1 X1 Y1"
    for frame, factor in (("MIRROR X0", (-1, 1)), ("SCALE X2 Y2", (2, 2)), ("SCALE X2 Y2\nAMIRROR Y0", (2, -2))):
        commands, findings = si(body.format(frame=frame, end=frame.split()[0]))
        assert findings == []
        expected = np.array([[20, 5], [30, 15]]) * factor
        assert ends(commands)[1:, :2].tolist() == [*expected.tolist(), [1, 1]]
        arc = commands.motion == ARC
        sense = np.sign(factor[0] * factor[1])
        assert np.sign(commands.turns[arc]).tolist() == [sense]
        # (20, 5) to (30, 15), radius 10, to the left: about (20, 15)
        np.testing.assert_allclose(commands.centre[arc][0], np.array([20, 15]) * factor, atol=1e-9)


def test_coordinates_within_mirrored_ones_are_left_out():
    _, findings = si("MIRROR X0\nATRANS X5\nG1 X1 F100\nMIRROR")
    assert codes(findings) == ["nc-left-out"]


def test_supa_keeps_its_name():
    text = f"{HEAD}G55\nG0 SUPA Z0 D0\nG1 G153 X5 F100\nM30\n"
    _, findings = read_gcode(text, dialect="sinumerik", lenient=True)
    named = [f.text for f in findings if "machine" in f.code]
    assert [text.split(":")[0] for text in named] == ["SUPA", "G153"]
