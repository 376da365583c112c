"""Tool libraries of Fusion 360, ISO 13399, CAMotics and FreeCAD 1.x: each number as the file has it, in mm."""

from __future__ import annotations

import json
import math
import zipfile
from pathlib import Path
from typing import Any

import pytest

from chipload.cutter.camotics import project_tools
from chipload.cutter.fctb import read_fctb
from chipload.cutter.fusion import read_fusion_tool
from chipload.cutter.iso13399 import read_iso13399
from chipload.cutter.table import cutter_from_table
from chipload.errors import InputError


def tool(number: int, kind: str = "flat end mill", unit: str = "millimeters", **geometry: Any) -> dict[str, Any]:
    return {
        "type": kind, "unit": unit, "BMC": "carbide", "description": f"tool {number}",
        "geometry": {"DC": 10, "NOF": 3, "LCF": 22, "LB": 35, "SFDM": 10, "RE": 0, **geometry},
        "holder": {"segments": [{"height": 20, "lower-diameter": 20, "upper-diameter": 25}]},
        "post-process": {"number": number},
    }  # fmt: skip


@pytest.fixture
def library(tmp_path: Path) -> Path:
    path = tmp_path / "library.json"
    tools = [
        tool(3),
        tool(4, "ball end mill", "inches", DC=0.25, LCF=0.75, LB=1.5, SFDM=0.25),
        tool(5, "bull nose end mill", RE=1.5),
        tool(6, "drill", SIG=118),
        tool(7, "chamfer mill", TA=45, **{"tip-diameter": 0.2}),
        tool(8, "probe shaft"),
        {"type": "holder", "unit": "millimeters"},
    ]
    path.write_text(json.dumps({"data": tools, "version": 2}))
    return path


def test_a_job_names_a_tool_of_a_fusion_library(library: Path) -> None:
    c = cutter_from_table({"number": 1, "file": "library.json", "tool": 3, "helix_deg": 30.0}, library.parent)
    assert (c.number, c.diameter, c.flutes, c.flute_length, c.overhang, c.modulus) == (1, 10.0, 3, 22.0, 35.0, 580e3)
    assert c.holder == ((20.0, 25.0),)
    assert c.strength.material is not None
    assert c.strength.material.value == "carbide"


@pytest.mark.parametrize(("rows", "height"), [(1, 1.5), (4, 6.0)])
def test_a_thread_mill_of_a_library_has_its_rows_of_teeth(tmp_path: Path, rows: int, height: float) -> None:
    path, more = tmp_path / "mill.json", {"shoulder-diameter": 6, "thread-profile-angle": 60, "HA": 10}
    path.write_text(json.dumps({"data": [tool(3, "thread mill", NT=rows, TP=1.5, **more)]}))
    mill = cutter_from_table({"number": 1, "file": "mill.json", "tool": 3}, tmp_path)
    assert (mill.tooth_rows, mill.flute_length, mill.thread_pitch, mill.body) == (rows, height, 1.5, ())
    # half the angle of the thread: ISO 68-1, the crest an eighth of the pitch
    crests = [0.75 + 1.5 * k for k in range(rows)]
    assert mill.radius_at(crests).tolist() == [5.0] * rows
    assert mill.radius_at([1.5 * k + 1e-9 for k in range(rows)]) == pytest.approx(5.0 - 0.65625 * math.sqrt(3.0))


def test_shapes_and_units(library: Path) -> None:
    ball = read_fusion_tool(library, 4)
    assert [ball[k] for k in ("diameter_mm", "corner_radius_mm", "flute_length_mm")] == pytest.approx(
        [6.35, 3.175, 19.05]
    )
    assert ball["holder_mm"] == [[508.0, 635.0]]
    assert read_fusion_tool(library, 5)["corner_radius_mm"] == 1.5
    # a point of 118 deg: its flank stands 31 deg from the plane normal to the axis
    assert read_fusion_tool(library, 6)["bottom_deg"] == 31.0
    chamfer = read_fusion_tool(library, 7)
    assert [chamfer[k] for k in ("diameter_mm", "taper_deg", "shank_diameter_mm")] == [0.2, 45, 10.0]


def test_what_a_fusion_library_is_refused_for(library: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="type probe shaft: must be one of flat end mill"):
        read_fusion_tool(library, 8)
    with pytest.raises(InputError, match="tool 9 is not there: must be one of 3, 4, 5, 6, 7, 8"):
        read_fusion_tool(library, 9)
    with pytest.raises(InputError, match=r"cutter\.tool is missing: library\.json holds 6"):
        read_fusion_tool(library, None)
    (tmp_path / "two.json").write_text(json.dumps({"data": [tool(1), tool(1)]}))
    with pytest.raises(InputError, match="tool 1 appears 2 times"):
        read_fusion_tool(tmp_path / "two.json", 1)
    (tmp_path / "nan.json").write_text(json.dumps({"data": [tool(1, DC=float("nan"))]}))
    with pytest.raises(InputError, match="DC = 'nan': must be a finite number"):
        read_fusion_tool(tmp_path / "nan.json", 1)
    for name, text in {"a.json": "[", "b.json": "{}", "c.json": '{"data": [1]}', "d.tools": "PK\x03\x04"}.items():
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match="not a Fusion tool library"):
            read_fusion_tool(tmp_path / name, None)


def test_a_zipped_library_of_one_tool(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "one.tools", "w") as archive:
        archive.writestr("tools.json", json.dumps({"data": [tool(12)]}))
    values = {"number": 2, "file": "one.tools", "helix_deg": 35.0, "flutes": 4}
    c = cutter_from_table(values, tmp_path)
    # what the job states stands above the file
    assert (c.number, c.flutes, c.diameter) == (2, 4, 10.0)


P21 = """ISO-10303-21;
HEADER;
ENDSEC;
DATA;
#10=UNIT('mm','');
#11=UNIT('inch','');
#20=NUMERICAL_VALUE('DC',$,#10,12.);
#21=NUMERICAL_VALUE('APMX',$,#10,26.);
#22=NUMERICAL_VALUE('ZEFF',$,$,4.);
#23=NUMERICAL_VALUE('DMM',$,#11,0.5);
#24=NUMERICAL_VALUE('RE',$,#10,0.5);
#25=NUMERICAL_VALUE('FHA',$,$,38.);
#26=NUMERICAL_VALUE('OAL',$,#10,83.);
#27=STRING_VALUE('BMC','CARBIDE');
ENDSEC;
END-ISO-10303-21;
"""


def test_properties_of_iso_13399(tmp_path: Path) -> None:
    (tmp_path / "mill.p21").write_text(P21)
    assert read_iso13399(tmp_path / "mill.p21") == {
        "diameter_mm": 12.0, "corner_radius_mm": 0.5, "flute_length_mm": 26.0, "shank_diameter_mm": 12.7,
        "helix_deg": 38.0, "flutes": 4, "modulus_gpa": 580.0, "tool_material": "carbide",
    }  # fmt: skip
    c = cutter_from_table({"number": 1, "file": "mill.p21", "overhang_mm": 40.0}, tmp_path)
    assert (c.diameter, c.flutes, c.helix) == (12.0, 4, pytest.approx(math.radians(38.0)))


def test_what_exchange_files_are_refused_for(tmp_path: Path) -> None:
    path = tmp_path / "mill.p21"
    for text, said in {
        "nothing": "must begin with ISO-10303-21",
        P21.replace("'DC'", "'XX'"): "states no DC",
        P21 + "#30=NUMERICAL_VALUE('DC',$,#10,16.);": "DC is 12 and 16: must be one value",
    }.items():
        path.write_text(text)
        with pytest.raises(InputError, match=said):
            read_iso13399(path)
    with pytest.raises(InputError, match=r"cutter\.tool applies to a file of several tools"):
        cutter_from_table({"number": 1, "file": "mill.p21", "tool": 3}, tmp_path)


def test_a_tool_bit_of_freecad_1(tmp_path: Path) -> None:
    bit = {
        "version": 2, "id": "2mm", "name": "2mm", "shape": "mine.fcstd", "shape-type": "Endmill", "attribute": {},
        "parameter": {"Diameter": "2.00 mm", "CuttingEdgeHeight": "12.00 mm", "Flutes": 2, "ShankDiameter": "3,17 mm"},
    }  # fmt: skip
    (tmp_path / "bit.fctb").write_text(json.dumps(bit))
    found = read_fctb(tmp_path / "bit.fctb")
    assert (found["diameter_mm"], found["flutes"], found["shank_diameter_mm"]) == (2.0, 2, 3.17)


def test_tools_of_a_camotics_project() -> None:
    """A cone of 12.5 mm over 15 mm: half its angle is atan(6.25 / 15)."""
    tools = {
        "1": {"units": "metric", "shape": "conical", "length": 15, "diameter": 12.5},
        "2": {"units": "imperial", "shape": "cylindrical", "length": 1, "diameter": 0.125, "description": "flat"},
        "3": {"shape": "snubnose", "length": 10, "diameter": 6, "snub_diameter": 2},
    }
    found = project_tools({"tools": tools, "units": "metric"}, "p")
    assert found[1]["taper_deg"] == pytest.approx(math.degrees(math.atan(6.25 / 15.0)))
    assert (found[2]["diameter_mm"], found[2]["flute_length_mm"], found[2]["name"]) == (3.175, 25.4, "flat")
    assert (found[3]["diameter_mm"], found[3]["taper_deg"]) == (2.0, pytest.approx(math.degrees(math.atan(0.2))))
    with pytest.raises(InputError, match="shape spheroid: must be cylindrical"):
        project_tools({"tools": {"1": {"shape": "spheroid", "length": 1, "diameter": 1}}}, "p")


def test_a_barrel_that_ends_at_its_widest_place_is_read(tmp_path: Path) -> None:
    """Fusion states the flank's radius and the height of the widest place: the arc there is upright."""
    sizes = {"DC": 12, "LCF": 10, "lower-radius": 1, "upper-radius": 1, "profile-radius": 48, "axial-distance": 10}
    path = tmp_path / "library.json"
    path.write_text(json.dumps({"data": [tool(3, "circle segment barrel", **sizes)]}))
    values = read_fusion_tool(path, 3)
    assert (values["corner_radius_mm"], values["barrel_radius_mm"]) == (1.0, 48.0)
    cutter = cutter_from_table({**values, "number": 3, "helix_deg": 30.0})
    assert cutter.radius_at([10.0])[0] == pytest.approx(6.0)
    assert cutter.flank_arc.f == pytest.approx(10.0)
    longer = tool(3, "circle segment barrel", **{**sizes, "LCF": 20})
    path.write_text(json.dumps({"data": [longer]}))
    assert read_fusion_tool(path, 3)["body_mm"] == ((6.0, 0.0), (6.0, 20.0))  # it cuts above the widest place too
