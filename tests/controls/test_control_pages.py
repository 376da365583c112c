"""The pages of the controls say what the readers do: read codes leave no finding, the others do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from chipload.errors import Severity
from chipload.jobs.control_reference import control_page
from chipload.program.control import CONTROLS, control_named
from chipload.program.gcode.reader import read_gcode

DOCS = Path(__file__).parents[2] / "docs" / "controls"


@pytest.mark.parametrize("name", CONTROLS)
def test_every_control_has_its_page(name):
    """Rules of the profile, words that are read and that are not; that it is current is tested with the other pages."""
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    assert text.startswith(f"# {control_named(name).title}\n")
    for part in ("Sources: ", "## Rules", "that are read", "that are not read"):
        assert part in text


@pytest.mark.parametrize("name", ["fanuc", "haas", "okuma", "mazak", "grbl", "mach3"])
def test_what_the_page_calls_unread_is_a_finding(name):
    rows = control_page(name).split("## Codes that are not read")[1]
    for code in re.findall(r"^\| (G[0-9.]+) \|", rows, re.MULTILINE):
        text = f"G21 G90 G0 X0 Y0 Z0\n{code} X1. Y1. Z1. I1. J1. K1. P1 Q1. R1. L2 F100.\nM30\n"
        _, findings = read_gcode(text, control=control_named(name), lenient=True)
        assert any(f.severity >= Severity.UNPROVEN and f.line == 2 for f in findings), code


def test_a_haas_has_other_offsets_as_variables():
    """#11001 is an input of a Haas, and the length of an offset of a Fanuc."""
    assert "#11001" not in control_page("haas")
    assert "#11001 on: length" in control_page("fanuc")
    assert 11001 not in control_named("haas").macros.tool_variables
