"""Walls of a part by faces of its STEP file: compliance, stock, neighbours, a whole job with two walls, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import chipload.examples
from chipload.errors import Cancelled, InputError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.neighbours import part_collisions
from chipload.jobs.thinwall.places import wall_stock
from chipload.jobs.thinwall.result import limits_of
from chipload.jobs.thinwall.wall_program import link_pass_programs
from chipload.planning.thinwall.blank import WallBlank
from chipload.planning.thinwall.passes import constant
from chipload.planning.thinwall.threshold import modelled
from chipload.result import Verdict
from chipload.simulation.checkpoint import Checkpoint
from chipload.structure.grid import plate
from chipload.structure.places import normals_of, on_cut, on_side
from chipload.structure.solid import SolidWorkpiece, factorise, loads

#: a floor of 6 mm with two walls of 3 mm, 12 and 10 mm high, 15 mm apart
BOXES = (((0, 0, 0), (12, 27, 6)), ((0, 3, 6), (12, 6, 18)), ((0, 21, 6), (12, 24, 16)))
WALLS = """[part]
file = "part.step"
places = [5, 4]

[[wall]]
face = [6.0, 3.0, 15.0]
foot_mm = 5.0
allowance_mm = [0.3]

[[wall]]
face = [6.0, 24.0, 14.0]
foot_mm = 5.0
allowance_mm = [0.2]

"""
CLAMP = '\n[[workpiece.clamp]]\nface = "z-"\n'
COARSE = (
    "workpiece.cell_mm=4.0",
    "operation.0.lean_deg=50.0",
    "operation.0.scallop_um=80.0",
    "operation.0.depth_max_mm=0.3",
    "operation.0.layer_mm=0.5",
    "operation.0.corner_slices=40",
    "operation.0.least_error=false",
    "operation.0.refine=false",
    "limits.deflection_workpiece_um=26.0",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    made = copy_example("plate", tmp_path_factory.mktemp("part") / "job")
    (made / "part.step").write_bytes((Path(chipload.examples.__file__).parent / "part" / "ribs.step").read_bytes())
    return made


def test_the_part_of_the_example(folder):
    """Boxes: a floor and two ribs."""
    shape = read_wall(job(folder).job).body.part.body
    assert shape.part.volume == pytest.approx(sum(np.prod(np.subtract(high, low)) for low, high in BOXES))
    assert shape.part.bounds.tolist() == [[0.0, 0.0, 0.0], [12.0, 27.0, 18.0]]


def job(folder: Path, *, walls: str = WALLS, clamp: str = CLAMP, change: tuple[str, ...] = ()):
    """A job like the shipped plate, with walls of the part."""
    text = (folder / "job.toml").read_text()
    if "[[wall]]" not in text:
        (folder / "rest.toml").write_text(text[text.index("[workpiece]") :].replace("compensate_um = 60.0\n", ""))
    rest = (folder / "rest.toml").read_text()
    (folder / "job.toml").write_text("# walls\n" + walls + rest.replace("\n[machine]", clamp + "\n[machine]"))
    return load_job(folder / "job.toml", (*COARSE, *change))


def test_compliance_of_a_wall_that_is_held_at_its_foot(folder):
    """The floor held as a whole: what finite elements of the wall alone say, clamped at its foot."""
    held = "\n[[workpiece.clamp]]\nlow_mm = [0.0, 0.0, 0.0]\nhigh_mm = [12.0, 27.0, 6.0]\n"
    change = ("workpiece.cell_mm=3.0", "workpiece.order=3")
    found = read_wall(job(folder, clamp=held, change=change).job)
    blank = found.body.part
    none = [np.zeros(blank.shape)] * 2
    grid = plate(12.0, 12.0, 3.3, (12, 12, 1))
    alone = WallBlank(SolidWorkpiece(grid, 113800.0, 0.342, 4.43e-9, grid.side("j-")), (0.3, 0.0), 1, 5)
    solid = alone.state([np.zeros(alone.shape)] * 2)
    factored, half = factorise(solid), 0.5 * blank.contact / 12.0
    over = half * np.linspace(-1.0, 1.0, 9)

    def spread(u: float, z: float) -> float:
        """Of a force over the contact square, on the finite elements."""
        a, b = np.meshgrid(*(np.clip(p, half, 1.0 - half) + over for p in (u, z / 12.0)))
        at = on_cut(on_side(grid, "k-", a.ravel(), b.ravel()), solid.kept, "k-")
        f = np.asarray(loads(factored, at, normals_of(grid, at, "k-")).mean(axis=1)).reshape(-1, 1)
        return float((f * factored.solve(f)).sum())

    expected = [[spread(u, z) for z in (5.0 + 14.0 / 3.0, 12.0)] for u in np.linspace(0.0, 1.0, 5)]
    assert blank.compliance(none, 0).reshape(5, 4)[:, 2:] == pytest.approx(np.array(expected), rel=0.08)
    # held below its floor alone it gives way more, by a part that the mean of all places sees
    soft = read_wall(job(folder, change=change).job).body.part
    assert (soft.compliance(none, 0) > 1.05 * blank.compliance(none, 0)).all()


def test_the_stated_error_covers_what_finer_cells_find(tmp_path):
    """The example at its own cells of 4 mm, beside cells of 2 mm of the next order; under a line they found 29 % more
    where 2 % was stated.
    """
    made = copy_example("part", tmp_path / "job") / "walls.toml"
    used, finer = (
        read_wall(load_job(made, sets).job).body.part for sets in ((), ("workpiece.cell_mm=2.0", "workpiece.order=3"))
    )
    none = [np.zeros(used.shape)] * 2
    for side in range(2):
        found = finer.compliance(none, side) / used.compliance(none, side) - 1.0
        stated = used.error(side).ravel()
        assert (found < stated).all()
        assert found.max() > 0.2
        assert stated.max() < 0.45


def test_stock_of_a_state(folder):
    """The part and what is left on its sides: volumes of boxes, the foot with all of its stock."""
    body = read_wall(job(folder).job).body
    left = [np.full(body.elastic.shape, x) for x in (0.1, 0.0)]
    stock = body.part.state(left).volume
    whole = 12.0 * (27.0 * 6.0 + 3.0 * 12.0 + 3.0 * 10.0)
    over = 12.0 * (0.3 * 5.0 + 0.1 * 7.0) + 12.0 * 0.2 * 5.0
    # layers of a quarter of a cell end at the level faces, not at the foot
    assert stock == pytest.approx(whole + over, abs=12.0 * 0.3 * 1.0)
    assert wall_stock(read_wall(job(folder).job)).volume() == pytest.approx(whole + 12.0 * (3.6 + 2.0), rel=1e-3)


def test_both_sides_of_a_wall(folder):
    """They belong to one wall, are cut alternately, and give way alike: its thickness hardly changes."""
    walls = WALLS.replace(
        "foot_mm = 5.0\nallowance_mm = [0.3]",
        "foot_mm = 5.0\nopposite = [6.0, 6.0, 15.0]\nallowance_mm = [0.3, 0.2]",
        1,
    )
    inputs = read_wall(job(folder, walls=walls).job)
    surfaces = [inputs.coarse(s) for s in inputs.body.side_numbers]
    assert [s.wall for s in surfaces] == [0, 0, 1]
    assert [s.allowance for s in surfaces] == [0.3, 0.2, 0.2]
    assert np.allclose(surfaces[0].normals, [0.0, -1.0, 0.0])
    assert np.allclose(surfaces[1].normals, [0.0, 1.0, 0.0])
    bears = modelled(np.full(surfaces[0].points.shape[:2], 1e-4).ravel(), 0.05)
    plan = constant(surfaces, lambda left, side: bears, inputs.depths.law, 0.15)
    assert [p.side for p in plan.passes] == [0, 1, 0, 1, 2, 2]
    part, none = inputs.body.part, [np.zeros(inputs.body.elastic.shape)] * 3
    one, other = (part.compliance(none, k).reshape(part.shape)[:, 1:] for k in (0, 1))
    # the way along u of the two faces may differ
    assert min(np.abs(one / other - 1.0).max(), np.abs(one / other[::-1] - 1.0).max()) < 0.05


@pytest.mark.parametrize("shank", [5.0, 6.0])
def test_the_shank_beside_the_neighbour(folder, shank):
    """The cutter leans 50 deg over the first wall while it cuts the inner side of the second. In the link along its
    lowest row, 1.5 mm off the surface, the axis passes 2.78 mm beside the upper edge of the first wall."""
    walls = WALLS.replace("face = [6.0, 24.0, 14.0]", "face = [6.0, 21.0, 14.0]")
    inputs = read_wall(job(folder, walls=walls, change=(f"cutter.0.shank_diameter_mm={shank}",)).job)
    surfaces = [inputs.coarse(s) for s in inputs.body.side_numbers]
    bears = modelled(np.full(surfaces[0].points.shape[:2], 1e-4).ravel(), 0.05)
    legs = link_pass_programs(inputs, constant(surfaces, lambda left, side: bears, inputs.depths.law, 0.3))
    found = part_collisions(inputs, wall_stock(inputs), legs)
    lean = np.radians(50.0)
    axis, across = np.array([-np.cos(lean), np.sin(lean)]), np.array([-np.sin(lean), -np.cos(lean)])
    tip = np.array([21.0 - 4.0 - 1.5, 11.0]) - 4.0 * axis  # y and z, of the ball's middle less its radius
    apart = (np.array([6.0, 18.0]) - tip) @ across
    if shank < 2.0 * apart:
        assert not found
        return
    assert {(c.what, c.into) for c in found} == {("shank or holder", "part")}
    assert max(c.depth_mm for c in found) == pytest.approx(0.5 * shank - apart, abs=0.005)
    second = next(leg for leg in legs if leg.side == 1)
    assert {c.line for c in found} <= set(second.program.line.tolist())


@pytest.fixture(scope="module")
def shipped(tmp_path_factory):
    """Copy of the shipped example, which has the walls of :func:`job`."""
    return copy_example("part", tmp_path_factory.mktemp("example") / "part") / "walls.toml"


@pytest.fixture(scope="module")
def done(shipped):
    return run_job(load_job(shipped, ["operation.0.refine=false"]))


def test_two_walls_in_one_job(done):
    """The variable plan holds with all errors; passes go wall by wall; no gouge of floor or neighbour."""
    used = next(t for t in done.result.tracks if t.in_use)
    assert used.verdict is Verdict.HOLDS, [c.text for c in used.limits if c.state is not Verdict.HOLDS]
    limits = {c.name: c for c in used.limits}
    assert limits["gouge_mm"].worst < 0.01
    sides = [m.side for m in done.outcome.variants["variable"].plan.maps]
    assert sorted(sides) == sides
    assert set(sides) == {0, 1}
    numbers = done.result.operations[0]
    assert [s["wall"] for s in numbers["sides"]] == [0, 1]
    assert [round(s["height_mm"], 6) for s in numbers["sides"]] == [12.0, 10.0]


def test_deflection_is_force_over_stiffness_of_the_state(done, folder):
    """Of the step with most: its force times a compliance between those of the places below and above it, in the state
    after the last pass of the first wall."""
    c = done.outcome.variants["variable"].columns
    k = int(np.argmax(c["deflection_workpiece_um"]))
    blank = read_wall(job(folder).job).body.part
    C = blank.compliance([np.zeros(blank.shape), np.full(blank.shape, 0.2)], 0).reshape(blank.shape)
    assert c["side"][k] == 0
    row = int(c["v"][k] * 3.0)
    softness = 1e-3 * c["deflection_workpiece_um"][k] / c["force_normal_n"][k]
    assert C[:, row].min() < softness < C[:, min(row + 1, 3)].max() * 1.001


def test_a_stopped_run_goes_on(shipped, done, tmp_path):
    """Stopped in the second variant: the first one is not simulated again, and all columns are those of one run."""
    reached: list[str] = []

    def until(_: float, what: str) -> None:
        if what.startswith("constant"):
            raise Cancelled("stopped")

    with pytest.raises(Cancelled), Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        run_job(load_job(shipped, ["operation.0.refine=false"]), until, checkpoint)
    with Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        again = run_job(
            load_job(shipped, ["operation.0.refine=false"]), lambda _, what: reached.append(what), checkpoint
        )
    assert not any(what.startswith("unconstrained") for what in reached)
    assert any(what.startswith("constant") for what in reached)
    for name, one in done.outcome.variants.items():
        other = again.outcome.variants[name]
        assert list(one.columns) == list(other.columns)
        for column, values in one.columns.items():
            assert other.columns[column].tolist() == values.tolist(), column
        assert [(t.worst, t.state) for t in limits_of(done.outcome, one)] == [
            (t.worst, t.state) for t in limits_of(again.outcome, other)
        ]


def said(call) -> str:
    with pytest.raises(InputError) as err:
        call()
    return str(err.value)


def test_refused(folder):
    floor = WALLS.replace("face = [6.0, 3.0, 15.0]", "face = [6.0, 12.0, 6.0]")
    assert "is not upright: its normal is 90 deg off the horizontal" in said(
        lambda: read_wall(job(folder, walls=floor).job)
    )
    twice = WALLS.replace("face = [6.0, 24.0, 14.0]", "face = [7.0, 3.0, 14.0]")
    assert "is wall.0.face too: state each face once" in said(lambda: read_wall(job(folder, walls=twice).job))
    assert said(lambda: job(folder, clamp="")) == (
        "job.toml: workpiece.clamp: missing: state how the part is held, as [[workpiece.clamp]]"
    )
    both = WALLS.replace("allowance_mm = [0.3]", "allowance_mm = [0.3, 0.3]")
    assert "wall.0.allowance_mm: 2 stated for 1 side: state one for the face" in said(lambda: job(folder, walls=both))
    loose = '\n[[workpiece.clamp]]\nface = "z-"\ndirections = "z"\n'
    assert "motion along" in said(lambda: read_wall(job(folder, clamp=loose).job))
    assert "the thinnest wall left is" in said(lambda: read_wall(job(folder, change=("workpiece.cell_mm=9.0",)).job))
    wrong = WALLS.replace("allowance_mm = [0.3]", "allowanc_mm = [0.3]")
    assert said(lambda: job(folder, walls=wrong)) == (
        "job.toml: wall.0.allowanc_mm: unknown key; did you mean allowance_mm?"
    )
    high = WALLS.replace("foot_mm = 5.0", "foot_mm = 9.0")
    assert "must be below 0.8 of the height of face" in said(lambda: read_wall(job(folder, walls=high).job))


def test_a_misspelt_key_of_one_wall(tmp_path):
    path = copy_example("plate", tmp_path / "plate") / "job.toml"
    path.write_text(path.read_text().replace("foot_mm = 5.0", "fot_mm = 5.0"))
    assert said(lambda: load_job(path)) == "job.toml: wall.fot_mm: unknown key; did you mean foot_mm?"
    path.write_text(path.read_text().replace("fot_mm = 5.0", "foot_mm = -5.0"))
    assert said(lambda: load_job(path)) == (
        "job.toml: wall.foot_mm = -5: must be above 0 (height above the clamp "
        "up to which the stock stays; below 0.8 of the wall's height)"
    )
