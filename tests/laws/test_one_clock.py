"""One clock: a program takes the same time in the summary, the history, `check`, the report and the page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import chipload.examples
from chipload.cli import app
from chipload.machine.machine import machine_named
from chipload.program.read import line_times, read_program, read_tools
from chipload.web.result import open_result

EXAMPLES = Path(chipload.examples.__file__).parent
CLOSE = 1e-3
#: what makes an example short
COARSE = {
    "contour": ("operation.0.step_mm=0.4",),
    "pocket": ("operation.0.step_mm=0.6", "operation.0.radial_depth_mm=2.4", "limits.engagement_deg=90"),
    "plate": (
        "wall.length_mm=8", "wall.height_mm=9", "wall.thickness_mm=1.7", "wall.foot_mm=4",
        "wall.allowance_mm=[0.2, 0.2]", "wall.elements=[4, 5]", "operation.0.scallop_um=40",
        "operation.0.depth_max_mm=0.2", "operation.0.step_mm=3", "operation.0.layer_mm=0.5",
        "operation.0.reserve=0.1",
    ),
    "impeller": ("operation.0.most_cutters=1", "operation.0.check_mm=4", "operation.0.scallop_mm=0.3"),
    "chips": ("operation.0.step_mm=4",),
    "feeds": ("operation.0.step_mm=4", "stock.layer_mm=2"),
    "bracket": ("operation.0.step_mm=6", "stock.layer_mm=5", "part.spacing_mm=5"),
    "trunnion": (),
}  # fmt: skip
#: machine that each planned program is written for, and its tool table where the text is of the axes with the length
MACHINES = {
    "contour": ("vmc", ""),
    "pocket": ("vmc", ""),
    "plate": ("xyzbc-head-table", "T1 P1 D8 Z32\n"),
    "impeller": ("horizontal-b", ""),
}
#: the one surface of a short impeller
SURFACE = """[[surface]]
body = "blade"
side = "plus"
along = [0.30, 0.45]
up = [0.50, 0.70]
points = [4, 4]

"""


def job_of(folder, name):
    """The job file of an example; the impeller with one surface and without roughing."""
    if name != "impeller":
        return EXAMPLES / name / "job.toml"
    text = (EXAMPLES / name / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + SURFACE + text[text.index("[[operation]]") :]
    text = text[: text.index("[operation.rough]")] + text[text.index("[operation.paths]") :]
    (folder / "job.toml").write_text(text)
    return folder / "job.toml"


def ran(folder, name):
    """Summary, greatest time of each track of the history, the result folder."""
    out = folder / name
    sets = [word for value in COARSE[name] for word in ("--set", value)]
    words = ["run", job_of(folder, name), *sets, "--out", out]
    done = CliRunner().invoke(app, [str(w) for w in words])
    assert done.exit_code in (0, 3), done.output
    table = pq.read_table(out / "history.parquet", columns=["track", "t_s", "duration_s"])
    tracks, t = np.array(table["track"].to_pylist()), table["t_s"].to_numpy()
    ends = {}
    for track in np.unique(tracks).tolist():
        own = t[tracks == track]
        assert (np.diff(own) >= 0.0).all(), "time goes back"
        ends[track] = float(own[-1])
        assert table["duration_s"].to_numpy()[tracks == track].sum() == pytest.approx(ends[track], rel=CLOSE)
    return json.loads((out / "summary.json").read_text()), ends, out


def page_times(out):
    """Time at the end of each track of the page."""
    return {track.own.name: float(track.t[-1]) for track in open_result(out.parent, out.name).tracks}


@pytest.mark.parametrize("name", MACHINES)
def test_planned_programs(tmp_path, name):
    summary, ends, out = ran(tmp_path, name)
    machine, table = machine_named(MACHINES[name][0]), tmp_path / "tools.tbl"
    table.write_text(MACHINES[name][1])
    tools = read_tools(table) if MACHINES[name][1] else None
    option = ["--tools", str(table)] if MACHINES[name][1] else []
    tracks = [track for track in summary["tracks"] if track["programs"]]
    assert set(ends) == {track["name"] for track in tracks}
    report = (out / "report.html").read_text()
    shown = set(re.findall(r"(?<![\d.])\d+\.?\d*(?![\d.])", report))
    on_page = page_times(out)
    for track in tracks:
        text = out / track["programs"][0]
        _, seconds = line_times(read_program(text, machine, tools=tools), machine)
        assert track["time_s"] == pytest.approx(seconds.sum(), rel=CLOSE)
        assert ends[track["name"]] == pytest.approx(seconds.sum(), rel=CLOSE)
        assert on_page[track["name"]] == pytest.approx(seconds.sum(), rel=CLOSE)
        assert f"{track['time_s']:.5g}" in shown
        words = ["check", str(text), "--machine", MACHINES[name][0], *option]
        done = CliRunner().invoke(app, words)
        minutes = float(re.search(r" mm, ([0-9.e+-]+) min; ", done.output)[1])
        assert 60.0 * minutes == pytest.approx(seconds.sum(), rel=CLOSE)


@pytest.mark.parametrize("name", ["chips", "feeds", "bracket", "trunnion"])
def test_programs_from_elsewhere(tmp_path, name):
    summary, ends, out = ran(tmp_path, name)
    times = {track["name"]: track["time_s"] for track in summary["tracks"]}
    assert ends == {track: pytest.approx(time_s, rel=CLOSE) for track, time_s in times.items()}
    assert page_times(out) == {track: pytest.approx(time_s, rel=CLOSE) for track, time_s in times.items()}
    in_use = summary["tracks"][0]
    assert in_use["in_use"]
    assert in_use["time_s"] > 0.0
    assert summary["operations"][0]["program"]["time_s"] == in_use["time_s"]
    minutes = re.search(r" ([0-9.e+-]+) min; ", (out / "report.html").read_text())
    assert 60.0 * float(minutes[1]) == pytest.approx(in_use["time_s"], rel=CLOSE)
