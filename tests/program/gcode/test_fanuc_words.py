"""Words of a Fanuc or Haas that change the path and are not read leave the program unproven, and move no axis.

The lists follow the operator's manuals: which of their codes give axes a position, and which give them a meaning.
"""

from __future__ import annotations

import numpy as np
import pytest

from chipload.errors import Finding, Severity
from chipload.program.commands import LINE, Commands
from chipload.program.gcode.reader import read_gcode

HEAD = "G17 G90 G21 G94 G40\nT1 M6\nS5000 M3\nG54\nG0 X0. Y0. Z10.\nG1 Z-1. F500.\n"
TAIL = "\nG1 X50. Y10.\nG1 X50. Y60.\nG0 Z20.\nM30\n"
#: rows of head and tail
ROWS = 5


def read(text: str, dialect: str = "fanuc") -> tuple[Commands, list[Finding]]:
    commands, findings = read_gcode(text, name="x.nc", dialect=dialect, lenient=True)
    return commands, [f for f in findings if f.severity is Severity.UNPROVEN]


@pytest.mark.parametrize(
    ("block", "rows"),
    [
        ("G27 X0. Y0.", 0),
        ("G60 X50.", 0),
        ("G41.1 D1", 0),
        ("M198 P2000", 0),
        ("G10 P1 R3.", 0),
        ("G10 L50", 0),
        ("G1 X50. ,A30.", 0),
        # a signal ends the motion
        ("G31 X50. F100.", 1),
        # words of roundings, spirals and helices by other controllers
        ("G1 X50. R5.", 1),
        ("G3 X0. Y0. Z-5. I10. L3", 1),
    ],
)
def test_what_moves_the_path_is_unproven(block: str, rows: int) -> None:
    commands, unproven = read(HEAD + block + TAIL)
    assert len(commands) - ROWS == rows
    assert unproven


@pytest.mark.parametrize("block", ["G5.1 Q3 X0 Y0 Z0", "G22 X50. Y50. Z10. I-50. J-50. K-10."])
def test_axes_that_are_no_positions_move_nothing(block: str) -> None:
    commands, unproven = read(HEAD + block + TAIL)
    assert len(commands) == ROWS
    assert unproven == []


@pytest.mark.parametrize("block", ["G10 L10 P1 R120.5", "G10 L13 P1 R0", "G13.1", "G187 P1"])
def test_what_does_not_is_not(block: str) -> None:
    commands, unproven = read(HEAD + block + TAIL)
    assert len(commands) == ROWS
    assert unproven == []


def test_a_cycle_without_holes_is_that_of_the_blocks_behind_it() -> None:
    head = "G90 G21 G17\nT1 M6\nS900 M3\nG0 X0. Y0. Z10.\n"
    stated, unproven = read(f"{head}G99 G81 Z-5. R2. F80. K0\nX5.\nX12. Y3.\nG80\nM30\n")
    plain, _ = read(f"{head}G99 G81 X5. Z-5. R2. F80.\nX12. Y3.\nG80\nM30\n")
    assert unproven == []
    assert np.array_equal(stated.position, plain.position)
    assert np.array_equal(stated.motion, plain.motion)


LENGTHS = (
    "G90 G21\nT1 M6\nS900 M3\nG0 X0 Y0\nG43 H1 Z10\nG1 Z-1 F100\nG0 Z50\nT2 M6\nM3\nG0 X5\n{0}Z-1\nG1 X9\nG0 Z50\nM30\n"
)


@pytest.mark.parametrize("dialect", ["fanuc", "linuxcnc"])
@pytest.mark.parametrize(("second", "found"), [("", [12]), ("G43 H2 ", []), ("G43 H12 ", [])])
def test_a_tool_without_a_length_offset_beside_one_with_it(dialect: str, second: str, found: list[int]) -> None:
    _, unproven = read(LENGTHS.format(second), dialect)
    missing = [f for f in unproven if f.code == "nc-length-missing"]
    assert [f.line for f in missing] == found
    assert all("tool 2" in f.text for f in missing)


def test_a_text_that_gives_no_lengths_is_not_asked_for_them() -> None:
    assert read(LENGTHS.format("").replace("G43 H1 ", ""), "linuxcnc")[1] == []


@pytest.mark.parametrize(("line", "moves"), [("$H", True), ("$J=G91 X10 F500", True), ("$X", False)])
def test_homing_and_jogging_of_grbl(line: str, moves: bool) -> None:
    assert bool(read(HEAD + line + TAIL, "linuxcnc")[1]) == moves


HOLE_HEAD = "G90 G21 G17\nT1 M6\nS900 M3\nG0 X0. Y0. Z10.\nG99 "


def depths(cycle: str) -> list[float]:
    """Heights at which the feeds of the holes end."""
    commands, unproven = read(f"{HOLE_HEAD}{cycle}\nX12.\nG80\nM30\n")
    assert unproven == []
    return [float(z) for z in commands.position[commands.motion == LINE, 2]]


@pytest.mark.parametrize(
    ("words", "pecks"),
    [
        # I is the first peck, each is J shorter, and none is below K, but the last one ends at the bottom
        ("I5. J1. K2.", [5.0, 4.0, 3.0, 2.0, 2.0, 2.0, 2.0]),
        ("I6. J2.5 K3.", [6.0, 3.5, 3.0, 3.0, 3.0, 1.5]),
        ("I8. J0 K2.", [8.0, 8.0, 4.0]),
        ("Q8.", [8.0, 8.0, 4.0]),
    ],
)
@pytest.mark.parametrize("code", ["G83", "G73"])
def test_pecks_of_a_haas_become_shorter(code: str, words: str, pecks: list[float]) -> None:
    ends = (1.0 - np.cumsum(pecks)).tolist()
    assert ends[-1] == -19.0
    assert depths(f"{code} X5. Z-19. R1. {words} F100.") == pytest.approx([*ends, *ends], abs=1e-12)


def test_pecks_that_become_nothing_are_refused() -> None:
    _, unproven = read(f"{HOLE_HEAD}G83 X5. Z-19. R1. I5. J1. F100.\nG80\nM30\n")
    assert "K0: pecks become shorter by J, 0 or more, down to K, which must be above 0" in unproven[0].text
    _, unproven = read(f"{HOLE_HEAD}G83 X5. Z-19. R1. I5. J1. K1. Q4. F100.\nG80\nM30\n")
    assert "I with Q" in unproven[0].text


def test_a_series_of_equal_pecks_follows_one_of_shorter_ones() -> None:
    found = depths("G83 X5. Z-19. R1. I5. J1. K2. F100.\nG83 X7. Z-19. R1. Q10.")
    assert found[7:] == pytest.approx([-9.0, -19.0, -9.0, -19.0])
