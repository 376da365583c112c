"""`chipload init` of a model with pockets: what it says of pockets, walls, floors and corners."""

from __future__ import annotations

from pathlib import Path

from command import call


def write_part(path: Path) -> None:
    """A frame of 90 x 40 x 20 mm: pockets of 17.5, 17.5 and 12 mm, the last open to y-; walls 2.5 and 1.8."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    body = BRepPrimAPI_MakeBox(90.0, 40.0, 20.0).Shape()
    for low, high in (
        ((2.5, 2.5, 2.5), (30.0, 37.5, 21.0)),
        ((31.8, 2.5, 2.5), (60.0, 37.5, 21.0)),
        ((62.5, -1.0, 8.0), (87.5, 37.5, 21.0)),
    ):
        body = BRepAlgoAPI_Cut(body, BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()).Shape()
    writer = STEPControl_Writer()
    writer.Transfer(body, STEPControl_AsIs)
    writer.Write(str(path))


def test_what_is_found_in_a_frame(tmp_path: Path) -> None:
    write_part(tmp_path / "frame.step")
    code, said, _ = call("init", tmp_path / "frame.step", tmp_path / "job")
    assert code == 0
    assert (
        "found: 3 pockets: 2 with the floor at z = 2.5 mm, 17.5 mm deep, with sharp corners; 1 with the floor at "
        "z = 8 mm, 12 mm deep, with an open side"
    ) in said
    assert "found: the part has walls of 1.8 mm beside pockets 17.5 mm deep and a floor of 2.5 mm: simulate" in said
    assert "[residual_stress] for the distortion after release; this draft checks neither" in said
    assert "leaves sharp corners" in said
    assert "found: floors at z = 8 mm are not in this draft: copy it for each, with its face_z_mm and depth_mm" in said
