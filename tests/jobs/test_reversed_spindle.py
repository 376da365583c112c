"""A cut with the spindle turning against the hand of the cutter exceeds; a left-hand cutter cuts under M4."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from command import call
from slot_job import slot_text

#: a plunge into the block and a slot, then a motion back through the empty slot with the spindle the other way
PROGRAM = "G21 G90 G94\nT1 M6\nS3000 M{0}\nG0 X-8 Y5 Z5\nG1 Z-2 F300\nX28\nM{1}\nX-8 F600\nG0 Z5\nM5\nM2\n"
FOUND = [(3, 4, False, None), (4, 3, False, "right-hand"), (3, 4, True, "left-hand"), (4, 3, True, None)]


@pytest.mark.parametrize(("first", "back", "left", "named"), FOUND)
def test_only_a_cut_against_the_hand_is_found(
    tmp_path: Path, first: int, back: int, left: bool, named: str | None
) -> None:
    (tmp_path / "slot.ngc").write_text(PROGRAM.format(first, back))
    text = slot_text(3.0)
    (tmp_path / "job.toml").write_text(text.replace("flutes =", "left_hand = true\nflutes =") if left else text)
    call("run", tmp_path / "job.toml", "--out", tmp_path / "result")
    summary = json.loads((tmp_path / "result" / "summary.json").read_text())
    found = [f for f in summary["tracks"][0]["findings"] if f["code"] == "spindle-reversed"]
    if named is None:
        assert found == []
        return
    (only,) = found
    assert (only["line"], only["severity"], summary["verdict"]) == (6, "exceeds", "exceeds")
    assert named in only["text"]
