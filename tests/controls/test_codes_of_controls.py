"""Codes that only one control has: Brother, Okuma, Mazak, Haas, NX on a Fanuc. Oracle: points and heights by hand."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.machine.machine import machine_named
from chipload.program.commands import DWELL
from chipload.program.recognise import recognise
from chipload.program.reconcile import unit_mm
from chipload.program.swivel import Swivel
from control_texts import ends, read

OKUMA = "G21 G17 G90 G94 G15 H1\nT1 M6\nS1000 M3\nG56 H1\nG0 X0. Y0. Z10.\n"


def test_change_and_approach_in_one_block_of_a_brother():
    """G100: the tool, then X Y with the offset and the spindle, then Z, at rapid though a cut came before."""
    commands, findings = read(
        "G43 H1 Z10.\nG1 X5. F100.\nG100 T2 X30. Y10. G54 G43 Z7. H2 S500 M3\nG1 Z-1. F100.", "brother"
    )
    assert findings == []
    assert ends(commands)[-3:].tolist() == [[30, 10, 10], [30, 10, 7], [30, 10, -1]]
    assert [(f == 0.0) for f in commands.feed[-3:]] == [True, True, False]
    assert commands.tool[-3:].tolist() == [2, 2, 2]
    assert commands.spindle[-1] == pytest.approx(500 * 2 * np.pi / 60)


@pytest.mark.parametrize(("words", "pitch"), [("I1.25", 1.25), ("J20", 25.4 / 20)])
def test_tapping_by_the_pitch_of_a_brother(words, pitch):
    commands, findings = read(f"G77 X1. Y2. Z-8. R3. {words} S400\nG80", "brother")
    assert findings == []
    down = (commands.feed > 0.0) & (commands.position[:, 2] == -8.0)
    assert commands.feed[down].tolist() == pytest.approx([pitch * 400 / 60])
    assert commands.position[-1].tolist()[:2] == [1.0, 2.0]


@pytest.mark.parametrize(("back", "height"), [("M53", 40.0), ("M54", 3.0)])
def test_the_level_of_cycles_of_an_okuma(back, height):
    """G71 moves nothing; with M53 each hole ends at its level, with M54 at R; Q is the peck of G83."""
    commands, findings = read(f"G71 Z40.\nG83 X5. Y5. Z-7. R3. Q5. F100. {back}\nX9.\nG80", "okuma", head=OKUMA)
    assert findings == []
    at = ends(commands)
    assert at[at[:, 2] == -7.0].tolist() == [[5, 5, -7], [9, 5, -7]]
    assert at[at[:, 2] == -2.0][:, :2].tolist() == [[5, 5], [9, 5]]
    assert at[-1].tolist() == [9, 5, height]


def test_user_tasks_of_an_okuma():
    """Variables, named blocks, calls with arguments and repeats; points by hand."""
    body = """VC1=12.5
CALL O200 Q2 DEPTH=-3
IF [VC1 GT 5] NEND
G1 X=99 F100.
NEND G0 X=VC1*2 Z[VC1+0.5]
G1X=-VC1Y=VC1 F=VC1*4
MODIN OSIDE
G0 X0. Y0.
MODOUT
M2
O200
G1 Z=DEPTH F200.
X=VC1
VC1=VC1+1
RTS
OSIDE
G91 G1 Z-1.
G90
RTS"""
    commands, findings = read(body, "okuma", head=OKUMA)
    assert findings == []
    assert ends(commands).tolist() == [
        [0, 0, 10], [0, 0, -3], [12.5, 0, -3], [12.5, 0, -3], [13.5, 0, -3], [29, 0, 15], [-14.5, 14.5, 15],
        [0, 0, 15], [0, 0, 14],
    ]  # fmt: skip
    assert commands.feed[-3] == pytest.approx(58.0 / 60.0)


def test_a_tap_goes_out_at_its_feed_to_r_and_a_brother_keeps_the_feed_of_cuts():
    commands, findings = read("G98 G84 X10. Y0. Z-12. R5. F500.\nG80", "fanuc")
    assert findings == []
    cuts = commands.motion != DWELL
    assert commands.position[cuts, 2][-4:].tolist() == [5.0, -12.0, 5.0, 10.0]
    assert (commands.feed[cuts][-4:] * 60.0).tolist() == pytest.approx([0.0, 500.0, 500.0, 0.0])
    commands, findings = read("G1 X1. F80.\nG77 X10. Y10. Z-12. R3. I1. S500\nG80\nG1 X30.", "brother")
    assert (findings, commands.feed[-1] * 60.0) == ([], pytest.approx(80.0))


def test_work_offset_and_length_of_an_okuma():
    origins = {1: ((100.0, *[0.0] * 8), 0.0), 2: ((300.0, *[0.0] * 8), 0.0)}
    commands, _ = read("G15 H2\nG0 X1. Y0.", "okuma", origins=origins)
    frame = commands.frames[commands.frame[-1]]
    assert (frame.number, frame.offset[0]) == (2, 300.0)


def test_the_next_tool_of_a_mazak():
    commands, findings = read("T3 T7 M6\nG1 X5. F100.", "mazak")
    assert (findings, int(commands.tool[-1])) == ([], 3)
    assert recognise("T01 T02 M06\nG0 X1.", "linuxcnc").control.name == "mazak"
    assert recognise("%\nO1\nG05 P10000\nG1 X1.\nG05 P0", "linuxcnc").control.name != "mazak"


@pytest.mark.parametrize(("code", "x"), [("G70", 25.4), ("G71", 1.0)])
def test_units_of_nx_on_a_fanuc(code, x):
    commands, findings = read(f"{code}\nG0 X1.")
    assert (findings, ends(commands)[-1][0]) == ([], pytest.approx(x))


def test_a_unit_without_blanks():
    assert unit_mm("N10G00G17G20G40\nX1.") == 25.4
    assert unit_mm("G70 I25. J15. L4") == 1.0


def test_a_program_number_alone_is_not_linuxcnc():
    assert recognise("O0026\nN1 G80 Z1. M09", "linuxcnc").control.name != "linuxcnc"


@pytest.mark.parametrize("angles", [(-30.0, 90.0), (20.0, 0.0)])
def test_dynamic_work_offset_of_a_haas(angles):
    """G254: the text's X Y Z are those of the machine about the zero that the table has carried along.

    Oracle: the point that the machine's axes reach is Ry(B) or Rz(C) of the tip on the part, written out here.
    """
    b, c = angles
    machine = machine_named("xyzbc-trunnion")
    body = f"G0 Z0.\nG0 B{b} C{c}\nG254\nG0 X3. Y4. Z50.\nG255\nG0 X1. Y1. Z60."
    commands, findings = read(body, "haas", swivel=Swivel(machine))
    assert findings == []
    tilted = commands.frames[commands.frame[-2]].tilt
    assert commands.frames[commands.frame[-1]].tilt is None
    swivel = Swivel(machine)
    axes = np.zeros(9)
    axes[4:6] = np.radians([b, c])
    np.testing.assert_allclose(tilted.matrix, swivel.directions(axes), atol=1e-12)
    b, c = np.radians([b, c])
    turn_b = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    turn_c = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    # a table turns the part the other way round: either sign is one of the machine, but both turns must be there
    signs = [(turn_b if s > 0 else turn_b.T) @ (turn_c if t > 0 else turn_c.T) for s in (1, -1) for t in (1, -1)]
    assert any(np.allclose(tilted.matrix, M.T, atol=1e-12) for M in signs)


def test_what_ends_nothing_and_words_of_unknown_functions_leave_no_doubt():
    """The preamble of Mach3, and M298 L of a Brother."""
    commands, findings = read("G0 G49 G40.1 G17 G80 G50 G90\nG1 X9. F90.", "mach3")
    assert (findings, ends(commands)[-1].tolist()) == ([], [9, 0, 10])
    _, found = read("M298 L5\nG1 X9. F90.", "brother")
    assert found == []


def test_a_colon_before_words_numbers_a_block():
    """NX marks a change of the tool so; alone it is the number of a program. G61.1 ,R of a Mazak is no corner."""
    commands, findings = read(
        "(TOOL NAME : EM10)\n:0030 T02 M06\nS900 M3\nG1 X9. F90.", head=":1234\nG21 G17 G90 G94\n"
    )
    assert (findings, commands.tool.tolist()) == ([], [2])
    assert read("G61.1 ,R3\nG1 X9. F90.", "mazak")[1] == []
