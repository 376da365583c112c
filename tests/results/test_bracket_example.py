"""The example of a foreign program: each of its mistakes is found, with its line."""

import json

import pyarrow.parquet as pq
import pytest

#: step of 60 by 15 and 8 deep, slot of 12 by 25 and 5 deep
VOLUME = 60.0 * 15.0 * 8.0 + 12.0 * 25.0 * 5.0


def test_every_mistake_is_found_with_its_line(example) -> None:
    done = example("bracket")
    assert done.exit_code == 3
    summary = json.loads((done.folder / "summary.json").read_text())
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
    history = pq.read_table(done.folder / "history.parquet")
    row = history["form_error_um"].to_pylist().index(error["least"])
    assert history["t_s"].to_pylist()[row] == by["form_error_um"]["t_s"]
    # 0.04 mm a tooth over the width of 10, five times loose, of 12 mm2
    assert by["flute_fill"]["worst"] == pytest.approx(0.04 * 10.0 * 5.0 / 12.0, rel=1e-3)
