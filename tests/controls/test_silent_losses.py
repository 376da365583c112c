"""What a program asks for and a reader could drop without a word: each is carried out or is a finding with its line.

Ends, times and feeds by closed forms of the manuals: an arc of the radius r whose centre goes on r_c has the feed
F r_c / r, a plunge of the length l and the depth h at most the feed F p l / h.
"""

import math

import pytest

from chipload.errors import Severity
from chipload.program.heidenhain.reader import read_heidenhain
from control_texts import codes, ends, minutes, read

SINUMERIK = "G71 G17 G90 G94 G54\nT1 D1\nM6\nS1000 M3\nG0 X0 Y0 Z10\n"
HEAD = "G21 G17 G90 G94\nT1 M6\nS1000 M3\nG0 X0. Y0. Z10.\n"
HEADS = {"okuma": "G90 G94\nT1 M6\nS1000 M3\nG0 X0. Y0. Z10.\n"}
TNC = "BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nL X+0 Y+0 Z+10 R0 FMAX M3\n"


def conversational(body):
    commands, findings = read_heidenhain(f"{TNC}{body}\nEND PGM A MM", lenient=True, radii={1: 5.0})
    return commands, [f for f in findings if f.severity > Severity.NOTE]


@pytest.mark.parametrize("control", ["fanuc", "haas", "mazak", "okuma"])
def test_a_block_behind_a_semicolon_is_carried_out(control):
    commands, findings = read("G1 X10. F100.; G1 Y10. (a; b)\nG1 X20.;", control, head=HEADS.get(control, HEAD))
    assert ends(commands)[-3:, :2].tolist() == [[10, 0], [10, 10], [20, 10]]
    assert [(f.code, f.line) for f in findings] == [("nc-end-of-block", 5)]


def test_text_behind_a_semicolon_is_a_comment():
    assert read("G1 X10. F100. ; finish pass 3\n; T1 D10. L50.")[1] == []


def test_what_stands_before_a_semicolon_is_never_dropped():
    """A jump that is made, one that is not, and words that nobody reads, each before a block."""
    line = "IF [#1 EQ %d] GOTO 7 ; G1 X50. F100.\nG1 Z5. F100.\nN7 G1 Y5. F100."
    made, findings = read("#1=1\n" + line % 1)
    assert ends(made)[-1].tolist() == [0, 5, 10]
    assert codes(findings) == ["nc-end-of-block", "nc-end-of-block"]
    not_made, findings = read("#1=1\n" + line % 2)
    assert ends(not_made)[-3:].tolist() == [[50, 0, 10], [50, 0, 5], [50, 5, 5]]
    assert codes(findings) == ["nc-end-of-block"]
    assert "nc-not-read" in codes(read("HELLO X=; G1 X50. F100.")[1])


def test_blocks_behind_a_call_on_one_line_are_a_finding():
    commands, findings = read("M98 P5; G1 X50. F100.\nM30\nO5\nG1 Y5. F100.\nM99")
    assert ends(commands)[-1].tolist() == [0, 5, 10]
    assert codes(findings) == ["nc-end-of-block", "nc-end-of-block"]


@pytest.mark.parametrize(
    ("control", "behind", "lines"),
    [
        ("fanuc", "O2\nG0 X0. Y0.\nG1 X50. F100.\nM30", (8, "lines 8 to 9 (O2)")),
        ("haas", "%\n%\nO2\nG1 X50. F100.\nM30\n%", (10, "line 10 (O2)")),
        ("linuxcnc", "G1 X50", (7, "line 7 (G1 X50)")),
        ("sinumerik", "%_N_B_MPF\nG1 X=AC(50)\nM30", (9, "line 9 (%_N_B_MPF)")),
    ],
    ids=["fanuc", "haas", "linuxcnc", "sinumerik"],
)
def test_a_program_behind_the_end_is_a_finding(control, behind, lines):
    head = SINUMERIK if control == "sinumerik" else HEAD
    commands, findings = read(f"G1 X10. F100.\nM30\n{behind}", control, head=head)
    assert ends(commands)[-1].tolist() == [10, 0, 10]
    assert [(f.code, f.line) for f in findings] == [("nc-behind-end", lines[0])]
    assert lines[1] in findings[0].text


def test_subprograms_and_lists_behind_the_end_are_no_finding():
    """One that is called, one that is not, a list of tools."""
    body = "M98 P3\nM30\nO2\nG1 X50. F100.\nM99\nO3\nG1 X3. F100.\nM99\n%\n(T1 X10. Y5.)"
    commands, findings = read(body)
    assert ends(commands)[-1].tolist() == [3, 0, 10]
    assert findings == []


def test_a_label_before_the_first_percent_is_not_read():
    body = "G1 X10. F100.\nM30\n%\n"
    commands, findings = read(body, head=f"PART TWELVE REV B\n%\nO1\n{HEAD}")
    assert ends(commands)[-1].tolist() == [10, 0, 10]
    assert findings == []


def test_a_repeat_of_a_later_label_is_a_finding():
    commands, findings = conversational("L X+10 F100\nCALL LBL 2 REP 3\nL X+20\nLBL 2\nL IY+5\nLBL 0")
    assert ends(commands)[-1].tolist() == [10, 5, 10]
    assert [(f.code, f.line) for f in findings] == [("heidenhain-repeat", 5)]
    commands, findings = conversational("LBL 2\nL IX+5 F100\nCALL LBL 2 REP 3")
    assert (ends(commands)[-1].tolist(), findings) == ([20, 0, 10], [])


def test_conversational_blocks_behind_the_end_are_a_finding():
    findings = conversational("L X+10 F100\nM30\nL X+20\nLBL 1\nL X+30\nLBL 0")[1]
    assert [(f.code, f.line) for f in findings] == [("nc-behind-end", 6)]


@pytest.mark.parametrize(
    ("words", "time"),
    [
        ("G1 X10 F100 CHR=2 FRC=50\nY10", 16 / 100 + math.sqrt(8) / 50),
        ("FRCM=25\nG1 X10 F100 RND=2\nY10", 16 / 100 + math.pi / 25),
        ("FRCM=25\nG1 X10 F100 RND=2 FRC=50\nY10\nFRCM=0", 16 / 100 + math.pi / 50),
        ("FRCM=25\nFRCM=0\nG1 X10 F100 RND=2\nY10", (16 + math.pi) / 100),
    ],
)
def test_the_feed_of_a_corner_of_a_sinumerik(words, time):
    commands, findings = read(words, "sinumerik", head=SINUMERIK)
    assert findings == []
    assert minutes(commands) == pytest.approx(time, rel=1e-9)


@pytest.mark.parametrize(
    ("word", "outside", "inside"),
    [
        ("CFTCP", 1.0, 1.0),
        ("CFC", 1.5, 0.5),
        ("CFIN", 1.0, 0.5),
        ("M111", 1.0, 1.0),
        ("M109", 1.5, 0.5),
        ("M110", 1.0, 0.5),
    ],
)
def test_the_feed_of_an_arc_beside_a_contour(word, outside, inside):
    """By the radius of the contour, 10 mm; the centre goes on 15 mm outside of it and on 5 mm inside."""
    for side, centre, share in (("L", 15.0, outside), ("R", 5.0, inside)):
        ends_at = (-5, 25) if side == "L" else (5, 15)
        if word.startswith("M"):
            body = f"{word}\nL Y-10 F100\nL Y+0 R{side}\nCC X+10 Y+0\nC X+20 Y+0 DR-\nL Y-10\nL X+30 R0"
            commands, findings = conversational(body)
        else:
            body = f"{word}\nG1 Y-10 F100\nG4{1 if side == 'L' else 2} D1 Y0\nG2 X20 Y0 I10 J0\nG1 Y-10\nG40 X30"
            commands, findings = read(body, "sinumerik", head=SINUMERIK, diameters={1: 10.0})
        assert findings == []
        arc = [k for k in range(len(commands)) if commands.turns[k]]
        assert len(arc) == 1
        assert commands.position[arc[0] - 1, 0] == pytest.approx(ends_at[0])
        assert commands.position[arc[0], 0] == pytest.approx(ends_at[1])
        assert abs(commands.position[arc[0], 0] - commands.centre[arc[0], 0]) == pytest.approx(centre)
        assert commands.feed[arc[0]] == pytest.approx(share * 100 / 60)


def test_outside_corners_of_g451_are_where_the_offsets_cross():
    body = "\nG41 D1 G1 X10 Y0 F100\nX20\nY-10\nG40 X30"
    for word, corner in (("G451", 1), ("G450", 2)):
        commands, findings = read(word + body, "sinumerik", head=SINUMERIK, diameters={1: 10.0})
        assert findings == []
        first = [25.0, 5.0] if corner == 1 else [20.0, 5.0]
        assert ends(commands)[2, :2].tolist() == first
        assert ends(commands)[2 + corner, :2].tolist() == [25.0, -10.0]
    assert codes(read("KONT\nG1 X10 F100", "sinumerik", head=SINUMERIK)[1]) == ["nc-unknown-word"]


def test_plunges_of_m103():
    """15 mm down in a way of 18.03 mm: 50 mm/min down are 60.1 mm/min along it; M103 without F ends it."""
    commands, findings = conversational("L X+10 Z-5 F100 M103 F50\nL Z-10\nL X+0\nM103\nL Z-20")
    assert findings == []
    assert minutes(commands) == pytest.approx(15 / 50 + 5 / 50 + 10 / 100 + 10 / 100, rel=1e-9)


def test_m136_counts_the_feed_of_its_own_block():
    commands, findings = conversational("L X+10 F0.1 M136\nL X+20 F50 M137")
    assert findings == []
    assert minutes(commands) == pytest.approx(10 / 100 + 10 / 50, rel=1e-9)
