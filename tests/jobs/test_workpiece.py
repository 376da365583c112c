"""[workpiece] of a program job: a wall that is finished gives way as a wall, limits, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from chipload import jobs
from chipload.errors import InputError, Severity
from chipload.jobs.coarse import coarser
from chipload.jobs.program.result import result_of
from chipload.jobs.program.run import check, run
from chipload.number_text import number_text

#: a wall of 3 mm, 16 mm high and 30 mm long, is made 2.5 mm thin from one side
PROGRAM = """%
G21 G90 G17 G54
T1 M6
S6000 M3
G0 X-8. Y-5. Z10.
G0 Z-8.
G1 X38. F600.
G0 Y-20.
G0 X-8.
G0 Z-16.
G0 Y-5.
G1 X38. F600.
G0 Z10.
M30
%
"""
JOB = """
[program]
file = "wall.nc"
[machine]
name = "vmc-fanuc"
[stock]
file = "wall.stl"
units = "mm"
layer_mm = 2.0
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 4
helix_deg = 30.0
flute_length_mm = 22.0
overhang_mm = 30.0
modulus_gpa = 580.0
[workpiece]
modulus_gpa = 70.0
poisson = 0.33
states = 4
[[workpiece.clamp]]
face = "z-"
[[operation]]
kind = "simulate"
step_mm = 2.0
tolerance_mm = 0.005
[limits]
deflection_workpiece_um = {limit}
"""


def loaded(path: Path):
    """The program job of a file."""
    return jobs.load_job(path).job


@pytest.fixture
def job_file(tmp_path: Path) -> Path:
    whole = trimesh.creation.box(bounds=[[0, -0.5, -20], [30, 2.5, 0]])
    whole.export(tmp_path / "wall.stl")
    (tmp_path / "wall.nc").write_text(PROGRAM)
    (tmp_path / "job.toml").write_text(JOB.format(limit=2000.0))
    return tmp_path / "job.toml"


def changed(job_file: Path, old: str, new: str) -> Path:
    text = job_file.read_text()
    assert old in text
    job_file.write_text(text.replace(old, new))
    return job_file


#: strip of 50 x 16 mm, 3 mm high, held at both ends, made 2.5 mm thin by a flat end from above
FLOOR = ("""[stock]
low_mm = [0.0, -8.0, -3.0]
high_mm = [50.0, 8.0, 0.0]
layer_mm = 0.5
""", """order = 3
cell_mm = 2.5
[[workpiece.clamp]]
low_mm = [0.0, -8.0, -3.0]
high_mm = [5.0, 8.0, -0.5]
[[workpiece.clamp]]
low_mm = [45.0, -8.0, -3.0]
high_mm = [50.0, 8.0, -0.5]
""")  # fmt: skip


def test_a_floor_gives_way_along_the_axis(job_file):
    """A flat end over a thin floor: the axial force on a beam that is held at both ends, F L^3 / (192 E I)."""
    path = changed(job_file, '[stock]\nfile = "wall.stl"\nunits = "mm"\nlayer_mm = 2.0\n', FLOOR[0])
    path = changed(path, '[[workpiece.clamp]]\nface = "z-"\n', FLOOR[1])
    path = changed(path, "diameter_mm = 10.0", "diameter_mm = 20.0")
    (path.parent / "wall.nc").write_text(
        "%\nG21 G90 G17 G54\nT1 M6\nS6000 M3\nG0 X-16. Y0. Z10.\nG0 Z-0.5\nG1 X66. F600.\nG0 Z10.\nM30\n%\n"
    )
    path = changed(path, "[limits]", "[checks]\nstress_wall_mm = 3.0\n[limits]")
    simulated = run(loaded(path)).simulated
    c = simulated.removal.columns
    said = [text for text in simulated.collisions.stock.unchecked if text.startswith("distortion by residual stress")]
    assert len(said) == 1
    assert "below checks.stress_wall_mm = 3" in said[0]
    middle = np.abs(c["x_mm"] - 24.0) < 2.5
    beam = 40.0**3 / (192.0 * 70e3 * 16.0 * 2.5**3 / 12.0)
    assert 1e-3 * c["deflection_workpiece_um"][middle] / -c["force_z_min_n"][middle] == pytest.approx(beam, rel=0.1)


#: the cutter meets the wall square, in the last quarter of a step of 2 mm, and goes on along it
SQUARE = "%\nG21 G90 G17 G54\nT1 M6\nS6000 M3\nG0 X12. Y-19. Z10.\nG0 Z-8.\nG1 Y-5. F600.\nX22.\nG0 Z10.\nM30\n%\n"


def test_a_step_that_meets_the_wall_at_its_end_bends_it_where_it_cuts(job_file):
    """Per force it moves as in the steps behind it, and as with steps of a quarter of the length."""
    (job_file.parent / "wall.nc").write_text(SQUARE)
    found = []
    for step_mm in ("2.0", "0.5"):
        path = changed(job_file, "step_mm = 2.0", f"step_mm = {step_mm}") if step_mm != "2.0" else job_file
        c = run(loaded(path)).simulated.removal.columns
        line = c["line"]
        cuts = c["force_n"] > 0.0
        square, along = np.flatnonzero(cuts & (line == 7)), np.flatnonzero(cuts & (line == 8))
        assert len(square) >= 1
        gives = c["deflection_workpiece_um"] / np.where(cuts, c["force_n"], 1.0)
        found.append((gives[square[-1]], gives[along[0]]))
        assert found[-1][0] == pytest.approx(found[-1][1], rel=0.5)
    assert found[0][0] == pytest.approx(found[1][0], rel=0.1)


def test_fewer_states_than_passes_are_named(job_file):
    """Two states where the first ones alone are four: how many there should be, and what the deflection may exceed."""
    done = run(loaded(changed(job_file, "states = 4", "states = 2")))
    note = next(f for f in result_of(done).tracks[0].findings if f.code == "few-states")
    assert note.severity is Severity.NOTE
    change = done.simulated.workpiece.state_change
    assert note.text.startswith("workpiece.states = 2: a state before each pass over a place takes 4; ")
    assert note.text.endswith(f"may be {number_text(100.0 * change, 2)} % greater")


def test_a_wall_gives_way_as_a_plate(job_file):
    done = run(loaded(job_file))
    simulation = done.simulated
    c = simulation.removal.columns
    cut = c["deflection_workpiece_um"] > 0.0
    assert (cut == (c["force_n"] > 0.0)).all()
    # between the middle of a cantilever that is wide as it is high and one as wide as the plate: its end bends most
    um, x = c["deflection_workpiece_um"], c["x_mm"]
    upper = cut & (c["z_mm"] > -9.0)
    ends, middle = um[upper & ((x < 4.0) | (x > 26.0))], um[upper & (np.abs(x - 15.0) < 4.0)]
    assert ends.max() > 1.3 * middle.max()
    # a strip of the plate: F L^3 / (3 E I) over its whole width is the least that the free edge can do
    force = c["force_normal_n"][upper].max()
    strip = force * 20.0**3 / (3.0 * 70e3 * 30.0 * 3.0**3 / 12.0)
    assert 1e3 * strip < ends.max() < 8e3 * strip
    result = result_of(done)
    numbers = result.operations[0]
    assert numbers["deflection_workpiece_um"]["max"] == um.max()
    assert 2 <= numbers["states"] <= 20
    assert numbers["thinnest_wall_mm"] == pytest.approx(2.5, rel=0.05)
    limit = next(check for check in result.limits if check.name == "deflection_workpiece_um")
    assert limit.resolution_error >= simulation.workpiece.error
    assert {m.name for m in result.maps} == {"workpiece"}
    assert 0.0 < numbers["support"]["lowers_percent"] < 100.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("modulus_gpa = 70.0\n", "", "workpiece.modulus_gpa: missing"),
        ("poisson = 0.33", "poisson = 0.5", "workpiece.poisson"),
        ('face = "z-"', 'face = "z-"\ndirections = "z"', "motion along x, motion along y, rotation about z are free"),
        (
            'face = "z-"',
            "low_mm = [50.0, 0.0, -20.0]\nhigh_mm = [60.0, 2.0, -18.0]",
            "workpiece.clamp.0: holds nothing: no stock between (50, 0, -20) and (60, 2, -18) mm: place it on",
        ),
        ('face = "z-"', "", "workpiece.clamp.0: state either a face, a box by low_mm and high_mm, or a cylinder"),
        ('face = "z-"', "point_mm = [1.0, 1.0, -19.0]", "both point_mm and diameter_mm of a cylinder"),
        ("[workpiece]", "[stiffness]\nwork_n_um = 100.0\n[workpiece]", "stiffness.work_n_um: leave it out"),
    ],
)
def test_what_cannot_be_clamped_is_refused(job_file, old, new, message):
    path = changed(job_file, old, new)
    with pytest.raises(InputError, match=re.escape(message)):
        check(loaded(path))


def test_the_additional_run_and_the_states_are_in_the_estimate(job_file):
    with_states = check(loaded(job_file))[0][-1]
    text = re.sub(r"\[workpiece\].*?\[\[operation", "[[operation", job_file.read_text(), flags=re.DOTALL)
    job_file.write_text(text.replace("deflection_workpiece_um", "force_n"))
    rigid = check(loaded(job_file))[0][-1]
    (steps, least, most), (once, first, last) = (
        [int(n) for n in re.findall(r"(\d+) (?:steps|to|s$)", line)] for line in (with_states, rigid)
    )
    assert steps == 2 * once
    assert least > first
    assert most > last


def test_a_limit_needs_a_workpiece(job_file):
    text = job_file.read_text()
    job_file.write_text(re.sub(r"\[workpiece\].*?\[\[operation", "[[operation", text, flags=re.DOTALL))
    with pytest.raises(InputError, match=r"limits.deflection_workpiece_um: needs the workpiece and its clamps"):
        loaded(job_file)


def test_coarse_leaves_cells_that_are_as_wide_as_the_wall_allows(job_file):
    """6 mm is within 2.5 times the wall of 2.49 mm, twice that is not."""
    path = changed(job_file, "states = 4", "states = 4\ncell_mm = 6.0")
    overrides = coarser(jobs.load_job(path))
    assert "workpiece.states=1" in overrides
    assert jobs.load_job(path, overrides).job.table.workpiece.cell_mm == 6.0


def test_a_coarse_run_takes_the_widest_cells_of_the_job(job_file):
    """2.5 times the wall of 2.5 mm, which a coarse run knows to 0.1 mm only, and its search to 1 %."""
    path = changed(job_file, "states = 4", "states = 4\ncell_mm = 6.25")
    coarse = jobs.load_job(path, coarser(jobs.load_job(path))).job
    assert coarse.table.operation[0].tolerance_mm == pytest.approx(0.1)
    assert run(coarse).simulated.workpiece.cell <= 6.25


def test_cells_wider_than_the_wall_allows_are_refused(job_file):
    path = changed(job_file, "states = 4", "states = 4\ncell_mm = 8.0")
    with pytest.raises(
        InputError, match=r"workpiece.cell_mm = 8: the thinnest wall left is 2.49 mm: at most 2.5 times"
    ):
        run(loaded(path))
