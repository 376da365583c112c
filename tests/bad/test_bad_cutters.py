"""Cutters that must be refused, each with its exact message."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import cutter_from_table
from chipload.errors import InputError

JOB = {
    "number": 3,
    "diameter_mm": 10.0,
    "flutes": 4,
    "helix_deg": 30.0,
    "flute_length_mm": 22.0,
    "overhang_mm": 35.0,
    "modulus_gpa": 580.0,
}
NEVER = "state it; dimensions of a cutter are never guessed"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        *(({key: None}, f"cutter.{key} is missing: {NEVER}") for key in JOB),
        ({"flute_mm": 3.0}, "cutter.flute_mm: unknown key: the nearest known one is flutes"),
        ({"diameter": 3.0}, "cutter.diameter: unknown key: the nearest known one is diameter_mm"),
        ({"diameter_mm": "10"}, "cutter.diameter_mm = '10': must be a number"),
        ({"diameter_mm": True}, "cutter.diameter_mm = True: must be a number"),
        ({"diameter_mm": math.nan}, "cutter.diameter_mm = nan: must be a finite number"),
        ({"overhang_mm": math.inf}, "cutter.overhang_mm = inf: must be a finite number"),
        ({"diameter_mm": -10.0}, "cutter.diameter_mm = -10: must be above 0"),
        ({"flutes": 2.5}, "cutter.flutes = 2.5: must be a whole number"),
        ({"flutes": 0}, "cutter.flutes = 0: must be at least 1"),
        ({"number": -1}, "cutter.number = -1: must be at least 0"),
        ({"name": 5}, "cutter.name = 5: must be a text"),
        ({"helix_deg": 80.0}, "cutter.helix_deg = 80: must be from 0 to below 80"),
        ({"overhang_mm": 20.0}, "cutter.overhang_mm = 20: must be at least flute_length_mm = 22"),
        ({"modulus_gpa": 5.8e5}, "cutter.modulus_gpa = 580000: must be from 10 to 1000 (steel 210, carbide 580)"),
        ({"corner_radius_mm": 8.0}, "cutter.corner_radius_mm = 8: must be at most diameter_mm / 2 = 5"),
        ({"corner_radius_mm": -1.0}, "cutter.corner_radius_mm = -1: must be at least 0"),
        (
            {"corner_radius_mm": 8.0, "taper_deg": 5.0},
            "cutter.corner_radius_mm = 8: must be at most 5.45654, where the corner's centre is on the axis",
        ),
        (
            {"corner_radius_mm": 1.0, "corner_e_mm": 3.0},
            "cutter.corner_e_mm = 3: must be 4, where the corner touches bottom and flank; leave it out",
        ),
        ({"bottom_deg": 90.0}, "cutter.bottom_deg = 90: must be from 0 to below 90"),
        (
            {"bottom_deg": 30.0, "taper_deg": 60.0},
            "cutter.taper_deg = 60: must be from 0 to below 90 - bottom_deg = 60",
        ),
        ({"runout_deg": 10.0}, "cutter.runout_mm is missing: state it with runout_deg, or leave both out"),
        ({"runout_mm": 6.0}, "cutter.runout_mm = 6: must be from 0 to diameter_mm / 2"),
        ({"runout_mm": -0.01, "runout_deg": 0.0}, "cutter.runout_mm = -0.01: must be at least 0"),
        ({"shank_diameter_mm": 0.0}, "cutter.shank_diameter_mm = 0: must be above 0"),
        ({"tool": 1}, "cutter.tool is stated without cutter.file: state the file, or leave it out"),
        ({"file_unit": "cm"}, "cutter.file_unit = 'cm': must be mm or inch"),
        ({"file": "a.xml"}, "cutter.file = a.xml: must end in .fctb, .json, .tools, .p21, .camotics, .tbl"),
        ({"file": "a.tbl"}, "cutter.tool is missing: a.tbl holds several tools; state the number of one"),
        ({"file": "a.tbl", "tool": 1}, "cutter.file_unit is missing: a.tbl does not state its unit; state mm or inch"),
        ({"file": "a.fctb", "tool": 1}, "cutter.tool applies to a file of several tools: leave it out for a.fctb"),
    ],
)
def test_table_is_refused(change, message):
    table = {key: value for key, value in {**JOB, **change}.items() if value is not None}
    with pytest.raises(InputError) as err:
        cutter_from_table(table)
    assert str(err.value) == message


def test_value_is_refused():
    good = Cutter(10.0, 4, 0.5, 22.0, 35.0, 6e5)
    with pytest.raises(InputError, match=r"^cutter: a number is not finite$"):
        replace(good, taper=math.nan)
    with pytest.raises(InputError, match=r"^cutter: radius_at: a height is below the tip: must be at least 0 mm$"):
        good.radius_at([-1e-9])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not a FreeCAD tool bit: must be JSON"),
        ("[" * 100000, "not a FreeCAD tool bit: must be JSON"),
        ("[1]", "not a FreeCAD tool bit: must have shape and parameter"),
        ({"shape": "endmill.fcstd", "parameter": 3}, "not a FreeCAD tool bit: must have shape and parameter"),
        (
            {"shape": "probe.fcstd", "parameter": {}},
            "shape probe: must be one of endmill, ballend, torus, bullnose, drill, vbit, reamer, tap, threadmill, "
            "dovetail, slittingsaw",
        ),
        (
            {"shape": "drill.fcstd", "parameter": {"Diameter": "3 mm"}},
            "shape drill: TipAngle: must be given and above 0",
        ),
        (
            {"shape": "torus.fcstd", "parameter": {"Diameter": "6 mm"}},
            "shape torus without TorusRadius, CornerRadius or FlatRadius: give one",
        ),
        *(
            (
                {"shape": "endmill.fcstd", "parameter": {"Diameter": text}},
                f"Diameter = {text!r}: must be a length with its unit, such as 6,0 mm or 1/4 in",
            )
            for text in ("6.0", "6 furlong", "-6 mm", "1e5 mm", "mm", "6,0,0 mm", 6.0, None, "1/0 xx")
        ),
        (
            {"shape": "endmill.fcstd", "parameter": {"Flutes": "two"}},
            "Flutes = 'two': must be a whole number",
        ),
    ],
)
def test_tool_bit_is_refused(tmp_path, text, message):
    path = tmp_path / "bit.fctb"
    path.write_text(text if isinstance(text, str) else json.dumps(text))
    with pytest.raises(InputError) as err:
        cutter_from_table({**JOB, "file": "bit.fctb"}, tmp_path)
    assert str(err.value) == f"cutter.file {path}: {message}"


def test_tool_bit_lacks_a_key(tmp_path):
    (tmp_path / "bit.fctb").write_text(json.dumps({"shape": "endmill", "parameter": {"Diameter": "6 mm"}}))
    with pytest.raises(InputError) as err:
        cutter_from_table({"number": 1, "file": "bit.fctb"}, tmp_path)
    lacks = ("flutes", "helix_deg", "flute_length_mm", "overhang_mm", "modulus_gpa")
    assert str(err.value).splitlines() == [f"cutter.{k} is missing: bit.fctb does not state it: {NEVER}" for k in lacks]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("T1 P1 D10\nT1 P2 D8\n", ": tool 1 appears twice, in lines 1 and 2: keep one"),
        ("T2 P1 D10\nT7 D3", ": tool 1 is not there: must be one of 2, 7"),
        ("", ": tool 1 is not there: must be one of none"),
        ("T2 P1 D10\nhello", " line 2: not a tool: must be words such as T1 P1 D10"),
        ("D10", " line 1: not a tool: must be words such as T1 P1 D10"),
    ],
)
def test_tool_table_is_refused(tmp_path, text, message):
    path = tmp_path / "t.tbl"
    path.write_text(text)
    with pytest.raises(InputError) as err:
        cutter_from_table({**JOB, "file": "t.tbl", "tool": 1, "file_unit": "mm"}, tmp_path)
    assert str(err.value) == f"cutter.file {path}{message}"


def test_no_file(tmp_path):
    for name, more in (("no.fctb", {}), ("no.tbl", {"tool": 1, "file_unit": "mm"})):
        with pytest.raises(InputError) as err:
            cutter_from_table({**JOB, "file": name, **more}, tmp_path)
        assert str(err.value) == f"cutter.file {tmp_path / name}: cannot be read: No such file or directory"
    (tmp_path / "big.fctb").write_bytes(b" " * 1_000_001)
    with pytest.raises(InputError, match="1000001 bytes: must be at most 1000000 bytes: not a tool bit"):
        cutter_from_table({**JOB, "file": "big.fctb"}, tmp_path)
