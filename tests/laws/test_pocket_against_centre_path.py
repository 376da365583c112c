"""The front against two things that know nothing of it: the trail of the centre, and a union of capsules by shapely."""

import math

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.machine.machine import machine_named
from chipload.planning.pocket.plan import plan_pocket
from chipload.planning.pocket.request import Clearing
from chipload.program.program import ARC_CCW, LINE, RAPID
from chipload.simulation.verify import verify_contour

R = 3.0
WANTED = math.degrees(math.acos(1.0 - 0.6 / R))
MILL = Cutter(2.0 * R, 3, math.radians(30), 20.0, 30.0, 580e3)
QUARTER = math.tan(math.pi / 8)
SQUARE = Contour.polyline([(0, 0), (24, 0), (24, 20), (0, 20)], closed=True)
ELL = Contour.from_bulges(
    [(0, 0), (26, 0), (26, 10), (14, 10), (10, 14), (10, 24), (0, 24)], [0, 0, 0, -QUARTER, 0, 0, 0], closed=True
)
ISLAND = Contour.circle((12.0, 10.0), 2.0)
DUMBBELL = Contour.polyline(
    [(0, 0), (14, 0), (14, 5), (20, 5), (20, 0), (34, 0), (34, 14), (20, 14), (20, 9), (14, 9), (14, 14), (0, 14)],
    closed=True,
)
CASES = {"square": [SQUARE], "L": [ELL], "island": [SQUARE, ISLAND], "neck narrower than the cutter": [DUMBBELL]}


def cleared(contours, milling="down", **limits):
    setting = Clearing(milling, 0.6, 5.0, 10.0, 800.0, 0.0, 5.0, 0.18)
    done = plan_pocket(contours, setting, MILL, material_named("al7075-t6"), machine_named("vmc"), limits)
    return done.strategies["pocket"]


@pytest.fixture(scope="module", params=[*((c, "down") for c in CASES), ("L", "up")], ids=lambda p: " ".join(p))
def result(request):
    name, milling = request.param
    return CASES[name], cleared(CASES[name], milling)


def test_engagement_by_the_trail(result):
    """Every row, and never above the wanted one."""
    _, front = result
    told = verify_contour(
        front.program,
        R,
        front.history,
        stock=None,
        stock_top_mm=0.0,
        wall=front.drawn["wall"],
        material="right",
        engagement_tolerance_deg=0.05,
        gouge_tolerance_mm=1e-3,
        excess_tolerance_mm=0.6,
        passes=("pocket", "link"),
        workers=2,
    )
    assert told.verdict == "proved", told.reasons
    assert front.summary["engagement_deg"]["max"] <= WANTED + 0.01
    assert any(e.failure for e in front.events) == (front.summary["cleared_share"] < 0.995)


def lines_of(program, rows):
    """The path of each row; arcs by 16 chords between the circles about their centre."""
    for k in rows:
        a, b, c = program.p_work[k - 1, :2], program.p_work[k, :2], program.centre[k, :2]
        if program.motion[k] == LINE:
            yield shapely.linestrings([a, b])
            continue
        t0, t1 = (math.atan2(*(x - c)[::-1]) for x in (a, b))
        sweep = (t1 - t0) % math.tau if program.motion[k] == ARC_CCW else -((t0 - t1) % math.tau)
        t = t0 + sweep * np.linspace(0.0, 1.0, 17)
        yield shapely.linestrings(c + math.hypot(*(a - c)) * np.column_stack([np.cos(t), np.sin(t)]))


def test_area_by_capsules(result):
    """Cleared and reachable area by shapely: opening of the region, union of the swept steps."""
    contours, front = result
    p = front.program.p_work
    floor = np.flatnonzero((p[1:, 2] < -4.99) & (p[:-1, 2] < -4.99) & (front.program.motion[1:] != RAPID)) + 1
    swept = shapely.union_all([shapely.buffer(line, R, quad_segs=48) for line in lines_of(front.program, floor)])
    region = shapely.polygons(contours[0].flatten(1e-5))
    for island in contours[1:]:
        region = shapely.difference(region, shapely.polygons(island.flatten(1e-5)))
    reach = shapely.buffer(shapely.buffer(region, -R, quad_segs=64), R, quad_segs=64)
    share = shapely.intersection(swept, reach).area / reach.area
    assert share >= (0.99 if contours == [DUMBBELL] else 0.995)  # its corners are half of it
    assert share == pytest.approx(front.summary["cleared_share"], abs=5e-4)
    assert shapely.difference(swept, region).area < 1e-2


def test_each_separate_part_has_an_entry(result):
    contours, front = result
    parts = 2 if contours == [DUMBBELL] else 1
    assert sum(e.code == "pocket-entry" for e in front.events) == parts


def test_links_meet_nothing(result):
    _, front = result
    link = front.history["pass"] == "link"
    assert front.history["engagement_deg"][link].max(initial=0.0) == 0.0


def test_same_input_same_path():
    one, two = (cleared([SQUARE]) for _ in range(2))
    assert (one.program.p_work == two.program.p_work).all()


def test_an_open_chain_is_refused():
    with pytest.raises(InputError) as err:
        cleared([Contour.polyline([(0, 0), (30, 0), (30, 30)])])
    assert str(err.value) == (
        "contour open at (30, 30), gap 42.4264 mm: a closed contour is needed; close the drawing, raise part.join_mm, "
        'or leave it out (part.open_chains = "dropped")'
    )


def test_a_cutter_that_fits_nowhere_is_refused():
    with pytest.raises(InputError, match="the cutter fits nowhere into the region; take a smaller one"):
        cleared([Contour.polyline([(0, 0), (30, 0), (30, 5), (0, 5)], closed=True)])
