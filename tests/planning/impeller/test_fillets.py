"""Fillets in the search: a straight channel in closed form, the paper's gouge test on dense fillets by formula."""

import math

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch, patch_through
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade, face_patch
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.closed_form import axis_at, rho_limits
from chipload.planning.impeller.compare import gouges
from chipload.planning.impeller.fillets import with_fillets
from chipload.planning.impeller.floor import patch_of
from chipload.planning.impeller.impeller import ARC, FILLET, SUNK, Impeller
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.surfaces import ContactSampling, surface_of

RADIUS = 3.0


def plane(y: float, sign: float) -> BSplinePatch:
    grid = np.array([[[20.0, y, 0.0], [20.0, y, 30.0]], [[60.0, y, 0.0], [60.0, y, 30.0]]])
    return face_patch(patch_through(grid, [0.0, 1.0], [0.0, 1.0]), sign)


@pytest.fixture(scope="module")
def flat() -> Impeller:
    """Four plates of 2 x 30 mm that stand radially on a disc, with fillets."""
    hub, shroud = (Revolved(np.array([[10.0, z], [70.0, z]]), w) for z, w in ((0.0, 1), (30.0, -1)))
    plain = Impeller(Blade(plane(1.0, 1.0), plane(-1.0, -1.0)), None, hub, shroud, 4)
    made, said = with_fillets(plain, RADIUS)
    assert said[0].startswith("blade plus fillet: 3 mm, up to 3 mm of the side are under it")
    return made


def test_what_the_fillets_take(flat):
    """Sides begin 3 mm up, floors 3 mm from the sides; fillets are quarters of cylinders."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9), indexing="ij"))
    assert flat.blade.plus.at(u, 0.0)[:, 2] == pytest.approx(3.0)
    p = flat.fillet(0).plus.at(u, v)
    assert np.hypot(p[:, 1] - 4.0, p[:, 2] - 3.0) == pytest.approx(3.0, abs=1e-6)
    q = flat.fillet(1).minus.at(u, v)
    assert np.hypot(q[:, 0] - 4.0, q[:, 2] - 3.0) == pytest.approx(3.0, abs=1e-6)
    s = np.linspace(0.2, 0.8, 13)
    r = flat.hub.curve(s)[:, 0]
    theta = flat.across(0, s, [0.0, 1.0])
    # of the foot at y = 4 by the table of 201 places along it
    assert r * np.sin(theta[:, 0]) == pytest.approx(4.0, abs=2e-3)
    assert r * np.cos(theta[:, 1]) == pytest.approx(4.0, abs=2e-3)


def test_check_points_lie_on_the_fillets(flat):
    scene = flat.scene(0, "plus", ([0.5], [0.5]), (11, 9), 2.0)
    own = scene.check[scene.check_surface == FILLET]
    facing_ = scene.check[scene.check_surface == FILLET + 1]
    assert len(own) == len(facing_) == 11 * ARC
    assert np.hypot(own[:, 1] - 4.0, own[:, 2] - 3.0) == pytest.approx(3.0 + SUNK, abs=1e-6)
    assert np.hypot(facing_[:, 0] - 4.0, facing_[:, 2] - 3.0) == pytest.approx(3.0 + SUNK, abs=1e-6)
    # eight sides are in the scene, each with its fillet
    assert len({n for n in scene.check_surface.tolist() if n >= FILLET}) == 8


@pytest.mark.parametrize(
    ("corner", "height", "clear"),
    [(2.0, 3.0, True), (3.0, 3.3, True), (3.4, 3.0, False), (4.0, 3.5, False), (4.0, 4.3, True), (6.0, 5.0, False)],
)
def test_upright_cutters_above_a_fillet(flat, corner, height, clear):
    """A corner greater than the fillet must stay its own radius above the floor, any other comes down to the fillet."""
    up = (height - RADIUS) / 27.0
    scene = flat.scene(0, "plus", ([0.413, 0.587], [up]), (41, 31), 2.0, hub_points=(61, 61), hub_range=(0.17, 0.83))
    answer = largest_cutters(scene, Catalogue("one", (CatalogueCutter(12.0, corner),)), [math.radians(1.0)], 0.0)
    assert (answer.cutter >= 0).tolist() == [clear, clear]


@pytest.mark.parametrize("lean", [0.0, 0.3, 1.0])
def test_only_a_corner_of_its_radius_comes_down_to_a_fillet(flat, lean):
    """Where the side begins, by the fillet alone, whichever way the axis leans from the wall: a corner of 3 mm, not of
    3.1."""
    scene = flat.scene(0, "plus", ([0.413], [0.0]), (401, 3), 2.0)
    T = np.array([0.2 * math.sin(lean), math.sin(lean), math.cos(lean)])
    own = scene.check[scene.check_surface == FILLET]
    for corner, fits in ((1.0, True), (3.0, True), (3.1, False), (5.0, False)):
        least = rho_limits(own, scene.contact[0], [0.0, 1.0, 0.0], T / np.linalg.norm(T), corner).min()
        assert (least > 0.0) == fits


@pytest.mark.parametrize(("corner", "clear"), [(1.0, True), (2.0, True), (2.9, True), (3.1, False), (4.0, False)])
def test_the_fillet_is_milled_where_its_radius_fits(flat, corner, clear):
    surface = surface_of(flat, "blade", "plus fillet", ContactSampling((0.3, 0.7), (0.3, 0.7), (3, 3), 2.0, 1.0))
    assert surface.name == "blade plus fillet"
    assert np.unique(surface.scene.surface).tolist() == [FILLET]
    answer = largest_cutters(surface.scene, Catalogue("one", (CatalogueCutter(8.0, corner),)), [0.0], 0.0)
    assert ((answer.cutter >= 0) == clear).all()
    assert len(answer.unreachable) == (0 if clear else 9)


def test_a_floor_on_a_twisted_impeller_holds_on_dense_fillets():
    """Of each cutter found the paper's own test finds no gouge on dense points of the fillets, but for what lies
    between check points; without fillets among those it does."""
    made, _ = with_fillets(impeller_of(ImpellerShape()), 6.0)
    tables = np.radians([20.0, 45.0])
    sizes = Catalogue("some", tuple(CatalogueCutter(d, 2.0) for d in (6.0, 10.0, 14.0, 20.0)))
    floor = surface_of(made, "blade", "floor", ContactSampling((0.2, 0.8), (0.03, 0.97), (4, 5), 2.0, 2.0)).scene
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 161), np.linspace(0.01, 0.99, 31), indexing="ij"))
    check = np.concatenate([made.foot(k, w).at(u, v) for k, w in ((0, 1), (1, -1), (0, -1), (1, 1))])
    dense = Scene(floor.contact, floor.normal, floor.curvature, floor.surface, check, np.full(len(check), FILLET), 2.0)
    bare = floor.check_surface < FILLET
    without = Scene(
        floor.contact, floor.normal, floor.curvature, floor.surface, floor.check[bare], floor.check_surface[bare], 2.0
    )
    worst = []
    for scene in (floor, without):
        answer = largest_cutters(scene, sizes, tables, 0.0)
        depth = [0.0]
        for k in np.flatnonzero(answer.cutter >= 0):
            cutter, table = sizes.cutters[answer.cutter[k]], float(tables[answer.table[k]])
            for B in (float(B) for a, b in answer.ranges[k] for B in np.linspace(a, b, 7)[1:-1]):
                if 0.0 <= floor.normal[k] @ axis_at(table, B) < 1.0:
                    found = gouges(dense, int(k), cutter, table, B)
                    depth.append(0.0 if found is None else found[1])
        assert (answer.cutter >= 0).sum() >= 10
        worst.append(max(depth))
    assert worst[0] < 0.02
    assert worst[1] > 1.0


def test_the_floor_between_fillets(flat):
    floor = patch_of(flat, "blade", "floor")
    p = floor.at(np.full(5, 0.5), np.linspace(0.0, 1.0, 5))
    assert p[0, 1] == pytest.approx(4.0, abs=2e-3)
    assert p[-1, 0] == pytest.approx(4.0, abs=2e-3)
    fillet = patch_of(flat, "blade", "minus fillet")
    assert fillet.at(0.5, 1.0)[0, 1:] == pytest.approx([-1.0, 3.0])


def test_too_large():
    """On a cylinder of radius R the foot of a fillet is asin((t/2 + a) / (R + a)) from the middle of the blade."""
    shape, a = ImpellerShape(), 16.0
    _, said = with_fillets(impeller_of(shape), a)
    half = math.asin((0.5 * shape.thickness + a) / (shape.hub_radius + a))
    least = 2.0 * shape.hub_radius * (math.pi / shape.blades - half)
    assert float(said[-1].removeprefix("floor: at least ").split()[0]) == pytest.approx(least, abs=0.02)
    narrow = ImpellerShape(channel=12.0, blades=19)

    with pytest.raises(InputError) as caught:
        with_fillets(impeller_of(narrow), 8.0)
    half = math.asin((0.5 * narrow.thickness + 8.0) / (narrow.hub_radius + 8.0))
    over = 2.0 * narrow.hub_radius * (half - math.pi / narrow.blades)
    text = str(caught.value)
    assert text.startswith("impeller.fillet_mm = 8: larger than half of the channel: two fillets overlap by ")
    assert float(text.split("overlap by ")[1].split()[0]) == pytest.approx(over, abs=0.02)
    assert text.endswith(" mm on the hub: state a smaller one")
