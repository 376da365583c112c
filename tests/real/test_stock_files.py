"""Real STL and STEP parts as layered stock: read, or refused with a clear line; their volumes."""

from __future__ import annotations

import os
from pathlib import Path

import manifold3d
import numpy as np
import pytest
import shapely
import trimesh

from chipload.errors import InputError
from chipload.geometry.mesh import read_mesh
from chipload.stock.layers import LayeredStock

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
FILES = sorted(p for p in (DATA / "cad").rglob("*") if p.suffix.lower() in (".stl", ".stp", ".step") and p.is_file())
#: meshes that are not closed, with the number of their open edges
OPEN = {"demo.stl": 196, "Interface-glue.STL": 4}
#: meshes that hold each body twice
TWICE = ("cone_on_side.stl",)

pytestmark = pytest.mark.skipif(not FILES, reason=f"no STL and STEP files under {DATA}: set CHIPLOAD_DATA")


def joined_volume(path: Path, part: trimesh.Trimesh) -> float:
    """Volume of the union of the bodies of a file, by Manifold; of the mesh where it takes that for no solid."""
    if path.name in TWICE:
        return 0.5 * float(part.volume)
    bodies = [
        manifold3d.Manifold(manifold3d.Mesh64(np.asarray(b.vertices), np.asarray(b.faces, dtype=np.uint64)))
        for b in part.split(only_watertight=False)
    ]
    if any(b.status() != manifold3d.Error.NoError or b.volume() <= 0.0 for b in bodies):
        return float(part.volume)
    return float(manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add).volume())


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(DATA)))
def test_it_is_read_or_refused_and_its_layers_have_its_volume(path: Path) -> None:
    if path.name in OPEN:
        with pytest.raises(InputError, match=f"the mesh is not closed: {OPEN[path.name]} open edges"):
            read_mesh(path, unit="mm", chord_mm=0.2)
        return
    part = read_mesh(path, unit="mm", chord_mm=0.2)
    low, high = part.bounds
    # faces are met at random by the bounds of layers: the error of a flat one is half a layer of it
    layers = 40
    thick = float(high[2] - low[2]) / layers
    stock = LayeredStock.of_mesh(part, thick, float(np.hypot(*(high - low)[:2])) / 5.0)
    volume = joined_volume(path, part)
    flat = np.abs(part.face_normals[:, 2]) > 0.999
    slack = 0.5 * thick * part.area_faces[flat].sum() + 0.002 * volume
    assert stock.volume() == pytest.approx(volume, abs=slack)
    levels = np.unique(np.round(part.triangles[flat][:, :, 2].ravel(), 9))
    if len(levels) < 60:
        stock.refine_at(levels)
        assert stock.volume() == pytest.approx(volume, rel=0.004)
    whole = stock.volume()
    x, y = 0.5 * (low + high)[:2]
    shape = shapely.Point(x, y).buffer(0.2 * float(np.hypot(*(high - low)[:2])))
    chips = stock.remove_many(range(stock.layers), [shape] * stock.layers)
    areas = np.array([sum(c.area for c in each) for each in chips])
    assert float(areas @ stock.thickness) + stock.volume() == pytest.approx(whole, rel=1e-12)
