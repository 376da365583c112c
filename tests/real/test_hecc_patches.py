"""Patches of NASA's HECC impeller: each point of each patch against the gouge test of the source."""

import os
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import check_sections, loft, read_meridian, read_sections
from chipload.planning.impeller.answer import largest_cutters
from chipload.planning.impeller.compare import cutter_choices, gouges
from chipload.planning.impeller.costs import ChannelSide, Terms
from chipload.planning.impeller.impeller import Impeller

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
FOLDER = DATA / "blades/nasa_hecc/HECC_Vaned_Configuration/Coordinates"
FOLDER = FOLDER / "HECC Design-Intent Stage Coordinates (Hot, No Fillets)"
OUTER = 431.5

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no {FOLDER}")

LONG = [CatalogueCutter(d, 1.0, 2.0 * d, d - 0.4, 90.0, max(d, 10.0), 110.0, 28.0) for d in (6.0, 8.0, 12.0, 16.0)]
TABLES = np.radians([30.0, 45.0, 60.0, 75.0, 90.0])


def test_patches_of_blade_and_splitter():
    hub, shroud = (
        read_meridian(FOLDER / f"HECCvanedCoordinates_flowpathCoordinates_{name}.txt", "inch", over=True)
        for name in ("hub", "shroud")
    )
    kinds = [sorted(FOLDER.glob(f"*impeller_{kind}_blade_section_*.txt")) for kind in ("main", "splitter")]
    blades = [loft(check_sections(read_sections(k, "inch", True, "X R*THETA R"), OUTER)) for k in kinds]
    impeller = Impeller(*blades, Revolved(hub, 1), Revolved(shroud, -1), 15)
    u, v = np.linspace(0.05, 0.95, 6), np.linspace(0.25, 0.95, 4)
    sides = []
    for body, side in ((0, "plus"), (1, "minus")):
        scene = impeller.scene(body, side, (u, v), (50, 20), 2.0, 1, (50, 12), (0.4, 0.75))
        grid = scene.contact.reshape(6, 4, 3)
        area = np.linalg.norm(np.cross(np.gradient(grid, axis=0), np.gradient(grid, axis=1)), axis=2).ravel()
        answer = largest_cutters(scene, Catalogue("long", tuple(LONG)), TABLES, 0.5)
        sides.append(ChannelSide(body, side, scene, u, v, area, answer, 0.5))
    choices = cutter_choices(sides, Terms(10.0, 0.05, 60.0, 30.0, 15), 0, (1, 2))
    ways = [choice.partition() for choice in choices]
    totals = [w.divided.total for w in ways]
    # the hand-picked one reaches the same points here, and is one of the catalogue
    assert [w.share for w in ways[1:]] == [ways[0].share] * 2
    assert all(a >= b for a, b in pairwise(totals))
    for way in ways:
        found = way.divided
        assert found.bound_any_shape <= found.bound <= found.total
        for p in found.patches:
            side = sides[p.body]
            for (pu, pv), rows in zip(p.at, p.ranges, strict=True):
                c = int(np.abs(u - pu).argmin() * len(v) + np.abs(v - pv).argmin())
                assert (len(rows) > 0) == (side.answer.cutter[c] >= 0)
                for lo, hi in rows:
                    assert gouges(side.scene, c, way.catalogue.cutters[p.cutter], p.table, 0.5 * (lo + hi), 0.5) is None
