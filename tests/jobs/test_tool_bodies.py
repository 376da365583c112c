"""A tool that is a body: held against part, stock and fixtures, its chips not simulated, the verdict never holds."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

from command import call
from slot_job import slot_text

#: tool 1 mills a slot 2 mm deep at Y5, tool 2 comes down in it: X10 at a feed, then X4 in a rapid
PROGRAM = (
    "G21 G90 G94\nT1 M6\nS3000 M3\nG0 X-8 Y5 Z5\nG1 Z-2 F300\nX28\nG0 Z5\n"
    "T2 M6\nS500 M3\nG0 X10 Y5 Z5\nG1 Z-4 F100\nG1 Z5\nG0 X4\nG0 Z-4\nG0 Z5\nM5\nM2\n"
)
TAP = '[[cutter]]\nnumber = 2\nname = "M6 tap"\nbody_mm = [[2.5, 0.0], [2.5, 15.0]]\noverhang_mm = 30.0\n'
JOB = slot_text(3.0).replace("[[operation]]", TAP + "[[operation]]")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    above = tmp_path_factory.mktemp("tap")
    (above / "slot.ngc").write_text(PROGRAM)
    post = trimesh.creation.box(bounds=[[9.0, 4.0, -6.0], [11.0, 6.0, -3.0]])
    post.export(above / "post.stl")
    more = '[[fixture]]\nfile = "post.stl"\nunits = "mm"\nspacing_mm = 0.5\n'
    text = JOB.replace('kind = "simulate"', 'kind = "simulate"\nstock_points_mm = 0.5')
    (above / "job.toml").write_text(text + more)
    code, _, said = call("run", above / "job.toml", "--out", above / "result")
    assert code == 3, said
    return above


def test_the_verdict_and_the_findings(folder: Path) -> None:
    summary = json.loads((folder / "result" / "summary.json").read_text())
    (track,) = summary["tracks"]
    found = {f["code"]: f for f in track["findings"]}
    assert found["tool-body"]["severity"] == "unproven"
    assert found["tool-body"]["line"] == 11
    assert "tool 2 (M6 tap) is a body" in found["tool-body"]["text"]
    assert "handed-over" not in found
    texts = [f["text"] for f in track["findings"] if f["code"] == "collision"]
    # at X10 it goes 1 mm into the post, whose top is at -3; at X4 in a rapid 2 mm into the floor of the slot
    assert any("cutting part goes 1 mm into fixture 0" in t for t in texts)
    assert found["rapid-cuts"]["text"] == "a rapid goes through material, 2 mm deep"


def test_it_removes_nothing_and_loads_nothing(folder: Path) -> None:
    history = pq.read_table(folder / "result" / "history.parquet")
    own = history["tool"].to_numpy() == 2
    assert own.any()
    for name in ("chip_volume_mm3", "force_n", "torque_nm"):
        assert not np.asarray(history[name])[own].any()
    # the slot of tool 1, as without tool 2: 6 by 2 by 20 mm
    assert np.asarray(history["chip_volume_mm3"]).sum() == pytest.approx(240.0, rel=1e-3)


def test_without_what_it_hits_the_verdict_is_unproven(folder: Path) -> None:
    plain = PROGRAM.replace("G0 X4\nG0 Z-4\n", "G0 X4\n")
    (folder / "plain.ngc").write_text(plain)
    (folder / "plain.toml").write_text(JOB.replace("slot.ngc", "plain.ngc"))
    code, out, _ = call("run", folder / "plain.toml", "--out", folder / "plain")
    assert (code, out.splitlines()[0].split(":")[0]) == (3, "Unproven")
    assert "tool 2 (M6 tap) is a body" in out


def test_what_is_refused(folder: Path) -> None:
    (folder / "speeds.toml").write_text(JOB.replace("[limits]", "[operation.speeds]\n[limits]"))
    code, _, said = call("check", folder / "speeds.toml")
    assert code == 2
    assert "operation.0.speeds: cutter 2 is a body (body_mm) whose load is unknown: leave speeds out" in said


TAPPED = (
    "G21 G90 G94\nT1 M6\nS3000 M3\nG0 X-8 Y5 Z5\nG1 Z-2 F300\nX28\nG0 Z5\n"
    "T2 M6\nS500 M3\nG0 X10 Y5 Z5\nG84 Z-1 R2 F500\nG80\nM5\nM2\n"
)


def test_new_feeds_leave_a_tap_alone(folder: Path) -> None:
    """The cutter becomes faster; the tap, whose load is not known, keeps its F, which is its pitch times the speed."""
    (folder / "tapped.ngc").write_text(TAPPED)
    feeds = "[operation.feeds]\nslowest_percent = 50.0\nfastest_percent = 150.0\nair_mm_min = 2000.0\n"
    text = JOB.replace("slot.ngc", "tapped.ngc").replace("[limits]", f"{feeds}[limits]")
    (folder / "feeds.toml").write_text(text)
    code, out, said = call("run", folder / "feeds.toml", "--out", folder / "feeds")
    assert code == 3, said
    (written,) = (folder / "feeds").rglob("*.ngc")
    before, _, behind = written.read_text().partition("G84")
    assert re.findall(r" F([0-9.]+)", behind)[0] == "500"
    # the greatest feed of the cut, 1.5 times 300
    assert "450" in re.findall(r" F([0-9.]+)", before), out
