from __future__ import annotations

import json
import math

import pytest

from chipload.cutter.fctb import read_fctb
from chipload.cutter.table import CutterTable, cutter_from_table
from chipload.cutter.tooltable import read_tool_table

JOB = {
    "number": 3,
    "name": "mill",
    "diameter_mm": 10,
    "flutes": 4,
    "helix_deg": 30.0,
    "flute_length_mm": 22.0,
    "overhang_mm": 35.0,
    "modulus_gpa": 580.0,
}


def bit(tmp_path, shape="endmill", name="bit.fctb", **parameter):
    path = tmp_path / name
    text = {"name": "mine", "shape": f"{shape}.fcstd", "parameter": parameter, "attribute": {}, "version": 1}
    path.write_text(json.dumps(text))
    return path


def test_all_keys():
    more = {"corner_radius_mm": 1.0, "corner_e_mm": 4.0, "corner_f_mm": 1.0, "runout_mm": 0.01, "runout_deg": 90.0}
    c = cutter_from_table({**JOB, **more, "shank_diameter_mm": 12.0, "bottom_deg": 0, "taper_deg": 0})
    assert (c.number, c.name, c.diameter, c.flutes, c.flute_length, c.overhang) == (3, "mill", 10.0, 4, 22.0, 35.0)
    assert (c.modulus, c.shank_diameter, c.corner_radius) == (580000.0, 12.0, 1.0)
    assert c.helix == pytest.approx(math.pi / 6)
    assert c.runout == (0.01, pytest.approx(math.pi / 2))


@pytest.mark.parametrize(
    ("text", "mm"),
    [
        ("6,0 mm", 6.0),
        ("6.35 mm", 6.35),
        ("1/4 in", 6.35),
        ('0.25 "', 6.35),
        ('1/4"', 6.35),
        ("1 1/2 in", 38.1),
        ("1-1/8 in", 28.575),
        ("1 cm", 10.0),
        ("250,0 \u03bcm", 0.25),
        ("6\u00a0mm", 6.0),
    ],
)
def test_lengths(tmp_path, text, mm):
    assert read_fctb(bit(tmp_path, Diameter=text))["diameter_mm"] == pytest.approx(mm, rel=1e-15)


@pytest.mark.parametrize(
    ("shape", "more", "corner"),
    [
        ("endmill", {}, None),
        ("ballend", {}, 3.0),
        ("torus", {"TorusRadius": "1,0 mm"}, 1.0),
        ("bullnose", {"CornerRadius": "0.5 mm"}, 0.5),
        ("bullnose", {"FlatRadius": "2 mm"}, 1.0),
    ],
)
def test_shapes(tmp_path, shape, more, corner):
    assert read_fctb(bit(tmp_path, shape, Diameter="6 mm", **more)).get("corner_radius_mm") == corner


def test_job_completes_and_overrides_the_file(tmp_path):
    bit(tmp_path, Diameter="6,0 mm", Flutes="0", CuttingEdgeHeight="18 mm", ShankDiameter="6 mm")
    job = {"number": 5, "file": "bit.fctb", "helix_deg": 30.0, "overhang_mm": 30.0, "modulus_gpa": 580.0, "flutes": 3}
    c = cutter_from_table(job, tmp_path)
    assert (c.diameter, c.flutes, c.flute_length, c.name, c.number) == (6.0, 3, 18.0, "mine", 5)


def test_tool_table(tmp_path):
    (tmp_path / "t.tbl").write_text(";head\n\nT1 P1 D10.0 ;10mm end mill\nT2P2Z+0.511 D.5 ; half\nT3 P3 Z1\n")
    assert read_tool_table(tmp_path / "t.tbl", 2, "inch") == {"number": 2, "name": "half", "diameter_mm": 12.7}
    assert read_tool_table(tmp_path / "t.tbl", 3, "mm") == {"number": 3}
    job = {k: v for k, v in JOB.items() if k not in ("number", "diameter_mm", "name")}
    c = cutter_from_table({**job, "file": "t.tbl", "tool": 1, "file_unit": "mm"}, tmp_path)
    assert (c.number, c.diameter, c.name) == (1, 10.0, "10mm end mill")


def test_table_embeds_in_a_job():
    table = CutterTable.model_validate(JOB)
    assert table.model_dump(exclude_none=True) == JOB
    assert table.cutter() == cutter_from_table(JOB)
