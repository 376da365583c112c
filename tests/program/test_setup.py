"""What a controller knows before a program: parameters and work offsets, and where the workpiece is placed."""

import os
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.errors import InputError, Severity
from chipload.machine.machine import machine_named
from chipload.program.read import read_program
from chipload.program.setup import Setup, offset_number

VMC = machine_named("vmc")
TWO = "G54 S900 M3\nG0 X0 Y0 Z5\nF600\nG1 X10\nG55\nG1 X1 Y2 Z3\nM2\n"


def read(folder: Path, text: str, name: str = "part.ngc", **setup):
    (folder / name).write_text(text)
    return read_program(folder / name, VMC, setup=Setup(**setup))


def gaps(reading):
    return [(f.code, f.line) for f in reading.findings if f.severity is Severity.UNPROVEN]


def test_two_work_offsets_without_origins_are_unproven(tmp_path: Path):
    reading = read(tmp_path, TWO)
    assert gaps(reading) == [("nc-offset-unset", 5)]
    text = next(f.text for f in reading.findings if f.code == "nc-offset-unset")
    assert text == ("G55: its origin is not known and is taken as the machine's: state it in program.work_offsets")


def test_one_work_offset_needs_no_origin(tmp_path: Path):
    assert gaps(read(tmp_path, TWO.replace("G54", "G55"))) == []


def test_origins_place_one_offset_in_the_other(tmp_path: Path):
    origins = {"G54": [100.0, 50.0, -20.0], "G55": [180.0, 55.0, -30.0]}
    reading = read(tmp_path, TWO, work_offsets=origins)
    assert gaps(reading) == []
    # by hand: (1, 2, 3) of G55, less how far G54 lies from it
    assert reading.program.p_work[-1] == pytest.approx([81.0, 7.0, -7.0])
    placed = read(tmp_path, TWO, work_offsets=origins, placed_in="G55")
    assert placed.program.p_work[-1] == pytest.approx([1.0, 2.0, 3.0])
    np.testing.assert_allclose(
        placed.program.p_work - reading.program.p_work, [[-80.0, -5.0, 10.0]] * len(placed.program)
    )
    np.testing.assert_allclose(placed.axes, reading.axes)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("part.nc", "G21 G90 G54.1 P1 S900 M3\nG0 X0. Y0. Z5.\nG54.1 P7\nG1 X1. Y2. Z3. F60.\nM30\n"),
        ("part.mpf", "G71 G54\nG0 X0 Y0 Z5\nG505\nG1 X1 Y2 Z3 F60\nM30\n"),
    ],
)
def test_further_work_offsets_of_other_controllers(tmp_path: Path, name, text):
    codes = ("G54.1 P1", "G54.1 P7") if name.endswith("nc") else ("G54", "G505")
    (tmp_path / name).write_text(text)
    dialect = "fanuc" if name.endswith("nc") else None
    bare = read_program(tmp_path / name, VMC, dialect=dialect)
    assert "nc-offset-unset" in [code for code, _ in gaps(bare)]
    origins = {codes[0]: [10.0, 0.0, 0.0], codes[1]: [20.0, 5.0, 1.0]}
    reading = read_program(tmp_path / name, VMC, dialect=dialect, setup=Setup(work_offsets=origins))
    assert gaps(reading) == []
    assert reading.program.p_work[-1] == pytest.approx([11.0, 7.0, 4.0])


def test_machine_coordinates_need_the_origin(tmp_path: Path):
    text = "G0 X0 Y0 Z5\nG53 G0 Z0\nM2\n"
    bare = read(tmp_path, text)
    assert gaps(bare) == []
    assert bare.retractions == (2,)
    assert bare.program.p_work[-1, 2] == pytest.approx(5.0)
    assert gaps(read(tmp_path, "G0 X0 Y0 Z5\nG53 G0 X0\nM2\n")) == [("nc-machine-coordinates", 2)]
    reading = read(tmp_path, text, work_offsets={"G54": [0.0, 0.0, -150.0]})
    assert gaps(reading) == []
    assert reading.program.p_work[-1, 2] == pytest.approx(150.0)


def test_parameters_of_every_dialect(tmp_path: Path):
    x = "G0 X0 Y0 Z#100\nX#<_width>\nM2\n"
    reading = read(tmp_path, x, parameters={"#100": 7.5, "#<_Width>": 2.0})
    assert reading.program.p_work[-1].tolist() == [2.0, 0.0, 7.5]
    reading = read(tmp_path, "G0 X0 Y0 Z=R10\nM30\n", "part.mpf", parameters={"R10": 4.0})
    assert reading.program.p_work[-1, 2] == 4.0
    blocks = "BEGIN PGM A MM\nFN18: SYSREAD Q3 = ID270 NR1 IDX3\nL X+0 Y+0 Z+Q3 FMAX\nEND PGM A MM\n"
    assert read(tmp_path, blocks, "part.h", parameters={"Q3": 9.0}).program.p_work[-1, 2] == 9.0


def test_a_parameter_that_counts_as_0_leaves_the_program_unproven(tmp_path: Path):
    assert gaps(read(tmp_path, "G0 X0 Y0 Z#100\nM2\n")) == [("nc-parameter-unset", 1)]


def test_a_feed_for_a_text_that_states_none(tmp_path: Path):
    (tmp_path / "part.ngc").write_text("G0 X0 Y0 Z0\nG1 X10\nF60\nX20\nM2\n")
    left_out = read_program(tmp_path / "part.ngc", VMC).findings
    assert [f.line for f in left_out if "the feed is 0 or was never set: give F" in f.text] == [2]
    reading = read_program(tmp_path / "part.ngc", VMC, feed=5.0)
    assert reading.program.feed.tolist() == [0.0, 5.0, 1.0]
    assert "nc-feed-given" in [f.code for f in reading.findings]


@pytest.mark.parametrize(
    ("setup", "name", "message"),
    [
        ({"parameters": {"R10": 1.0}}, "part.ngc", "program.parameters: 'R10': must be as linuxcnc names them: #100"),
        ({"parameters": {"#1": 1.0}}, "part.h", "program.parameters: '#1': must be as heidenhain names them: Q10"),
        ({"parameters": {"#9999": 1.0}}, "part.ngc", "parameter #9999: the number must be from 1 to 5601"),
        ({"work_offsets": {"G54": [1.0]}}, "part.ngc", "program.work_offsets: G54 = [1.0]: must be 3 to 9 numbers"),
        ({"work_offsets": {"G53": [1, 2, 3]}}, "part.ngc", "program.work_offsets: 'G53': must be G54 to G59.3"),
        ({"work_offsets": {"G54": [1, 2, 3]}}, "part.h", "program.work_offsets: 'G54': heidenhain has none: leave it"),
        ({"placed_in": "G56"}, "part.ngc", "program.placed_in: no motion is in G56: must be one of G54"),
        ({"placed_in": "P1"}, "part.ngc", "program.placed_in: 'P1': must be G54 to G59.3"),
    ],
)
def test_refused(tmp_path: Path, setup, name, message):
    text = "BEGIN PGM A MM\nL X+0 Y+0 Z+3 FMAX\nEND PGM A MM\n" if name == "part.h" else "G0 X1\nM2\n"
    with pytest.raises(InputError) as caught:
        read(tmp_path, text, name, **setup)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("name", "dialect", "number"),
    [("G54", "linuxcnc", 1), ("g59.1", "linuxcnc", 7), ("G57", "sinumerik", 4), ("G54.1  P300", "fanuc", 309)],
)
def test_names_of_work_offsets(name, dialect, number):
    assert offset_number(name, dialect) == number


@pytest.fixture
def data() -> Path:
    folder = Path(os.environ.get("CHIPLOAD_DATA", "/nonexistent")) / "nc"
    if not folder.is_dir():
        pytest.skip("no real programs: set CHIPLOAD_DATA")
    return folder


def test_a_real_conversational_program_with_the_parameters_that_it_asks_for(data: Path):
    path = data / "apt_dmu50" / "heidenhain" / "WALL.h"
    with pytest.raises(InputError, match="Q23 comes from the controller and is not known here: state it in program"):
        read_program(path, machine_named("dmu50"))
    given = {f"Q{n}": 10.0 for n in range(1, 40)}
    assert len(read_program(path, machine_named("dmu50"), setup=Setup(given)).program) == 5


def test_a_real_program_with_the_pins_of_its_machine(data: Path):
    path = data / "linuxcnc_5axis" / "xyzab-tdr-demo.ngc"
    with pytest.raises(InputError, match="or state it in program"):
        read_program(path, machine_named("horizontal-b"), strict=True)
    pins = ("x-rot-point", "z-rot-point", "x-offset", "z-offset")
    given = {f"_hal[xyzab_tdr_kins.{pin}]": 0.0 for pin in pins}
    assert len(read_program(path, machine_named("horizontal-b"), setup=Setup(given)).program) == 30


def test_the_command_line_gives_the_same(tmp_path: Path):
    (tmp_path / "part.ngc").write_text(TWO + "\n")
    (tmp_path / "free.ngc").write_text("G0 X0 Y0 Z#100\nM2\n")

    def check(*words: str) -> tuple[int, str, str]:
        done = CliRunner().invoke(app, ["check", *words, "--machine", "vmc"])
        return done.exit_code, done.stdout, done.stderr

    code, out, _ = check(str(tmp_path / "part.ngc"))
    assert (code, out.splitlines()[1].split(":")[:2]) == (3, ["line 5", " G55"])
    assert out.splitlines()[0] == "control: LinuxCNC 2.9 (stated)"
    assert "unproven: line 5: G55: its origin is not known and is taken as the machine's" in out
    code, out, _ = check(str(tmp_path / "part.ngc"), "--work-offset", "G55=80,5,-10", "--work-offset", "G54=0,0,0")
    assert code == 0
    assert "X 0 to 81, Y 0 to 7, Z -7 to 5 mm" in out
    code, out, _ = check(str(tmp_path / "free.ngc"), "--parameter", "#100=4.5")
    assert (code, "Z 4.5 to 4.5 mm" in out) == (0, True)
    for words, message in (
        (("--parameter", "#100=a"), "--parameter #100=a: must have the form NAME=NUMBER, with commas between numbers"),
        (("--parameter", "#100=1,2"), "--parameter #100: has 2 numbers: must have one"),
    ):
        assert message in check(str(tmp_path / "free.ngc"), *words)[2]
