"""An impeller by the command line: what the result files say, against the gouge test of the source by brute force."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh
from typer.testing import CliRunner

from chipload import examples
from chipload.cli import app
from chipload.cutter.catalogue import catalogue_named
from chipload.planning.impeller.closed_form import axis_at, contact_limit
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.surfaces import hub_range

EXAMPLES = Path(examples.__file__).parent
#: fewer points than the example's, so that it is quick
FEW = [f"surface.{k}.points=[6, 4]" for k in range(3)] + [
    "operation.0.check_mm=5",
    "operation.0.most_cutters=2",
    "surface.2.up=[0.05, 0.75]",
]
GRID = np.radians(np.arange(0.0, 360.0, 1.0))


def call(*words):
    return CliRunner().invoke(app, [str(w) for w in words])


def sets(*texts):
    return [word for text in texts for word in ("--set", text)]


def without_programs(folder):
    """The example, with nothing of programs."""
    text = (EXAMPLES / "impeller" / "job.toml").read_text()
    path = folder / "impeller" / "job.toml"
    path.parent.mkdir()
    path.write_text(text[: text.index("[operation.rough]")])
    return path


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("impeller")
    out = folder / "result"
    done = call("run", without_programs(folder), "--out", out, *sets(*FEW))
    return done, out


@pytest.fixture(scope="module")
def summary(result):
    return json.loads((result[1] / "summary.json").read_bytes())


def gouges(s, k, diameter, r, T):
    """Check points that a plain cutter meets: axis distance below the profile at their height above the tip."""
    N, S, R = s["normal"][k], s["contact"][k], 0.5 * diameter
    n = N @ T
    V = (N - n * T) / math.sqrt(1.0 - n * n)
    a = s["check"] - (S + r * N + (R - r) * V - r * T)
    height = a @ T
    away = np.linalg.norm(a - height[:, None] * T, axis=1)
    radius = np.where(height < r, R - r + np.sqrt(np.clip(r * r - (r - height) ** 2, 0.0, None)), R)
    own = (s["check_surface"] == 0) & (((s["check"] - S) ** 2).sum(axis=1) < s["near"] ** 2)
    return ((height >= 0.0) & (away < radius - 1e-9) & ~own).any()


def goes(s, k, diameter, r, T):
    return not gouges(s, k, diameter, r, T) and 0.5 * diameter - r <= contact_limit(
        s["normal"][k], T, r, s["curvature"][k]
    )


@pytest.fixture(scope="module")
def proof(result):
    with np.load(result[1] / "proof.npz", allow_pickle=False) as file:
        arrays = dict(file)
    return [{key[2:]: value for key, value in arrays.items() if key[0] == str(k)} for k in range(3)]


def test_the_files_are_there(result):
    done, out = result
    # the floor's edge is not reached: nothing is dropped, and the exit code says so
    assert done.exit_code == 3, done.output
    names = {p.name for p in out.iterdir()}
    assert {"summary.json", "contact_points.parquet", "scene.glb", "report.html", "proof.npz"} <= names


def test_every_point_is_counted(result, summary):
    (op,) = summary["operations"]
    rows = pq.read_table(result[1] / "contact_points.parquet").to_pylist()
    assert op["cc_points"] == len(rows) == 72
    missed = [r for r in rows if r["diameter_mm"] == 0.0]
    assert op["unreachable"] == len(missed) == sum(len(s["unreachable_points"]) for s in op["surfaces"]) > 0
    assert all(r["unreachable"] for r in missed)
    assert op["certified"] is True
    for s in op["surfaces"]:
        reached = sum(p["cc_points"] for p in s["pointwise"])
        assert reached + s["unreachable"] == s["cc_points"] == 24
    assert "contact points" in summary["message"]
    assert summary["verdict"] == "exceeds"
    worst = {check["name"]: check["worst"] for check in summary["limits"]}
    assert worst == {"unreached_points": len(missed), "uncertified_points": 0.0}


@pytest.fixture(scope="module")
def walls():
    """Points of the exact walls, 0.3 mm apart."""
    impeller = impeller_of(ImpellerShape(11, 24.185, 45.88, 111.5, 50.0, 39.35, math.radians(20.0), 0.0, 24.0))
    U, V = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 480), np.linspace(0, 1, 130), indexing="ij"))
    out = [p.at(U, V) for k in (-1, 0, 1, 2) for p in (impeller.body(k).plus, impeller.body(k).minus)]
    s = np.linspace(*hub_range(impeller, 0.0), 350)
    for k in (-1, 0, 1):
        theta = impeller.across(k, s, np.linspace(0.0, 1.0, 160))
        out.append(impeller.hub.at(np.repeat(s, 160), theta.ravel()))
    return np.concatenate(out)


def cuts_in(points, s, k, diameter, r, T):
    """How deep a cutter comes into a wall at most, by its outline."""
    N, S, R = s["normal"][k], s["contact"][k], 0.5 * diameter
    n = N @ T
    a = points - (S + r * N + (R - r) * (N - n * T) / math.sqrt(1.0 - n * n))
    height = a @ T
    away = np.sqrt(np.maximum((a * a).sum(axis=1) - height**2, 0.0))
    corner = np.where(away > R - r, r - np.hypot(away - (R - r), height), r + height)
    return np.where(height > 0.0, R - away, corner).max()


def test_each_largest_cutter_is_clear_and_the_next_is_not(result, proof, walls):
    rows = pq.read_table(result[1] / "contact_points.parquet").to_pylist()
    sizes = [c.diameter for c in catalogue_named("wu2019").family(2.0)]
    tables = np.radians(np.arange(20.0, 91.0, 5.0))
    for row in rows[::5]:
        s = proof[["blade plus", "blade minus", "blade floor"].index(row["surface"])]
        k, D, r = row["cc_point"], row["diameter_mm"], row["corner_radius_mm"]
        if D > 0.0:
            for low, high in np.radians(row["pallet_deg"]).reshape(-1, 2):
                for B in low + (high - low) * np.linspace(0.05, 0.95, 4):
                    T = axis_at(math.radians(row["table_deg"]), B)
                    assert goes(s, k, D, r, T)
                    # and between the check points, within tolerance_mm
                    assert cuts_in(walls, s, k, D, r, T) <= 0.05
        larger = [d for d in sizes if d > D]
        if larger:
            for table in tables[::3]:
                for T in axis_at(table, GRID):
                    if 0.0 <= T @ s["normal"][k] < 1.0 - 1e-9 and goes(s, k, larger[0], 2.0, T):
                        # clear of the check points, it collides with a wall between them
                        assert cuts_in(walls, s, k, larger[0], 2.0, T) > 0.0


def test_the_one_cutter_and_the_next(summary, proof):
    (op,) = summary["operations"]
    sizes = [c.diameter for c in catalogue_named("wu2019").family(2.0)]
    reached = [[k for k in range(24) if k not in {u["cc_point"] for u in s["unreachable_points"]}]
               for s in op["surfaces"]]  # fmt: skip
    for s, data, points in zip(op["surfaces"], proof, reached, strict=True):
        if s["diameter_mm"] is None:
            continue
        T = axis_at(math.radians(s["table_deg"]), GRID)
        n = T @ data["normal"].T
        for k in points[::4]:
            facing = T[(n[:, k] >= 0.0) & (n[:, k] < 1.0 - 1e-9)]
            assert any(goes(data, k, s["diameter_mm"], s["corner_radius_mm"], one) for one in facing)
        # at each table angle the next size is stopped at the contact point that the summary names
        following = [d for d in sizes if d > s["diameter_mm"]]
        for x in s["limits"][-15::4]:
            if following and x["corner_radius_mm"] == 2.0 and not x["capped"]:
                T = axis_at(math.radians(x["table_deg"]), GRID)
                n_k = T @ data["normal"][x["cc_point"]]
                for one in T[(n_k >= 0.0) & (n_k < 1.0 - 1e-9)]:
                    assert not goes(data, x["cc_point"], following[0], 2.0, one)


def test_patches_cover_what_is_reached_and_are_clear(summary, proof):
    (op,) = summary["operations"]
    names = [s["surface"] for s in op["surfaces"]]
    total = sum(s["area_mm2"] for s in op["surfaces"])
    reached = sum(p["area_share"] * s["area_mm2"] for s in op["surfaces"] for p in s["pointwise"]) / total
    for way in (w for w in op["ways"] if w["name"] != "hand-picked"):
        assert sum(p["area_share"] for p in way["patches"]) == pytest.approx(reached, abs=1e-9)
        assert way["reached_share"] == pytest.approx(reached, abs=1e-9)
    for way in op["ways"]:
        path = sum(p["path_mm"] for p in way["patches"])
        # of the job: 11 channels, 100 mm/min, 60 s and 300 s a change
        assert way["path_mm"] == pytest.approx(11 * path)
        changes = way["cutter_changes"] + 5 * way["table_changes"]
        assert way["time_min"] == pytest.approx(11 * path / 100.0 + changes)
        assert way["least_time_any_shape_min"] <= way["least_time_min"] + 1e-9 <= way["time_min"] + 2e-9
        assert way["above_bound"] == pytest.approx(way["time_min"] / way["least_time_min"] - 1.0)
    times = [w["time_min"] for w in op["ways"][1:]]
    assert times == sorted(times, reverse=True)
    assert (op["time_min"], op["name"]) == (min(times), op["ways"][1 + times.index(min(times))]["name"])
    assert op["hand_picked"]["diameter_mm"] == 14.0
    assert op["hand_picked"]["patches"] == op["ways"][0]["patches"]
    points = {(s["surface"], u["cc_point"]) for s in op["surfaces"] for u in s["unreachable_points"]}
    for patch in op["patches"]:
        n = names.index(patch["surface"])
        grid = np.linspace(*op["surfaces"][n]["where"]["along"], 6), np.linspace(*op["surfaces"][n]["where"]["up"], 4)
        x = np.repeat(grid[0], 4) if patch["across"] == "u" else np.tile(grid[1], 6)
        y = np.tile(grid[1], 6) if patch["across"] == "u" else np.repeat(grid[0], 4)
        low, high = patch["part"]
        inside = (x >= patch["from"]) & (x <= patch["to"]) & (y >= low) & (y <= high)
        assert inside.sum() == patch["cc_points"]
        # ranges may be narrower than a degree
        T = axis_at(math.radians(patch["table_deg"]), np.concatenate([GRID, np.radians(np.arange(0.0, 360.0, 0.05))]))
        for k in np.flatnonzero(inside)[::5]:
            if (patch["surface"], int(k)) not in points:
                facing = T[((T @ proof[n]["normal"][k]) >= 0.0) & (T @ proof[n]["normal"][k] < 1.0 - 1e-9)]
                assert any(goes(proof[n], k, patch["diameter_mm"], patch["corner_radius_mm"], one) for one in facing)


def test_the_scene_has_the_surfaces(result):
    scene = trimesh.load(result[1] / "scene.glb")
    assert {"hub", "blades", "0-largest", "1-largest", "2-largest"} <= set(scene.geometry)
    p = scene.geometry["blades"].vertices
    assert np.hypot(p[:, 0], p[:, 1]).max() == pytest.approx(111.5, abs=0.1)
    assert np.ptp(p[:, 2]) == pytest.approx(50.0, abs=1e-6)


def test_the_page_says_what_is_not_proved(result):
    page = (result[1] / "report.html").read_text()
    for text in ("Not checked", "between the check points", "not reached", "Not reached", "The proof"):
        assert text in page


def test_the_same_bytes_again(result, tmp_path):
    out = tmp_path / "again"
    call("run", without_programs(tmp_path), "--out", out, *sets(*FEW))
    first, second = (json.loads((p / "summary.json").read_bytes()) for p in (result[1], out))
    for values in (first, second):
        # the time of the search is the one number that is not of the input
        (op,) = values["operations"]
        for row in (op, op["hand_picked"], *op["surfaces"]):
            assert row.pop("search_s") > 0.0
    assert first == second
    for name in ("contact_points.parquet", "history.parquet", "scene.glb", "proof.npz"):
        assert (out / name).read_bytes() == (result[1] / name).read_bytes()


def test_check_reads_all_and_writes_nothing(tmp_path):
    folder = Path(shutil.copytree(EXAMPLES / "hecc", tmp_path / "hecc"))
    before = sorted(folder.iterdir())
    done = call("check", folder / "job.toml")
    assert done.exit_code == 0
    assert "impeller: 15 blades and as many splitters" in done.output
    assert "surface 3: splitter plus: 128 contact points, 12183 check points" in done.output
    assert "catalogue long-reach: 19 cutters, corner radii 1, 2 mm" in done.output
    assert sorted(folder.iterdir()) == before
