"""Programs that their controller refuses, or that hold what is not read: the rest is read, and the gap is stated."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

from chipload.errors import InputError, Severity, worst_severity
from chipload.machine.machine import machine_named
from chipload.program.program import LINE, RAPID
from chipload.program.read import ENDINGS, read_program

VMC = machine_named("vmc")
MOVES = "S600 M3\nG0 X0 Y0 Z5\nG1 X10 F600\n"


def read(folder: Path, text: str, name: str = "part.ngc", **options):
    (folder / name).write_text(text)
    return read_program(folder / name, VMC, **options)


def gaps(reading):
    return [(f.code, f.line) for f in reading.findings if f.severity is Severity.UNPROVEN]


@pytest.mark.parametrize(
    ("text", "gap", "refusal"),
    [
        (MOVES + "%\nG1 X20\n", ("nc-percent", 4), "%: ends a text that begins with %"),
        (MOVES, ("nc-no-end", 4), "the text ends without M2, M30 or %"),
        (MOVES + "G187 P2\nM2\n", ("nc-unknown-word", 4), "G187: is not a code of LinuxCNC"),
        (MOVES + "M777\nM2\n", ("nc-unknown-word", 4), "M777: is not a code of LinuxCNC"),
        (MOVES + "G1 X10 R3\nM2\n", ("nc-unused-word", 4), "R3: no code of the block uses it"),
        (MOVES + "G76 P1 Z-5 I-1 J0.1 K0.5 X3\nM2\n", ("nc-unknown-word", 4), "threading cycles of a lathe"),
        (MOVES + f"G1 X10 ({'long ' * 60})\nM2\n", ("nc-long-line", 4), "a line has at most 255"),
    ],
    ids=["percent", "no end", "G187", "M777", "unused word", "G76", "long line"],
)
def test_what_linuxcnc_refuses_leaves_a_program_unproven(tmp_path: Path, text, gap, refusal):
    reading = read(tmp_path, text)
    assert gaps(reading) == [gap]
    assert reading.program.motion[:2].tolist() == [RAPID, LINE]
    assert reading.program.p_work[1].tolist() == [10.0, 0.0, 5.0]
    with pytest.raises(InputError, match=refusal.replace("(", r"\(")):
        read(tmp_path, text, strict=True)


@pytest.mark.parametrize("end", ["%", "%\n", " % \n\n"])
def test_a_percent_that_ends_a_text_loses_nothing(tmp_path: Path, end):
    # LinuxCNC 2.9, run headless: all motions are carried out, then "Bad character '%' used", the spindle goes on
    reading = read(tmp_path, MOVES + end)
    assert gaps(reading) == []
    (found,) = [f for f in reading.findings if f.code == "nc-percent"]
    assert found.line == 4
    assert found.text.endswith("the motions end here, the spindle goes on: write M2 in its place")
    with pytest.raises(InputError, match="this one does not: write M2 in its place"):
        read(tmp_path, MOVES + end, strict=True)


def test_a_motion_that_is_not_read_does_not_move_until_another_motion(tmp_path: Path):
    reading = read(tmp_path, MOVES + "G6.1 P3 X11 Y1\nX12 Y2\nX13 Y3\nG1 X20 Y0\nX30\nM2\n")
    assert reading.program.p_work[:, 0].tolist() == [0.0, 10.0, 20.0, 30.0]
    assert gaps(reading) == [("nc-unknown-word", line) for line in (4, 5, 6)]


@pytest.mark.parametrize("ending", [".gc", ".GC", ".gcd", ".din", ".g", ".I"])
def test_further_endings(tmp_path: Path, ending):
    assert ending.lower() in ENDINGS
    reading = read(tmp_path, MOVES + "M2\n", f"part{ending}")
    assert worst_severity(reading.findings) is Severity.NOTE
    assert len(reading.program) == 2


def test_many_gaps_stay_unproven_where_not_all_are_listed(tmp_path: Path):
    reading = read(tmp_path, MOVES + "(msg, one)\n" + "G187 P1\n" * 3000 + "M2\n")
    last = reading.findings[-1]
    assert (last.code, last.severity) == ("nc-more-findings", Severity.UNPROVEN)
    assert len(reading.findings) == 2001


def test_real_programs_that_were_refused_for_one_word():
    data = Path(os.environ.get("CHIPLOAD_DATA", "/nonexistent")) / "nc"
    if not data.is_dir():
        pytest.skip("no real programs: set CHIPLOAD_DATA")
    for name, code, motions in (
        ("camotics/compass/compass.ngc", None, 2900),
        ("camotics/heart/heart.ngc", "nc-no-end", 150),
        ("linuxcnc_nurbs/UNIPA #1=1.ngc", None, 900),
    ):
        path = data / name
        with pytest.raises(InputError):
            read_program(path, VMC, strict=True)
        reading = read_program(path, VMC)
        assert {found for found, _ in gaps(reading)} == ({code} if code else set()), name
        assert len(reading.program) > motions, name


@pytest.mark.parametrize(("machine", "dwell_s"), [("haas-vf-2", 2.0), ("vmc-fanuc", 0.002), ("brother-s700x1", 2.0)])
def test_a_program_that_shows_no_control_is_read_as_the_machine_s(tmp_path: Path, machine, dwell_s):
    """G4 P2. are two seconds on a Haas and a Brother; a Fanuc reads no point in P. P2 are two milliseconds."""
    named = machine_named(machine)
    text = "G90 G21 S3000 M3\nG0 X0. Y0. Z5.\nG1 X10. F300.\nG4 P{}\nG0 Z50.\nM30\n"
    (tmp_path / "part.nc").write_text(text.format("2."))
    long = read_program(tmp_path / "part.nc", named)
    assert long.recognition.control.name == (named.control or named.dialect)
    (tmp_path / "part.nc").write_text(text.format("2"))
    short = read_program(tmp_path / "part.nc", named)
    assert long.seconds.sum() - short.seconds.sum() == pytest.approx(dwell_s - 0.002, abs=1e-6)


def test_a_machine_s_control_must_be_one(tmp_path: Path):
    (tmp_path / "part.nc").write_text(MOVES + "M30\n")
    with pytest.raises(InputError, match="control = 'has': must be one of linuxcnc, fanuc, haas"):
        read_program(tmp_path / "part.nc", replace(VMC, control="has"))
