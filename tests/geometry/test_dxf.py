"""Drawings written by ezdxf come back as the contours that were drawn."""

import ezdxf
import numpy as np
import pytest

from chipload.geometry.dxf import read_dxf


@pytest.fixture
def draw(tmp_path):
    """Calls ``fill(modelspace, doc)`` and reads the file back."""

    def make(fill, header=4, **keys):
        doc = ezdxf.new("R2010", units=header)
        fill(doc.modelspace(), doc)
        path = tmp_path / "part.dxf"
        doc.saveas(path)
        return read_dxf(path, **keys)

    return make


def test_lines_and_an_arc_join_to_one_contour(draw):
    def fill(msp, _):
        msp.add_line((0, 0), (10, 0))
        msp.add_arc((10, 2), 2, -90, 90)
        msp.add_line((10, 4), (0, 4))
        msp.add_line((0, 0), (0, 4))

    drawing = draw(fill)
    (c,) = drawing.contours
    assert c.area == pytest.approx(40.0 + 2.0 * np.pi, abs=1e-9)
    assert (drawing.layers, drawing.units, drawing.findings) == (("0",), "mm", ())


def test_bulges_circles_and_inches(draw):
    def fill(msp, doc):
        doc.layers.add("cut")
        msp.add_lwpolyline([(0, 0, 0), (1, 0, 1), (1, 1, 0), (0, 1, 0)], format="xyb", close=True)
        msp.add_circle((0.5, 0.5), 0.25, dxfattribs={"layer": "cut"})

    drawing = draw(fill, header=1)
    assert drawing.units == "inch"
    assert drawing.contours[0].area == pytest.approx((1 + np.pi / 8) * 25.4**2, abs=1e-9)
    assert drawing.contours[1].radii[0] == pytest.approx(6.35, abs=1e-12)
    only = draw(fill, header=1, layers=["CUT"])
    assert only.layers == ("cut",)


def test_units_are_overridden_with_a_finding_and_taken_where_unsaid(draw):
    def fill(msp, _):
        msp.add_circle((0, 0), 1)

    over = draw(fill, header=4, units="inch")
    assert over.contours[0].radii[0] == pytest.approx(25.4)
    assert [(f.code, f.text) for f in over.findings] == [
        ("dxf-units", "the header states mm; read as inch, as part.units states")
    ]
    unsaid = draw(fill, header=0, units_if_unstated="cm")
    assert unsaid.contours[0].radii[0] == pytest.approx(10.0)
    assert [f.text for f in unsaid.findings] == ["the header names no unit: read as cm"]
    assert draw(fill, header=4, units_if_unstated="cm").contours[0].radii[0] == 1.0


def test_what_is_seen_from_below_is_mirrored(draw):
    below = {"extrusion": (0, 0, -1)}

    def fill(msp, _):
        msp.add_arc((10, 0), 2, 0, 90, dxfattribs=below)
        msp.add_circle((20, 1), 1, dxfattribs=below)
        msp.add_lwpolyline([(30, 0, 1), (32, 0, 0)], format="xyb", dxfattribs=below)

    arc, circle, poly = draw(fill).contours
    assert np.allclose([*arc.start, *arc.end], [-12, 0, -10, 2])
    assert arc.segments[0, 6] == pytest.approx(-np.pi / 2)
    assert np.allclose(circle.segments[0, 4:6], [-20, 1])
    assert np.allclose([*poly.start, *poly.end], [-30, 0, -32, 0])
    assert np.allclose(poly.at(poly.length / 2)[0], [[-31, -1]])


def test_layers_that_are_off_or_frozen_are_read_only_by_name(draw):
    def fill(msp, doc):
        for name, at in (("part", 0.0), ("old", 20.0), ("help", 40.0)):
            doc.layers.add(name)
            msp.add_circle((at, 0.0), 5.0, dxfattribs={"layer": name})
        doc.layers.get("old").off()
        doc.layers.get("help").freeze()

    drawing = draw(fill)
    assert drawing.layers == ("part",)
    assert [f.text for f in drawing.findings] == [
        "layer 'help' is frozen: 1 entity not read; part.layers = ['help'] reads it",
        "layer 'old' is off: 1 entity not read; part.layers = ['old'] reads it",
    ]
    assert sorted(draw(fill, layers=["old", "part"]).layers) == ["old", "part"]


def test_blocks_are_exploded_where_they_stand(draw):
    def fill(msp, doc):
        inner = doc.blocks.new("hole")
        inner.add_circle((0, 0), 1)
        outer = doc.blocks.new("pair")
        outer.add_blockref("hole", (0, 0))
        outer.add_blockref("hole", (5, 0), dxfattribs={"xscale": 2, "yscale": 2})
        msp.add_blockref("pair", (100, 0), dxfattribs={"rotation": 90, "layer": "holes"})
        msp.add_blockref("hole", (0, 50), dxfattribs={"column_count": 3, "column_spacing": 10})

    drawing = draw(fill)
    found = sorted(
        (round(c.segments[0, 4], 6), round(c.segments[0, 5], 6), round(c.radii[0], 6)) for c in drawing.contours
    )
    assert found == [(0, 50, 1), (10, 50, 1), (20, 50, 1), (100, 0, 1), (100, 5, 2)]
    assert sorted(drawing.layers) == ["0", "0", "0", "holes", "holes"]


@pytest.mark.parametrize("tolerance", [0.1, 0.001])
def test_ellipses_stay_within_the_tolerance(draw, tolerance):
    drawing = draw(lambda msp, _: msp.add_ellipse((3, 4), (20, 0), 0.3), tolerance_mm=tolerance)
    (c,) = drawing.contours
    assert c.closed
    p = c.at(np.linspace(0, c.length, 3000))[0] - (3, 4)
    miss = np.abs(np.hypot(p[:, 0] / 20, p[:, 1] / 6) - 1.0) * 6.0
    assert miss.max() < 1.3 * tolerance
    assert c.area == pytest.approx(120 * np.pi, abs=2 * tolerance * c.length)
    assert len(c.segments) <= 96


def test_splines_stay_within_the_tolerance_of_fine_sampling(draw):
    points = [(0, 0), (10, 15), (25, -5), (40, 10), (45, 0)]
    drawing = draw(lambda msp, _: msp.add_open_spline(points), tolerance_mm=0.002)
    (c,) = drawing.contours
    from ezdxf.math import BSpline

    from chipload.geometry.distance import distance

    fine = np.array([(v.x, v.y) for v in BSpline(points).approximate(5000)])
    assert distance(c.segments, fine).max() < 0.0022
    assert np.allclose([*c.start, *c.end], [0, 0, 45, 0])


def test_a_flat_3d_polyline_is_read_and_text_is_dropped_with_a_finding(draw):
    def fill(msp, _):
        msp.add_polyline3d([(0, 0, 5), (4, 0, 5), (4, 4, 5)], close=True)
        msp.add_text("hello")
        msp.add_point((1, 1))

    drawing = draw(fill)
    assert drawing.contours[0].area == pytest.approx(8.0)
    assert [f.text for f in drawing.findings] == [
        "1 POINT on layer '0' dropped: not a line",
        "1 TEXT on layer '0' dropped: not a line",
    ]


def test_a_damaged_file_is_recovered_with_a_finding(tmp_path):
    path = tmp_path / "cut_off.dxf"
    lines = "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\n0.0\n20\n0.0\n11\n5.0\n21\n0.0\n0\nENDSEC\n"
    path.write_text("999\nno header\n" + lines.replace("10\n", "x10\n") + "0\nEOF\n")
    drawing = read_dxf(path, units="mm")
    assert any(f.code == "dxf-recovered" for f in drawing.findings)
