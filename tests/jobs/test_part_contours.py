"""The contours of a drawing that are milled: which of them, where they lie, and what lies where they cross."""

from __future__ import annotations

import ezdxf
import numpy as np
import pytest
import shapely

from chipload.errors import InputError
from pocket_job import SQUARE, checked, done, operation, swept, written


def job(folder, drawn, part="", more="radial_depth_mm = 1.2"):
    return written(folder, drawn, operation(more), part=part)


def line_added(folder, start, end):
    doc = ezdxf.readfile(folder / "part.dxf")
    doc.modelspace().add_line(start, end)
    doc.saveas(folder / "part.dxf")


def test_squares_that_overlap_are_cleared_where_one_of_them_is(tmp_path):
    """Two squares of 30 by 24 mm, 15 by 12 mm of them common, which stand; no cut goes there or beyond."""
    other = [(x + 15, y + 12) for x, y in SQUARE]
    path = job(tmp_path, {"0": [SQUARE, other]}, more="radial_depth_mm = 1.2\nallowance_mm = 0.1")
    lines, _ = checked(path)
    assert any("1080 mm2" in line for line in lines)
    assert "finding: part: contours meet in 2 places, the first (15, 24)" in "\n".join(lines)
    (strategy,), _ = done(path)
    area = shapely.symmetric_difference(shapely.Polygon(SQUARE), shapely.Polygon(other))
    reach = shapely.buffer(shapely.buffer(area, -4.1, quad_segs=64), 4.0, quad_segs=64)
    cut = swept(strategy.program, 4.0, -4.0)
    assert shapely.difference(cut, shapely.buffer(area, -0.09)).area < 1e-3
    assert shapely.difference(reach, cut).area < 5e-3 * reach.area


def test_lines_that_close_nothing_are_refused_or_dropped(tmp_path):
    path = job(tmp_path, {"0": [SQUARE]})
    line_added(tmp_path, (-5, 12), (35, 12))
    with pytest.raises(InputError, match=r'^contour open at \(35, 12\).*part\.open_chains = "dropped"'):
        checked(path)
    path.write_text(path.read_text().replace('units = "mm"', 'units = "mm"\nopen_chains = "dropped"'))
    lines, _ = checked(path)
    assert any(line.endswith("720 mm2") for line in lines)
    assert "finding: part: 1 open chain dropped, the first from (-5, 12) (part-open)" in lines


def test_only_open_lines_cannot_be_dropped(tmp_path):
    path = job(tmp_path, {"0": []}, part='open_chains = "dropped"')
    line_added(tmp_path, (0, 0), (9, 0))
    with pytest.raises(InputError, match=r"no contour is closed: close them \(part.join_mm\), or drop none"):
        checked(path)


def test_a_part_beyond_the_travel_is_refused_before_it_is_planned(tmp_path):
    """The machine travels 800 mm in X, 500 in Y, wherever its work offset lies."""
    far = [(x + 990.0, y) for x, y in SQUARE]
    assert checked(job(tmp_path, {"0": [far]}))
    wide = [(0, 0), (30, 0), (30, 600), (0, 600)]
    with pytest.raises(
        InputError, match=r"Y from 0 to 600 mm: machine .* travels 500 mm: name a machine with more travel, or check"
    ):
        checked(job(tmp_path, {"0": [wide]}))


def test_the_origin_moves_the_part_and_its_program(tmp_path):
    """A program of a moved drawing is that of the drawing where it was, moved; an arc and its centre with it."""
    round_end = (15, 12, 11.5)
    (here,), _ = done(job(tmp_path, {"0": [round_end]}))
    (tmp_path / "far").mkdir()
    path = job(tmp_path / "far", {"0": [(1015, 512, 11.5)]}, part="origin_mm = [1000.0, 500.0]")
    (there,), _ = done(path)
    a, b = (swept(s.program, 4.0, -4.0) for s in (here, there))
    assert a.area > 200.0
    assert shapely.symmetric_difference(a, b).area < 1e-6 * a.area
    assert np.allclose(here.program.p_work[:5], there.program.p_work[:5])
