"""The example of chatter: its modes from its hammer tests, exit 3 as posted, held with new speeds."""

from __future__ import annotations

import json
from pathlib import Path

from chipload import examples
from command import call


def test_the_example_chatters_as_posted_and_holds_at_the_new_speed(tmp_path: Path) -> None:
    folder = examples.copy_example("chatter", tmp_path / "chatter")
    taps = [str(folder / f"tap_{x}.csv") for x in "xy"]
    words = ["--direction", "x", "--direction", "y", "--tool", "3", "--out", str(tmp_path / "modes.toml")]
    assert call("tap", *taps, *words)[0] == 0
    assert (tmp_path / "modes.toml").read_text() == (folder / "modes.toml").read_text()

    coarse = ["--set", "operation.0.step_mm=6", "--set", "stock.layer_mm=2"]
    code, out, _ = call("run", folder / "job.toml", "--out", tmp_path / "new", *coarse)
    assert code == 0, out
    assert out.startswith("Holds at 95 %: ")
    told = json.loads((tmp_path / "new" / "summary.json").read_text())["operations"][0]
    assert told["speeds"]["before"]["margin_min"] < 0.95
    assert told["speeds"]["after"]["margin_min"] == told["stability"]["margin_min"] > 2.0
    (tool,) = told["speeds"]["tools"]
    assert any(w["low_rpm"] < tool["rpm"] < w["high_rpm"] for w in told["stability"]["windows"])
    assert f"S{tool['rpm']:g} M3" in (tmp_path / "new" / "0-speeds.nc").read_text()
    report = (tmp_path / "new" / "report.html").read_text()
    for text in ("<h2>Stability</h2>", "Quiet speeds of tool 3", "Stability chart", "Margin along the path"):
        assert text in report

    job = (folder / "job.toml").read_text()
    asks = job[job.index("[operation.speeds]") : job.index("[limits]")]
    (folder / "job.toml").write_text(job.replace(asks, ""))
    code, out, _ = call("run", folder / "job.toml", "--out", tmp_path / "posted", *coarse)
    assert code == 3
    assert "stability margin 0.89" in out
    assert "is below 1.2 in line" in out
    told = json.loads((tmp_path / "posted" / "summary.json").read_text())["operations"][0]["stability"]
    assert told["chatter_hz"] > 700.0
    assert told["mode"] == "cutter 811.982 Hz"
    assert told["speed_rpm_advised"] is not None
