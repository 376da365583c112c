"""A small plate from its job to its result: three variants, simulated; what the result has and what must hold."""

import io
import json
import math

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

from chipload.examples import copy_example
from chipload.job import load_job
from chipload.program.gcode.writer import NOT_VERIFIED, VERIFIED
from chipload.report.wall.outcome import fails, verdict
from chipload.report.wall.page import page_bytes
from chipload.report.wall.scene import scene_bytes
from chipload.report.wall.summary import history_bytes, program_files, summary_bytes
from chipload.run import run
from chipload.run.wall import TRIES
from rs274 import MISSING, canonical, rs274_installed

SMALL = (
    "wall.length_mm=8.0",
    "wall.height_mm=9.0",
    "wall.thickness_mm=1.7",
    "wall.foot_mm=4.0",
    "wall.allowance_mm=[0.2, 0.2]",
    "wall.elements=[4, 5]",
    "operation.0.scallop_um=40.0",
    "operation.0.depth_max_mm=0.2",
    "operation.0.step_mm=3.0",
    "operation.0.layer_mm=0.5",
    "operation.0.corner_slices=60",
    "operation.0.reserve=0.1",
    "limits.deflection_um=48.0",
)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wall")
    return run(load_job(copy_example("plate", folder / "plate") / "job.toml", SMALL))


@pytest.fixture(scope="module")
def operation(done):
    return json.loads(summary_bytes(done))["operations"][0]


def test_summary_has_what_is_compared(done, operation):
    assert set(operation["variants"]) == {"variable", "constant", "unconstrained"}
    for one in operation["variants"].values():
        for key in ("passes", "time_min", "deflection_um_max", "error_um_max", "force_normal_n_max"):
            assert one[key] > 0.0
    assert operation["threshold_source"] == "modelled"
    assert operation["infeasible"] == []
    assert operation["reserve"] == 0.1


def test_all_stock_is_taken_and_nothing_else(done):
    """Volume of the chips = length x height above the foot x both allowances, more 2/3 a sqrt(2 r a) of the fillets
    below it, less a third of the cusps; no gouge by path or by stock, all points of the finished sides made."""
    fillet, cusp = 2.0 / 3.0 * 0.2 * math.sqrt(2.0 * 4.0 * 0.2), 0.04
    expected = 2.0 * 8.0 * (5.0 * (0.2 - cusp / 3.0) + fillet)
    for one in done.variants.values():
        volume = one.columns["chip_volume_mm3"].sum()
        assert volume == pytest.approx(expected, rel=0.04)
        assert one.shape.gouge <= 0.001
        assert one.shape.nearest >= -0.001
        assert all(f.made.all() for f in one.finish)
        assert not (one.columns["rapid"] & (one.columns["chip_pieces"] > 0)).any()


def test_variable_is_held_to_the_constant_one(done, operation):
    variable, constant = done.variants["variable"], done.variants["constant"]
    held = variable.deflection <= constant.deflection * (1.0 + 1e-9)
    assert held or done.settings["simulated_tries"] == TRIES
    said = verdict(done)
    assert held or not said[0] or f"bends the wall by {1e3 * constant.deflection:.4g} um" in said[1]
    assert operation["time_constant_over_variable"] == pytest.approx(constant.seconds / variable.seconds)
    assert done.variants["unconstrained"].deflection > variable.deflection


def test_deflection_is_force_over_threshold_times_the_limit(done):
    """The threshold is limit / C_nn and the deflection F_n C_nn: their quotients are the same; F_n along the normal of
    a plate is that along y."""
    for one in done.variants.values():
        c = one.columns
        cut = c["force_normal_n"] > 0.0
        limit = done.limits["deflection_um"] / 1000.0
        assert np.allclose(c["work_mm"][cut] / limit, c["force_over_threshold"][cut], rtol=1e-6)
        greatest = np.maximum(c["force_y_max_n"], -c["force_y_min_n"])
        slope = math.cos(math.atan(0.03))
        assert (c["force_normal_n"][cut] <= greatest[cut] / slope + 0.05 * c["force_n"][cut]).all()


def test_what_exceeds_is_listed_and_fails(done, operation):
    free = done.variants["unconstrained"]
    share = free.deflection / (done.limits["deflection_um"] / 1000.0)
    assert bool(fails(done, "unconstrained")) == (share > 1.01)
    listed = operation["variants"]["unconstrained"]["over_threshold"]
    assert listed == int((free.columns["force_over_threshold"] > 1.01).sum())
    holds, says = verdict(done)
    assert holds == (not fails(done, "variable"))
    assert operation["holds"] == holds
    assert says


def test_files(done):
    table = pq.read_table(io.BytesIO(history_bytes(done)))
    assert table.num_rows == sum(len(v.columns["line"]) for v in done.variants.values())
    assert {"strategy", "pass", "u", "v", "depth_mm", "threshold_n", "work_mm", "cutter_mm"} <= set(table.column_names)
    scene = trimesh.load(io.BytesIO(scene_bytes(done)), file_type="glb")
    assert {"0-wall", "0-stock", "0-path-variable", "0-cutter"} <= set(scene.graph.nodes_geometry)
    page = page_bytes(done).decode()
    for text in ("Three ways to cut it", "What each place bears", "Depth of each pass", "Places that bear no cut"):
        assert text in page


def test_programs(done):
    files = program_files(done)
    assert set(files) == {f"0-{n}.{e}" for n in done.variants for e in ("ngc", "apt")}
    first = {name: text.decode().splitlines()[0] for name, text in files.items() if name.endswith(".ngc")}
    assert VERIFIED in first["0-variable.ngc"]
    assert NOT_VERIFIED in first["0-constant.ngc"]


@pytest.mark.skipif(not rs274_installed(), reason=MISSING)
def test_linuxcnc_reads_the_programs(done):
    for name, text in program_files(done).items():
        if name.endswith(".ngc"):
            calls = canonical(text.decode())
            moves = [words for call, words in calls if call in ("STRAIGHT_FEED", "STRAIGHT_TRAVERSE")]
            assert len(moves) >= len(done.variants[name[2:-4]].program) - 2
            # rotary axes move
            assert len({words[4] for words in moves}) > 3
