"""New feeds by the command line: the text, the page, and what the job may say."""

import json
import re
from pathlib import Path

import pytest

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
