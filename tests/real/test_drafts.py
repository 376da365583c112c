"""Drafts of jobs for real files: the kind of job, what the file states, and that the product reads the draft."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from chipload.errors import InputError
from chipload.geometry.step_faces import read_faces
from chipload.jobs import check_job, load_job
from chipload.jobs.drafts.blade import draft_blade_model
from chipload.jobs.drafts.draft import write_draft
from chipload.jobs.drafts.make import draft_of

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[3] / "shared" / "data"))
pytestmark = pytest.mark.skipif(not (DATA / "nc").is_dir(), reason=f"no real files in {DATA}: set CHIPLOAD_DATA")
#: file -> kind of job, a line of the draft that the file states
FILES = {
    "nc/camotics/bear/bear.camotics": ("program", "high_mm = [80.0, 80.0, 0.0]      # workpiece of bear.camotics"),
    "nc/camotics/compass/top.ngc": ("program", 'name = "vmc"'),
    "nc/linuxcnc_5axis/boat-xyzac.ngc": ("program", "diameter_mm = 10.0               # the comment"),
    "nc/apt_dmu50/heidenhain/parts-2022/Dem-target2/11.h": ("program", "high_mm = [220.0, 220.0, 0.0]    # BLK FORM"),
    "nc/apt_dmu50/apt/Guincho_Lbar.apt": ("program", "overhang_mm = 120.0              # CSI_SET_EXTENSION_LENGTH"),
    "nc/apt_dmu50/apt/Dem-target2.apt": ("program", "high_mm = [220.0, 220.0, 0.0]"),
    "cad/dxf_hsm_nibbler/gear.dxf": ("contour", 'kind = "pocket"'),
    "cad/dxf_camotics/locket/seahorse.dxf": ("contour", "diameter_mm = 1.0"),
    "cad/nist_step/nist_ftc_11_asme1_rb.stp": ("contour", "face_z_mm = 0.425"),
    "machines_tools/better_tool_library/Shape/slittingsaw.fcstd": ("contour", 'file = "part.step"'),
    "cad/tblade3_rotor/Case_7-28-8_Rotor.step": ("thinwall", "front = 2"),
    "blades/turbogrid_rotor37/profile.curve": ("thinwall", 'unit = "cm"'),
    "blades/turbogrid_rotor37/BladeGen.inf": ("impeller", "blades = 36"),
    "blades/turbogrid_hannover4ac/3_Rotor2_Blade.inf": ("impeller", "outer_diameter_mm = 354.691"),
    "blades/pyturbo_radial/centrif_compressor_mainblade_xyz_pts.csv": ("impeller", 'unit = "m"'),
}


@pytest.mark.parametrize("name", FILES)
def test_a_draft_of_a_real_file(name: str, tmp_path: Path) -> None:
    kind, line = FILES[name]
    job = write_draft(draft_of(DATA / name, tmp_path / "job"), tmp_path / "job")
    assert line in job.read_text()
    loaded = load_job(job)
    assert loaded.capability.name == kind
    assert len(loaded.guesses) == job.read_text().count("# guess: ") > 3
    if kind == "contour":
        lines, _ = check_job(loaded)
        assert any(text.startswith("operation 0: pocket, cutter 1") for text in lines)


def test_a_model_whose_largest_faces_are_no_wall_is_refused(tmp_path: Path) -> None:
    """A thin wall of the two largest curved faces of a wheel could not be run: one of them folds."""
    file = DATA / "cad" / "impeller_kj66" / "impeller.step"
    with pytest.raises(
        InputError, match=r"the largest curved faces, 88 and 3, are not sides of a thin wall: .*; chipload"
    ):
        draft_blade_model(file, tmp_path, read_faces(file))
