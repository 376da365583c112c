"""Impellers that must be refused, each with its exact message."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from chipload import examples
from chipload.errors import InputError
from chipload.geometry.sections import read_sections
from chipload.jobs import check_job, load_job, run_job

EXAMPLES = Path(examples.__file__).parent


@pytest.fixture
def hecc(tmp_path):
    return Path(shutil.copytree(EXAMPLES / "hecc", tmp_path / "hecc")) / "job.toml"


@pytest.fixture
def formula(tmp_path):
    return Path(shutil.copytree(EXAMPLES / "impeller", tmp_path / "impeller")) / "job.toml"


def refused(path, *sets, call=check_job):
    with pytest.raises(InputError) as caught:
        call(load_job(path, sets))
    return str(caught.value).replace(str(path.parent) + "/", "")


def changed(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_sections_out_of_order(hecc):
    changed(hecc, '  "main_05.txt",\n  "main_06.txt",\n', '  "main_06.txt",\n  "main_05.txt",\n')
    assert refused(hecc) == (
        "impeller.sections.blade: section 5: is not between sections 4 and 6: sort the sections from hub to shroud"
    )


def test_a_section_that_crosses_itself(hecc):
    path = hecc.parent / "main_04.txt"
    lines = path.read_text().splitlines()
    lines[40], lines[60] = lines[60], lines[40]
    path.write_text("\n".join(lines))
    assert refused(hecc) == (
        "impeller.sections.blade: section 4: crosses itself: its points must go once round the profile"
    )


def test_too_few_sections(hecc):
    text = hecc.read_text()
    hecc.write_text(text[: text.index("blade = [")] + 'blade = ["main_01.txt"]\n' + text[text.index("splitter = [") :])
    assert refused(hecc) == "impeller.sections.blade: sections: 1: must be at least 2, from hub to shroud"


def test_too_few_points_in_a_section(hecc):
    path = hecc.parent / "splitter_02.txt"
    path.write_text("\n".join(path.read_text().splitlines()[:9]))
    assert refused(hecc) == "impeller.sections.splitter: section 2: 8 points: must be at least 12"


def test_inches_taken_for_millimetres(hecc):
    changed(hecc, 'unit = "inch"', 'unit = "mm"')
    assert refused(hecc) == (
        "impeller.sections.blade: sections: outer diameter 16.9994 mm: must be 431.5 as stated: smaller by 25.38, as "
        "inch read as mm"
    )


def test_another_outer_diameter(hecc):
    changed(hecc, "outer_diameter_mm = 431.5", "outer_diameter_mm = 400.0")
    assert refused(hecc) == (
        "impeller.sections.blade: sections: outer diameter 431.784 mm: must be 400 as stated: check the unit"
    )


def test_columns_that_no_line_names(hecc):
    changed(hecc, 'columns = "X R*THETA R"\n', "")
    assert refused(hecc) == (
        "impeller.sections.blade: main_07.txt: no line names the columns: state them, for example X R*THETA R"
    )


def test_a_splitter_that_stands_in_its_blade(hecc):
    """As pyturbo-aero writes it: at the angle of its blade, here by the blade's own sections."""
    text = hecc.read_text()
    head, tail = text[: text.index("splitter = [")], text[text.index("hub = ") :]
    names = re.findall(r"main_\d\d.txt", head)
    hecc.write_text(f"{head}splitter = {names[2:]}\n{tail}")
    message = refused(hecc)
    found = re.fullmatch(
        r"impeller\.sections\.splitter: overlaps the blade: sections 1 to 9: up to ([\d.]+) mm round the axis: "
        r"must not overlap: turn it about the axis by 12 deg, to the middle of the channel, or leave it out",
        message,
    )
    assert found, message
    # the whole of the blade is in common: its greatest thickness round the axis
    sections = [read_sections([hecc.parent / name], "inch", True, "X R*THETA R")[0] for name in names[2:]]
    assert float(found[1]) == pytest.approx(max(map(thickness, sections)), rel=0.02)


def thickness(p):
    """Greatest r dtheta [mm] at one z of a section, by its points."""
    r, theta = np.hypot(p[:, 0], p[:, 1]), np.unwrap(np.arctan2(p[:, 1], p[:, 0]))
    front, back = int(p[:, 2].argmax()), int(np.linalg.norm(p - p[p[:, 2].argmax()], axis=1).argmax())
    ring = np.roll(np.arange(len(p)), -front)
    end = int(np.flatnonzero(ring == back)[0])
    one, other = ring[: end + 1], ring[end:][::-1]
    # r along the section, for at the outlet z is the same all along
    along = [r[k] - p[k, 2] for k in (one, other)]
    at = along[0][(along[0] > along[1].min()) & (along[0] < along[1].max())]
    thetas = [np.interp(at, np.maximum.accumulate(a), theta[k]) for a, k in zip(along, (one, other), strict=True)]
    return float((np.interp(at, np.maximum.accumulate(along[0]), r[one]) * np.abs(thetas[0] - thetas[1])).max())


def test_a_file_that_is_missing(hecc):
    (hecc.parent / "hub.txt").unlink()
    assert refused(hecc) == "hub.txt: cannot be read: No such file or directory"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "horizontal-b"', 'name = "vmc"',
         "machine vmc: rotary axes none: must have one pallet axis and one index axis with steps, as horizontal-b"),
        ("clearance_mm = 0.5", "clearance_mm = 0.5\ntable_deg = [45.0, 42.0]",
         "operation.0.table_deg: table angle 42 deg: no position of axis A: the nearest are 35, 40, 45 deg"),
        ("along = [0.03, 0.97]", "along = [0.97, 0.03]",
         "job.toml: surface.0.along = [0.97, 0.03]: must ascend within 0 to 1"),
        ("along = [0.03, 0.97]", "along = [0.03, 1.97]", "job.toml: surface.0.along.1 = 1.97: must be at most 1"),
        ("along = [0.03, 0.97]", "along = [0.03]", "job.toml: surface.0.along.1: missing: state it"),
        ("points = [20, 10]", "points = [1, 10]", "job.toml: surface.0.points = [1, 10]: must be at least 2 each"),
        ('body = "blade"\nside = "minus"', 'body = "splitter"\nside = "minus"',
         "job.toml: surface.1.body = 'splitter': the impeller has no splitter: leave it out"),
        ('body = "blade"\nside = "minus"', 'body = "blade"\nside = "plus"',
         "job.toml: surface.1: blade plus appears twice: list each surface once"),
        ("[impeller.shape]\n", "[impeller.shap]\n", "job.toml: impeller.shap: unknown key; did you mean shape?"),
        ("channel_mm = 24.185", "channel_mm = 30.0",
         "shape: must be hub_radius + blade_height < outer_radius, outlet_height < height, blades thick"),
        ("margin_mm = 0.1", "margin_mm = 9.0",
         "job.toml: operation.0.paths.margin_mm = 9: must be above touch_mm = 0.01 and below lift_mm = 3"),
        ("lead_mm = 1.0", "lead_mm = 4.0", "job.toml: operation.0.paths.lead_mm = 4: must be at most lift_mm = 3"),
        ("lead_mm = 1.0", "lead_mm = 0.3",
         "job.toml: operation.0.paths.lead_mm = 0.3: must be at least the allowance of roughing, 0.5 mm, which stands "
         "beside a pass"),
        ("scallop_mm = 0.1", "scallop_inch = 0.004",
         "job.toml: operation.0.scallop_inch: unknown key; did you mean scallop_mm?"),
        ("blades = 11", "blades = 1", "job.toml: impeller.blades = 1: must be at least 2 (number of blades, evenly "
         "spaced; the number of splitters, if there are any, is the same)"),
    ],
)  # fmt: skip
def test_a_wrong_line(formula, old, new, message):
    changed(formula, old, new)
    assert refused(formula) == message


def test_neither_shape_nor_sections(formula):
    text = formula.read_text()
    formula.write_text(text[: text.index("[impeller.shape]")] + text[text.index("[catalogue]") :])
    assert refused(formula) == (
        "job.toml: impeller: none is stated: state one of [impeller.shape], [impeller.sections], [impeller.step]"
    )


def test_a_catalogue_of_which_nothing_fits(formula):
    (formula.parent / "large.toml").write_text(
        'name = "large"\ncutter = [{ diameter_mm = 70.0, corner_radius_mm = 2.0 }]\n'
    )
    changed(formula, 'name = "wu2019"', 'file = "large.toml"')
    changed(formula, "diameter_mm = 14.0, corner_radius_mm = 1.5", "diameter_mm = 70.0, corner_radius_mm = 2.0")
    sets = ["surface.0.points=[2, 2]", "surface.0.along=[0.2, 0.4]", "surface.0.up=[0.3, 0.5]"]
    text = refused(formula, *sets, call=run_job)
    head = "surface.0: no cutter of catalogue large fits anywhere: contact point 0 at ("
    assert text.startswith(head)
    assert text.endswith(" r 2 mm would fit")
    place, said = text.removeprefix(head).split("): the smallest cutters of the catalogue collide with other walls: D ")
    assert np.hypot(*map(float, place.split(", ")[:2])) > 45.88
    # with the paper's catalogue D 36 to 40 go there, see the map of the example
    assert 34.0 < float(said.split()[0]) < 42.0


def test_a_cutter_picked_by_hand_that_is_not_in_the_catalogue(formula):
    changed(formula, "diameter_mm = 14.0, corner_radius_mm = 1.5", "diameter_mm = 15.0, corner_radius_mm = 1.5")
    assert refused(formula) == (
        "operation.0.hand_picked: D 15 r 1.5 mm is not in catalogue wu2019: the nearest is D 14 r 1.5 mm"
    )


@pytest.mark.parametrize(
    ("fillet", "message"),
    [
        ("17.0", "impeller.fillet_mm = 17: larger than half of the channel: two fillets overlap by 0.4496 mm on the "
         "hub: state a smaller one"),
        ("30.0", "impeller.fillet_mm = 30: blade plus: a fillet of 30 mm reaches above the side at u = 0.213: state "
         "a smaller one"),
        ("0.0", "job.toml: impeller.fillet_mm = 0: must be above 0 (radius of fillets between sides and hub that the "
         "model lacks; sides begin above them; none: no fillets)"),
    ],
)  # fmt: skip
def test_fillets_that_do_not_fit(formula, fillet, message):
    changed(formula, "outer_diameter_mm = 223.0", f"outer_diameter_mm = 223.0\nfillet_mm = {fillet}")
    assert refused(formula) == message


def test_a_fillet_that_is_milled_but_not_stated(formula):
    changed(formula, 'side = "minus"', 'side = "minus fillet"')
    assert refused(formula) == (
        "job.toml: surface.1.side = 'minus fillet': the impeller has no fillets: state impeller.fillet_mm"
    )


def test_flank_passes_need_five_axes_links_and_a_side(formula):
    stated = '[operation.flank]\nmachine = { name = "horizontal-b" }\nexcess_mm = 0.1\n\n'
    text = formula.read_text()
    formula.write_text(text.replace("[operation.paths]", stated + "[operation.paths]"))
    assert refused(formula) == (
        "operation.0.flank.machine: horizontal-b has 1 rotary axes that move in the cut: must have two"
    )
    finish = text[: text.index("[operation.rough]")]
    formula.write_text(finish + stated.replace("horizontal-b", "cradle-ac"))
    assert refused(formula) == "job.toml: operation.0.flank: takes its links from [operation.paths]: state that too"


def test_a_stock_is_stated_once_and_for_programs(formula):
    stated = "[stock]\nlow_mm = [0.0, 0.0, 0.0]\nhigh_mm = [10.0, 10.0, 10.0]\n\n"
    text = formula.read_text()
    finishing = text[: text.index("[operation.rough]")]
    for job, why in (
        (text, "leave it out: the programs begin with the blank of [operation.rough]"),
        (finishing, "there are no programs to simulate in it: state [operation.paths] or leave it out"),
    ):
        formula.write_text(job.replace("[[surface]]", stated + "[[surface]]", 1))
        assert refused(formula) == f"job.toml: stock: {why}"
    missing = '[stock]\nfile = "none.stl"\nunits = "mm"\n\n'
    paths = text[text.index("[operation.paths]") :]
    formula.write_text((finishing + paths).replace("[[surface]]", missing + "[[surface]]", 1))
    assert "none.stl" in refused(formula)


def test_elastic_blades_need_forces_and_a_stock(formula):
    stated = "[operation.blades]\nmodulus_gpa = 70.0\ndeflection_um = 20.0\n\n"
    text = formula.read_text()
    formula.write_text(text.replace("[operation.paths]", stated + "[operation.paths]"))
    assert refused(formula) == (
        "job.toml: operation.0.blades: there are no forces that bend the blades: state [operation.forces]"
    )
    text = text[: text.index("[operation.rough]")] + text[text.index("[operation.paths]") :]
    forces = FORCES.replace("deflection_um", "allowance_mm = 0.5\ndeflection_um", 1)
    formula.write_text(text.replace("[operation.paths]", stated + forces + "[operation.paths]"))
    assert refused(formula) == (
        "job.toml: operation.0.blades: forces are those of the simulation in the stock: state [operation.rough] or "
        "[stock]"
    )


def test_point_milling_needs_five_axes_and_links(formula):
    stated = '[operation.point_milling]\nmachine = { name = "horizontal-b" }\n\n'
    text = formula.read_text()
    formula.write_text(text.replace("[operation.paths]", stated + "[operation.paths]"))
    assert refused(formula) == (
        "operation.0.point_milling.machine: horizontal-b has 1 rotary axes that move in the cut: must have two"
    )
    finish = text[: text.index("[operation.rough]")]
    formula.write_text(finish + stated.replace("horizontal-b", "cradle-ac"))
    assert refused(formula) == (
        "job.toml: operation.0.point_milling: takes its links from [operation.paths]: state that too"
    )


BALL = "{ diameter_mm = 12.0, corner_radius_mm = 6.0 }"
OVAL = "{ diameter_mm = 12.0, corner_radius_mm = 2.0, cutting_length_mm = 25.0, barrel_radius_mm = 85.0 }"
CONE = "{ corner_radius_mm = 2.0, cutting_length_mm = 20.0, taper_deg = 3.0 }"


def with_cutters(formula, *rows):
    formula.with_name("cutters.toml").write_text(f'name = "own"\ncutter = [{", ".join(rows)}]\n')
    changed(formula, 'name = "wu2019"', 'file = "cutters.toml"')


POINTS = '[operation.point_milling]\nmachine = { name = "cradle-ac" }\n\n'
FORCES = (
    '[operation.forces]\nmaterial = { name = "al7075-t6" }\nflutes = 2\noverhang_mm = 70.0\ndeflection_um = 20.0\n\n'
)


def test_a_barrel_is_refused_without_point_milling(formula):
    with_cutters(formula, BALL, OVAL)
    assert refused(formula) == (
        "catalogue own: barrel 85 D 12 r 2: such a cutter mills by points on five axes alone: state "
        "operation.0.point_milling, or leave it out"
    )


def test_a_tapered_cutter_is_refused_with_forces(formula):
    with_cutters(formula, BALL, CONE)
    formula.write_text(formula.read_text().replace("[operation.paths]", FORCES + "[operation.paths]"))
    assert refused(formula) == (
        "catalogue own: taper 3 deg D 3.796 r 2: with operation.0.forces such a cutter mills by points on five axes "
        "alone: state operation.0.point_milling, or leave it out"
    )


def test_the_index_table_needs_a_cutter(formula):
    with_cutters(formula, OVAL)
    formula.write_text(formula.read_text().replace("[operation.paths]", POINTS + "[operation.paths]"))
    assert refused(formula) == (
        "catalogue own: barrel 85 D 12 r 2: no other cutter for the index table, which is not planned with such "
        "cutters: add a flat, bull-nose or ball cutter"
    )


def test_roughing_needs_a_straight_cutter(formula):
    with_cutters(formula, CONE)
    assert refused(formula) == (
        "operation.0.rough: catalogue own has tapered cutters alone, which are not planned with here: add a "
        "straight one"
    )


def test_a_steep_taper_needs_a_wide_tolerance(formula):
    with_cutters(formula, BALL, CONE.replace("3.0", "12.0"))
    changed(formula, "hand_picked = { diameter_mm = 14.0, corner_radius_mm = 1.5 }\n", "")
    assert refused(formula) == (
        "operation.0.tolerance_mm = 0.05: taper 12 deg D 3.239 r 2 stands out of the cylinders that the index table is "
        "planned with by 0.0447 mm: must be at least 0.0894"
    )


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("diameter_mm = 4.0, corner_radius_mm = 2.0, taper_deg = 3.0, cutting_length_mm = 20.0",
         "cutter 1: diameter_mm = 4: with taper_deg it is the diameter where flank line and bottom meet, 3.79586 of a "
         "tapered ball: leave it out"),
        ("diameter_mm = 5.0, corner_radius_mm = 2.0, taper_deg = 3.0",
         "cutter taper 3 deg D 5 r 2: cutting_length_mm missing: must be given with taper_deg or barrel_radius_mm: how "
         "far up the cutter has that shape"),
        ("diameter_mm = 5.0, corner_radius_mm = 0.0, taper_deg = 3.0, cutting_length_mm = 20.0",
         "cutter taper 3 deg D 5 r 0: corner_radius_mm = 0: must be above 0 with taper_deg or barrel_radius_mm"),
        ("diameter_mm = 5.0, corner_radius_mm = 3.0, taper_deg = 3.0, cutting_length_mm = 20.0",
         "cutter taper 3 deg D 5 r 3: corner_radius_mm = 3: must be at most 2.63445, where the corner's centre is on "
         "the axis"),
        ("diameter_mm = 12.0, corner_radius_mm = 2.0, barrel_radius_mm = 5.0, cutting_length_mm = 20.0",
         "cutter barrel 5 D 12 r 2: barrel_radius_mm = 5: must be above 6, the distance of the corner's centre from "
         "the flank"),
        ("corner_radius_mm = 2.0, barrel_radius_mm = 85.0, cutting_length_mm = 20.0",
         "cutter 1: diameter_mm is missing: must be given"),
        ("diameter_mm = 5.0, corner_radius_mm = 1.0, taper_deg = 70.0, cutting_length_mm = 20.0",
         "cutter 1: taper_deg = 70.0: must be from 0 to below 60"),
        ("diameter_mm = 5.0, corner_radius_mm = 1.0, half_angle_deg = 3.0", "cutter 1: half_angle_deg: unknown key: "
         "state taper_deg"),
        ("diameter_mm = 12.0, corner_radius_mm = 1.0, segment_radius_mm = 85.0", "cutter 1: segment_radius_mm: unknown "
         "key: state barrel_radius_mm"),
    ],
)  # fmt: skip
def test_numbers_of_tapered_and_barrel_cutters(formula, row, says):
    with_cutters(formula, f"{{ {row} }}")
    assert refused(formula).endswith(says)


@pytest.mark.parametrize("other", ["flank", "point_milling"])
def test_forces_are_not_ignored_on_five_axes(formula, other):
    stated = (
        '[operation.forces]\nmaterial = { name = "al7075-t6" }\nflutes = 2\noverhang_mm = 70.0\n'
        f'deflection_um = 20.0\n\n[operation.{other}]\nmachine = {{ name = "cradle-ac" }}\n'
    )
    stated += "excess_mm = 0.1\n\n" if other == "flank" else "\n"
    text = formula.read_text()
    formula.write_text(text.replace("[operation.paths]", stated + "[operation.paths]"))
    assert refused(formula) == (
        f"job.toml: operation.0.{other}.feed_mm_min: missing: operation.0.forces finds the feeds of the index table "
        "alone, none on five axes: state it"
    )


def test_feeds_by_force_need_an_allowance_and_an_overhang(formula):
    stated = '[operation.forces]\nmaterial = { name = "al7075-t6" }\nflutes = 2\ndeflection_um = 20.0\n\n'
    text = formula.read_text()
    formula.write_text(text.replace("[operation.paths]", stated + "[operation.paths]"))
    assert refused(formula).startswith("operation.0.forces.overhang_mm: missing: the catalogue states no reach of D ")
    formula.write_text(text[: text.index("[operation.rough]")] + stated)
    assert refused(formula) == (
        "job.toml: operation.0.forces.allowance_mm: missing: there is no allowance of roughing: state what stands on "
        "the surfaces"
    )
