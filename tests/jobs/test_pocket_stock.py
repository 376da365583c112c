"""Rest machining from the stock of an earlier result: what stands in `stock.npz`, whoever cut it."""

from __future__ import annotations

import math

import pytest
import shapely

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from pocket_job import SQUARE, checked, done, operation, swept, written

BOX = shapely.box(*SQUARE[0], *SQUARE[2])
#: what a cutter of R 4 mm clears of the square, and a lump that it left on the floor, in the lower layer alone
CLEARED = shapely.buffer(shapely.buffer(BOX, -4.0), 4.0, quad_segs=200)
LUMP = shapely.box(12.0, 10.0, 15.0, 13.0)


def stock(folder, bounds=(-8.0, -4.0, -2.0, 0.0), lump=LUMP):
    """A block with the square pocket in it, 4 mm deep."""
    body = LayeredStock.block((-10.0, -10.0, bounds[0]), (40.0, 34.0, bounds[-1]), list(bounds), 20.0)
    for k in range(body.layers):
        if body.heights[k] > -4.0:
            body.remove(k, shapely.difference(CLEARED, lump) if k == 1 else CLEARED)
    body.save(folder / "stock.npz")


def job(folder, more="", part="", top="0.0", file="stock.npz"):
    path = written(folder, {"0": [SQUARE]}, operation(f"radial_depth_mm = 0.6\n{more}", cutter=2), part=part)
    path.write_text(path.read_text().replace("top_mm = 0.0", f'top_mm = {top}\nfile = "{file}"'))
    return path


def test_the_corners_and_the_lump_are_cut(tmp_path):
    """Four corners, of which a cutter of R 2.5 mm leaves its own: (4 - pi) (16 - 6.25) mm2, and the lump of 9 mm2."""
    stock(tmp_path)
    (strategy,), _ = done(job(tmp_path))
    corners = (4.0 - math.pi) * (16.0 - 6.25)
    summary = strategy.summary
    assert summary["reachable_mm2"] == pytest.approx(corners + LUMP.area, abs=0.3)  # with a margin around the lump
    assert summary["leftover_mm2"] < 0.05 * corners + 0.3  # in the tips of the corners, as behind rest_of
    assert summary["engagement_deg"]["max"] <= summary["engagement_deg"]["wanted"] + 0.01
    gone = swept(strategy.program, 2.5, -4.0)
    reach = shapely.buffer(shapely.buffer(BOX, -2.5), 2.5, quad_segs=200)
    missed = shapely.difference(shapely.difference(reach, CLEARED), gone).area
    assert missed < summary["leftover_mm2"] + 0.05
    assert shapely.difference(LUMP, gone).area < 1e-6
    assert shapely.difference(gone, BOX).area < 1e-3
    assert summary["lengths_mm"]["cut"] < 300.0  # the walls that are finished are not run along
    assert summary["lengths_mm"]["entry"] == 0.0


def test_nothing_is_left(tmp_path):
    """A stock in which the whole square is open."""
    body = LayeredStock.block((-10.0, -10.0, -8.0), (40.0, 34.0, 0.0), [-8.0, -4.0, 0.0], 20.0)
    body.remove(1, BOX)
    body.save(tmp_path / "stock.npz")
    with pytest.raises(InputError, match="nothing is left for the cutter to clear"):
        done(job(tmp_path))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"more": "depth_mm = 3.0"}, "the floor of the pocket at -3 mm lies within its layer from -4 to -2 mm"),
        ({"top": "-2.0", "more": "depth_mm = 2.0"}, "stock.top_mm = -2: stock.npz holds material up to 0 mm"),
        ({"more": "holes_mm = [[15.0, 12.0, 9.0]]"}, "operation.0.holes_mm: leave it out with stock.file"),
        ({"part": 'stock_layers = ["0"]'}, "stock.file and part.stock_layers: state one of them"),
        ({"file": "part.dxf"}, "stock.file = part.dxf: must be the stock.npz of an earlier result"),
    ],
)
def test_refused(changes, message, tmp_path):
    stock(tmp_path)
    with pytest.raises(InputError) as err:
        checked(job(tmp_path, **changes))
    assert message in str(err.value)
