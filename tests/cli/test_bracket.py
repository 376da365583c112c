"""The example of a foreign program, corrected: it holds against all that can be stated."""

import json
from pathlib import Path

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


def test_the_corrected_program_holds(folder: Path, tmp_path: Path) -> None:
    sets = ("--set", "program.file=corrected.nc", "--set", "cutter.0.overhang_mm=25.0")
    code, out, err = call("run", folder / "job.toml", "--out", tmp_path / "r", *sets)
    assert (code, err) == (0, "")
    # the first line states the limit with the least margin: in line 30 a bent cutter leaves the wall 15.2 um off
    assert out.startswith("Holds at 95 %: form error 15.2 + 1.7 of 20 µm, margin 15.5 %, in line 30 at ")
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
