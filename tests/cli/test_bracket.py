"""The example of a foreign program that is held against all that can be stated."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from chipload import examples
from command import call


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return examples.copy_example("bracket", tmp_path / "bracket")


def summary_of(out: Path) -> dict:
    return json.loads((out / "summary.json").read_text())


#: step of 60 by 15 and 8 deep, slot of 12 by 25 and 5 deep
VOLUME = 60.0 * 15.0 * 8.0 + 12.0 * 25.0 * 5.0


def test_every_mistake_is_found_with_its_line(folder: Path, tmp_path: Path) -> None:
    code, _, err = call("run", folder / "job.toml", "--out", tmp_path / "r")
    assert (code, err) == (3, "")
    summary = summary_of(tmp_path / "r")
    op = summary["operations"][0]
    assert summary["verdict"] == "exceeds"
    by = {x["name"]: x for x in summary["limits"]}
    assert {n for n, x in by.items() if x["state"] == "exceeds"} == {"form_error_um", "gouge_mm"}
    assert by["gouge_mm"]["worst"] == pytest.approx(0.15, abs=1e-9)
    # the way back at x = 31 that is too deep is 10 wide of the 12, and round at its end at y = 30
    assert op["removed_mm3"] == pytest.approx(VOLUME + 0.15 * 10.0 * 25.0, rel=1e-4)
    (hit,) = op["collisions"]
    # the holder begins 22 over the tip at -5.15, the clamp ends at 18
    assert (hit["line"], hit["into"]) == (by["gouge_mm"]["line"], "fixture 0") == (29, "fixture 0")
    assert hit["depth_mm"] == pytest.approx(18.0 - (22.0 - 5.15), abs=1e-9)
    # in the full slot the cutter is drawn into the wall on its left
    error = op["form_error_um"]
    assert by["form_error_um"]["line"] == error["line"] == 25
    assert error["max"] == -error["least"] > 20.0
    assert op["deflection_um"]["not_stated"] == []
    history = pq.read_table(tmp_path / "r" / "history.parquet")
    row = history["form_error_um"].to_pylist().index(error["least"])
    assert history["t_s"].to_pylist()[row] == by["form_error_um"]["t_s"]
    # 0.04 mm a tooth over the width of 10, five times loose, of 12 mm2
    assert by["flute_fill"]["worst"] == pytest.approx(0.04 * 10.0 * 5.0 / 12.0, rel=1e-3)


def test_the_corrected_program_holds(folder: Path, tmp_path: Path) -> None:
    sets = ("--set", "program.file=corrected.nc", "--set", "cutter.0.overhang_mm=25.0")
    code, out, err = call("run", folder / "job.toml", "--out", tmp_path / "r", *sets)
    assert (code, err) == (0, "")
    # the first line states the limit with the least margin: in line 30 a bent cutter leaves the wall 15.2 um off
    assert out.startswith("Holds at 95 %: form error 15.21 + 1.8 of 20 µm, margin 15.1 %, in line 30 at ")
    summary = summary_of(tmp_path / "r")
    op, (track,) = summary["operations"][0], summary["tracks"]
    assert (summary["verdict"], track["findings"], op["collisions"]) == ("holds", [], [])
    assert {x["state"] for x in summary["limits"]} == {"holds"}
    assert op["removed_mm3"] == pytest.approx(VOLUME, rel=1e-4)
    assert op["gouge_mm"]["max"] < 1e-9
    keys = (
        "removed_mm3", "time_s", "air_cut_s", "force_n", "torque_nm", "power_w", "deflection_um", "gouge_mm",
        "excess_mm", "collisions", "energy_balance", "resolution_error",
    )  # fmt: skip
    assert set(keys) <= set(op)
