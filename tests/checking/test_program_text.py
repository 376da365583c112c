"""The statement on the first line of a changed program keeps the line as short as the control reads it."""

from __future__ import annotations

import pytest

from chipload.checking.outcome import ChangedText
from chipload.checking.program_text import program_text
from chipload.program.release import Release
from rs274 import canonical, rs274_installed

REASON = Release("Unproven: " + "torque 1.2 of 1.5 N m, unproven: at 95 % it may be 2.02 N m; " * 8)


def changed(text: str, dialect: str):
    return ChangedText(text, dialect, None, 0.0)


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "sinumerik", "heidenhain"])
def test_a_long_reason_leaves_a_line_that_is_read(dialect: str) -> None:
    """254 characters with the end of line are what LinuxCNC reads; the block stays, and the comment is closed."""
    text = program_text(changed("G21 G90 G17\r\nG1 X1 F100\r\n", dialect), REASON)
    first, second, _ = text.split("\r\n")
    assert first.startswith("G21 G90 G17 ")
    assert "NOT VERIFIED: Unproven: torque 1.2 of 1.5 N m" in first
    assert len(first) <= 252
    assert first.count("(") == first.count(")")
    assert second == "G1 X1 F100"


def test_a_line_without_room_leaves_it_to_the_next() -> None:
    text = program_text(changed("(" + "a" * 240 + ")\nG21\nM2\n", "linuxcnc"), REASON)
    assert [len(line) <= 252 for line in text.split("\n")] == [True] * 4
    assert text.split("\n")[1].startswith("G21 (NOT VERIFIED")


@pytest.mark.skipif(not rs274_installed(), reason="rs274 is not installed")
def test_linuxcnc_reads_the_line() -> None:
    """Its interpreter refuses the line that was written before, and when it runs it goes on without it."""
    text = program_text(changed("G20 G90 G17\nG0 X1\nM2\n", "linuxcnc"), REASON)
    assert ("USE_LENGTH_UNITS", ["CANON_UNITS_INCHES"]) in canonical(text)
