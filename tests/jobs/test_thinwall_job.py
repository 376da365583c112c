"""Jobs of thin walls that must be refused, each with its message."""

from pathlib import Path

import pytest

from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job
from chipload.jobs.thinwall.job import ThinWallJob


@pytest.fixture
def plate(tmp_path) -> Path:
    return copy_example("plate", tmp_path / "plate") / "job.toml"


@pytest.mark.parametrize("name", ["plate", "blade"])
def test_examples_are_read(name, tmp_path):
    loaded = load_job(copy_example(name, tmp_path / name) / "job.toml")
    assert loaded.capability.name == "thinwall"
    job = loaded.job
    assert isinstance(job, ThinWallJob)
    assert job.limits["deflection_workpiece_um"] > 0.0
    assert "form_error_um" in job.unchecked


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ("workpiece.modulus_gpa=113800.0", "workpiece.modulus_gpa = 113800: must be from 1 to 1000 GPa; is it in MPa"),
        ("workpiece.density_kg_m3=4.43", "must be from 500 to 25000 kg/m3; is it in g/cm3?"),
        ("workpiece.yield_mpa=0.88", "must be from 10 to 5000 MPa; is it in GPa?"),
        ("workpiece.poisson=0.5", "workpiece.poisson = 0.5: must be below 0.5"),
        ("wall.foot_mm=3.0", "wall.foot_mm = 3: must be at least the corner radius of cutter 1, 4"),
        ("wall.chord_root_mm=20.0", "wall.chord_root_mm: not used by shape = plate: leave it out"),
        ('wall.shape="blade"', "wall.chord_root_mm: missing: state it (shape = blade needs it)"),
        ("operation.0.step_over_mm=0.5", "operation.0: both are stated: state either step_over_mm or scallop_um"),
        ("operation.0.cutter=7", "operation.0.cutter = 7: no [[cutter]] has this number: state one of 1"),
        ("operation.0.clearance_mm=0.2", "operation.0.clearance_mm = 0.2: must be above wall.allowance_mm = 0.4"),
        ("limits.deflection_workpiece_um=0.0", "limits.deflection_workpiece_um = 0: must be above 0"),
        ("operation.0.lean_deg=95.0", "operation.0.lean_deg = 95: must be below 89"),
    ],
)
def test_refused(plate, change, text):
    with pytest.raises(InputError) as err:
        load_job(plate, [change])
    assert text in str(err.value)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ("operation.0.depth_max_mm=1.6", "where the flank begins to cut"),
        ("operation.0.depth_min_mm=0.5", "depth_min_mm = 0.5: must be above 0 and below depth_max_mm = 0.4"),
        ("operation.0.scallop_um=2500.0", "operation.0.scallop_um = 2500: must be below 2000, half the radius"),
        ("wall.foot_mm=18.0", "must be below 0.8 of the wall's height"),
        ("wall.elements=[8, 1]", "must be above 1, those of the foot: raise it"),
    ],
)
def test_refused_when_it_is_made(plate, change, text):
    from chipload.jobs.thinwall.inputs import read_wall

    with pytest.raises(InputError) as err:
        read_wall(load_job(plate, [change]).job)
    assert text in str(err.value)
