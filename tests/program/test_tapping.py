"""Tapping motions in every dialect, their pitch, and taps that comments and cutters state.

The pitch of a motion is feed over spindle speed, by hand: F400 at S500 is 0.8 mm.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import Severity
from chipload.machine.machine import machine_named
from chipload.program.read import read_program
from chipload.program.setup import Setup
from chipload.program.tapping import tapping_motions, thread_comments

VMC = machine_named("vmc")
TAP = Cutter(5.0, 1, 0.0, 20.0, 40.0, 2.1e5, body=((2.5, 0.0), (2.5, 20.0)), thread_pitch=1.0)
HEAD = "G21 G90 G17 G94\nT1 M6\nS500 M3\nG0 X30. Y20. Z10.\n"
#: dialect, text of one thread, pitch [mm], line
TEXTS = [
    ("linuxcnc", HEAD + "G84 X30 Y20 Z-15 R2 F400\nG80\nM2\n", 0.8, 5),
    ("linuxcnc", HEAD + "G0 Z2\nG33.1 Z-15 K1.25\nM2\n", 1.25, 6),
    ("linuxcnc", HEAD.replace("M3", "M4") + "G74 X30 Y20 Z-15 R2 F600\nG80\nM2\n", 1.2, 5),
    ("linuxcnc", HEAD.replace("G21", "G20").replace("X30. Y20. Z10.", "X1 Y1 Z1")
     + "G84 X1 Y1 Z-0.5 R0.1 F15.625\nG80\nM2\n", 25.4 / 32.0, 5),
    ("fanuc", HEAD + "M29 S500\nG84 X30. Y20. Z-15. R2. F625.\nG80\nM30\n", 1.25, 6),
    ("fanuc", HEAD + "G95\nM29 S500\nG84 X30. Y20. Z-15. R2. F1.5\nG80\nM30\n", 1.5, 7),
    ("sinumerik", "G90 G17 G94\nT1 D1\nM6\nS500 M3\nG0 X30 Y20 Z10\nCYCLE84(10,0,2,-15,,0.5,3,,1.25,0,500,500)\nM30\n",
     1.25, 6),
    ("heidenhain", "BEGIN PGM A MM\nTOOL CALL 1 Z S500\nL X+30 Y+20 Z+10 R0 FMAX M3\n"
     "CYCL DEF 207 RIGID TAPPING NEW ~\nQ200=2 ~\nQ201=-15 ~\nQ239=+1.25 ~\nQ203=+0 ~\nQ204=10\nCYCL CALL\n"
     "END PGM A MM\n", 1.25, 10),
]  # fmt: skip


def read(dialect: str, text: str, cutters: dict[int, Cutter] | None = None):
    name = {"heidenhain": "a.h", "sinumerik": "a.mpf"}.get(dialect, "a.nc")
    return read_program(Path(name), VMC, dialect=dialect, text=text, setup=Setup(cutters=cutters or {}))


def taps(reading) -> list[tuple[str, int, Severity | None]]:
    found = [(f.code, f.line, f.severity) for f in (*reading.violations, *reading.findings)]
    return [f for f in found if f[0].startswith("tap-")]


@pytest.mark.parametrize(("dialect", "text", "pitch", "line"), TEXTS)
def test_the_pitch_of_a_tapping_motion(dialect: str, text: str, pitch: float, line: int) -> None:
    program = read(dialect, text).program
    found = tapping_motions(program)
    assert found.pitch.tolist() == pytest.approx([pitch])
    assert program.line[found.rows].tolist() == [line]
    # the end of the thread
    assert program.p_work[found.rows, 2].min() == pytest.approx(program.p_work[:, 2].min())


@pytest.mark.parametrize(
    "words", ["G81 X30 Y20 Z-15 R2 F400", "G86 X30 Y20 Z-15 R2 P0.1 F400", "G85 X30 Y20 Z-15 R2 F400"]
)
def test_other_cycles_do_not_tap(words: str) -> None:
    assert len(tapping_motions(read("linuxcnc", HEAD + f"{words}\nG80\nM2\n").program).rows) == 0


@pytest.mark.parametrize(
    ("feed", "tool", "expected"),
    [
        (500.0, TAP, []),
        # 0.9 % off is the last digits of F
        (504.5, TAP, []),
        (506.0, TAP, [("tap-pitch", 5, Severity.EXCEEDS)]),
        (494.0, TAP, [("tap-pitch", 5, Severity.EXCEEDS)]),
        (500.0, Cutter(5.0, 1, 0.0, 20.0, 40.0, 2.1e5, body=TAP.body), [("tap-pitch-unknown", 5, Severity.UNPROVEN)]),
        (500.0, Cutter(5.0, 3, 0.5, 20.0, 40.0, 5.8e5), [("tap-cutter", 5, Severity.EXCEEDS)]),
        # without cutters only what the text states is compared
        (500.0, None, []),
    ],
)
def test_the_tap_of_the_job(feed: float, tool: Cutter | None, expected: list[object]) -> None:
    text = HEAD + f"G84 X30 Y20 Z-15 R2 F{feed}\nG80\nM2\n"
    assert taps(read("linuxcnc", text, {} if tool is None else {1: tool})) == expected


def test_the_tap_of_a_comment() -> None:
    """10-32: 25.4 / 32 = 0.79375 mm; F1.872 in at S128 cuts 0.3715 mm."""
    text = (
        "%\nO0031\n(T1 10-32 TAP)\nG20 G90 G17 G94 G54\nT1 M6\nS128 M3\nG0 X0. Y0.\nG43 H1 Z0.5\n"
        "G84 X0. Y0. Z-0.5 F{0} R0.1\nG80\nM30\n%\n"
    )
    wrong = read("linuxcnc", text.format("1.872"))
    assert taps(wrong) == [("tap-pitch", 9, Severity.EXCEEDS)]
    assert "0.37147 mm" in next(f.text for f in wrong.violations if f.code == "tap-pitch")
    assert taps(read("linuxcnc", text.format("4.0"))) == []


@pytest.mark.parametrize(
    ("comment", "pitch"),
    [
        ("(T1 10-32 TAP)", 25.4 / 32.0),
        ("(T12 - 1/4-20 UNC TAP)", 25.4 / 20.0),
        ("(TOOL 3 M10X1.5 RH TAP)", 1.5),
        ("(T3 TAP M8)", 1.25),
        ("; T4 M6 x 0.75 tap", 0.75),
        ("(T5 D=5. 3-48 TAPPED HOLES LATER)", 25.4 / 48.0),
        ("(T1 D=10. CR=0. TAPER=3 - FLAT END MILL)", None),
        ("(T1 10-32 THREAD MILL)", None),
        ("(TAP M8)", None),
    ],
)
def test_threads_of_comments(comment: str, pitch: float | None) -> None:
    found = [value for value, _ in thread_comments(comment).values()]
    assert found == ([] if pitch is None else [pytest.approx(pitch)])
