"""The example of new feeds: faster, within its limits, the same path in more lines, its numbers on its page."""

import json
import re

import numpy as np
import pytest

from chipload.program.commands import extents
from chipload.program.gcode.reader import read_gcode
from chipload.result import load_result
from command import TIME_LEFT
from conftest import EXAMPLES


def comments(text: str) -> list[str]:
    return re.findall(r"\([^)]*\)|;.*", text)


def test_the_example_is_faster_and_within_its_limits(example) -> None:
    done = example("feeds")
    folder, out = done.folder, TIME_LEFT.sub("", done.output)
    assert done.exit_code == 0, out
    # the first line states the limit with the least margin, at 95 %
    assert re.search(r"^Holds at 95 %: chip thickness 0\.0931 \+ 0\.003 of 0\.1 mm", out, re.MULTILINE)
    summary = json.loads((folder / "summary.json").read_text())
    feeds = summary["operations"][0]["feeds"]
    assert (summary["verdict"], feeds["program"]) == ("holds", "0-feeds.nc")
    assert [(x["name"], x["in_use"], x["verdict"]) for x in summary["tracks"]] == [
        ("optimised", True, "holds"), ("original", False, "exceeds"),
    ]  # fmt: skip
    assert [x["time_s"] for x in summary["tracks"]] == [feeds["time_after_s"], feeds["time_before_s"]]
    assert feeds["still_exceeding"] == []
    assert feeds["time_after_s"] < 0.7 * feeds["time_before_s"]
    assert f"Divided: {feeds['segments']} segments in {feeds['lines_divided']} lines." in out
    assert feeds["lines"] == 162 + feeds["segments"] - feeds["lines_divided"]
    assert feeds["before"]["force_n"] > 600.0
    held = next(x for x in summary["limits"] if x["name"] == "force_n")
    assert 0.95 * 550.0 < held["budget"]["value"] <= 550.0
    assert feeds["before"]["torque_nm"] > 2.8 >= feeds["after"]["torque_nm"]
    assert sum(feeds["by"].values()) == feeds["lines"] >= feeds["lines_changed"]
    assert {"force_n", "torque_nm", "chip_max_mm", "fastest", "air", "machine"} <= set(feeds["by"])
    old, new = ((EXAMPLES / "feeds" / "pocket.nc").read_text(), (folder / "0-feeds.nc").read_text())
    assert comments(old) == comments(new)
    # the same path in more lines: every end of a line is passed, and no way is longer
    paths = [read_gcode(x, dialect="fanuc")[0] for x in (old, new)]
    ends, passed = ([tuple(p) for p in c.position[:, :3].round(6).tolist()] for c in paths)
    rest = iter(passed)
    assert all(end in rest for end in ends)
    assert float(extents(paths[1]).sum()) == pytest.approx(float(extents(paths[0]).sum()), abs=1e-3)
    # and the page and the history show both
    page = (folder / "report.html").read_text()
    assert "What limits the feed of the lines" in page
    assert "Lines that still exceed a limit" not in page
    tracks = {track.name: track.columns for track in load_result(folder).tracks}
    rows = tracks["optimised"]
    force, before = (tracks[k]["force_n"] for k in ("optimised", "original"))
    feed, was = (tracks[k]["feed_mm_min"] for k in ("optimised", "original"))
    there = np.searchsorted(tracks["original"]["s_mm"], rows["s_mm"] - 0.01).clip(0, len(before) - 1)
    before, was = before[there], was[there]
    cut = (force > 0.0) & (before > 0.0)
    # steps of the two programs do not lie at the same places where lines are divided
    assert ((force[cut] < before[cut]) == (feed[cut] < was[cut])).mean() > 0.9
    assert was[cut].min() > 299.0
    assert was[cut].max() < 1200.001
    assert set(rows["feed_limited_by"].tolist()) <= set(feeds["by"]) | {""}
