"""`chipload init` and `simulate`: what a file states is in the job; the rest is a guess that must be confirmed."""

from __future__ import annotations

import csv
import json
import tomllib
import zipfile
from pathlib import Path

import pytest

from chipload.jobs import check_job, load_job, run_job
from chipload.jobs.confirm import guesses_of, take_confirm
from chipload.jobs.drafts.comments import read_header
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry, write_draft
from command import call

FUSION = """%
(T3 D=8. CR=0. - ZMIN=-2. - flat end mill)
(MATERIAL STEEL 1045)
G21 G90 G94 G17
T3 M6
S4000 M3
G0 X-10 Y5 Z15
Z5
G1 Z-2 F100
X30 F400
Y15
G0 Z15
X0
M5
M2
%
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "slot.nc"
    path.write_text(FUSION)
    return path


def test_what_a_program_states_and_what_is_guessed(program: Path, tmp_path: Path) -> None:
    code, said, _ = call("init", program, tmp_path / "job")
    assert code == 0
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert job["program"] == {"file": "../slot.nc"}
    (cutter,) = job["cutter"]
    assert (cutter["number"], cutter["diameter_mm"], cutter["confirm"]) == (3, 8.0, True)
    assert job["material"]["name"] == "group-2-steel"
    # the centre path goes from (-10, 5, -2) to (30, 15, -2); program zero is the top; 1 mm around it
    assert job["stock"]["low_mm"] == [-11.0, 4.0, -3.0]
    assert job["stock"]["high_mm"] == [31.0, 16.0, 0.0]
    # the spindle of the machine bounds torque and power
    assert (job["limits"]["torque_nm"], job["limits"]["power_w"]) == (70.0, 11000.0)
    assert "guess: cutter.0.flutes = 3: no file states them; a common number" in said
    # what is stated is no guess
    assert "cutter.0.diameter_mm" not in said


def test_a_draft_is_refused_until_confirmed(program: Path, tmp_path: Path) -> None:
    call("init", program, tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    code, _, said = call("run", job, "--out", tmp_path / "out")
    assert code == 2
    lines = said.splitlines()
    text = job.read_text().splitlines()
    number = next(k for k, line in enumerate(text, 1) if line.startswith("flutes"))
    assert f"chipload: cutter.0.flutes = 3: no file states them; a common number (line {number})" in lines
    assert len(lines) == job.read_text().count("# guess: ") + 1
    assert lines[-1].startswith(f"chipload: {len(lines) - 1} guesses are not confirmed")
    assert not (tmp_path / "out").exists()
    # a table without `confirm` is confirmed
    job.write_text(job.read_text().replace("confirm = true\n", ""))
    assert load_job(job).guesses == ()


def test_an_option_is_a_guess_no_more(program: Path, tmp_path: Path) -> None:
    call("init", program, tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    before, after = load_job(job).guesses, load_job(job, ["cutter.0.flutes=4"]).guesses
    assert [g for g in before if g not in after] == [next(g for g in before if g.startswith("cutter.0.flutes"))]


def test_accepted_guesses_stand_in_the_result(program: Path, tmp_path: Path) -> None:
    call("init", program, tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    code, said, _ = call("run", job, "--accept", "--out", tmp_path / "out", "--set", "operation.0.step_mm=4")
    assert code in (0, 3)
    summary = json.loads((tmp_path / "out" / "summary.json").read_bytes())
    notes = [f for f in summary["findings"] if f["code"] == "job-guess"]
    assert len(notes) == len(load_job(job).guesses) > 5
    lines, holds = check_job(load_job(job))
    assert not holds
    assert lines[0].startswith("guess: machine.name = ")
    assert "report:" in said
    assert f" {len(notes)} guesses of the job were accepted." in said.splitlines()[0]


def test_a_first_look_is_never_better_than_unproven(program: Path, tmp_path: Path) -> None:
    code, said, _ = call("simulate", program, "--set", "operation.0.step_mm=4", "--out", tmp_path / "out")
    assert code == 3
    lines = said.splitlines()
    assert lines[1].startswith("guess: machine.name = ")
    assert json.loads((tmp_path / "out" / "summary.json").read_bytes())["verdict"] == "unproven"
    # the same job with its guesses accepted is no worse than that, and writes nothing beside the program
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out", "slot.nc"]


def test_a_job_is_not_overwritten(program: Path, tmp_path: Path) -> None:
    call("init", program, tmp_path / "job")
    before = (tmp_path / "job" / "job.toml").read_bytes()
    code, _, said = call("init", program, tmp_path / "job")
    assert code == 2
    assert said.startswith(f"chipload: {tmp_path / 'job' / 'job.toml'}: already exists: name another folder")
    assert (tmp_path / "job" / "job.toml").read_bytes() == before


def test_a_draft_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from chipload.jobs.drafts import draft as module

    write = module.write_whole

    def fails(path: Path, data: bytes) -> None:
        if path.name == "job.toml":
            raise OSError(28, "No space left on device")
        write(path, data)

    monkeypatch.setattr(module, "write_whole", fails)
    made = Draft("a job", (DraftTable("machine", (Entry("name", "vmc"),)),), files={"program.ngc": b"M2\n"})
    (tmp_path / "old").mkdir()
    for folder in ("new", "old"):
        with pytest.raises(Exception, match="cannot be written"):
            write_draft(made, tmp_path / folder)
    assert not (tmp_path / "new").exists()
    assert list((tmp_path / "old").iterdir()) == []


def test_confirm_must_be_true_or_false() -> None:
    raw = {"cutter": [{"number": 1, "confirm": True}], "machine": {"confirm": False, "name": "vmc"}}
    assert take_confirm(raw) == ("cutter.0",)
    assert raw == {"cutter": [{"number": 1}], "machine": {"name": "vmc"}}
    with pytest.raises(Exception, match=r"machine.confirm = 'yes': must be true or false"):
        take_confirm({"machine": {"confirm": "yes"}})
    # a table without marked guesses is named itself
    assert guesses_of(["machine"], '[machine]\nconfirm = true\nname = "vmc"\n') == (
        "machine: confirm = true: the table is not confirmed",
    )


def test_a_program_that_never_starts_the_spindle(program: Path, tmp_path: Path) -> None:
    """150 m/min with 8 mm is 5968 rpm, in two digits 6000; the loads are those of the same text with S6000 M3."""
    silent = FUSION.replace("S4000 M3\n", "")
    program.write_text(silent)
    code, said, _ = call("init", program, tmp_path / "job")
    assert code == 0
    assert "program.speed_rpm = 6000.0: the text cuts with the spindle at rest; 150 m/min" in said
    assert "machine-spindle-off" not in said
    job = (tmp_path / "job" / "job.toml").read_text()
    assert tomllib.loads(job)["program"]["speed_rpm"] == 6000.0
    worst = []
    for name, text, keys in (("guessed", silent, job), ("stated", FUSION.replace("S4000", "S6000"), "")):
        program.write_text(text)
        (tmp_path / "job" / "job.toml").write_text(keys or job.replace("speed_rpm = 6000.0", "# "))
        code, _, said = call("run", tmp_path / "job" / "job.toml", "--accept", "--out", tmp_path / name)
        assert code == 3, said
        summary = json.loads((tmp_path / name / "summary.json").read_text())
        worst.append({c["name"]: c["worst"] for c in summary["limits"]})
        assert not [f for t in summary["tracks"] for f in t["findings"] if f["code"] == "machine-spindle-off"]
    assert worst[0] == worst[1]
    assert worst[0]["spindle_power_w"] > 0.0


def test_a_speed_that_the_tool_change_stops_is_the_one_that_is_guessed(program: Path, tmp_path: Path) -> None:
    """M6 stops the spindle that M3 S10000 started: its speed is known. One above the spindle's is its greatest."""
    program.write_text(FUSION.replace("T3 M6\nS4000 M3", "(S9 of old) M3 S10000\nT3 M6"))
    code, said, _ = call("init", program, tmp_path / "job")
    assert code == 0
    assert "program.speed_rpm = 10000.0: the text cuts with the spindle at rest; S10000 of the text" in said
    program.write_text(FUSION.replace("T3 M6\nS4000 M3", "M3 S24000\nT3 M6"))
    _, said, _ = call("init", program, tmp_path / "fast")
    assert "speed_rpm = 15000.0: the text cuts with the spindle at rest; S24000 of the text, as far as" in said


def test_a_program_whose_axes_no_machine_has(tmp_path: Path) -> None:
    path = tmp_path / "quill.ngc"
    path.write_text("G21 G90 F100\nG1 X1 B5 C5\nG1 W3\nM2\n")
    code, _, said = call("init", path, tmp_path / "job")
    assert code == 2
    assert said == (
        "chipload: quill.ngc: none of the machines vmc, xyzbc-trunnion, xyzac-trunnion, xyzbc-head-table has its axes: "
        "line 3: W moves: machine vmc has the axes XYZ; line 3: W moves: machine xyzbc-trunnion has the axes CBXYZ; "
        "line 3: W moves: machine xyzac-trunnion has the axes CAXYZ; "
        "line 3: W moves: machine xyzbc-head-table has the axes CXYZB: name a machine that has (--on)\n"
    )


def test_a_table_of_numbers_is_no_program(tmp_path: Path) -> None:
    path = tmp_path / "points.txt"
    path.write_text("51.2 30.1 2.0\n52.2 30.1 2.0\n")
    code, _, said = call("init", path, tmp_path / "job")
    assert code == 2
    assert said == (
        "chipload: points.txt: neither NC text nor CL data nor a table with a heading of its columns: "
        "line 1: character '5': begins no word\n"
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


def test_comments_of_other_posts() -> None:
    """FeatureCAM's APT, Heidenhain and Sinumerik: numbers as they stand in the texts."""
    apt = "UNITS/MM\nINSERT/[HOLDER=C40] 14MM CRB 2FL 32 LOC\nCUTTER/14.,0,7.,0,0,0,84.\nLOAD/TOOL,17\n"
    apt += "CSI_SET_FLUTE_LENGTH/32.\nCSI_SET_EXTENSION_LENGTH/60.\nINSERT/Stock Size X135. Y130. Z30.\nGOTO/0,0,0\n"
    found = read_header(apt, apt=True)
    tool = {k: v for k, (v, _) in found.cutters[17].items()}
    assert tool["diameter_mm"] == 14.0
    assert (tool["flutes"], tool["modulus_gpa"], tool["flute_length_mm"], tool["overhang_mm"]) == (2, 580.0, 32.0, 60.0)
    assert found.stock is not None
    assert found.stock[0] == ((0.0, 0.0, -30.0), (135.0, 130.0, 0.0))
    conversational = ";3.0mm DRILL FLUTE LEN 16.0 FLUTE EXT 25.0\n26 TOOL DEF 114 L+1.000 R+0.000\n"
    drill = read_header(conversational).cutters[114]
    assert [drill[k][0] for k in ("diameter_mm", "flute_length_mm", "overhang_mm")] == [3.0, 16.0, 25.0]
    created = read_header("(stockMin:0.00mm, -1.5mm, -12.70mm)\n(stockMax:4in, 100.00mm, 0.00mm)\nG21")
    assert created.stock is not None
    assert created.stock[0] == ((0.0, -1.5, -12.7), (101.6, 100.0, 0.0))
    vectric = read_header("( Material Size)\n( X= 100.000, Y= 80.000, Z= 12.000)\nG21")
    assert vectric.stock is not None
    assert vectric.stock[0] == ((0.0, 0.0, -12.0), (100.0, 80.0, 0.0))
    siemens = read_header('WORKPIECE(,"",,"BOX",112,0,-20,-80,-5,-5,100,60)')
    assert siemens.stock is not None
    assert siemens.stock[0] == ((-5.0, -5.0, -20.0), (100.0, 60.0, 0.0))
    # high-speed steel is a tool's
    assert read_header("(T1 HSS STEEL END MILL)").material is None


def said_of(tools: str) -> dict[int, dict[str, object]]:
    """What comments state about each tool, but for its name."""
    found = read_header(tools).cutters
    return {n: {k: v for k, (v, _) in own.items() if k != "name"} for n, own in found.items()}


@pytest.mark.parametrize(
    ("text", "stated"),
    [
        ("(TC: 5mm Endmill)\n(begin toolchange)\nM5\nM6 T1\nG43 H1", {1: {"diameter_mm": 5.0}}),
        ("N10 T7 M6 (BALL END MILL 6MM)", {7: {"diameter_mm": 6.0, "corner_radius_mm": 3.0}}),
        ('T2\n(1/4" ENDMILL)\nM6', {2: {"diameter_mm": 6.35}}),
        ("(DRILL 5.5 mm)\nG0 X1\nT3 M6", {}),
        ("N120T1M06\nN130 (End Mill {6 mm})\nN140G00Z20.000", {1: {"diameter_mm": 6.0}}),
        ("N120T1M06\nN130G00Z20.000\nN140 (End Mill {6 mm})", {}),
        ("(plate of 20 mm)\nT3 M6", {}),
        ("T1 M06 (3/8 4FL ENDMILL)", {1: {"diameter_mm": 9.525, "flutes": 4}}),
        ("(TOOL/MILL,3.17, 0.00, 0.00, 0.00)\nM6 T102", {102: {"diameter_mm": 3.17}}),
        ("( T5 | 6. DRILL | H5 | D5 )", {5: {"diameter_mm": 6.0}}),
        ("(T4 D=6. CR=0. TAPER=118deg - ZMIN=-12. - drill)", {4: {"diameter_mm": 6.0, "bottom_deg": 31.0}}),
    ],
)  # fmt: skip
def test_tools_of_other_posts(text: str, stated: dict[int, dict[str, object]]) -> None:
    """FreeCAD names a tool above its change, Mastercam in a table; a motion in between ends what a comment is about."""
    assert said_of(text) == {n: pytest.approx(own) for n, own in stated.items()}


@pytest.mark.parametrize(
    ("comment", "name"),
    [
        ("Output Time:2024-04-02 20:11:48", None),
        ("DATE=DD-MM-YY - 2024 TIME=HH:MM - 10:45", None),
        ("FEB 3 2024", None),
        ("SET VALUE 3", None),
        ("MATERIAL: 2024", "group-22-aluminium"),
        ("STOCK AL2024-T351", "group-22-aluminium"),
        ("7075 T6", "al7075-t6"),
        ("MATERIAL - STEEL MM - 1030 - 200 BHN", "group-2-steel"),
        ("AISI 1018", "group-2-steel"),
        ("T1 HSS STEEL END MILL", None),
    ],
)  # fmt: skip
def test_the_material_of_a_comment(comment: str, name: str | None) -> None:
    """A year is no alloy."""
    found = read_header(f"({comment})").material
    assert (found and found[0]) == name


def test_a_material_that_is_not_shipped_is_named(program: Path, tmp_path: Path) -> None:
    program.write_text(FUSION.replace("STEEL 1045", ": DELRIN"))
    _, said, _ = call("init", program, tmp_path / "job")
    why = "none that is shipped is like DELRIN; chipload materials lists all"
    assert f'guess: material.name = "al7075-t6": {why}' in said


def test_a_drill_has_a_point_and_two_flutes(program: Path, tmp_path: Path) -> None:
    program.write_text(FUSION.replace("(T3 D=8. CR=0. - ZMIN=-2. - flat end mill)", "(T3 | 8. DRILL | H3 | D3)"))
    call("init", program, tmp_path / "job")
    (cutter,) = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["cutter"]
    assert (cutter["diameter_mm"], cutter["bottom_deg"], cutter["flutes"]) == (8.0, 31.0, 2)
    assert cutter["name"] == "8. DRILL"


def test_a_text_without_a_change_of_tools(program: Path, tmp_path: Path) -> None:
    """T alone changes nothing: what cuts is tool 0, with the size of the only tool that the text names."""
    program.write_text("(TOOL 2: 1/2 FLAT)\n" + FUSION[FUSION.index("G21") :].replace("T3 M6", "T2"))
    call("init", program, tmp_path / "job")
    (cutter,) = tomllib.loads((tmp_path / "job" / "job.toml").read_text())["cutter"]
    assert (cutter["number"], cutter["diameter_mm"]) == (0, 12.7)


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
    assert (code, "words.txt: line 1: " in err) == (2, True)


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
    assert "guess: stock" not in said


def test_a_camotics_project_whose_script_has_no_nc_text(tmp_path: Path) -> None:
    tool = {"units": "metric", "shape": "cylindrical", "length": 20, "diameter": 6}
    (tmp_path / "sign.camotics").write_text(json.dumps({"tools": {"1": tool}, "files": ["letters.tpl"]}))
    code, _, err = call("init", tmp_path / "sign.camotics", tmp_path / "job")
    assert code == 2
    assert "export the NC text of letters.tpl from CAMotics, as sign.nc beside the project" in " ".join(err.split())
    (tmp_path / "sign.camotics").write_text(json.dumps({"tools": {"1": tool}, "files": ["letters.nc"]}))
    _, _, err = call("init", tmp_path / "sign.camotics", tmp_path / "job")
    assert err.rstrip().endswith("(letters.nc): put it beside the project")


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


def test_a_draft_is_looked_at(program: Path, tmp_path: Path) -> None:
    """The same verdict and the same worst values as of the file itself; a machine is stated in the job."""
    assert call("init", program, tmp_path / "job")[0] == 0
    job = tmp_path / "job" / "job.toml"
    code, said, _ = call("simulate", program, "--set", "operation.0.step_mm=20")
    again, same, _ = call("simulate", job, "--set", "operation.0.step_mm=20")
    worst = [[line for line in text.splitlines() if line.startswith("worst values")] for text in (said, same)]
    assert (again, worst[1]) == (code, worst[0])
    assert same.splitlines()[-1] == "unproven: a first result"
    code, _, said = call("simulate", job, "--machine", "vmc")
    assert (code, said) == (2, "chipload: --machine: job.toml is a job: state it there, or with --set\n")


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
