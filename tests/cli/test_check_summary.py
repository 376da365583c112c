"""The summary of `check` for a program: its box with the bulge of arcs, and the dialect that leaves less unread."""

from __future__ import annotations

from pathlib import Path

from command import call

HEAD = "G21 G90 G17\nT1 M6\nS5000 M3\n"


def test_the_box_holds_the_bulge_of_arcs(tmp_path: Path) -> None:
    (tmp_path / "turns.ngc").write_text(f"{HEAD}G0 X10 Y0 Z5\nG1 Z0 F500\nG3 X10 Y0 Z-6 I-10 J0 P3\nG0 Z5\nM2\n")
    code, out, said = call("check", tmp_path / "turns.ngc")
    assert code == 0
    assert "X -10 to 10, Y -10 to 10, Z -6 to 5 mm" in out + said


def test_the_dialect_of_a_fanuc_program_is_named(tmp_path: Path) -> None:
    text = f"%\nO0001\n{HEAD}G0 X0. Y0. Z10.\nG68 X10. Y5. R30.\nG1 X20. F500.\nG69\nM30\n%\n"
    (tmp_path / "part.nc").write_text(text)
    code, out, said = call("check", tmp_path / "part.nc")
    assert code == 3
    assert "as fanuc it has 0 unproven findings, not 2: --dialect fanuc" in out + said
    assert call("check", tmp_path / "part.nc", "--dialect", "fanuc")[0] == 0
    code, out, said = call("check", tmp_path / "part.nc", "--machine", "vmc")
    assert "--dialect" not in out + said
