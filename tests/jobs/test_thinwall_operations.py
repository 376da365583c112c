"""Semi-finishing and finishing of a thin wall as operations with cutters of their own: stock between them, volumes,
the change of the tool, refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.depth import DepthRange
from chipload.planning.thinwall.force_table import ForceTable
from chipload.planning.thinwall.passes import in_operations
from chipload.planning.thinwall.threshold import modelled
from chipload.planning.thinwall.variants import DepthOperation, even, limited_to
from chipload.report.folder import write_result

SMALL = (
    "wall.length_mm=8.0",
    "wall.height_mm=9.0",
    "wall.thickness_mm=1.7",
    "wall.foot_mm=4.0",
    "wall.allowance_mm=[0.3, 0.3]",
    "wall.elements=[4, 5]",
    "limits.deflection_workpiece_um=60.0",
)
SEMIFINISH = """[[operation]]
kind = "thinwall"
cutter = 2
leave_mm = 0.1
milling = "down"
feed_mm_min = 800.0
speed_rpm = 3000.0
lean_deg = 45.0
lead_deg = 0.0
scallop_um = 50.0
depth_min_mm = 0.04
depth_max_mm = 0.2
slope = 0.05
reserve = 0.1
clearance_mm = 1.5
step_mm = 3.0
layer_mm = 0.25
corner_slices = 60
tolerance_mm = 0.002

"""
CUTTER = """[[cutter]]
number = 2
name = "ball nose 6"
diameter_mm = 6.0
corner_radius_mm = 3.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 8.0
overhang_mm = 28.0
modulus_gpa = 580.0

"""
FINISH = {
    "scallop_um = 20.0": "scallop_um = 40.0",
    "depth_max_mm = 0.4": "depth_max_mm = 0.1",
    "step_mm = 2.5": "step_mm = 3.0",
    "layer_mm = 0.4": "layer_mm = 0.25",
    "corner_slices = 100": "corner_slices = 60",
    "reserve = 0.09": "reserve = 0.1",
    "least_error = true\n": "refine = false\n",
    "compensate_um = 60.0\n": "",
}


def job(folder, change=()):
    path = folder / "job.toml"
    text = (folder / "shipped.toml").read_text()
    at = text.index("[[operation]]")
    for old, new in FINISH.items():
        assert old in text
        text = text.replace(old, new)
    text = text[:at] + CUTTER + SEMIFINISH + text[at:]
    path.write_text(text)
    return load_job(path, (*SMALL, *change))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = copy_example("plate", tmp_path_factory.mktemp("wall") / "plate")
    (made / "job.toml").rename(made / "shipped.toml")
    return made


@pytest.fixture(scope="module")
def finished(folder):
    return run_job(job(folder))


def surface(allowance: float, wall: int = 0) -> FinishSurface:
    x, y = np.meshgrid(np.linspace(0.0, 4.0, 5), np.linspace(0.0, 2.0, 3), indexing="ij")
    points = np.stack([x, y, 0.0 * x], axis=-1)
    return FinishSurface(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape), allowance, wall)


def law(newton_a_mm: float) -> ForceTable:
    return ForceTable(DepthRange(0.01, 1.0), np.array([0.01, 1.0]), newton_a_mm * np.array([0.01, 1.0]))


def bears(left, side):
    """60 N beside its own finish surface, 60 N more for each mm of stock that is left on the side."""
    return modelled(0.05 / (60.0 + 60.0 * left[side].ravel()), 0.05)


def test_each_operation_cuts_by_its_own_law():
    """Two walls of 0.95 mm stock, 0.35 mm left: 150 N/mm semi-finishes (81 N at 0.35: 0.54, then the rest), 300 N/mm
    finishes (0.2, then 72 N: 0.24, of which 0.15 is left). All walls by the first cutter before the second one."""
    walls = [surface(0.95, 0), surface(0.95, 1)]
    made = [DepthOperation(bears, law(150.0), 0.35), DepthOperation(bears, law(300.0))]
    plan = limited_to(walls, made, 0.05).plan
    order = [(k, side) for k in (0, 1) for side in (0, 0, 1, 1)]
    assert [(p.operation, p.side) for p in plan.passes] == order
    expected = [0.06, 0.54, 0.15, 0.2]
    for side in (0, 1):
        own = [p for p in plan.passes if p.side == side]
        assert [float(p.depth.min()) for p in own] == pytest.approx(expected)
        assert [float(p.low.max()) for p in own] == pytest.approx([0.89, 0.35, 0.2, 0.0])
    assert plan.holds
    equal = even(walls[:1], made, 0.05).plan
    assert [float(p.depth.max()) for p in equal.passes] == pytest.approx([0.3, 0.3, 0.175, 0.175])
    assert [p.operation for p in equal.passes] == [0, 0, 1, 1]


def test_an_operation_that_leaves_what_it_finds():
    with pytest.raises(InputError, match=r"operation\.0: leaves 0\.5 mm of stock, finds 0\.4 mm"):
        in_operations([surface(0.4)], [0.5, 0.0], lambda k, found, leave: None)


def test_stock_between_the_operations(finished):
    """Every plan: the first cutter goes from 0.3 to 0.1 mm, the second from 0.1 mm to the finish, both sides each."""
    for one in finished.outcome.variants.values():
        maps = one.plan.maps
        assert [m.operation for m in maps] == sorted(m.operation for m in maps)
        for number, stock in ((0, 0.2), (1, 0.1)):
            for side in (0, 1):
                whole = sum(m.depth for m in maps if (m.operation, m.side) == (number, side))
                assert whole == pytest.approx(np.full(whole.shape, stock))
        tool = one.program.tool
        change = np.flatnonzero(np.diff(tool))
        assert [int(tool[0]), *tool[change + 1].tolist()] == [2, 1]
        # tools are changed over the wall
        assert one.program.p_work[[change[0], change[0] + 1], 2].min() > 9.0


def removed(radius: float, low: float, high: float, rows: int) -> float:
    """Volume [mm^3] of both sides of 8 x 5 mm above the foot: from ``high`` to ``low`` with scallops between rows of a
    ball, and what it takes below its last row, half a segment of its circle."""
    scallop = (5.0 / rows) ** 2 / (8.0 * radius)
    depth = high - low
    half = np.sqrt(2.0 * radius * depth - depth**2)
    below = 0.5 * (radius**2 * np.arccos(1.0 - depth / radius) - (radius - depth) * half)
    return float(2.0 * 8.0 * (5.0 * (depth - scallop / 3.0) + below))


def test_volumes_are_those_of_the_stock(finished):
    """A ball of 3 mm from 0.3 to 0.1 mm, then one of 4 mm to the finish; rows are 1 mm apart, 5 intervals up the side.
    Below the last row the finish, x^2 / 8, lies deeper everywhere than what the semi-finish left, 0.1 + x^2 / 6."""
    first, last = finished.result.operations[0]["operations"]
    assert (first["cutter"], first["leave_mm"], last["cutter"], last["leave_mm"]) == (2, 0.1, 1, 0.0)
    semifinish, whole = removed(3.0, 0.1, 0.3, 5), removed(4.0, 0.0, 0.3, 5)
    assert first["chip_volume_mm3"] == pytest.approx(semifinish, rel=0.01)
    assert last["chip_volume_mm3"] == pytest.approx(whole - semifinish, rel=0.02)
    assert first["chip_volume_mm3"] + last["chip_volume_mm3"] == pytest.approx(whole, rel=0.005)


def test_verdict_program_and_files(finished, tmp_path):
    used = next(t for t in finished.result.tracks if t.in_use)
    limits = {c.name: c for c in used.limits}
    assert limits["gouge_mm"].state.value == "holds"
    assert limits["deflection_workpiece_um"].worst <= 60.0
    folder = write_result(finished.result, finished.presentation, tmp_path / "r")
    assert json.loads((folder / "summary.json").read_text())["operations"][0]["operations"][0]["passes"] >= 2
    name = next(p for p in used.programs if not p.endswith("apt"))
    text = (folder / name).read_text()
    assert text.index("T2 M6") < text.index("T1 M6")
    cl = (folder / next(p for p in used.programs if p.endswith("apt"))).read_text()
    assert cl.index("LOADTL/2") < cl.index("LOADTL/1")


def said(call) -> str:
    with pytest.raises(InputError) as err:
        call()
    return str(err.value)


def test_refused(folder):
    assert "operation.0.leave_mm = 0.3: must be above 0 and below 0.3, the stock that the operation finds" in said(
        lambda: job(folder, ("operation.0.leave_mm=0.3",))
    )
    assert "operation.1.leave_mm = 0.1: the last operation finishes: leave it out" in said(
        lambda: job(folder, ("operation.1.leave_mm=0.1",))
    )
    assert "operation.0.refine: belongs to the last operation" in said(
        lambda: job(folder, ("operation.0.refine=false",))
    )
    assert "operation.0.least_error: belongs to the last operation" in said(
        lambda: job(folder, ("operation.0.least_error=true",))
    )
    assert "operation.1.cutter = 7" in said(lambda: job(folder, ("operation.1.cutter=7",)))
