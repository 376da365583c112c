"""`chipload init`: kinds of files: NC text, CL data, CAMotics projects, sections of a wall; what is refused."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from chipload.jobs import load_job, run_job
from command import call
from fusion_text import FUSION


def test_a_program_whose_axes_no_machine_has(tmp_path: Path) -> None:
    """The machine that lacks the fewest is taken; the motion of the axis that it lacks is a question, no refusal."""
    path = tmp_path / "quill.ngc"
    path.write_text("G21 G90 F100 S600 M3\nG1 X1 B5 C5\nG1 W3\nX9\nM2\n")
    code, said, _ = call("init", path, tmp_path / "job")
    assert code == 0
    assert "line 3: W moves: machine xyzbc-trunnion has the axes CBXYZ: W is held at 0 (1 motion)" in said
    machine = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["machine"]
    assert machine["name"] == "xyzbc-trunnion"


def test_a_table_of_numbers_is_no_program(tmp_path: Path) -> None:
    path = tmp_path / "points.txt"
    path.write_text("51.2 30.1 2.0 4.5 5.0\n52.2 30.1 2.0 4.5 5.0\n")
    code, _, said = call("init", path, tmp_path / "job")
    assert code == 2
    assert said == (
        "chipload: points.txt: neither NC text nor CL data nor a table with a heading of its columns: "
        "line 1: character '5': does not begin a word\n"
    )


def test_a_mesh_is_named_as_one(tmp_path: Path) -> None:
    path = tmp_path / "part.3mf"
    path.write_text("part\n")
    code, _, said = call("init", path, tmp_path / "job")
    assert code == 2
    assert said.startswith(
        f"chipload: {path}: a mesh of this kind has no faces or contours to plan from: export STEP or DXF"
    )


def test_a_program_without_known_motion_is_refused(tmp_path: Path) -> None:
    """Its only motions wait for what the controller measures; a dwell is none."""
    path = tmp_path / "cut.h"
    path.write_text(
        "BEGIN PGM CUT MM\nTOOL CALL 5 Z S700\nFN 18: SYSREAD Q11 = ID270 NR1 IDX1\nM3\n"
        "CYCL DEF 9.0 DWELL\nCYCL DEF 9.1 TIME5\nL X+Q11 Y+0 F100\nEND PGM CUT MM\n"
    )
    code, _, said = call("init", path, tmp_path / "job")
    assert code == 2
    assert said.startswith("chipload: cut.h: no motion that can be read: nothing to simulate: line 7: Q11 comes from ")
    assert not (tmp_path / "job").exists()


def test_a_text_with_a_byte_order_mark(program: Path, tmp_path: Path) -> None:
    program.write_bytes(b"\xef\xbb\xbf" + FUSION.replace("\n", "\r\n").encode())
    assert call("init", program, tmp_path / "job")[0] == 0


def test_a_program_that_begins_with_incremental_motion(tmp_path: Path) -> None:
    """Where it begins stands nowhere: the draft says so, and its result is unproven."""
    path = tmp_path / "cut.ngc"
    path.write_text("G21 G91 G94\nT3 M6\nS4000 M3\nG1 Z-2 F120\nX40 F400\nG0 Z20\nM2\n")
    _, said, _ = call("init", path, tmp_path / "job")
    assert "found: line 4: G91: Z moves before any position is stated" in said
    path.write_text("G21 G90 G94\nT3 M6\nS4000 M3\nG0 X0 Y0 Z0\nG91 G1 Z-2 F120\nX40 F400\nG0 Z20\nM2\n")
    assert "before any position" not in call("init", path, tmp_path / "placed")[1]


def test_a_tool_that_is_called_by_name(tmp_path: Path) -> None:
    """Its only number is a guess of the diameter; the tool of an earlier name keeps its own number."""
    text = '; T="EM8" after T="FACE 40 Z5"\nN1 G90 G54\nN2 T="FACE 40 Z5" D1\nN3 M6\nN4 S3000 M3\n'
    text += "N5 G0 X0 Y0 Z5\nN6 G1 Z-1 F200\nN7 X20\nN8 G0 Z5\n"
    text += 'N9 T="EM8"\nN10 M6\nN11 S3000 M3\nN12 G1 Z-2 F200\nN13 X10\nN14 G0 Z9\nN15 M30\n'
    (tmp_path / "a.mpf").write_text(text)
    assert call("init", tmp_path / "a.mpf", tmp_path / "job")[0] == 0
    text = (tmp_path / "job" / "job.toml").read_text()
    face, mill = tomllib.loads(text)["cutter"]
    assert [(c["number"], c["name"], c["diameter_mm"]) for c in (face, mill)] == [
        (9001, "FACE 40 Z5", 10.0),
        (9002, "EM8", 8.0),
    ]
    assert "# guess: the number in its name, EM8" in text


def test_a_compensated_path_is_read_with_the_cutter_that_a_comment_states(tmp_path: Path) -> None:
    """The stock is guessed round the path of the centre: right of the text's line by 4 mm, the radius."""
    text = "(T1 D=8. CR=0. - flat end mill)\nG21 G90 G17\nT1 M6\nS4000 M3\nG0 X-20 Y0 Z5\nZ-2\nG42 D1 G1 X0 Y0 F300\n"
    (tmp_path / "a.nc").write_text(text + "X40\nG40 G1 X60\nG0 Z5\nM30\n")
    code, said, _ = call("init", tmp_path / "a.nc", tmp_path / "job")
    assert code == 0
    assert "nc-diameter-unknown" not in said
    stock = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["stock"]
    assert (stock["low_mm"][1], stock["high_mm"][1]) == (-5.0, 1.0)


def test_cl_data_that_are_named_as_a_text(tmp_path: Path) -> None:
    """No NC dialect reads them, CL data do: five axes, no spindle, no feed."""
    text = "GOTO/-30.5,18.5,30.7,-0.6,0,0.8\nGOTO/-30.4,18.7,30.7,-0.6,0,0.8\nGOTO/-20.4,18.7,30.7,0,0,1\n"
    (tmp_path / "path.txt").write_text(text)
    assert call("init", tmp_path / "path.txt", tmp_path / "job")[0] == 0
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert job["program"]["dialect"] == "apt"
    assert job["machine"]["name"] == "xyzbc-trunnion"
    (tmp_path / "words.txt").write_text("no program\n")
    code, _, err = call("init", tmp_path / "words.txt", tmp_path / "no")
    assert (code, "line 1: " in err) == (2, True)


def test_inches_become_millimetres(tmp_path: Path) -> None:
    path = tmp_path / "inch.nc"
    path.write_text("(T1 D=0.5 CR=0.)\nG20 G90\nT1 M6\nS3000 M3\nG0 X0 Y0 Z1\nG1 Z-0.1 F10\nX1\nG0 Z1\nM2\n")
    call("init", path, tmp_path / "job")
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert job["cutter"][0]["diameter_mm"] == 12.7
    assert job["stock"]["high_mm"][0] == 26.4


def test_a_camotics_project(tmp_path: Path) -> None:
    (tmp_path / "slot.nc").write_text(FUSION)
    tool = {"units": "imperial", "shape": "ballnose", "length": 1, "diameter": 0.25}
    block = {"automatic": False, "bounds": {"min": [-20, 0, -8], "max": [40, 20, 0]}}
    project = {"units": "metric", "tools": {"3": tool}, "workpiece": block, "files": ["slot.tpl"]}
    (tmp_path / "slot.camotics").write_text(json.dumps(project))
    code, said, _ = call("init", tmp_path / "slot.camotics", tmp_path / "job")
    assert code == 0
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    (cutter,) = job["cutter"]
    assert (cutter["diameter_mm"], cutter["corner_radius_mm"], cutter["flute_length_mm"]) == (6.35, 3.175, 25.4)
    assert (job["stock"]["low_mm"], job["stock"]["high_mm"]) == ([-20.0, 0.0, -8.0], [40.0, 20.0, 0.0])
    assert "question: [stock]" not in said


def test_a_camotics_project_whose_script_has_no_nc_text(tmp_path: Path) -> None:
    tool = {"units": "metric", "shape": "cylindrical", "length": 20, "diameter": 6}
    (tmp_path / "sign.camotics").write_text(json.dumps({"tools": {"1": tool}, "files": ["letters.tpl"]}))
    code, _, err = call("init", tmp_path / "sign.camotics", tmp_path / "job")
    assert code == 2
    assert "export the NC text of letters.tpl from CAMotics, as sign.nc next to the project" in " ".join(err.split())
    (tmp_path / "sign.camotics").write_text(json.dumps({"tools": {"1": tool}, "files": ["letters.nc"]}))
    _, _, err = call("init", tmp_path / "sign.camotics", tmp_path / "job")
    assert err.rstrip().endswith("(letters.nc): put it next to the project")


def test_a_cloud_of_points_is_a_thin_wall(tmp_path: Path) -> None:
    """Three ellipses of 30 by 4 mm in any order, in metres, numbered; points on no levels are refused."""
    from math import cos, pi, sin

    points = [
        (15e-3 * cos(t), 2e-3 * sin(t), 20e-3 * k) for t in (2 * pi * i / 60 for i in range(60)) for k in range(3)
    ]
    write = "".join(f"{i}\t{x:.6f}\t{y:.6f}\t{z:.6f}\n" for i, (x, y, z) in enumerate(points, 7))
    (tmp_path / "cloud.txt").write_text(write)
    code, _, said = call("init", tmp_path / "cloud.txt", tmp_path / "job")
    assert code == 0, said
    text = (tmp_path / "job" / "job.toml").read_text()
    wall = tomllib.loads(text)["wall"]
    assert (wall["unit"], wall["columns"]) == ("m", "X Y Z")
    assert "# 3 sections" in text
    (tmp_path / "cloud.txt").write_text("".join(f"{x} {y} {z + 2 * x:.6f}\n" for x, y, z in points))
    code, _, said = call("init", tmp_path / "cloud.txt", tmp_path / "other")
    assert code == 2
    assert "of a cloud, the points of each must have one x, y, z or distance from z" in said


def test_sections_are_a_thin_wall(tmp_path: Path) -> None:
    """Three numbered files of an ellipse of 30 by 4 mm, 20 mm apart."""
    from math import cos, pi, sin

    for k in range(3):
        rows = [f"{15 * cos(t)} {2 * sin(t)} {20 * k}" for t in (2 * pi * i / 60 for i in range(60))]
        (tmp_path / f"blade_{k + 1}.txt").write_text("X Y Z\n" + "\n".join(rows) + "\n")
    code, _, said = call("init", tmp_path / "blade_2.txt", tmp_path / "job")
    assert code == 0, said
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert job["wall"]["files"] == [f"../blade_{k}.txt" for k in (1, 2, 3)]
    assert job["wall"]["unit"] == "mm"
    loaded = load_job(tmp_path / "job" / "job.toml")
    assert loaded.capability.name == "thinwall"
    with pytest.raises(Exception, match=r"wall.unit = .mm.: the files name none"):
        run_job(loaded)
