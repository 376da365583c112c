"""Every real DXF is read, or refused with a clear line; its inset by 1 mm agrees with shapely's."""

import os
from pathlib import Path

import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from chipload.geometry.contour import Region
from chipload.geometry.distance import distance
from chipload.geometry.dxf import read_dxf
from chipload.geometry.offset import offset_region

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
FILES = sorted(p for p in DATA.rglob("*") if p.suffix.lower() == ".dxf")
NOT_READ = {"text.dxf": "dxf_trimesh", "tray-easy1.dxf": "dxf_trimesh"}

pytestmark = pytest.mark.skipif(not FILES, reason=f"no DXF files under {DATA}: set CHIPLOAD_DATA")


def name(path):
    return str(path.relative_to(DATA))


def regions(drawing):
    """Layer by layer the closed contours, where none crosses itself or another."""
    for layer in sorted(set(drawing.layers)):
        closed = [c for c, on in zip(drawing.contours, drawing.layers, strict=True) if on == layer and c.closed]
        rings = [shapely.Polygon(c.flatten(1e-3)) for c in closed]
        lines = [r.exterior for r in rings]
        met = shapely.STRtree(lines).query(lines, predicate="intersects") if lines else np.zeros((2, 0))
        if closed and all(r.is_valid for r in rings) and met.shape[1] == len(lines):
            yield Region.of(closed)


@pytest.mark.parametrize("path", FILES, ids=name)
def test_it_is_read_or_refused_and_its_inset_is_that_of_shapely(path):
    if NOT_READ.get(path.name) == path.parent.name:
        with pytest.raises(InputError, match=r"no lines or arcs; layers there are: "):
            read_dxf(path, units_if_unstated="mm")
        return
    drawing = read_dxf(path, units_if_unstated="mm")
    assert len(drawing.contours) == len(drawing.layers) > 0
    for region in regions(drawing):
        inset = offset_region(region, 1.0)
        length = sum(c.length for c in inset.contours)
        want = np.array([region.flatten(f).buffer(-1.0, quad_segs=32).area for f in (1e-3, 1e-4)])
        assert np.abs(want - inset.area).min() <= 2e-3 * (length + 1.0)
        if inset.contours:
            p = np.vstack([c.at(np.linspace(0.0, c.length, 100))[0] for c in inset.contours])
            assert np.abs(distance(region.segments, p) - 1.0).max() < 1e-8
            opened = offset_region(inset, -1.0)
            assert opened.area <= region.area * (1 + 1e-9)
            assert offset_region(opened, 1.0).area == pytest.approx(inset.area, rel=1e-9)
