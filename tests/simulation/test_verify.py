"""A right plan is proved; a gouge, a rapid through stock, a wrong engagement and left stock are caught."""

import math

import numpy as np
import pytest

from chipload.errors import Cancelled, InputError
from chipload.geometry.contour import Contour, Region
from chipload.program.program import ARC_CCW, LINE, RAPID, Program
from chipload.simulation import verify as verify_module
from chipload.simulation.verify import MATCH_MM, verify_contour
from left_material import material_left_of

R, S, RC, Z, SAFE = 5.0, 0.1, 8.0, -6.0, 5.0
SHALLOW = np.degrees(np.arccos(1 - S / R))


def corner(radius, run=30.0):
    return Contour(
        [
            [-run, -radius, 0, -radius, 0, 0, 0],
            [0, -radius, radius, 0, 0, 0, np.pi / 2],
            [radius, 0, radius, run, 0, 0, 0],
        ]
    )


def program(rows):
    """Rows (motion, x, y, z, xc, yc)."""
    a = np.array(rows, dtype=float)
    n = len(a)
    cuts = np.isin(a[:, 0], (LINE, ARC_CCW))
    return Program(
        motion=a[:, 0],
        p_work=a[:, 1:4],
        axis=np.tile([0.0, 0.0, 1.0], (n, 1)),
        centre=np.column_stack([a[:, 4:6], np.zeros(n)]),
        normal=np.tile([0.0, 0.0, 1.0], (n, 1)),
        turns=np.zeros(n),
        feed=np.where(cuts, 10.0, 0.0),
        spindle=np.full(n, 100.0),
        tool=np.ones(n),
        line=np.zeros(n),
        label=np.zeros(n),
        labels=("finish",),
    )


def plan(dent=0.0, retract=SAFE, run=30.0):
    """Two passes round the corner, the second with a step of ``dent`` into the wall at x = -20..-18."""
    rows = []
    for r in (RC - R - S, RC - R):
        d = dent if r == RC - R else 0.0
        rows += [(RAPID, -run - 8, -r, SAFE, 0, 0), (LINE, -run - 8, -r, Z, 0, 0)]
        if d:
            rows += [(LINE, -20, -r, Z, 0, 0), (LINE, -19, -r - d, Z, 0, 0), (LINE, -18, -r, Z, 0, 0)]
        rows += [(LINE, 0, -r, Z, 0, 0), (ARC_CCW, r, 0, Z, 0, 0), (LINE, r, run + 8, Z, 0, 0)]
        if r != RC - R:
            rows += [(RAPID, r, run + 8, retract, 0, 0), (RAPID, -run - 8, -r, retract, 0, 0)]
        rows += [(RAPID, rows[-1][1], rows[-1][2], SAFE, 0, 0)]
    return program(rows)


def finish_rows(step=0.25, run=30.0):
    """The finish pass with its engagement by bisection on the closed form of circle against line and circle."""
    path = corner(RC - R, run)
    s = np.arange(5.0, path.length - 5.0, step)
    p, t, _ = path.at(s)
    n = np.column_stack([-t[:, 1], t[:, 0]])
    old = RC - S

    def in_stock(q):  # outside of the surface that the first pass left
        x, y = q.T
        far = np.where((x > 0) & (y < 0), np.hypot(x, y), np.where(x <= 0, -y, x))
        return far > old

    lo, hi = np.full(len(s), np.pi / 2), np.full(len(s), np.pi)
    for _ in range(50):
        mid = 0.5 * (lo + hi)
        stock = in_stock(p + R * (np.sin(mid)[:, None] * t + np.cos(mid)[:, None] * n))
        lo, hi = np.where(stock, lo, mid), np.where(stock, mid, hi)
    return {
        "x_mm": p[:, 0],
        "y_mm": p[:, 1],
        "z_mm": np.full(len(s), Z),
        "engagement_deg": np.degrees(np.pi - hi),
        "pass": np.full(len(s), "finish", dtype=object),
    }


WALL = corner(RC)
STOCK = material_left_of(corner(RC - 2 * S).reversed(), 1000.0)


def verify(p, rows, **options):
    given = {
        "stock": STOCK,
        "stock_top_mm": 0.0,
        "wall": [WALL],
        "material": "right",
        "engagement_tolerance_deg": 1e-4,
        "gouge_tolerance_mm": 1e-6,
        "excess_tolerance_mm": 1e-6,
    }
    return verify_contour(p, R, rows, **(given | options))


def test_a_right_plan_is_proved():
    rows = finish_rows()
    v = verify(plan(), rows)
    assert v.reasons == ()
    assert v.verdict == "proved"
    assert v.compared == len(rows["x_mm"])
    assert v.engagement_difference_deg < 1e-5
    assert max(rows["engagement_deg"]) == pytest.approx(18.7375, abs=1e-3)


def test_a_gouge_is_measured_and_placed():
    rows = finish_rows()
    far = (rows["x_mm"] > -14) | (rows["y_mm"] > 0)
    v = verify(plan(dent=0.005), {k: c[far] for k, c in rows.items()})
    assert v.verdict == "failed"
    assert v.gouge_mm == pytest.approx(0.005, abs=1e-9)
    assert v.gouge_at == pytest.approx((-19.0, -8.0), abs=1e-3)
    assert v.reasons == ("gouge 0.005 mm at (-19.0000, -8.0000): limit 1e-06 mm",)


def test_left_stock_is_measured_and_placed():
    wall = Contour.polyline([[-30, -RC], [-10, -RC - 0.003], [10, -RC]])
    v = verify(plan(), finish_rows(), wall=[wall.part(0.0, 20.0)])
    assert v.verdict == "failed"
    assert v.excess_mm == pytest.approx(0.003, abs=1e-6)
    assert v.excess_at == pytest.approx((-10.0, -8.003), abs=0.051)


def test_a_rapid_through_stock_is_placed():
    # back from the first pass at depth, in a straight line across the corner that it just went round
    v = verify(plan(retract=Z), finish_rows(), stock=None, wall=[], passes=[])
    assert v.verdict == "failed"
    assert len(v.rapids) == 1
    # still inside the slot of the last line at first
    x, y = v.rapids[0]
    start, end = np.array([2.9, 38.0]), np.array([-38.0, -2.9])
    assert np.cross(np.append(end - start, 0), np.append([x, y] - start, 0))[2] == pytest.approx(0.0, abs=1e-9)
    assert np.hypot(*([x, y] - start)) <= 0.1
    assert v.reasons[0].startswith("rapid through stock at (")


def test_the_same_rapid_in_the_open_pocket_is_none():
    assert verify(plan(retract=Z), finish_rows()).verdict == "proved"


def test_a_rapid_plunge_into_stock():
    p = program([(RAPID, 0, 0, SAFE, 0, 0), (RAPID, 0, 0, Z, 0, 0), (LINE, 20, 0, Z, 0, 0)])
    v = verify(p, {k: c[:0] for k, c in finish_rows().items()}, stock=None, wall=[])
    assert v.verdict == "failed"
    assert v.rapids == ((0.0, 0.0),)


def test_a_wrong_engagement_is_placed():
    rows = finish_rows()
    rows["engagement_deg"] = rows["engagement_deg"].copy()
    rows["engagement_deg"][57] += 0.02
    v = verify(plan(), rows, engagement_tolerance_deg=0.01)
    assert v.verdict == "failed"
    assert v.engagement_difference_deg == pytest.approx(0.02, abs=1e-5)
    assert v.engagement_at == (rows["x_mm"][57], rows["y_mm"][57])
    assert "engagement differs by 0.02" in v.reasons[0]


def test_a_row_compared_the_path_fails():
    rows = finish_rows()
    rows["y_mm"] = rows["y_mm"].copy()
    rows["y_mm"][10] += 1e-3
    v = verify(plan(), rows)
    assert v.verdict == "failed"
    assert "history row 10 at" in v.reasons[0]


def test_two_levels():
    upper, rows = plan(), finish_rows()
    z = upper.p_work.copy()
    z[z[:, 2] == Z, 2] *= 2
    lower = Program(**{**upper.__dict__, "p_work": z})
    both = Program.join([upper, lower])
    twice = {k: np.concatenate([c, c]) for k, c in rows.items()}
    twice["z_mm"] = np.repeat([Z, 2 * Z], len(rows["x_mm"]))
    v = verify(both, twice)
    assert v.reasons == ()
    assert v.compared == 2 * len(rows["x_mm"])


def test_stopped_or_not_comparable_is_unproven():
    def stop(done, what):
        if done > 0.2:
            raise Cancelled("enough")

    rows = finish_rows()
    assert verify(plan(), rows, progress=stop).verdict == "unproven"
    assert verify(plan(), rows, passes=["pocket"]).reasons == ("no row of the history was compared",)
    ramp = program([(RAPID, 0, 0, SAFE, 0, 0), (LINE, 10, 0, Z, 0, 0), (LINE, 20, 0, Z, 0, 0)])
    one = {k: c[:1].copy() for k, c in rows.items()}
    one["x_mm"][0], one["y_mm"][0], one["z_mm"][0] = 8.0, 0.0, SAFE + 0.8 * (Z - SAFE)
    v = verify(ramp, one, stock=None, wall=[])
    assert v.verdict == "unproven"
    assert "1 rows on rising or falling motions, the first at (8.0000, 0.0000)" in v.reasons[0]


def test_refused():
    rows = finish_rows()
    with pytest.raises(InputError, match="gouge_tolerance_mm = 0: must be above 0"):
        verify(plan(), rows, gouge_tolerance_mm=0.0)
    del rows["pass"]
    with pytest.raises(InputError, match="column pass is missing"):
        verify(plan(), rows)


def test_a_row_at_a_kink_is_held_against_both_headings(monkeypatch):
    """Two slots at right angles: leaving the corner the rim is engaged over 90 deg, arriving over 180."""
    p = program([(RAPID, 0, 0, SAFE, 0, 0), (LINE, 0, 0, Z, 0, 0), (LINE, 30, 0, Z, 0, 0), (LINE, 30, 30, Z, 0, 0)])

    def row(angle):
        return {
            "x_mm": np.array([20.0, 30.0, 30.0]),
            "y_mm": np.array([0.0, 0.0, 20.0]),
            "z_mm": np.full(3, Z),
            "engagement_deg": np.array([180.0, angle, 180.0]),
            "pass": np.full(3, "pocket", dtype=object),
        }

    looked = []
    closely = verify_module._difference
    monkeypatch.setattr(verify_module, "_difference", lambda *args: looked.append(len(args[1])) or closely(*args))

    def check(angle):
        looked.clear()
        return verify(p, row(angle), stock=None, wall=[], engagement_tolerance_deg=0.01)

    assert check(180.0).verdict == "proved"
    assert looked == []  # it agrees on the first side
    assert check(90.0).verdict == "proved"
    assert looked == [1]
    assert check(135.0).engagement_difference_deg == pytest.approx(45.0, abs=0.01)
    assert looked == [1, 1]


def film_planned_as(angle, thickness):
    """Two passes along one another, the second ``thickness`` deeper: a third along it the plan says ``angle``."""
    p = program(
        [
            (RAPID, 0, 0, SAFE, 0, 0),
            (LINE, 0, 0, Z, 0, 0),
            (LINE, 30, 0, Z, 0, 0),
            (LINE, 30, 0, SAFE, 0, 0),
            (RAPID, 0, -thickness, SAFE, 0, 0),
            (LINE, 0, -thickness, Z, 0, 0),
            (LINE, 30, -thickness, Z, 0, 0),
        ]
    )
    rows = {
        "x_mm": np.array([15.0, 10.0]),
        "y_mm": np.array([0.0, -thickness]),
        "z_mm": np.full(2, Z),
        "engagement_deg": np.array([180.0, angle]),
        "pass": np.full(2, "pocket", dtype=object),
    }
    return verify(p, rows, stock=None, wall=[], engagement_tolerance_deg=0.01)


def test_only_films_that_a_displacement_makes_are_forgiven():
    """Stock of 0.1 um beside the cutter is 0.362 deg at R = 5 and counts; stock of 0.5 nm, which a displacement by 1 nm
    makes or takes, does not: it may be planned as 0 or as acos(1 - 0.5 nm / R) = 0.026 deg, not as 0.05 deg.
    """
    thin = math.degrees(math.acos(1.0 - 1e-4 / R))
    assert film_planned_as(thin, 1e-4).verdict == "proved"
    missed = film_planned_as(0.0, 1e-4)
    assert missed.verdict == "failed"
    assert missed.engagement_difference_deg == pytest.approx(thin, abs=1e-4)
    for angle in (0.0, math.degrees(math.acos(1.0 - 5e-7 / R))):
        assert film_planned_as(angle, 5e-7).verdict == "proved"
    # stock on the right displaced one way, on the left the other way
    beyond = sum(math.degrees(math.acos(1.0 - t / R)) for t in (MATCH_MM + 5e-7, MATCH_MM - 5e-7))
    assert film_planned_as(beyond + 0.009, 5e-7).verdict == "proved"
    assert film_planned_as(beyond + 0.011, 5e-7).verdict == "failed"


def test_the_edge_of_the_stock_is_displaced_too():
    """The rim runs along the straight edge of the stock, 0.5 nm deep in it: planned as nothing or as that, no more; a
    depth of 0.1 um counts.
    """

    def check(angle, depth):
        p = program([(RAPID, 0, 0, SAFE, 0, 0), (LINE, 0, 0, Z, 0, 0), (LINE, 30, 0, Z, 0, 0)])
        rows = {
            "x_mm": np.array([15.0]),
            "y_mm": np.array([0.0]),
            "z_mm": np.full(1, Z),
            "engagement_deg": np.array([angle]),
            "pass": np.full(1, "pocket", dtype=object),
        }
        edge = depth - R
        box = Contour.polyline([(-20, -30), (50, -30), (50, edge), (-20, edge)], closed=True)
        return verify(p, rows, stock=Region.of([box]), wall=[], engagement_tolerance_deg=0.01).verdict

    thin = math.degrees(math.acos(1.0 - 5e-7 / R))
    assert check(0.0, 5e-7) == check(thin, 5e-7) == "proved"
    assert check(0.1, 5e-7) == check(0.0, 1e-4) == "failed"


@pytest.mark.parametrize("aside", [0.5, 0.003, 0.0006])
@pytest.mark.parametrize("angle", [0.0, 20.0, 36.87])
def test_a_place_that_the_cutter_comes_back_to(aside, angle):
    """A pass of radial depth 1 mm stops, goes back by ``aside`` and comes 2 nm beyond its end: the rim lies on the edge
    that it has just cut, and its engagement is anything from nothing to acos(1 - 1 / 5) = 36.87 deg.
    """
    p = program(
        [
            (RAPID, -20, 1, SAFE, 0, 0),
            (LINE, -20, 1, Z, 0, 0),
            (LINE, 30, 1, Z, 0, 0),
            (LINE, 30, 1, SAFE, 0, 0),
            (RAPID, -20, 0, SAFE, 0, 0),
            (LINE, -20, 0, Z, 0, 0),
            (LINE, 0, 0, Z, 0, 0),
            (LINE, -aside, 0, Z, 0, 0),
            (LINE, 2e-9, 0, Z, 0, 0),
            (LINE, 10, 0, Z, 0, 0),
        ]
    )

    def check(planned, end=36.87):
        rows = {
            "x_mm": np.array([-10.0, 0.0, -aside, 2e-9, 5.0]),
            "y_mm": np.zeros(5),
            "z_mm": np.full(5, Z),
            "engagement_deg": np.array([36.87, 36.87, 0.0, planned, end]),
            "pass": np.full(5, "pocket", dtype=object),
        }
        return verify(p, rows, stock=None, wall=[], engagement_tolerance_deg=0.5)

    assert check(angle).verdict == "proved"
    for wrong in (check(37.5), check(angle, 36.2)):
        assert wrong.verdict == "failed"
        assert wrong.engagement_difference_deg == pytest.approx(0.65, abs=0.03)
