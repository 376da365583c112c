"""A KJ66 impeller by others (STEP): sides of seven edges that go on through the hub, tips of three faces each."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.catalogue import read_catalogue
from chipload.examples import copy_example
from chipload.geometry.step_faces import read_faces
from chipload.jobs import check_job, load_job, run_job
from chipload.jobs.drafts.draft import write_draft
from chipload.jobs.drafts.make import draft_of
from chipload.jobs.impeller.flank import checked_flanks
from chipload.jobs.impeller.flow import AGAINST_Z
from chipload.jobs.impeller.part import read_part
from chipload.jobs.impeller.paths import finish_settings
from chipload.machine.machine import machine_named
from chipload.planning.impeller.tables import index_table

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
FILE = DATA / "cad" / "impeller_kj66" / "impeller.step"

pytestmark = pytest.mark.skipif(not FILE.is_file(), reason=f"{FILE} is missing")

PART = """[impeller]
blades = 9
outer_diameter_mm = 100.2

[impeller.step]
file = "impeller.step"
flow = "-y"
plus = {plus}
minus = {minus}
hub = [88]
shroud = [7, 2, 9]
fit_mm = 0.02
hub_ahead_mm = 0.0

[[surface]]
body = "blade"
side = "plus"
along = [0.1, 0.9]
up = [0.2, 0.9]
points = [4, 3]

[catalogue]
file = "cutters.toml"

"""
CUTTERS = """name = "small"
note = "made up"
cutter = [{ diameter_mm = 2.0, corner_radius_mm = 1.0 }, { diameter_mm = 3.0, corner_radius_mm = 1.0 }]
"""


def job(folder, plus=3, minus=1):
    path = copy_example("impeller", folder / "job") / "job.toml"
    shutil.copy(FILE, path.parent)
    (path.parent / "cutters.toml").write_text(CUTTERS)
    text = path.read_text()
    machine = text[text.index("[machine]") : text.index("[[surface]]")]
    search = text[text.index("[[operation]]") : text.index("hand_picked")].replace("check_mm = 3.0", "check_mm = 1.5")
    path.write_text(PART.format(plus=plus, minus=minus) + machine + search.replace("near_mm = 2.0", "near_mm = 1.0"))
    return path


def test_its_sides_are_those_of_the_file(tmp_path):
    """Points of the patches, turned back into the frame of the file, lie on the faces by the CAD kernel's distance."""
    path = job(tmp_path)
    part = read_part(load_job(path).job)
    assert part.faces[4] == "blade: its foot leaves the hub by at most 0.00994 mm"
    R = AGAINST_Z["-y"]
    model = read_faces(FILE)
    rng = np.random.default_rng(4)
    u, v = rng.random(25), rng.random(25)
    for number, patch in ((3, part.impeller.blade.plus), (1, part.impeller.blade.minus)):
        away = [model.faces[number - 1].distance(p) for p in (patch.at(u, v) @ R).tolist()]
        # the minus side may be that of another blade, turned
        if number == 3:
            assert max(away) < 0.005


PATHS = """
[operation.paths]
check_mm = 1.0
chord_mm = 0.02
overrun_mm = 0.5
lift_mm = 1.0
margin_mm = 0.1
touch_mm = 0.02
near_mm = 4.0
above_mm = 5.0
link_feed_mm_min = 1200.0
gouge_mm = 0.1
"""


def test_it_is_planned_to_verified_programs(tmp_path):
    """A piece of a side: points of the file's own faces, by the CAD kernel, against the poses of the programs."""
    path = job(tmp_path)
    text = path.read_text().replace("along = [0.1, 0.9]\nup = [0.2, 0.9]", "along = [0.4, 0.6]\nup = [0.5, 0.8]")
    text = text.replace("most_cutters = 3", "most_cutters = 1")
    text = text.replace("check_mm = 1.5", "check_mm = 1.5\ntolerance_mm = 0.1")
    path.write_text(text + PATHS)
    found = run_job(load_job(path)).outcome
    (way,) = found.checked
    assert way.verified, way.fails
    R = AGAINST_Z["-y"]
    model = read_faces(FILE)
    sides = [model.faces[k] for k in (2, 0)]
    for one in way.programs:
        c, program = one.setting.cutter, one.setting.program
        rows = np.flatnonzero(program.motion == 1)[::7]
        for tip, axis in zip(program.p_work[rows] @ R, program.axis[rows] @ R, strict=True):
            # the ring of the corner's centres never comes nearer to a face than the corner radius, less the gouge
            a = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
            a /= np.linalg.norm(a)
            b = np.cross(axis, a)
            for t in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
                p = tip + c.corner_radius * axis + c.rho * (np.cos(t) * a + np.sin(t) * b)
                assert min(f.distance(p.tolist()) for f in sides) > c.corner_radius - 0.1


def test_it_is_searched(tmp_path):
    found = run_job(load_job(job(tmp_path))).outcome
    assert (found.surfaces[0].answer.cutter >= 0).all()
    assert found.surfaces[0].answer.certified.all()


def test_sides_that_are_changed_are_refused(tmp_path):
    with pytest.raises(Exception, match="must be less than half: exchange the sides: plus faces a growing angle"):
        check_job(load_job(job(tmp_path, plus=1, minus=3)))


FLANK = """
[operation.flank]
machine = { name = "cradle-ac" }
excess_mm = 0.1
most_passes = 4
feed_mm_min = 300.0
speed_rpm = 3000.0
"""


def test_its_bulging_side_is_milled_by_the_flank_in_passes(tmp_path):
    """The axis of every row keeps the cutter's radius from the file's own face, by the CAD kernel."""
    path = job(tmp_path)
    thick = "{ diameter_mm = 6.0, corner_radius_mm = 1.0 }"
    path.with_name("cutters.toml").write_text(f'name = "one"\nnote = "made up"\ncutter = [{thick}]\n')
    text = path.read_text().replace("up = [0.2, 0.9]", "up = [0.3, 0.9]")
    path.write_text(text + PATHS + FLANK)
    loaded = load_job(path).job
    machine, catalogue, impeller = machine_named("horizontal-b"), read_catalogue(loaded.catalogue), read_part(loaded)
    op = loaded.operation
    how = finish_settings(
        impeller.impeller, machine, index_table(machine), catalogue, op, op.paths, 0.0, 0, 2
    )  # fmt: skip
    (one,) = checked_flanks(loaded, how, catalogue)
    assert one.verified, one.fails
    assert len(one.passes) == 3
    face = read_faces(FILE).faces[2]
    R = AGAINST_Z["-y"]
    finish = np.array([name == "finish" for name in one.program.labels])[one.program.label]
    for tip, axis in zip(one.program.p_work[finish][::3], one.program.axis[finish][::3], strict=True):
        for height in (1.0, 2.0, 4.0, 8.0, 16.0):
            assert face.distance(((tip + height * axis) @ R).tolist()) > 3.0 - 0.1
    # points of the side, as it is in the file, against every pose and those between: what is left
    side = impeller.impeller.blade.plus
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.1, 0.9, 33), np.linspace(0.3, 0.9, 17), indexing="ij"))
    share = np.linspace(0.0, 1.0, 9)[:, None, None]
    away = np.full(len(u), np.inf)
    for path_of in one.passes:
        tips, axes = ((1.0 - share) * x[:-1] + share * x[1:] for x in (path_of.tip, path_of.axis))
        for tip, axis in zip(tips.reshape(-1, 3), axes.reshape(-1, 3), strict=True):
            y = side.at(u, v) - tip
            h = y @ axis / np.linalg.norm(axis)
            d = np.sqrt(np.maximum((y * y).sum(axis=1) - h * h, 0.0)) - 3.0
            away = np.minimum(away, np.where(h >= 1.0, d, np.inf))
    assert away.max() < 0.1
    assert away.min() > -0.1


def test_the_whole_wheel_becomes_a_job(tmp_path):
    """Without a face named: points of the sides lie on the faces by the CAD kernel's distance, of one of its blades."""
    draft = draft_of(FILE, tmp_path / "job")
    assert draft.notes[0] == "9 blades, outer diameter 100.2 mm"
    assert draft.notes[2].startswith("the blades of the model differ: ")
    part = read_part(load_job(write_draft(draft, tmp_path / "job")).job)
    model, R = read_faces(FILE), AGAINST_Z["-y"]
    rng = np.random.default_rng(4)
    u, v = rng.uniform(0.05, 0.95, 12), rng.uniform(0.05, 0.95, 12)
    sides = [face for face in model.faces if face.kind not in ("plane", "cylinder") and face.area > 500.0]
    for patch in (part.impeller.blade.plus, part.impeller.blade.minus):
        p = (patch.at(u, v) @ R).tolist()
        assert max(min(face.distance(q) for face in sides) for q in p) < 0.03
