"""Messages of programs that cut nothing and of edges that rub: the remedy that they state is one."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from command import call
from slot_job import slot_text


def summary(folder: Path, program: str) -> dict[str, Any]:
    """Summary of a program in the block X 0 to 20, Y 0 to 10, Z -6 to 0."""
    folder.mkdir(exist_ok=True)
    (folder / "slot.ngc").write_text(f"G21 G90 G94\nT1 M6\n{program}M2\n")
    (folder / "job.toml").write_text(slot_text(3.0))
    call("run", folder / "job.toml", "--out", folder / "result")
    done: dict[str, Any] = json.loads((folder / "result" / "summary.json").read_text())
    return done


AIR = [
    ("S3000 M3\nG0 X-8 Y5 Z45\nG1 Z38 F300\nX30\nG0 Z45\n", "the cutter stays 38 mm above the stock: "),
    ("S3000 M3\nG0 X108 Y5 Z5\nG1 Z-2 F300\nX130\nG0 Z5\n", "the cutter stays 85 mm beside (X+) the stock: "),
    ("S3000 M3\nG0 X8 Y-25 Z7\nG1 Z4 F300\nX9 Y-23\nG0 Z5\n", "4 mm above and 20 mm beside (Y-) the stock: "),
    ("S3000 M3\nG0 X30 Y5 Z5\nZ8\n", "no motion is at a feed"),
]


@pytest.mark.parametrize(("program", "text"), AIR)
def test_a_program_that_cuts_nothing_names_the_distances_and_the_zero_point(
    tmp_path: Path, program: str, text: str
) -> None:
    done = summary(tmp_path / "job", program)
    assert done["verdict"] == "unproven"
    assert done["message"].startswith("Unproven: nothing is cut: ")
    assert text in done["message"]
    assert "zero point" in done["message"]
    (rigid,) = [x for x in done["tracks"][0]["limits"] if x["name"] == "deflection_share"]
    assert rigid["reason"] == "nothing is cut"


def test_a_program_that_cuts_is_not_said_to_cut_nothing(tmp_path: Path) -> None:
    done = summary(tmp_path / "job", "S3000 M3\nG0 X-8 Y5 Z5\nG1 Z-2 F300\nX8\nG0 Z5\n")
    assert "nothing-cut" not in [f["code"] for f in done["tracks"][0]["findings"]]


def slot(feed: float, rpm: float) -> str:
    return f"S{rpm:g} M3\nG0 X-4 Y5 Z-2\nG1 X2 F{feed:g}\nG0 Z5\n"


def test_the_feed_and_the_speed_that_the_message_of_a_rubbing_edge_names_are_proven(tmp_path: Path) -> None:
    def rigid(name: str, feed: float, rpm: float) -> dict[str, Any]:
        limits = summary(tmp_path / name, slot(feed, rpm))["tracks"][0]["limits"]
        return next(x for x in limits if x["name"] == "deflection_share")

    slow = rigid("slow", 10.0, 15000.0)
    assert slow["state"] == "unproven"
    found = re.search(
        r"from 10 to at least (\S+) mm/min, or lower .* from 15000 to at most (\S+) 1/min", slow["reason"]
    )
    assert found is not None
    feed, rpm = float(found[1]), float(found[2])
    assert rigid("feed", feed, 15000.0)["state"] == "holds"
    assert rigid("speed", 10.0, rpm)["state"] == "holds"
    # and they are not far more than is needed
    assert rigid("less", 0.8 * feed, 15000.0)["worst"] > 1.0
