"""G33 and G33.1: motions at K times the spindle's speed, against what rs274 prints."""

import math

import pytest

from chipload.errors import InputError, Severity
from chipload.program.commands import LINE, RAPID
from chipload.program.gcode.reader import read_gcode
from rs274 import MISSING, canonical, rs274_installed

HEAD = "G21 G90\nG0 X0 Y0 Z5\nS600 M3\n"
TAPS = HEAD + "G33.1 Z-10 K1.25\nG33.1 X2 Z-12 K1.25\nX5 Z-3 K1\nG33 Z-2 K0.5\nG1 X3 F100\nM2\n"


def test_rigid_tapping_feeds_in_and_out_by_the_pitch():
    commands, findings = read_gcode(HEAD + "G33.1 Z-10 K1.25\nG1 X3 F100\nM2")
    assert commands.motion.tolist() == [RAPID, LINE, LINE, LINE]
    assert commands.position[1:3, 2].tolist() == [-10.0, 5.0]
    # 600 rpm are 10 turns a second, each of 1.25 mm
    assert commands.feed[1:3].tolist() == pytest.approx([12.5, 12.5])
    assert commands.spindle[1:].tolist() == pytest.approx([20 * math.pi, -20 * math.pi, 20 * math.pi])
    assert [(f.code, f.severity) for f in findings] == [("nc-tapping", Severity.NOTE)]


def test_g33_ends_where_it_is_told_and_counts_inches():
    commands, _ = read_gcode("G20\nS600 M3\nG33 Z1 K0.1\nM2")
    assert commands.position[-1, 2] == 25.4
    assert commands.feed[-1] == pytest.approx(25.4)


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
def test_ends_and_pitches_are_those_that_rs274_prints():
    ends, pitch, k = [], 0.0, 0
    commands, _ = read_gcode(TAPS)
    rows = [
        (p, f) for m, p, f in zip(commands.motion, commands.position[:, :3], commands.feed, strict=True) if m == LINE
    ]
    for name, words in canonical(TAPS):
        if name == "START_SPEED_FEED_SYNC":
            pitch = float(words[0])
        elif name in ("RIGID_TAP", "STRAIGHT_FEED"):
            ends.append(name)
            end, feed = rows[k]
            assert end.tolist() == pytest.approx([float(w) for w in words[:3]], abs=1e-4)
            assert feed == pytest.approx(10.0 * pitch if pitch else 100.0 / 60.0)
            # the way back of a tap is not printed
            k += 2 if name == "RIGID_TAP" else 1
        elif name == "STOP_SPEED_FEED_SYNCH":
            pitch = 0.0
    assert ends == ["RIGID_TAP"] * 3 + ["STRAIGHT_FEED"] * 2
    assert k == len(rows)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("G33.1 Z-1 K1", "G33.1: the spindle does not turn: start it by M3 or M4"),
        ("M3\nG33.1 Z-1 K1", "G33.1: the spindle speed is not known: give S in rpm (G97)"),
        ("S5 M3\nG33 Z-1 K0", "G33: K0: the distance for each revolution must not be 0"),
        ("S5 M3\nG33 Z0 K1", "the spindle drives X, Y and Z, and none of them moves: give the end of the motion"),
        ("G41.1 D2\nS5 M3\nG33 Z-1 K1", "G33: not while cutter compensation is on: write G40 before"),
    ],
)
def test_refused(text, message):
    with pytest.raises(InputError) as caught:
        read_gcode(f"{text}\nM2")
    assert str(caught.value).endswith(message)
