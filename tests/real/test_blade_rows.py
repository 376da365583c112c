"""Blade rows of others: NASA's Rotor 37 in two files of different origin, and a drum with several rows."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from chipload.geometry.bladegen import read_blade_row
from chipload.geometry.sections import read_meridian, read_sections
from chipload.jobs import check_job, load_job
from chipload.jobs.drafts.draft import write_draft
from chipload.jobs.drafts.make import draft_of

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data")) / "blades"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"no real files in {DATA}: set CHIPLOAD_DATA")


def test_rotor_37_about_x_is_rotor_37_about_z() -> None:
    """Sections about X of one archive, and those of TurboGrid about Z of another: the same points, hub and shroud."""
    row = read_blade_row(DATA / "turbogrid_rotor37" / "BladeGen.inf")
    assert (row.blades, row.unit, row.axis, row.splitter) == (36, "cm", "z", False)
    grid = read_sections([row.profile], row.unit)
    other = DATA / "rotor37_pyturbo"
    single = read_sections([other / f"R37_profile0{k}.csv" for k in range(1, 7)], "cm", axis="x")
    whole = read_sections([other / "profile_R37.dat"], "cm", columns="X Y Z", axis="x")
    for a, b, c in zip(grid, single, whole, strict=True):
        assert np.abs(b - c).max() < 1e-3
        # the frames differ by a reflection or a turn about the axis at most: radius and height are the same
        n = min(len(a), len(b))
        assert np.hypot(a[:n, 0], a[:n, 1]) == pytest.approx(np.hypot(b[:n, 0], b[:n, 1]), abs=1e-3)
        assert a[:n, 2] == pytest.approx(b[:n, 2], abs=1e-3)
    for name, file in (("hub", row.hub), ("shroud", row.shroud)):
        fine = read_meridian(file, "cm")
        rough = read_meridian(other / f"{name}_R37.dat", "cm", axis="x")
        inside = rough[(rough[:, 1] > fine[:, 1].min()) & (rough[:, 1] < fine[:, 1].max())]
        order = np.argsort(fine[:, 1])
        assert np.interp(inside[:, 1], fine[order, 1], fine[order, 0]) == pytest.approx(inside[:, 0], abs=0.1)


def test_a_row_of_a_drum(tmp_path: Path) -> None:
    """The hub of the file is that of all rows; the floor of one is that between its blades."""
    draft = draft_of(DATA / "turbogrid_hannover4ac" / "1_Rotor1_Blade.inf", tmp_path / "job")
    found, _ = check_job(load_job(write_draft(draft, tmp_path / "job")))
    lines = [line for line in found if not line.startswith("guess: ")]
    assert lines[:2] == [
        "impeller: 23 blades", "flow: along the axis of the files, by the hub, whose narrow end is up",
    ]  # fmt: skip
    assert any(line.endswith("no cutter is too short") for line in lines)
