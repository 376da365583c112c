"""Mirrored and scaled coordinates (cycles 8, 11, 26). Oracle: the path of the same blocks without them, transformed."""

import numpy as np
import pytest

from chipload.errors import Severity
from chipload.program.commands import ARC
from chipload.program.heidenhain.reader import read_heidenhain

HEAD = ("BEGIN PGM T MM", "TOOL DEF 1 L+0 R+{}", "TOOL CALL 1 Z S1000", "L X-20 Y-20 Z+5 FMAX M3")
#: lines, arcs of each kind, polar words, a rounding, compensation, approach and departure
CONTOUR = (
    "APPR LCT X+0 Y+0 R10 RL F300", "L Y+20", "RND R3", "L X+20 Y+30", "CC X+20 Y+40", "C X+30 Y+40 DR+",
    "CR X+40 Y+50 R-10 DR-", "L IX+5", "DEP LT LEN6", "L X+60 Y+0 R0 FMAX", "CC X+70 Y+0", "LP PR+15 PA+30 F500",
    "CP IPA+90 DR+", "CP PA+45 DR-", "L IX+3 IY-1", "CT X+95 Y-9", "L Y-30",
)  # fmt: skip


def read(before, blocks, radius=4.0):
    head = [block.format(radius) for block in HEAD]
    commands, findings = read_heidenhain("\n".join([*head, *before, *blocks, "END PGM T MM"]))
    assert not [f for f in findings if f.severity >= Severity.UNPROVEN]
    return commands


def points(commands):
    """Points of the path from its second place on; arcs from their centres by their turns."""
    out, at = [], commands.position[0, :2]
    for k in range(1, len(commands)):
        end = commands.position[k, :2]
        if commands.motion[k] == ARC:
            centre, sense = commands.centre[k], np.sign(commands.turns[k])
            a, b = complex(*(at - centre)), complex(*(end - centre))
            sweep = sense * ((sense * np.angle(b / a)) % (2 * np.pi) or 2 * np.pi)
            arc = a * np.exp(1j * sweep * np.linspace(0.1, 1.0, 10)) + complex(*centre)
            out += [[z.real, z.imag] for z in arc]
        else:
            out.append(end.tolist())
        at = end
    return np.array(out)


START = ("L X-20 Y-30 R0 F900",)


@pytest.mark.parametrize(
    ("change", "factor"),
    [("CYCL DEF 8.1 X", (-1.0, 1.0)), ("CYCL DEF 8.1 Y", (1.0, -1.0)), ("CYCL DEF 8.1 X Y", (-1.0, -1.0))],
)
def test_a_mirrored_contour_is_the_mirrored_path(change, factor):
    """The side of the tool and the sense of arcs change with one mirrored axis, not with two."""
    plain = points(read((), (*START, *CONTOUR)))
    mirrored = points(read((change,), (*START, *CONTOUR)))
    np.testing.assert_allclose(mirrored, plain * factor, atol=1e-9)


def test_a_scaled_contour_is_the_path_of_a_smaller_tool():
    """Scaled by two, a tool of 4 mm stands beside the contour as one of 2 mm beside the contour itself."""
    plain = points(read((), (*START, *CONTOUR), 2.0))
    scaled = points(read(("CYCL DEF 11.1 SCL 2",), (*START, *CONTOUR), 4.0))
    np.testing.assert_allclose(scaled, 2.0 * plain, atol=1e-9)


def test_each_axis_by_its_own_factor_about_a_point():
    """(20, 20) about (10, 10): 10 + 1.4 * 10 and 10 + 0.6 * 10; steps by their factors; ended by a factor of 1."""
    c = read(("CYCL DEF 26.1 X1.4 Y0.6 CCX+10 CCY+10",), ("L X+20 Y+20 F300", "L IX+10", "CYCL DEF 26.1", "L X+5"))
    np.testing.assert_allclose(c.position[1:, :2], [[24, 16], [38, 16], [5, 16]])


def test_holes_are_mirrored_and_what_is_not_read_is_a_finding():
    hole = ("CYCL DEF 200 Q200=2 Q201=-9 Q206=100 Q202=9 Q210=0 Q203=0 Q204=5 Q211=0",)
    c = read(("CYCL DEF 8.1 X",), (*hole, "L X+30 Y+10 FMAX M99"))
    cut = c.position[np.argmin(c.position[:, 2])]
    np.testing.assert_allclose(cut[:3], [-30, 10, -9])
    head = [block.format(4) for block in HEAD]
    for blocks, text in (
        (("CYCL DEF 26.1 X2 Y1", "CC X+0 Y+0", "L X+10 Y+0 F300", "C X-10 Y+0 DR+"), "must have one factor"),
        (("CYCL DEF 8.1 X", "CYCL DEF 10.1 ROT+30"), "taken as the outer one"),
        (("CYCL DEF 11.1 SCL 0.5", *hole, "L X+30 Y+10 FMAX M99"), "what it cuts here is left out"),
    ):
        _, findings = read_heidenhain("\n".join([*head, *blocks, "END PGM T MM"]), lenient=True)
        assert any(text in f.text and f.severity is Severity.UNPROVEN for f in findings), findings
