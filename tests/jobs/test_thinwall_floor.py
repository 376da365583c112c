"""Floors of a part: compliance against plate theory, the rows around an island, a whole job, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely
from tests.step_files import moved, written

from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.places import places_of
from chipload.jobs.thinwall.tries import unlimited_plan
from chipload.jobs.thinwall.wall_program import link_pass_programs
from chipload.planning.thinwall.passes import at_one_level
from chipload.program.program import RAPID
from chipload.result import Verdict

FRAME = "".join(
    f"\n[[workpiece.clamp]]\nlow_mm = {low}\nhigh_mm = {high}\n"
    for low, high in (
        ([0.0, 0.0, 0.0], [4.0, 48.0, 6.0]),
        ([44.0, 0.0, 0.0], [48.0, 48.0, 6.0]),
        ([4.0, 0.0, 0.0], [44.0, 4.0, 6.0]),
        ([4.0, 44.0, 0.0], [44.0, 48.0, 6.0]),
    )
)


def made(folder: Path, cut: tuple, *, face: str, clamp: str, block: tuple = (48, 48, 6), change: tuple[str, ...] = ()):
    """A job on the floor of a block of which boxes are cut; an island is left by a box that is added."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    whole = BRepPrimAPI_MakeBox(*block).Shape()
    for sign, low, high in cut:
        box = BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()
        whole = (BRepAlgoAPI_Cut if sign == "-" else BRepAlgoAPI_Fuse)(whole, box).Shape()
    job = copy_example("part", folder / "job") / "floor.toml"
    written(job.parent / "web.step", whole)
    text = job.read_text().replace("face = [23.0, 18.0, 5.0]", f"face = {face}")
    job.write_text(text.replace('\n[[workpiece.clamp]]\nface = "z-"\n', clamp))
    return load_job(job, change)


POCKET = (("-", (4, 4, 1), (44, 44, 6)),)


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """A floor of 40 x 40 x 1 mm in a frame that is held as a whole."""
    change = ("workpiece.cell_mm=2.5", "part.places=[9, 9]")
    job = made(tmp_path_factory.mktemp("plate"), POCKET, face="[20.0, 20.0, 1.0]", clamp=FRAME, change=change)
    return read_wall(job.job)


def test_a_clamped_plate(plate):
    """Under a force in its middle w = 0.0056 F a^2 / D (Timoshenko and Woinowsky-Krieger, table 37); shear adds 2 %."""
    part = plate.body.part
    none = [np.zeros(part.shape)]
    motion = part.motion(none, 0).reshape(9, 9, 3)
    D = 71.7e3 / (12.0 * (1.0 - 0.33**2))
    assert motion[4, 4, 2] == pytest.approx(0.0056 * 1600.0 / D, rel=0.05)
    assert np.abs(motion[4, 4, :2]).max() < 1e-3 * motion[4, 4, 2]
    # symmetric, and almost none at the walls
    C = motion[..., 2]
    assert C[1:-1, 1:-1] == pytest.approx(C[::-1][1:-1, 1:-1], rel=1e-3)
    assert C[1:-1, 1:-1] == pytest.approx(C.T[1:-1, 1:-1], rel=1e-3)
    assert C[0].max() < 0.02 * C[4, 4]


def test_a_lateral_force_bends_the_floor(plate):
    """It acts half the thickness above the middle: h / 2 times the slope of the place's own deflection, dC/dx / 2."""
    part = plate.body.part
    motion = part.motion([np.zeros(part.shape)], 0).reshape(9, 9, 3)
    x = np.linspace(0.0, 40.0, 9)
    slope = np.gradient(motion[:, 4, 2], x)
    for i in (2, 3, 5, 6):
        assert motion[i, 4, 0] == pytest.approx(-0.5 * 0.5 * slope[i], rel=0.2)
    assert abs(motion[2, 4, 0]) > 0.02 * motion[2, 4, 2]


def test_stock_makes_it_stiffer(plate):
    """Twice as thick: an eighth of the deflection in the limit of thin plates; shear and the square leave more."""
    part = plate.body.part
    thin, thick = (part.compliance([np.full(part.shape, x)], 0).reshape(9, 9)[4, 4] for x in (0.0, 1.0))
    assert 0.125 < thick / thin < 0.16


ISLAND = (("-", (4, 4, 2), (44, 34, 8)), ("+", (20, 14, 0), (28, 22, 8)))


def test_rows_around_an_island(tmp_path):
    """All of the floor that a disc of 8 mm reaches is covered, no motion enters a wall, no rapid enters stock."""
    job = made(
        tmp_path, ISLAND, face="[10.0, 10.0, 2.0]", clamp='\n[[workpiece.clamp]]\nface = "z-"\n', block=(48, 38, 8)
    )
    inputs = read_wall(job.job)
    floor = shapely.box(4, 4, 44, 34).difference(shapely.box(20, 14, 28, 22))
    assert inputs.floor(0).face.area == pytest.approx(floor.area)
    places = places_of(inputs)
    (leg,) = link_pass_programs(inputs, unlimited_plan(places).plan, places.grid)
    p = leg.program
    lines = [shapely.LineString(q) for q in zip(p.p_work[:-1, :2], p.p_work[1:, :2], strict=True)]
    low = np.minimum(p.p_work[1:, 2], p.p_work[:-1, 2])
    walls = shapely.box(0, 0, 48, 38).difference(floor)
    assert (
        min(q.distance(walls) for q, z in zip(lines, low, strict=True) if z < 8.0) > 4.0 - 5e-4
    )  # chords of the offset around a corner
    feeds = [q for q, m, z in zip(lines, p.motion[1:], low, strict=True) if m != RAPID and z < 2.0 + 1e-9]
    swept = shapely.union_all([q.buffer(4.0, quad_segs=64) for q in feeds])
    reached = floor.buffer(-4.0).buffer(4.0, quad_segs=64)
    assert reached.difference(swept).area < 1e-3 * floor.area
    assert np.all(low >= 2.0 - 1e-9)
    # a rapid below the stock's top moves up or down only
    for q, m, z in zip(lines, p.motion[1:], low, strict=True):
        assert m != RAPID or z >= 3.0 or q.length < 1e-9


def test_level_passes():
    """Rows whose places allow all of the stock are left whole; the others are cut down to the least of them before."""
    low = np.full((3, 4), 0.1)
    high = np.array([[1.0, 0.5, 0.6, 1.0], [1.0, 0.7, 0.8, 1.2], [1.1, 0.6, 0.4, 1.0]])
    assert at_one_level(low, high, 0.9, 0.1)[0].tolist() == [0.9, 0.4, 0.4, 0.9]
    # not so near to the top that a film is left for the pass before
    assert at_one_level(low, np.full((3, 4), 0.85), 0.9, 0.1)[0].tolist() == pytest.approx([0.8] * 4)


def said(call) -> str:
    with pytest.raises(InputError) as err:
        call()
    return str(err.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('contact = "end"', 'contact = "end"\nslope = 0.05', "operation.0.slope: not used with contact = end"),
        ("allowance_mm = [1.0]", "allowance_mm = [1.0]\nfoot_mm = 2.0", "wall.0.foot_mm: not used with contact = end"),
        ("step_over_mm = 4.0", "scallop_um = 4.0", "operation.0.step_over_mm: missing: state it"),
        ("step_over_mm = 4.0", "step_over_mm = 8.5", "must be from above 0 to 8, the flat of the bottom"),
        ("face = [23.0, 18.0, 5.0]", "face = [23.0, 18.0, 3.5]", "looks down, or its facets do not make one outline"),
        ("face = [23.0, 18.0, 5.0]", "face = [23.0, 0.0, 5.0]", "is not a level face"),
        (
            "diameter_mm = 8.0",
            "diameter_mm = 31.0\nshank_diameter_mm = 8.0",
            "cutter 1: diameter_mm = 31: fits nowhere between the walls of face",
        ),
    ],
)
def test_refused(tmp_path, old, new, message):
    path = copy_example("part", tmp_path / "job") / "floor.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))

    def planned():
        inputs = read_wall(load_job(path).job)
        places = places_of(inputs)
        link_pass_programs(inputs, unlimited_plan(places).plan, places.grid)

    assert message in said(planned)


#: where the part of the example lies in the tests [mm]: no number of a plan may depend on it
AWAY = np.array([100.0, -50.0])


def example(folder: Path, degrees: float):
    """The job of the shipped example, its part turned about z and moved."""
    job = copy_example("part", folder / "part") / "floor.toml"
    moved(job.parent / "web.step", degrees, tuple(AWAY))
    angle = np.radians(degrees)
    x, y = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ (23.0, 18.0) + AWAY
    text = job.read_text()
    assert "face = [23.0, 18.0, 5.0]" in text
    job.write_text(text.replace("face = [23.0, 18.0, 5.0]", f"face = [{x}, {y}, 5.0]"))
    return load_job(job, ["operation.0.refine=false"])


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The example: a floor of 40 x 30 x 1.5 mm in a frame that is open at one end, with 1 mm of stock."""
    return run_job(example(tmp_path_factory.mktemp("example"), 0.0))


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 217.0])
def test_rows_of_a_turned_floor(tmp_path, degrees):
    """Seven rows over the floor, of 44 mm each, that begin in air at the open end; the walls at three sides."""
    inputs = read_wall(example(tmp_path, degrees).job)
    area = inputs.floor_area(inputs.body.side_numbers[0])
    # 39 + 22 + 39 mm: half a cutter from the walls
    assert area.walls.length == pytest.approx(100.0, abs=1e-5)
    # a rounded corner of 4 mm on each side at the closed end, none at the open one
    assert area.centres.intersection(area.outline).area == pytest.approx(39.0 * 22.0, rel=1e-6)
    places = places_of(inputs)
    (one,) = link_pass_programs(inputs, unlimited_plan(places).plan, places.grid)
    program = one.program
    p = np.asarray(program.p_work)
    # one feed down for each row, and for each of six pieces of the contour: no ramps
    down = np.flatnonzero((np.diff(p[:, 2]) < -1e-9) & (program.motion[1:] != RAPID)) + 1
    assert len(down) == 7 + 6
    angle = np.radians(degrees)
    own = (p[down[:7], :2] - AWAY) @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert (own[:, 0] > 46.0 + 4.0 - 1e-6).all()
    assert own[:, 1] == pytest.approx(np.sort(own[:, 1])[:: 1 if own[0, 1] < own[-1, 1] else -1])


def test_the_example(done):
    """Constant and variable depth hold, the greatest depth does not; passes over fewer rows take less time."""
    tracks = {t.name: t for t in done.result.tracks}
    assert tracks["variable"].verdict is Verdict.HOLDS, [c.text for c in tracks["variable"].limits]
    assert tracks["constant"].verdict is Verdict.HOLDS
    assert tracks["unconstrained"].verdict is Verdict.EXCEEDS
    # the axial force and the lateral one of a level cut are known to a tenth
    for name in ("constant", "unconstrained"):
        assert done.outcome.variants[name].load_error["force_normal_n"] < 0.1
    assert len(done.outcome.variants["variable"].plan.maps) == 3
    variants = done.outcome.variants
    assert variants["variable"].seconds < 0.8 * variants["constant"].seconds
    assert variants["unconstrained"].seconds < 0.5 * variants["variable"].seconds
    rows = [int((m.depth > 0.0).all(axis=0).sum()) for m in variants["variable"].plan.maps]
    assert rows[0] < rows[-1] == max(rows)
    assert all(f.made.all() for v in variants.values() for f in v.finish)


def test_volume_of_the_example(done):
    """1 mm over the floor up to the open end, without the two corners that a cutter of 8 mm does not reach."""
    reached = 43.0 * 30.0 - 2.0 * (1.0 - 0.25 * np.pi) * 16.0
    for one in done.outcome.variants.values():
        # films, and the wedges between two steps
        assert one.columns["chip_volume_mm3"].sum() == pytest.approx(reached, rel=2e-3)
        assert one.shape.gouge < 1e-4


def test_axial_force_in_the_middle_of_a_row(done):
    """The mean of the layered simulation is the closed form N d / 2 pi (Kac f (1 - cos psi) + Kae psi)."""
    c = done.outcome.variants["unconstrained"].columns
    own = done.outcome.planning.operations[0]
    _, _, Kac, _, _, Kae = material_named("al7075-t6").coefficients
    psi = np.arccos(1.0 - 22.0 / 6.0 / 4.0)  # 7 rows over 22 mm
    expected = 3.0 / (2.0 * np.pi) * (Kac * own.feed_per_tooth * (1.0 - np.cos(psi)) + Kae * psi)
    middle = (np.abs(c["contact_x_mm"] - AWAY[0] - 25.0) < 4.0) & (np.abs(c["contact_y_mm"] - AWAY[1] - 18.0) < 1.0)
    assert middle.sum() >= 3
    assert np.abs(c["force_z_mean_n"][middle]) == pytest.approx(expected, rel=0.02)


def test_deflection_of_a_step_of_the_example(done):
    """Of the worst step: its equivalent force times a compliance that neighbouring places enclose."""
    one = done.outcome.variants["constant"]
    c = one.columns
    k = int(np.argmax(c["deflection_workpiece_um"]))
    assert c["contact_x_mm"][k] - AWAY[0] > 40.0  # near the open end
    softness = 1e-3 * c["deflection_workpiece_um"][k] / c["force_normal_n"][k]
    assert softness == pytest.approx(6e-3 / c["force_allowable_n"][k])
    assert c["force_over_allowable"][k] == pytest.approx(c["deflection_workpiece_um"][k] / 6.0)
    # the floor moves by the lateral force as well: more than by the greatest axial force alone
    axial = max(abs(c["force_z_max_n"][k]), abs(c["force_z_min_n"][k]))
    assert axial < c["force_normal_n"][k] < 3.0 * axial
