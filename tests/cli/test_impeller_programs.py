"""Finishing programs of an impeller by the command line: what is written against what the summary says of it."""

import json
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload import examples
from chipload.cli import app
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of

SURFACE = """[[surface]]
body = "blade"
side = "plus"
along = [0.30, 0.45]
up = [0.50, 0.70]
points = [4, 4]

"""


#: material that stands on the piece of the side
STOCK = """[stock]
low_mm = [69.0, -6.0, 25.0]
high_mm = [83.0, -0.5, 36.0]

"""


def job(folder, rough=False, **changes):
    text = (Path(examples.__file__).parent / "impeller" / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + SURFACE + text[text.index("[[operation]]") :]
    if not rough:
        text = text[: text.index("[operation.rough]")] + text[text.index("[operation.paths]") :]
        text = text.replace("[[surface]]", f"{STOCK}[[surface]]")
    for key, value in ({"most_cutters": "1", "check_mm": "2.0"} | changes).items():
        text, n = re.subn(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
        assert n
    folder.mkdir()
    (folder / "job.toml").write_text(text)
    return folder / "job.toml"


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    root = tmp_path_factory.mktemp("programs")
    path = job(root / "one", scallop_mm="0.1")
    done = CliRunner().invoke(app, ["run", str(path), "--out", str(root / "out")])
    assert done.exit_code in (0, 3), done.output
    return done, root / "out", json.loads((root / "out" / "summary.json").read_bytes())


def test_exit_code_and_first_lines_say_whether_it_is_verified(result):
    done, out, summary = result
    (op,) = summary["operations"]
    assert (done.exit_code == 0) == (summary["verdict"] == "holds")
    tracks = {track["name"]: track for track in summary["tracks"]}
    # the other ways are written and checked too, but released is the quickest that holds
    assert all(track["in_use"] == (not name.startswith("way-")) for name, track in tracks.items())
    texts = sorted(p for p in out.glob("[0-9]*.ngc") if not p.stem.endswith("-all"))
    assert len(texts) == len(op["programs"]) > 0
    for text, program in zip(texts, op["programs"], strict=True):
        assert text.stem == program["program"]
        first = text.read_text().splitlines()[0]
        verified = summary["verdict"] == "holds" and tracks[text.stem]["in_use"]
        said = "(chipload: verified by independent simulation)" if verified else "NOT VERIFIED"
        assert said in first
        assert (tracks[text.stem]["verdict"] == "holds") == (
            program["gouge_mm"] <= 0.05 and all(x["scallop_greatest_mm"] <= 0.1 for x in program["patches"])
        )
        assert text.with_suffix(".apt").is_file()


def test_every_way_is_written_checked_and_timed(result):
    *_, out, summary = result
    (op,) = summary["operations"]
    partitions = {one["name"]: one for one in op["ways"]}
    assert set(partitions) == {"hand-picked", "1 cutter"}
    tracks = {track["name"]: track for track in summary["tracks"]}
    for name, partition in partitions.items():
        stem = "[0-9]" if partition["in_use"] else f"way-{name.replace(' ', '-')}-"
        texts = sorted(p.stem for p in out.glob(f"{stem}*.ngc") if not p.stem.endswith("-all"))
        assert all((out / f"{text}-all.ngc").is_file() for text in texts)
        assert texts
        parts = sum(partition[key] for key in ("cutting_min", "link_min", "changes_min"))
        assert partition["time_min"] == pytest.approx(parts)
        # the tracks are of one channel; between two of eleven the pallet turns on
        one = sum(tracks[text]["time_s"] for text in texts) / 60.0
        assert 11 * one <= partition["time_min"] - partition["changes_min"] <= 11 * (one + len(texts) * 2.0 / 60.0)
        assert partition["predicted_min"] == pytest.approx(partition["time_min"], rel=0.1)
        holds = all(tracks[text]["verdict"] == "holds" for text in texts)
        assert (partition["verdict"] == "holds") <= holds
        assert (partition["verdict"] == "holds") == (partition["fails"] == [])
    (used,) = (partition for partition in partitions.values() if partition["in_use"])
    assert used["name"] == "1 cutter"
    assert op["time_min"] == used["time_min"]
    assert op["scallop"]["mean_share"] == pytest.approx(op["finished"]["scallop_mean_share"])
    assert op["certified"] is True
    assert op["search_s"] > 0.0


def test_the_surface_is_covered_or_the_verdict_says_where_not(result):
    done, _, summary = result
    (op,) = summary["operations"]
    (surface,) = op["finished"]["surfaces"]
    assert surface["spacing_mm"] <= 0.6
    left = [f["text"] for f in summary["findings"] if f["code"] == "impeller-left"]
    assert (not left) == (surface["greatest_mm"] <= 0.1) == (surface["within_share"] == 1.0)
    assert done.exit_code == 0
    assert op["finished"]["time_min"] == pytest.approx(sum(p["time_min"] for p in op["programs"]))
    assert 0.5 <= op["finished"]["scallop_mean_share"] <= 1.0
    assert op["roughing"] is None


def test_every_number_of_the_answer_is_there(result):
    *_, summary = result
    (op,) = summary["operations"]
    keys = {"diameter_mm", "corner_radius_mm", "table_deg"}
    more = {"cc_points", "check_points", "unreachable", "search_s", "certified"}
    assert {*keys, *more, "patches", "path_mm", "time_min"} <= set(op)
    picked = op["hand_picked"]
    assert {*keys, *more, "patches", "path_mm", "time_min"} <= set(picked)
    for one in (op, picked):
        assert one["cc_points"] == 16
        assert one["check_points"] > 100
        assert one["certified"] is True
        assert one["search_s"] > 0.0
        assert sum(p["area_share"] for p in one["patches"]) == pytest.approx(1.0)
        assert sum(p["path_mm"] for p in one["patches"]) > 0.0
        assert all({*keys, "area_share"} <= set(p) for p in one["patches"])
        assert min(one["path_mm"], one["time_min"]) > 0.0
    assert (picked["diameter_mm"], picked["corner_radius_mm"]) == (14.0, 1.5)


def test_the_scallop_is_as_asked(result):
    *_, summary = result
    for program in summary["operations"][0]["programs"]:
        for patch in program["patches"]:
            assert patch["scallop_greatest_mm"] <= 0.1
            assert patch["scallop_mean_share"] >= 0.5
            assert patch["scallops"] > 0


def test_the_axes_lead_the_cutter_along_the_blade(result):
    """The index table stands, and at the feed the cutter touches the blade: by distances to a fine cloud of it."""
    _, out, summary = result
    machine, impeller = machine_named("horizontal-b"), impeller_of(ImpellerShape())
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.25, 0.5, 300), np.linspace(0.4, 0.8, 200), indexing="ij"))
    cloud = impeller.blade.plus.at(u, v)
    for text, program in zip(
        sorted(p for p in out.glob("[0-9]*.ngc") if not p.stem.endswith("-all")),
        summary["operations"][0]["programs"],
        strict=True,
    ):
        q, rows, finish = np.zeros(9), [], False
        for line in text.read_text().splitlines():
            if line.startswith("("):
                finish = line == "(finish)"
            elif re.search(r"[XYZAB]-?[\d.]", line):
                for letter, value in re.findall(r"([XYZAB])(-?[\d.]+)", line):
                    q["XYZAB".index(letter)] = float(value) * (math.pi / 180.0 if letter in "AB" else 1.0)
                rows.append((q.copy(), finish))
        axes = np.array([r for r, _ in rows])
        cut = np.array([f for _, f in rows])
        assert np.degrees(axes[:, 3]) == pytest.approx(90.0 - program["table_deg"])
        tips, T = forward(machine, axes[cut][::7])
        R, r = 0.5 * program["diameter_mm"], program["corner_radius_mm"]
        for p, a in zip(tips, T, strict=True):
            d = cloud - p
            h = d @ a
            away = np.linalg.norm(d - h[:, None] * a, axis=1)
            profile = R - r + np.where(h < r, np.sqrt(np.clip(r * r - (r - h) ** 2, 0.0, None)), r)
            gap = np.where(h < 0.0, np.inf, away - profile).min()
            # the cloud is 0.15 mm wide: it misses the contact by its sagitta
            assert -0.03 <= gap <= 0.03


def test_roughing_comes_first_and_leaves_the_allowance(tmp_path):
    path = job(tmp_path / "one", rough=True, scallop_mm="0.3", depth_mm="60.0", step_mm="25.0", check_mm="4.0")
    done = CliRunner().invoke(app, ["run", str(path), "--out", str(tmp_path / "out")])
    assert done.exit_code in (0, 3), done.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_bytes())
    (op,) = summary["operations"]
    roughs = op["roughing"]["programs"]
    names = sorted(p.name for p in (tmp_path / "out").glob("[0-9]*deg.ngc"))
    assert len(names) == len(roughs) + len(op["programs"])
    assert [n.startswith(f"{k}-rough-") for k, n in enumerate(names, 1)] == [True] * len(roughs) + [False] * len(
        op["programs"]
    )
    for k, (name, rough) in enumerate(zip(names, roughs, strict=False), 1):
        text = (tmp_path / "out" / name).read_text()
        assert f"T{k} M6" in text
        assert ("NOT VERIFIED" not in text.splitlines()[0]) == (summary["verdict"] == "holds")
        assert rough["rapids_take_mm3"] <= 2.0
        assert rough["above_takes_mm3"] <= 2.0
        assert rough["gouge_mm"] <= 0.05
        # of the allowance of 0.5 mm check points 4 mm apart may lose s^2 / (8 r), a row its chord
        for key in ("stands_on_blades_mm", "stands_on_hub_mm"):
            assert rough[key] is None or rough[key] >= 0.5 - 4.0**2 / 16.0 - 0.1
    assert roughs[0]["taken_mm3"] > 1e4
    assert op["roughing"]["time_min"] == pytest.approx(sum(r["time_min"] for r in roughs))
    assert op["roughing"]["time_all_channels_min"] == pytest.approx(11 * op["roughing"]["time_min"])
    assert f"T{len(roughs) + 1} M6" in (tmp_path / "out" / names[len(roughs)]).read_text()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("diameter_mm = 14.0\ndepth_mm", "depth_mm"), "state both diameter_mm and corner_radius_mm, or neither"),
        (("diameter_mm = 14.0\ncorner_radius_mm = 2.5\ndepth_mm", "depth_mm"), "D 14 r 2.5 mm is not in catalogue"),
    ],
)
def test_a_wrong_cutter_for_roughing_is_refused(tmp_path, change, message):
    path = job(tmp_path / "one", rough=True)
    path.write_text(path.read_text().replace(change[1], change[0], 1))
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 2
    assert message in " ".join(done.output.split())


def test_roughing_without_paths_is_refused(tmp_path):
    path = job(tmp_path / "one", rough=True)
    path.write_text(path.read_text()[: path.read_text().index("[operation.paths]")])
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 2
    assert "takes its links from [operation.paths]" in " ".join(done.output.split())


FORCES = """[operation.blades]
modulus_gpa = 70.0
deflection_um = 50.0

[operation.forces]
material = { name = "al7075-t6" }
flutes = 2
overhang_mm = 70.0
allowance_mm = 0.5
deflection_um = 30.0

[operation.paths]"""


FLANK = """[operation.flank]
machine = { name = "cradle-ac" }
excess_mm = 0.05
feed_mm_min = 300.0
speed_rpm = 3000.0

[operation.point_milling]
machine = { name = "cradle-ac" }
feed_mm_min = 300.0
speed_rpm = 3000.0

"""


@pytest.fixture(scope="module")
def more(tmp_path_factory):
    """The same with feeds by force, with flank passes and with point milling on five axes."""
    root = tmp_path_factory.mktemp("more")
    path = job(root / "fed", feed_mm_min="400.0")
    path.write_text(path.read_text().replace("[operation.paths]", FLANK + FORCES))
    done = CliRunner().invoke(app, ["run", str(path), "--out", str(root / "out")])
    assert done.exit_code == 3, done.output
    return root / "out", json.loads((root / "out" / "summary.json").read_bytes())


def test_a_side_is_milled_by_the_flank_in_one_pass_on_five_axes(more):
    out, summary = more
    (flank,) = summary["operations"][0]["flank"]
    assert flank["surface"] == "blade plus"
    (track,) = (t for t in summary["tracks"] if t["name"] == flank["program"])
    assert not track["in_use"]
    limits = {x["name"]: x["state"] for x in track["limits"]}
    assert {"gouge_mm", "excess_mm", "axial_overrun_mm", "deflection_cutter_um"} <= set(limits)
    # the pass is not slowed by forces: how far the cutter bends is seen only where its stock is simulated
    assert limits.pop("deflection_workpiece_um") != "holds"
    assert limits.pop("deflection_cutter_um") == "unproven"
    assert flank["verdict"] == track["verdict"] != "holds"
    assert set(limits.values()) == {"holds"}
    own, away, taken = by_the_text(out, flank)
    assert flank["removal"]["removed_mm3"] == pytest.approx(taken, rel=0.04)
    assert flank["removal"]["rapids_take_mm3"] == 0.0 < flank["removal"]["force_n"]
    assert own.min() > -0.05
    assert own.max() < 0.05
    assert own.max() == pytest.approx(flank["excess_mm"], abs=0.01)
    assert away > -0.05
    # one pass along the side, not many
    assert flank["path_mm"] < 0.5 * summary["operations"][0]["finished"]["path_mm"]


def test_a_side_is_milled_by_points_with_a_moving_axis(more):
    out, summary = more
    (points,) = summary["operations"][0]["point_milling"]
    assert points["surface"] == "blade plus"
    (track,) = (t for t in summary["tracks"] if t["name"] == points["program"])
    assert not track["in_use"]
    limits = {x["name"]: x["state"] for x in track["limits"]}
    assert {"gouge_mm", "scallop_mm", "axial_overrun_mm", "deflection_cutter_um"} <= set(limits)
    # in the line of the greatest scallop the cutter passes its place at the height of the scallop
    (scallop,) = (x for x in track["limits"] if x["name"] == "scallop_mm")
    lines, tip, axis = poses_of(out, points)
    there, place = lines == scallop["line"], np.array([scallop["place"]])
    assert there.any()
    assert away_from(points, tip[there], axis[there], place) == pytest.approx(scallop["worst"], abs=0.01)
    assert away_from(points, tip, axis, place) == pytest.approx(scallop["worst"], abs=0.01)
    assert limits.pop("deflection_workpiece_um") in ("holds", "unproven")
    assert set(limits.values()) == {"holds"}
    own, away, taken = by_the_text(out, points)
    # each kind begins with what roughing leaves: points remove what the flank has removed too
    assert points["removal"]["removed_mm3"] == pytest.approx(taken, rel=0.04)
    assert min(own.min(), away) > -0.05
    assert own.max() <= 0.1
    # the densest points that are looked at here are 0.3 mm apart
    assert own.max() == pytest.approx(points["scallop_greatest_mm"], abs=0.015)
    assert points["time_all_channels_min"] == pytest.approx(11 * points["time_min"])
    # the loop over all channels is the same rows, the table turned on each time
    assert points["all_channels"] == "loop"
    text = (out / f"{points['program']}-all.ngc").read_text()
    assert "o100 repeat [11]" in text
    assert "G52 C[#<turn> * -360 / 11]" in text


def by_the_text(out, program):
    """Distances of points of the side, and the least of the channel's walls, from the cutter along a text of axes; the
    volume of the stock that the cutter sweeps [mm^3], by points drawn in it.
    """
    _, tip, axis = poses_of(out, program)
    impeller = impeller_of(ImpellerShape())
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.30, 0.45, 41), np.linspace(0.50, 0.70, 21), indexing="ij"))
    own = away_from(program, tip, axis, impeller.blade.plus.at(u, v))
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.01, 0.99, 61), np.linspace(0.0, 0.99, 25), indexing="ij"))
    walls = (impeller.blade.plus, impeller.blade.minus, impeller.body(1).minus)
    low, high = (np.array(tomllib.loads(STOCK)["stock"][key]) for key in ("low_mm", "high_mm"))
    drawn = np.random.default_rng(1).uniform(low, high, (4000, 3))
    share = np.concatenate([away_from(program, tip, axis, some) < 0.0 for some in np.split(drawn, 40)]).mean()
    least = min(away_from(program, tip, axis, wall.at(u, v)).min() for wall in walls)
    return own, least, share * np.prod(high - low)


def poses_of(out, program):
    """Line, tip and axis of the poses along a text of axes, eight in each motion.

    The text is read by a few regular expressions and brought back to tips and axes by the machine's chain.
    """
    machine = machine_named("cradle-ac")
    position, rows, lines = {"X": 0.0, "Y": 0.0, "Z": 0.0, "A": 0.0, "C": 0.0}, [], []
    for number, line in enumerate((out / f"{program['program']}.ngc").read_text().splitlines(), 1):
        if line.startswith(("(", "M", "T", "G43")) or not re.search(r"[XYZAC]-?\d", line):
            continue
        position |= {letter: float(x) for letter, x in re.findall(r"([XYZAC])(-?[\d.]+)", line)}
        rows.append(list(position.values()))
        lines.append(number)
    q = np.zeros((len(rows), 9))
    # the text counts from the work offset, 77.5 mm above the origin of the axes
    q[:, [0, 1, 2]] = np.array(rows)[:, :3] + machine.chain.work_zero
    q[:, [3, 5]] = np.radians(np.array(rows)[:, 3:])
    # the first row, before which Z is nowhere
    tip, axis = (x[1:] for x in forward(machine, q))
    share = np.linspace(0.0, 1.0, 9)[:-1, None, None]
    tip, axis = (((1.0 - share) * x[:-1] + share * x[1:]).reshape(-1, 3) for x in (tip, axis))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    return np.tile(lines[2:], 8), tip, axis


def away_from(program, tip, axis, points):
    """Distance of each point from the cutter in all these poses, its corner as that of a ball at its rim."""
    R, r = 0.5 * program["diameter_mm"], program["corner_radius_mm"]
    h = points @ axis.T - (tip * axis).sum(axis=1)
    square = (points * points).sum(axis=1)[:, None] - 2.0 * points @ tip.T + (tip * tip).sum(axis=1)
    d = np.sqrt(np.maximum(square - h * h, 0.0))
    low = np.where(d > R - r, np.hypot(d - R + r, h - r), r - h) - r
    return np.where(h >= r, d - R, low).min(axis=1)


def test_a_thin_blade_bends_and_its_program_is_not_released(more):
    """A blade 2 mm thick and 24 to 39 mm high under hundreds of newtons: more than a tenth of a millimetre."""
    out, summary = more
    (program,) = summary["operations"][0]["programs"]
    (track,) = (t for t in summary["tracks"] if t["name"] == program["program"])
    limits = {x["name"]: x for x in track["limits"]}
    bent, force = limits["deflection_workpiece_um"], program["removal"]["force_n"]
    assert (bent["state"], summary["verdict"]) == ("unproven", "unproven")
    assert bent["reason"].startswith("a bound; under the mean force at the nearest point of a blade it is ")
    assert program["removal"]["deflection_workpiece_um"] == bent["worst"]
    # a long plate that ends where the piece does, 22 mm over the hub, gives more; the force is not all across it
    edge = 0.168 * 22.0**2 / (70e3 * 2.0**3 / 12.0 / (1.0 - 0.3**2))
    assert 0.05 * edge < bent["worst"] / 1000.0 / force < edge
    assert "NOT VERIFIED" in (out / f"{program['program']}.ngc").read_text().splitlines()[0]
    listed = "chatter; deflection of the blades in roughing, of the hub under them: not calculated"
    assert summary["unchecked"][0] == listed


def test_feeds_by_force_make_the_stiff_cutter_the_fast_one(more):
    out, summary = more
    (op,) = summary["operations"]
    partitions = {one["name"]: one for one in op["ways"]}
    slow, fast = partitions["hand-picked"], partitions["1 cutter"]
    assert slow["cutters"][0]["diameter_mm"] < fast["cutters"][0]["diameter_mm"]
    # at one feed the times of cutting would be as the paths
    assert slow["cutting_min"] / slow["path_mm"] > 1.3 * fast["cutting_min"] / fast["path_mm"]
    tracks = {track["name"]: track for track in summary["tracks"]}
    for program in op["programs"]:
        loads = program["loads"]
        limits = {limit["name"]: limit for limit in tracks[program["program"]]["limits"]}
        assert loads["deflection_cutter_um"] <= 30.0 / 1.1
        # more stands on the side than the allowance that the feeds are planned with
        simulated = limits["deflection_cutter_um"]["worst"]
        assert program["removal"]["deflection_cutter_um"] == simulated > loads["deflection_cutter_um"]
        assert loads["cutter_stress_mpa"] < limits["cutter_stress_mpa"]["worst"] < 1500.0
    # what the text states: passes of the slender cutter below the greatest feed, its links above it
    (picked,) = out.glob("way-hand-picked*.apt")
    feeds = {float(f) for f in re.findall(r"FEDRAT/([0-9.]+)", picked.read_text())}
    assert min(feeds) < 200.0
    # links, some as fast as the pallet turns
    assert 1100.0 < min(f for f in feeds if f > 400.0) <= max(feeds) == 1200.0
    assert summary["unchecked"][0].startswith("chatter")
