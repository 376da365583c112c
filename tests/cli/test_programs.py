"""The command line on programs that exist: check, convert, run."""

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from command import call

TEXT = """G21 G90 G17 G94
T3 M6
G43 H3
S8000 M3
G0 X0 Y0 Z5
M8
G1 Z-1 F100
X30 F600
G3 X30 Y20 I0 J10
G1 X0
G3 X0 Y0 I0 J-10
G4 P0.5
G0 Z5
M9
M5
M2
"""
TABLE = "T3 P3 D10 Z50\n"
APT = """PARTNO/A PART
UNITS/MM
LOADTL/1
SPINDL/3000,RPM,CLW
RAPID
GOTO/0,0,50
FEDRAT/500,MMPM
GOTO/0,0,5
MULTAX/ON
GOTO/20,0,5,0,0.17364817766693033,0.984807753012208
GOTO/20,10,5,0.17364817766693033,0,0.984807753012208
FINI
"""


@pytest.fixture
def files(tmp_path):
    (tmp_path / "a.ngc").write_text(TEXT)
    (tmp_path / "t.tbl").write_text(TABLE)
    (tmp_path / "p.cls").write_text(APT)
    return tmp_path


def test_a_program_that_fits(files: Path):
    code, out, err = call("check", files / "a.ngc", "--machine", "vmc", "--tools", files / "t.tbl")
    assert (code, err) == (0, "")
    assert "line 6: M8: coolant" in out
    # 30 + 30 at each straight, two half circles of radius 10, 6 down and 6 up
    length = 2 * 30 + 2 * np.pi * 10 + 6 + 6
    assert re.search(rf"a\.ngc: 8 motions on machine vmc, {length:.6g} mm", out)
    assert out.splitlines()[-1] == "the program stays within the limits of machine vmc"


def test_a_program_beyond_the_machine(files: Path):
    (files / "b.ngc").write_text(
        TEXT.replace("X30 F600", "X900 F600").replace("G3 X30 Y20 I0 J10", "Y20").replace("M3", "")
    )
    code, out, _ = call("check", files / "b.ngc", "--machine", "vmc")
    assert code == 3
    assert "X goes from -10 to 900 mm, 910 mm: machine vmc travels 800 mm" in out
    assert "cuts with the spindle at rest" in out
    assert out.count("[exceeds]") == 2


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["convert", "a.ngc", "b.ngc"], "--machine: missing: name a file (.toml, .ini) or one of "),
        (["check", "a.ngc", "--machine", "vcm"], "machine vcm: "),
        (["check", "a.xyz", "--machine", "vmc"], "a.xyz: the ending .xyz is not known: must be one of .ngc "),
        (["check", "none.ngc", "--machine", "vmc"], "none.ngc: cannot be read: "),
        (["check", "bad.ngc", "--machine", "vmc"], "bad.ngc: no motion: nothing to check: line 2: "),
        (["check", "a.ngc", "--machine", "vmc", "--dialect", "bosch"], "dialect = 'bosch': must be one of linuxcnc, "),
        (["convert", "a.ngc", "b.xyz", "--machine", "vmc"], "the ending .xyz cannot be written: must be one of .ngc "),
        (["convert", "p.cls", "b.ngc", "--machine", "vmc"], "program row "),
        (["check", "a.ngc", "--machine", "vmc", "--set", "a=1"], "--set: applies to a job"),
        (["check", "a.toml", "--machine", "vmc"], "--machine: applies to a program"),
    ],
)
def test_refused(files: Path, monkeypatch, words, text):
    (files / "bad.ngc").write_text("G21\nG1 X1 G0\nM2\n")
    (files / "a.xyz").write_text("")
    monkeypatch.chdir(files)
    before = sorted(files.iterdir())
    code, out, err = call(*words)
    assert (code, out) == (2, "")
    assert err.startswith(f"chipload: {text}")
    assert len(err.splitlines()) == 1
    assert sorted(files.iterdir()) == before


def test_converted_for_another_controller(files: Path):
    code, out, _ = call("convert", files / "a.ngc", files / "a.nc", "--machine", "vmc-fanuc", "--from", "vmc")
    assert code == 0
    text = (files / "a.nc").read_text().splitlines()
    assert text[1].startswith("O0001 (NOT VERIFIED")
    assert "M8" in text
    assert text.index("M8") < text.index("G1 Z-1. F100.")
    assert "M9" in text
    assert "G3 X30. Y20. I0. J10." in text
    assert "not verified" in out


def test_converted_for_five_axes(files: Path):
    """Read back, the tip and the tool's axis are those of the CL data."""
    from chipload.machine.machine import machine_named
    from chipload.program.read import read_program

    code, _, err = call(
        "convert", files / "p.cls", files / "p.ngc", "--machine", "xyzbc-trunnion", "--tools", files / "t.tbl"
    )
    assert (code, err) == (0, "")
    read = read_program(files / "p.ngc", machine_named("xyzbc-trunnion"))
    s, c = 0.17364817766693033, 0.984807753012208
    for tip, axis in (((0, 0, 5), (0, 0, 1)), ((20, 0, 5), (0, s, c)), ((20, 10, 5), (s, 0, c))):
        near = np.linalg.norm(read.program.p_work - tip, axis=1)
        k = int(near.argmin())
        assert near[k] < 2e-6
        np.testing.assert_allclose(read.program.axis[k], axis, atol=1e-7)


def test_a_coarser_tolerance_makes_fewer_pieces(files: Path):
    """The pieces of a row go with the root of the tolerance."""
    counts = []
    for tolerance in ("0.01", "0.0001"):
        out = files / f"{tolerance}.ngc"
        words = ("--machine", "xyzbc-trunnion", "--tolerance-mm", tolerance)
        assert call("convert", files / "p.cls", out, *words)[0] == 0
        counts.append(sum(line.startswith(("X", "Y", "Z", "B", "G93")) for line in out.read_text().splitlines()))
    assert 7 <= counts[1] / counts[0] <= 13


def test_a_tolerance_of_nothing_is_refused(files: Path):
    code, _, err = call(
        "convert", files / "p.cls", files / "x.ngc", "--machine", "xyzbc-trunnion", "--tolerance-mm", "0"
    )
    assert code == 2
    assert "tolerance" in err
    assert not (files / "x.ngc").exists()


def test_a_job_with_a_program(files: Path):
    job = files / "job.toml"
    job.write_text('[program]\nfile = "a.ngc"\ntools = "t.tbl"\n[machine]\nname = "vmc"\n')
    code, out, err = call("run", job, "--out", files / "result")
    assert (code, err) == (3, "")
    assert out.startswith("Unproven: the program was not simulated in its stock")
    summary = json.loads((files / "result" / "summary.json").read_text())
    (operation,), (track,) = summary["operations"], summary["tracks"]
    assert summary["verdict"] == track["verdict"] == "unproven"
    assert operation["program"]["cutting_mm"] == pytest.approx(6 + 60 + 20 * np.pi)
    assert operation["program"]["rapid_mm"] == pytest.approx(6)
    assert [x["code"] for x in track["findings"]] == ["not-simulated"]
    history = pq.read_table(files / "result" / "history.parquet")
    assert {"operation", "track", "pass", "line", "x_mm", "y_mm", "z_mm", "axis_z", "feed_mm_min", "t_s"} <= set(
        history.column_names
    )
    assert list(dict.fromkeys(history["line"].to_pylist())) == [5, 7, 8, 9, 10, 11, 12, 13]
    # an arc has a row a chord, no chord is farther than 0.01 mm from it
    where = np.column_stack([history[f"{x}_mm"].to_numpy() for x in "xyz"])
    length = np.linalg.norm(np.diff(where, axis=0), axis=1).sum()
    assert length < history["s_mm"][-1].as_py() == pytest.approx(12 + 60 + 20 * np.pi)
    assert length == pytest.approx(12 + 60 + 20 * np.pi, rel=2e-4)
    assert history["t_s"][-1].as_py() == pytest.approx(track["time_s"]) == operation["program"]["time_s"]
    page = (files / "result" / "report.html").read_text()
    assert "<b>unproven</b>" in page
    assert sorted(p.name for p in (files / "result").iterdir()) == [
        "0-program.apt", "history.parquet", "report.html", "scene.glb", "summary.json"
    ]  # fmt: skip
    assert "NOT VERIFIED" in (files / "result" / "0-program.apt").read_text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[program]\nfil = "a.ngc"\n[machine]\nname = "vmc"\n', "program.fil: unknown key; did you mean file?"),
        (
            '[program]\nfile = "a.ngc"\n[machine]\nname = "vmc"\n[part]\nfile = "x.stl"\nspacing_mm = 1.0\n',
            "part: not used where a program is only read: add an [[operation]]",
        ),
        ('[program]\nfile = "a.ngc"\n', "machine: missing: state it"),
        (
            '[program]\nfile = "a.ngc"\nfeed_mm_min = -1\n[machine]\nname = "vmc"\n',
            "program.feed_mm_min = -1: must be above 0",
        ),
    ],
)
def test_a_job_with_a_program_that_is_refused(files: Path, text, said):
    (files / "job.toml").write_text(text)
    code, out, err = call("run", files / "job.toml", "--out", files / "result")
    assert (code, out) == (2, "")
    assert said in err
    assert not (files / "result").exists()
