"""NASA's HECC impeller: 15 blades and 15 splitters, sections in inches, hub and shroud."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial import cKDTree

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import check_sections, loft, read_meridian, read_sections
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.impeller import Impeller

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
FOLDER = DATA / "blades/nasa_hecc/HECC_Vaned_Configuration/Coordinates"
FOLDER = FOLDER / "HECC Design-Intent Stage Coordinates (Hot, No Fillets)"
OUTER = 431.5  # 2 x 8.4943 inch, the outermost point of the sections

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no {FOLDER}")


def sections(kind, unit="inch"):
    files = sorted(FOLDER.glob(f"*impeller_{kind}_blade_section_*.txt"))
    return read_sections(files, unit, over=True, columns="X R*THETA R")


@pytest.fixture(scope="module")
def impeller():
    hub, shroud = (
        read_meridian(FOLDER / f"HECCvanedCoordinates_flowpathCoordinates_{name}.txt", "inch", over=True)
        for name in ("hub", "shroud")
    )
    blades = [loft(check_sections(sections(kind), OUTER)) for kind in ("main", "splitter")]
    return Impeller(*blades, Revolved(hub, 1), Revolved(shroud, -1), 15)


def test_a_wrong_unit_is_caught():
    with pytest.raises(InputError, match=r"smaller by 2.538, as inch read as cm"):
        check_sections(sections("main", "cm"), OUTER)


def test_columns_that_a_file_does_not_name_are_not_guessed():
    with pytest.raises(InputError, match=r"main_blade_section_07\.txt: no line names the columns"):
        read_sections(sorted(FOLDER.glob("*impeller_main_blade_section_*.txt")), "inch")


@pytest.mark.parametrize("kind", ["main", "splitter"])
def test_the_loft_keeps_to_the_points(impeller, kind):
    blade = impeller.blade if kind == "main" else impeller.splitter
    u = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 4001))
    start = 0.0
    for p in sections(kind)[::2]:

        def away(v, p=p):
            at = np.concatenate([patch.at(u, v) for patch in (blade.plus, blade.minus)])
            along = np.concatenate([patch.at(u, v, 1, 0) for patch in (blade.plus, blade.minus)])
            along /= np.linalg.norm(along, axis=1)[:, None]
            near = cKDTree(at).query(p)[1]
            gap = p - at[near]
            return np.linalg.norm(gap - (gap * along[near]).sum(axis=1)[:, None] * along[near], axis=1)

        # the section's own v is where its points lie nearest
        v = min(np.clip(start + np.linspace(0.0, 0.3, 16), 0.0, 1.0), key=lambda v: away(v).mean())
        low, high = max(v - 0.02, 0.0), min(v + 0.02, 1.0)
        start = minimize_scalar(lambda v: away(v).mean(), bounds=(low, high), method="bounded").x
        start = min((start, 0.0, 1.0), key=lambda v: away(v).mean())
        # between the places that are read along a side the patch leaves the points a little, most at the blunt edge
        assert np.median(away(start)) < 0.002
        assert away(start).max() < 0.1


def test_it_is_smooth(impeller):
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.05, 0.95, 40), np.linspace(0.0, 1.0, 15)))
    for blade in (impeller.blade, impeller.splitter):
        for patch in (blade.plus, blade.minus):
            # radii of curvature above 25 mm: no waves between the sections
            assert np.abs(patch.principal(u, v)).max() < 0.04


def test_blade_splitter_and_hub_fit_together(impeller):
    # the foot of the first section stands on the hub
    foot = impeller.blade.plus.at(np.linspace(0.1, 0.9, 20), 0.0)
    s = impeller.hub.nearest(np.hypot(foot[:, 0], foot[:, 1]), foot[:, 2], 20001)
    hub = impeller.hub.curve(s)
    gap = np.hypot(np.hypot(foot[:, 0], foot[:, 1]) - hub[:, 0], foot[:, 2] - hub[:, 1])
    assert gap.max() < 0.5
    # the splitter half way round the channel, by the angles of their trailing edges
    at = [b.plus.at(1.0, 0.5)[0] for b in impeller.bodies]
    ahead = np.diff([np.arctan2(p[1], p[0]) for p in at])[0] % impeller.pitch
    assert ahead == pytest.approx(0.5 * impeller.pitch, rel=0.1)


@pytest.mark.parametrize(("body", "side"), [(0, "plus"), (0, "minus"), (1, "plus"), (1, "minus")])
def test_largest_cutters_of_each_side(impeller, body, side):
    s = impeller.scene(
        body, side, (np.linspace(0.05, 0.95, 7), np.linspace(0.2, 0.98, 5)), (60, 25), 2.0, 1, (60, 12), (0.4, 0.75)
    )
    r = 1.0
    sizes = [CatalogueCutter(d, r) for d in (2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0)]
    tables = np.radians(np.arange(20.0, 91.0, 10.0))
    found = largest_cutters(s, Catalogue("shop", tuple(sizes)), tables, 0.0)
    assert found.bounded.all()
    # nothing is dropped: reached, or listed with its reason
    missed = {u.point for u in found.unreachable}
    assert missed == set(np.flatnonzero(found.cutter < 0).tolist())
    for k in np.flatnonzero(found.cutter >= 0)[::4]:
        cutter = found.catalogue.cutters[found.cutter[k]]
        T = axis_at(tables[found.table[k]], found.ranges[k][0].mean())
        n = s.normal[k] @ T
        V = (s.normal[k] - n * T) / np.sqrt(1.0 - n * n)
        a = s.check - (s.contact[k] + r * s.normal[k] + cutter.rho * V - r * T)
        height = a @ T
        away = np.linalg.norm(a - height[:, None] * T, axis=1)
        radius = cutter.rho + np.where(height < r, np.sqrt(np.clip(r * r - (r - height) ** 2, 0.0, None)), r)
        own = (s.check_surface == 0) & (((s.check - s.contact[k]) ** 2).sum(axis=1) < s.near**2)
        assert ((height < 0.0) | (away >= radius - 1e-9) | own).all()
