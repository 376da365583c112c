"""`chipload init` of a model with pockets: what it says of pockets, walls, floors and corners."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from chipload.jobs.drafts.folder import jobs_in
from chipload.jobs.drafts.make import draft_of
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


@pytest.fixture(scope="module")
def drafted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("frame")
    write_part(folder / "frame.step")
    code, said, _ = call("init", folder / "frame.step", folder / "jobs")
    assert code == 0
    return folder, said


def test_what_is_found_in_a_frame(drafted: tuple[Path, str]) -> None:
    _, said = drafted
    assert (
        "found: 3 pockets: 2 with the floor at z = 2.5 mm, 17.5 mm deep, with sharp corners; 1 with the floor at "
        "z = 8 mm, 12 mm deep, with an open side"
    ) in said
    assert "found: 1 wall between pockets, 1.8 mm thick, 17.5 mm high (9.72 : 1), up to 35 mm long" in said
    assert "found: 5 walls at the outside, 2.5 mm thick, 17.5 mm high (7 : 1), up to 35 mm long" in said
    assert "found: floors at z = 2.5 mm: 2.5 mm thick" in said
    assert "found: pockets with an open side are not in these drafts" in said
    assert "found: sharp corners: R 3 mm stays in them" in said
    assert said.count("question:") == 5


def test_the_jobs_of_a_frame(drafted: tuple[Path, str]) -> None:
    """Roughing leaves stock on the walls, which a smaller cutter finishes level by level; checks follow, in order."""
    folder, said = drafted
    jobs = jobs_in(folder / "jobs")
    assert [path.name for path in jobs] == ["1-pockets.toml", "2-roughing.toml", "3-walls.toml", "4-distortion.toml"]
    assert f"then chipload run {folder / 'jobs'} --out {folder / 'jobs' / 'result'}" in said
    plan, rough, walls, release = (tomllib.loads(path.read_text()) for path in jobs)
    first, second = plan["operation"]
    assert (first["allowance_mm"], second["rest_of"], second["allowance_mm"]) == (1.8, 0, 0.3)
    assert second["axial_depth_mm"] == min(2.5 * 1.8, 0.5 * 6.0)
    assert second["wall_finish"]["by_level"]
    assert [c["diameter_mm"] for c in plan["cutter"]] == [10.0, 6.0]  # 12 mm would leave 3.2 % in sharp corners
    assert rough["program"]["file"] == "result/1-pockets/0-pocket.ngc"
    assert (rough["stock"]["low_mm"], rough["stock"]["high_mm"]) == ([0.0, 0.0, 0.0], [90.0, 40.0, 20.0])
    assert (walls["program"]["file"], walls["stock"]["file"]) == (
        "result/1-pockets/1-pocket.ngc", "result/2-roughing/stock.npz",
    )  # fmt: skip
    assert walls["cutter"] == [plan["cutter"][1]]
    assert walls["workpiece"]["cell_mm"] == 2.4 * 1.8
    assert (walls["workpiece"]["clamp"][0]["face"], walls["limits"]["form_error_um"]) == ("z-", 50.0)
    assert release["residual_stress"]["source"].startswith("an example")
    for name in ("1-pockets.toml", "4-distortion.toml"):
        code, found, _ = call("check", folder / "jobs" / name)
        assert f"{name}: valid" in found, found
        assert code == 3  # guesses are not confirmed
    picture = (folder / "jobs" / "found.svg").read_text()
    assert (picture.count("<line"), picture.count("<path"), picture.count("1.8 x 17.5")) == (6, 3, 1)


def test_a_folder_is_not_written_twice_and_its_results_have_one_place(drafted: tuple[Path, str]) -> None:
    folder, _ = drafted
    code, _, err = call("init", folder / "frame.step", folder / "jobs")
    assert code == 2
    assert "already exists" in err
    code, _, err = call("run", folder / "jobs", "--out", folder / "elsewhere")
    assert code == 2
    assert f"use --out {folder / 'jobs' / 'result'}" in err
    code, _, err = call("run", folder / "jobs", "--out", folder / "jobs" / "result")
    assert code == 2
    assert "not confirmed" in err or "confirm" in err


def test_the_draft_of_one_face(drafted: tuple[Path, str]) -> None:
    """A first result plans one face, and names what it leaves out."""
    folder, _ = drafted
    notes = draft_of(folder / "frame.step", folder / "one").notes
    assert any("walls of 1.8 mm beside pockets 17.5 mm deep and a floor of 2.5 mm: simulate" in n for n in notes)
    assert any("[residual_stress] for the distortion after release; this draft checks neither" in n for n in notes)
    assert any("leaves sharp corners" in n for n in notes)
    assert any("floors at z = 8 mm are not in this draft: copy it for each, with its face_z_mm" in n for n in notes)
