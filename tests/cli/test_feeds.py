"""New feeds by the command line: the example, the text, the page, and what the job may say."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from chipload import examples
from chipload.program.commands import extents
from chipload.program.gcode.reader import read_gcode
from chipload.result import load_result
from command import call
from mill import MILL
from rs274 import MISSING, canonical, rs274_installed

SLOT = """%
(A slot and a shoulder, one feed)
/N10 G21 G90 G17 G94 (F words in here stay: F99)
N20 T1 M6
N30 S3000 M3
N40 F600. (for all of it)
N50 G0 X-10 Y0 Z5
N60 G0 Z-3
N70 G1 X30
N80 Y3.5
N90 X-8 ; back F1
N100 G2 X-12 Y7.5 I0 J4 (in air)
N110 G0 Z5
N120 M2
%
"""
JOB = (
    """[program]
file = "slot.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, -15.0, -6.0]
high_mm = [50.0, 15.0, 0.0]
layer_mm = 1.0
[material]
name = "al7075-t6"
"""
    + MILL
    + """holder_mm = [[30.0, 40.0]]
[stiffness]
holder_gpa = inf
grip_n_um = inf
grip_nm_rad = inf
spindle_n_um = 30.0
spindle_nm_rad = inf
work_n_um = inf
[[operation]]
kind = "simulate"
step_mm = 2.0
[operation.feeds]
slowest_percent = 20.0
fastest_percent = 400.0
divide = false
[limits]
force_n = 350.0
deflection_um = 14.0
[checks]
confidence = 0.5
"""
)


@pytest.fixture
def job(tmp_path: Path) -> Path:
    (tmp_path / "slot.ngc").write_text(SLOT)
    (tmp_path / "job.toml").write_text(JOB)
    return tmp_path / "job.toml"


def bare(text: str) -> list[list[str]]:
    """Blocks without comments and without F words, by another rule than the writer's: word after word."""
    out = []
    for line in text.splitlines():
        plain = re.sub(r"\([^)]*\)|;.*", " ", line)
        out.append([word for word in plain.split() if not re.fullmatch(r"F[0-9.]+", word)])
    return out


def comments(text: str) -> list[str]:
    return re.findall(r"\([^)]*\)|;.*", text)


def test_the_example_is_faster_and_within_its_limits(tmp_path: Path) -> None:
    folder = examples.copy_example("feeds", tmp_path / "feeds")
    code, out, err = call("run", folder / "job.toml", "--out", tmp_path / "r")
    assert code == 0, err
    # the first line states the limit with the least margin, at 95 %
    assert out.startswith("Holds at 95 %: chip thickness 0.09313 + 0.0028 of 0.1 mm")
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
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
    old, new = ((folder / "pocket.nc").read_text(), (tmp_path / "r" / "0-feeds.nc").read_text())
    assert comments(old) == comments(new)
    # the same path in more lines: every end of a line is passed, and no way is longer
    paths = [read_gcode(x, dialect="fanuc")[0] for x in (old, new)]
    ends, passed = ([tuple(p) for p in c.position[:, :3].round(6).tolist()] for c in paths)
    rest = iter(passed)
    assert all(end in rest for end in ends)
    assert float(extents(paths[1]).sum()) == pytest.approx(float(extents(paths[0]).sum()), abs=1e-3)
    # and the page and the history show both
    page = (tmp_path / "r" / "report.html").read_text()
    assert "What limits the feed of the lines" in page
    assert "Lines that still exceed a limit" not in page
    tracks = {track.name: track.columns for track in load_result(tmp_path / "r").tracks}
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


def test_the_stress_of_the_cutter_holds_feeds(job: Path, tmp_path: Path) -> None:
    """A weak cutter: nobody states a limit of its stress, and its feeds are those at which it does not break."""
    weak = ("--set", "cutter.0.strength_mpa=150", "--set", "limits.deflection_um=90", "--set", "limits.force_n=9000")
    code, _, err = call("run", job, *weak, "--out", tmp_path / "r")
    assert (code, err) == (0, "")
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    op = summary["operations"][0]
    held = next(x for x in summary["limits"] if x["name"] == "cutter_stress_mpa")
    assert held["limit"] == 75.0
    # all of it is used but for what the resolution leaves unknown
    assert 0.97 * 75.0 < held["worst"] * (1.0 + held["resolution_error"]) <= 75.0
    assert op["feeds"]["before"]["cutter_stress_mpa"] > 75.0
    assert op["feeds"]["by"]["cutter_stress_mpa"] >= 2
    # without the check the same lines are as fast as the job allows
    code, _, _ = call("run", job, *weak, "--set", "checks.cutter_strength=false", "--out", tmp_path / "s")
    op = json.loads((tmp_path / "s" / "summary.json").read_text())["operations"][0]
    assert "cutter_stress_mpa" not in op["feeds"]["by"]
    assert op["feeds"]["after"]["cutter_stress_mpa"] > 75.0


def test_deflection_holds_feeds_and_the_text_moves_as_before(job: Path, tmp_path: Path) -> None:
    code, _, err = call("run", job, "--out", tmp_path / "r")
    assert (code, err) == (0, "")
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    feeds = summary["operations"][0]["feeds"]
    held = next(x for x in summary["limits"] if x["name"] == "deflection_um")
    assert feeds["before"]["deflection_um"] > 14.0 > feeds["after"]["deflection_um"] == held["worst"]
    assert 0.97 * 14.0 < held["worst"] * (1.0 + held["resolution_error"]) <= 14.0
    assert feeds["after"]["force_n"] < 350.0
    assert feeds["by"] == {"deflection_um": 3, "programmed": 1}
    new = (tmp_path / "r" / "0-feeds.ngc").read_text()
    assert bare(SLOT) == bare(new)
    assert comments(SLOT) == comments(new)
    assert "N40 F600. (for all of it)" in new
    if not rs274_installed():
        pytest.skip(MISSING)
    one, two = ([c for c in canonical(text) if c[0] != "SET_FEED_RATE"] for text in (SLOT, new))
    assert one == two
    assert [c for c in canonical(SLOT) if c[0] == "SET_FEED_RATE"] != [
        c for c in canonical(new) if c[0] == "SET_FEED_RATE"
    ]


def test_an_unproven_text_says_so_in_its_first_line(job: Path, tmp_path: Path) -> None:
    job.write_text(JOB.replace("work_n_um = inf\n", ""))
    code, out, _ = call("run", job, "--out", tmp_path / "r")
    # an older result is replaced
    assert call("run", job, "--out", tmp_path / "r")[0] == code == 3
    assert out.startswith("Unproven: ")
    text = (tmp_path / "r" / "0-feeds.ngc").read_text().split("\n")
    assert text[0] == "%"
    assert text[1].startswith("(A slot and a shoulder, one feed) (NOT VERIFIED: Unproven: deflection ")
    assert bare("\n".join(text)) == bare(SLOT)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "slowest_percent = 20.0",
            "slowest_percent = 120.0",
            "operation.0.feeds.slowest_percent = 120: must be at most 100",
        ),
        ("fastest_percent = 400.0", "", "operation.0.feeds.fastest_percent: missing"),
        ("fastest_percent = 400.0", "fastest_percent = 400.0\nfaster = 1", "operation.0.feeds.faster: unknown key"),
        ("force_n = 350.0\ndeflection_um = 14.0\n", "gouge_mm = 0.1\n", "limits.gouge_mm: needs the finished part"),
        ("(for all of it)", "\no7 if [1 GT 0]", "feeds are changed only in a program without jumps"),
    ],
)
def test_what_feeds_cannot_be_asked_for(job: Path, tmp_path: Path, old: str, new: str, said: str) -> None:
    job.write_text(JOB.replace(old, new))
    (tmp_path / "slot.ngc").write_text(SLOT.replace(old, new))
    for words in (("check", job), ("run", job, "--out", tmp_path / "r")):
        code, _, err = call(*words)
        assert code == 2, words
        assert said in err
    assert not (tmp_path / "r").exists()
