"""The summary of `check` for a program: its box with the bulge of arcs, and the dialect that its text tells."""

from __future__ import annotations

import math
from pathlib import Path

from command import call

HEAD = "G21 G90 G17\nT1 M6\nS5000 M3\n"


def test_the_box_holds_the_bulge_of_arcs(tmp_path: Path) -> None:
    (tmp_path / "turns.ngc").write_text(f"{HEAD}G0 X10 Y0 Z5\nG1 Z0 F500\nG3 X10 Y0 Z-6 I-10 J0 P3\nG0 Z5\nM2\n")
    code, out, said = call("check", tmp_path / "turns.ngc")
    assert code == 0
    assert "X -10 to 10, Y -10 to 10, Z -6 to 5 mm" in out + said


def test_a_fanuc_program_is_recognized_and_read_as_one(tmp_path: Path) -> None:
    """G68 turns X20 Y0 by 30 degrees about X10 Y5; LinuxCNC would read no G68."""
    text = f"%\nO0001\n{HEAD}G0 X0. Y0. Z10.\nG68 X10. Y5. R30.\nG1 X20. Y0. F500.\nG69\nM30\n%\n"
    (tmp_path / "part.nc").write_text(text)
    turn = math.radians(30.0)
    x, y = 10.0 + 10.0 * math.cos(turn) + 5.0 * math.sin(turn), 5.0 + 10.0 * math.sin(turn) - 5.0 * math.cos(turn)
    for words in ((), ("--dialect", "fanuc"), ("--machine", "vmc")):
        code, out, said = call("check", tmp_path / "part.nc", *words)
        assert code == 0
        assert f"X 0 to {x:.6g}, Y 0 to {y:.6g}, Z 10 to 10 mm" in out + said
        assert f"control: Fanuc 0i, 30i ({'stated' if '--dialect' in words else 'a guess'})" in out + said
        read_as = "read as a program for Fanuc 0i, 30i ('%', 'O0001'); Haas NGC reads it in the same way (nc-control)"
        assert (read_as in out + said) == ("--dialect" not in words)
    code, out, said = call("check", tmp_path / "part.nc", "--dialect", "linuxcnc")
    assert code == 3
    assert "G68" in out + said
