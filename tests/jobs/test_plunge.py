"""Plunges and ramps of cutters that do not cut at their centre, or only up to an angle."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from command import call
from slot_job import slot_text

HEAD = "G21 G90 G94\nT1 M6\nS3000 M3\nG0 X6 Y5 Z0\n"
PLUNGE, RAMP = "G1 Z-1 F100\n", "G1 X14 Z-1 F100\n"
SLOPE = math.degrees(math.atan2(1.0, 8.0))  # 7.125


def result(folder: Path, entry: str, keys: str, flutes: int = 2, checks: str = "") -> dict[str, Any]:
    """Summary of a job whose cutter has more ``keys``."""
    (folder / "slot.ngc").write_text(f"{HEAD}{entry}G0 Z5\nM2\n")
    text = slot_text(3.0).replace("flutes = 2", f"{keys}\nflutes = {flutes}")
    (folder / "job.toml").write_text(text + checks)
    call("run", folder / "job.toml", "--out", folder / "result")
    summary: dict[str, Any] = json.loads((folder / "result" / "summary.json").read_text())
    return summary


CASES = [
    (PLUNGE, "", 2, "holds", ""),
    (PLUNGE, "centre_cutting = true", 6, "holds", ""),
    (PLUNGE, "corner_radius_mm = 3.0", 6, "holds", ""),
    (PLUNGE, "", 6, "unproven", "whether its 6 teeth reach its axis is not known: state centre_cutting"),
    (PLUNGE, "centre_cutting = false", 2, "exceeds", "tool 1 plunges into solid material: no tooth cuts under its"),
    (RAMP, "centre_cutting = false", 2, "unproven", "tool 1 ramps into solid material at 7.13 deg: how steep"),
]


@pytest.mark.parametrize(("entry", "keys", "flutes", "verdict", "text"), CASES)
def test_a_cutter_that_does_not_cut_at_its_centre_cannot_plunge(
    tmp_path: Path, entry: str, keys: str, flutes: int, verdict: str, text: str
) -> None:
    found = [f for f in result(tmp_path, entry, keys, flutes)["tracks"][0]["findings"] if f["code"] == "plunge"]
    assert [f["severity"] for f in found] == ([] if verdict == "holds" else [verdict])
    if found:
        assert text in found[0]["text"]
        assert found[0]["line"] == 5


@pytest.mark.parametrize(
    ("entry", "limit", "state"),
    [(PLUNGE, 89.0, "exceeds"), (PLUNGE, 90.0, "holds"), (RAMP, SLOPE - 0.01, "exceeds"), (RAMP, SLOPE, "holds")],
)
def test_a_ramp_is_checked_against_the_angle_of_the_cutter(
    tmp_path: Path, entry: str, limit: float, state: str
) -> None:
    summary = result(tmp_path, entry, f"ramp_angle_deg = {limit!r}\ncentre_cutting = false")
    (only,) = [x for x in summary["tracks"][0]["limits"] if x["name"] == "ramp_deg"]
    assert (only["limit"], only["state"], only["line"]) == (pytest.approx(limit), state, 5)
    assert only["worst"] == pytest.approx(90.0 if entry is PLUNGE else SLOPE, abs=1e-6)


def test_the_check_is_switched_off_and_the_report_lists_it(tmp_path: Path) -> None:
    summary = result(tmp_path, PLUNGE, "ramp_angle_deg = 3.0", checks="[checks]\nplunge = false\n")
    assert "check plunge: switched off by the job" in summary["unchecked"]
    assert not [x for x in summary["tracks"][0]["limits"] if x["name"] == "ramp_deg"]
