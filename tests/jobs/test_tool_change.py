"""A program that changes its tool in the stock is unproven; after a retraction it is not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from command import call
from slot_job import slot_text

PROGRAM = "G21 G90 G94\nT1 M6\nS3000 M3\nG54 G0 X-8. Y5. Z5.\nG1 Z-2. F300.\nX8.\n{0}\nT2 M6\nS3000 M3\nG0 Z5.\nM2\n"
#: what stands before the change, the dialect, and whether it is found
BEFORE = [
    ("G4 P1", "linuxcnc", True),
    ("G0 Z-1", "linuxcnc", True),
    ("G0 Z0", "linuxcnc", False),
    ("G0 X-4", "linuxcnc", False),
    ("G91 G28 Z0.\nG90", "fanuc", False),
    ("G53 G0 Z0.", "fanuc", False),
    ("G0 Z-1.", "fanuc", True),
]


@pytest.mark.parametrize(("before", "dialect", "found"), BEFORE)
def test_a_change_in_the_stock_is_unproven(tmp_path: Path, before: str, dialect: str, found: bool) -> None:
    (tmp_path / "slot.ngc").write_text(PROGRAM.format(before))
    text = slot_text(3.0).replace('file = "slot.ngc"', f'file = "slot.ngc"\ndialect = "{dialect}"')
    cutter = text[text.index("[[cutter]]") : text.index("[[operation]]")]
    text = text.replace("[[operation]]", cutter.replace("number = 1", "number = 2") + "[[operation]]")
    (tmp_path / "job.toml").write_text(text)
    call("run", tmp_path / "job.toml", "--out", tmp_path / "result")
    summary = json.loads((tmp_path / "result" / "summary.json").read_text())
    own = [f for f in summary["tracks"][0]["findings"] if f["code"] == "tool-change-in-stock"]
    assert len(own) == found
    if found:
        assert (own[0]["line"], own[0]["severity"]) == (10, "unproven")
        assert summary["verdict"] == "unproven"
