"""Drawings that must be refused, each with its exact message."""

import re

import ezdxf
import pytest

from chipload.errors import InputError
from chipload.geometry.contour import Region
from chipload.geometry.dxf import read_dxf


def assert_refused(path, message, **keys):
    with pytest.raises(InputError, match="^" + re.escape(message) + "$"):
        read_dxf(path, **keys)


@pytest.fixture
def drawn(tmp_path):
    def make(*adders, units=4):
        doc = ezdxf.new("R2010", units=units)
        doc.layers.add("walls")
        for add in adders:
            add(doc.modelspace())
        path = tmp_path / "part.dxf"
        doc.saveas(path)
        return path

    return make


def entities(*values):
    return "\n".join(["0", "SECTION", "2", "ENTITIES", *values, "0", "ENDSEC", "0", "EOF", ""])


def line_of(x):
    return ["0", "LINE", "8", "0", "10", x, "20", "0.0", "11", "5.0", "21", "0.0"]


def test_missing_file(tmp_path):
    path = tmp_path / "none.dxf"
    assert_refused(path, f"part.file = {path}: no such file")
    assert_refused(tmp_path, f"part.file = {tmp_path}: no such file")


@pytest.mark.parametrize(
    "data", [bytes(range(256)) * 4000, b"\x89PNG\r\n\x1a\n" + bytes(999), b"hello\nworld\n", b"\0"]
)
def test_rubbish(tmp_path, data):
    path = tmp_path / "rubbish.dxf"
    path.write_bytes(data)
    assert_refused(path, "part.file = rubbish.dxf: not a DXF drawing")


def test_empty_file(tmp_path):
    path = tmp_path / "empty.dxf"
    path.write_bytes(b"")
    assert_refused(path, "part.file = empty.dxf: the file is empty")


def test_binary_dxf_with_rubbish_in_it(tmp_path):
    path = tmp_path / "binary.dxf"
    path.write_bytes(b"AutoCAD Binary DXF\r\n\x1a\0" + bytes(range(256)))
    with pytest.raises(InputError, match=r"^part\.file = binary\.dxf: not a DXF drawing that can be read: "):
        read_dxf(path)


def test_a_million_lines_are_refused(tmp_path):
    path = tmp_path / "huge.dxf"
    one = "\n".join(line_of("1.0")) + "\n"
    with path.open("w") as stream:
        stream.write("0\nSECTION\n2\nENTITIES\n")
        for _ in range(100):
            stream.write(one * 10_000)
        stream.write("0\nENDSEC\n0\nEOF\n")
    assert_refused(
        path,
        "part.file = huge.dxf: 1000000 entities: must be at most 200000; keep only the part there",
    )


def test_too_many_by_blocks_in_blocks(drawn):
    def add(msp):
        doc = msp.doc
        doc.blocks.new("b0").add_line((0, 0), (1, 0))
        for k in range(1, 6):
            block = doc.blocks.new(f"b{k}")
            for _ in range(10):
                block.add_blockref(f"b{k - 1}", (0, 0))
        msp.add_blockref("b5", (0, 0))

    assert_refused(
        drawn(add),
        "part.file = part.dxf: more than 500 entities: must be at most 500; keep only the part there",
        max_entities=500,
    )


def test_no_geometry_names_the_layers(drawn):
    path = drawn(lambda msp: msp.add_text("only text"))
    assert_refused(path, "part.file = part.dxf: no lines or arcs; layers there are: 0, Defpoints, walls")


def test_unknown_layer_names_those_there_are(drawn):
    path = drawn(lambda msp: msp.add_circle((0, 0), 1))
    assert_refused(
        path, "part.layers: no layer 'wall' in part.dxf; layers there are: 0, Defpoints, walls", layers=["wall"]
    )
    assert_refused(
        path, "part.file = part.dxf: no lines or arcs on walls; layers there are: 0, Defpoints, walls", layers=["walls"]
    )


def test_units_must_be_said(drawn):
    def add(msp):
        msp.add_circle((0, 0), 1)

    assert_refused(
        drawn(add, units=0),
        "part.file = part.dxf: the header names no unit: state part.units_if_unstated or part.units",
    )
    assert_refused(drawn(add, units=3), "part.file = part.dxf: $INSUNITS = 3 is not read: state part.units")
    assert_refused(drawn(add), "part.units = 'mmm': must be one of um, mm, cm, m, inch, foot", units="mmm")


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf", "1e999"])
def test_a_coordinate_that_is_no_number(tmp_path, bad):
    path = tmp_path / "part.dxf"
    path.write_text(entities(*line_of(bad)))
    assert_refused(
        path, "part.file = part.dxf: LINE on layer '0' has a coordinate that is not a finite number", units="mm"
    )


def test_what_is_not_flat(drawn):
    assert_refused(
        drawn(lambda msp: msp.add_line((1, 2, 0), (3, 4, 5))),
        "part.file = part.dxf: LINE on layer '0' at (1, 2) is not parallel to the XY plane: a flat drawing is needed",
    )
    assert_refused(
        drawn(lambda msp: msp.add_arc((0, 0), 1, 0, 90, dxfattribs={"extrusion": (1, 0, 0)})),
        "part.file = part.dxf: ARC on layer '0' is not parallel to the XY plane (extrusion [1.0, 0.0, 0.0]): "
        "a flat drawing is needed",
    )
    assert_refused(
        drawn(lambda msp: msp.add_polyline3d([(0, 0, 0), (1, 0, 0), (1, 1, 1)])),
        "part.file = part.dxf: POLYLINE on layer '0' at (0, 0) is not parallel to the XY plane: a flat drawing "
        "is needed",
    )


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan")])
def test_a_tolerance_that_is_none(drawn, bad):
    path = drawn(lambda msp: msp.add_circle((0, 0), 1))
    assert_refused(path, f"part.tolerance_mm = {bad:g}: must be a finite number above 0", tolerance_mm=bad)


def test_an_open_chain_where_a_closed_one_is_needed(drawn):
    drawing = read_dxf(drawn(lambda msp: msp.add_lwpolyline([(0, 0), (10, 0), (10, 10)])))
    message = (
        "contour open at (10, 10), gap 14.1421 mm: a closed contour is needed; close the drawing, raise part.join_mm, "
        'or leave it out (part.open_chains = "dropped")'
    )
    with pytest.raises(InputError, match="^" + re.escape(message) + "$"):
        Region(drawing.contours)
