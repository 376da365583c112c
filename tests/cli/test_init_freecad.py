"""`chipload init`: drafts from FreeCAD documents, of a CAM job and of a part."""

from __future__ import annotations

import csv
import tomllib
import zipfile
from pathlib import Path

import pytest

from chipload.jobs import check_job, load_job
from command import call


def prop(name: str, kind: str, inner: str) -> str:
    return f'<Property name="{name}" type="{kind}">{inner}</Property>'


def document(path: Path) -> None:
    """A CAM job as FreeCAD 0.20 saves it: a box as stock, a ball nose of 6 mm, one operation with its path."""
    link, float_, text = "App::PropertyLink", "App::PropertyLength", "App::PropertyString"
    place = '<PropertyPlacement Px="-5" Py="-5" Pz="-10" Q0="0" Q1="0" Q2="0" Q3="1"/>'
    objects = {
        "Job": ("Path::FeaturePython", [
            prop("Stock", link, '<Link value="Stock"/>'), prop("Operations", link, '<Link value="Operations"/>'),
        ]),
        "Operations": ("App::DocumentObjectGroup", [
            prop("Group", "App::PropertyLinkList", '<LinkList count="1"><Link value="Profile"/></LinkList>'),
        ]),
        "Stock": ("Part::FeaturePython", [
            *(prop(k, float_, f'<Float value="{v}"/>') for k, v in (("Length", 50), ("Width", 30), ("Height", 10))),
            prop("Placement", "App::PropertyPlacement", place),
        ]),
        "Profile": ("Path::FeaturePython", [
            prop("ToolController", link, '<Link value="TC"/>'), prop("Label", text, '<String value="Rough (1)"/>'),
            prop("Path", "Path::PropertyPath", '<Path file="Profile.nc" version="1"/>'),
        ]),
        "TC": ("Path::FeaturePython", [
            prop("Tool", link, '<Link value="Bit"/>'),
            prop("ToolNumber", "App::PropertyInteger", '<Integer value="5"/>'),
            prop("SpindleSpeed", "App::PropertyFloat", '<Float value="9000"/>'),
        ]),
        "Bit": ("Part::FeaturePython", [
            prop("Diameter", float_, '<Float value="6"/>'),
            prop("Flutes", "App::PropertyInteger", '<Integer value="4"/>'),
            prop("CuttingEdgeHeight", float_, '<Float value="18"/>'),
            prop("ShapeName", text, '<String value="ballend"/>'), prop("Label", text, '<String value="6mm Ball"/>'),
        ]),
    }  # fmt: skip
    head = "".join(f'<Object type="{kind}" name="{name}"/>' for name, (kind, _) in objects.items())
    data = "".join(
        f'<Object name="{name}"><Properties>{"".join(ps)}</Properties></Object>' for name, (_, ps) in objects.items()
    )
    with zipfile.ZipFile(path, "w") as archive:
        xml = f"<?xml version='1.0'?><Document><Objects>{head}</Objects><ObjectData>{data}</ObjectData></Document>"
        archive.writestr("Document.xml", xml)
        archive.writestr("Profile.nc", "(Rough)\nG0 X0 Y0 Z5\nG1 X0 Y0 Z-3 F2.5\nG1 X20 Y0 Z-3 F10\nG0 Z5\n")


def test_a_freecad_job(tmp_path: Path) -> None:
    """Feeds of the document are mm/s: 10 is F600."""
    document(tmp_path / "part.FCStd")
    code, _, said = call("init", tmp_path / "part.FCStd", tmp_path / "job")
    assert code == 0, said
    text = (tmp_path / "job" / "program.ngc").read_text()
    assert "G1 X20 Y0 Z-3 F600.0000" in text
    assert "T5 M6 (TC)\n" in text
    assert "S9000 M3" in text
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert job["program"]["file"] == "program.ngc"
    assert (job["stock"]["low_mm"], job["stock"]["high_mm"]) == ([-5.0, -5.0, -10.0], [45.0, 25.0, 0.0])
    (cutter,) = job["cutter"]
    assert [cutter[k] for k in ("number", "diameter_mm", "corner_radius_mm", "flutes", "flute_length_mm")] == [
        5, 6.0, 3.0, 4, 18.0
    ]  # fmt: skip
    lines, _ = check_job(load_job(tmp_path / "job" / "job.toml"))
    assert any(line.startswith("estimate: ") for line in lines)


def test_a_freecad_job_by_name_and_where_its_lines_come_from(program: Path, tmp_path: Path) -> None:
    document(tmp_path / "part.FCStd")
    code, _, said = call("init", tmp_path / "part.FCStd", tmp_path / "job", "--job", "Other")
    assert (code, said) == (2, "chipload: part.FCStd: no CAM job Other: has Job\n")
    code, _, said = call("init", program, tmp_path / "job", "--job", "Job")
    assert (code, said) == (2, "chipload: --job Job: applies to a FreeCAD document only: leave it out for slot.nc\n")
    assert call("init", tmp_path / "part.FCStd", tmp_path / "job", "--job", "Job")[0] == 0
    lines = (tmp_path / "job" / "program.ngc").read_text().splitlines()
    with zipfile.ZipFile(tmp_path / "part.FCStd") as archive:
        path = archive.read("Profile.nc").decode().splitlines()
    with (tmp_path / "job" / "program_lines.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["command"]) for row in rows] == list(range(len(path)))
    assert {row["operation"] for row in rows} == {"Profile"}
    for row, own in zip(rows, path, strict=True):
        written = lines[int(row["line"]) - 1]
        words = [w for w in own.split() if not w.startswith(("F", "("))]
        assert own.startswith("(") or written.split()[: len(words)] == words


def test_damaged_documents_are_refused(tmp_path: Path) -> None:
    for name, data in {"a": b"", "b": b"PK\x03\x04 nothing", "c": b"<Document/>"}.items():
        path = tmp_path / f"{name}.FCStd"
        path.write_bytes(data)
        code, _, said = call("init", path, tmp_path / "job")
        assert (code, "not a FreeCAD document" in said) == (2, True)
    with zipfile.ZipFile(tmp_path / "d.FCStd", "w") as archive:
        archive.writestr("Document.xml", '<!DOCTYPE a [<!ENTITY b "c">]><Document>&b;</Document>')
    assert "entities are not read" in call("init", tmp_path / "d.FCStd", tmp_path / "job")[2]
    assert not (tmp_path / "job").exists()


def test_a_freecad_part_is_a_pocket(tmp_path: Path) -> None:
    """A block of 60 x 40 x 20 mm with a pocket of 40 x 20 mm, 8 mm deep: its floor is at z = 12."""
    pytest.importorskip("OCP")
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.BRepTools import BRepTools
    from OCP.gp import gp_Pnt

    block = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(60, 40, 20)).Shape()
    hollow = BRepPrimAPI_MakeBox(gp_Pnt(10, 10, 12), gp_Pnt(50, 30, 30)).Shape()
    BRepTools.Write_s(BRepAlgoAPI_Cut(block, hollow).Shape(), str(tmp_path / "shape.brp"))
    shape = prop("Shape", "Part::PropertyPartShape", '<Part file="Shape.brp"/>')
    data = f'<Object name="Body"><Properties>{shape}</Properties></Object>'
    with zipfile.ZipFile(tmp_path / "part.FCStd", "w") as archive:
        head = '<Object type="PartDesign::Body" name="Body"/>'
        archive.writestr(
            "Document.xml", f"<Document><Objects>{head}</Objects><ObjectData>{data}</ObjectData></Document>"
        )
        archive.write(tmp_path / "shape.brp", "Shape.brp")
    code, _, said = call("init", tmp_path / "part.FCStd", tmp_path / "job")
    assert code == 0, said
    assert sorted(p.name for p in (tmp_path / "job").iterdir()) == ["job.toml", "part.step"]
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert (job["part"]["file"], job["part"]["face_z_mm"]) == ("part.step", 12.0)
    # an opening by D leaves (4 - pi) D^2 / 4 in the corners: 3 % of 800 mm2 is D = 10.6 mm; a depth of D / 2
    assert (job["cutter"][0]["diameter_mm"], job["operation"][0]["axial_depth_mm"]) == (10.0, 5.0)
    # the stock holds the whole block, 8 mm above the floor
    assert (job["stock"]["top_mm"], job["operation"][0]["depth_mm"]) == (20.0, 8.0)
    lines, _ = check_job(load_job(tmp_path / "job" / "job.toml"))
    assert any("800 mm2" in line for line in lines)
    # the same document gives the same bytes
    call("init", tmp_path / "part.FCStd", tmp_path / "again")
    assert (tmp_path / "again" / "part.step").read_bytes() == (tmp_path / "job" / "part.step").read_bytes()
