"""Several setups of a part: closed forms of what each removes, and stock that one leaves for the next."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from chipload.errors import InputError
from chipload.jobs import load_job, run_job
from chipload.jobs.drafts.program import draft_program
from chipload.machine.machine import machine_named
from chipload.program.lines_of import reading_of_lines
from chipload.program.read import read_program
from chipload.stock.layers import LayeredStock

HEAD = "%\nO0001\nG21 G90 G17 G40 G49 G80\nT1 M6\nS3000 M3\n"
JOB = """
[program]
file = "part.nc"
control = "fanuc"
settings = { point = "increment" }
[machine]
name = "vmc"
[stock]
low_mm = [0, 0, -20]
high_mm = [40, 30, 0]
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 12
flutes = 3
helix_deg = 30
flute_length_mm = 30
overhang_mm = 40
modulus_gpa = 580
[[operation]]
kind = "simulate"
step_mm = 4
[limits]
force_n = 3000
"""


def faced(offset, depth, rows=(5, 15, 25)):
    """Cuts along X beside one another, in a work offset."""
    cuts = "".join(f"G0 X-10. Y{y}.\nZ-{depth}.\nG1 X50. F400.\nG0 Z20.\n" for y in rows)
    return f"S3000 M3\n{offset} G0 X-10. Y5.\nG43 H1 Z20.\n{cuts}M5\n"


def job(folder: Path, first: str, second: str, setups: str) -> Path:
    """A job of two setups: the lines before M0 and those from it on."""
    text = f"{HEAD}{first}"
    line = text.count("\n")
    (folder / "part.nc").write_text(f"{text}M0 (TURN THE PART)\n{second}M30\n%\n")
    last = line + second.count("\n") + 1
    own = f'[[setup]]\nlines = [1, {line}]\nwork_offset = "G54"\n[[setup]]\nlines = [{line + 1}, {last}]\n'
    path = folder / "job.toml"
    path.write_text(f'{JOB}{own}work_offset = "G55"\n{setups}\n')
    return path


def codes(track):
    return {f.code for f in track.findings}


def test_a_block_faced_on_two_sides(tmp_path: Path):
    """A block of 40 x 30 x 20 mm loses 1 mm on one side and 2 mm on the other: 17 mm are left."""
    path = job(tmp_path, faced("G54", 1), faced("G55", 2), 'flip = { axis = "x" }\nzero = ["x-", "y-", "z+"]')
    done = run_job(load_job(path))
    result = done.result
    assert [track.name for track in result.tracks] == ["setup 1", "setup 2"]
    assert [op["removed_mm3"] for op in result.operations] == pytest.approx([40 * 30 * 1, 40 * 30 * 2], rel=1e-9)
    assert result.verdict == "holds", result.message
    folder = done.save(tmp_path / "result")
    left = LayeredStock.load(folder / "stock.npz")
    full = [k for k in range(left.layers) if left.area(k) > 0.0]
    assert (left.bounds[full[0]], left.bounds[full[-1] + 1]) == pytest.approx((-19.0, -2.0), abs=1e-9)
    assert left.volume() == pytest.approx(40 * 30 * 17, rel=1e-9)
    assert {"0-program.apt", "1-program.apt"} <= {file.name for file in folder.iterdir()}
    summary = json.loads((folder / "summary.json").read_text())
    assert [op["setup"] for op in summary["operations"]] == [1, 2]


SLOT = "S3000 M3\nG54 G0 X-10. Y5.\nG43 H1 Z20.\nZ-8.\nG1 X50. F400.\nG0 Z20.\nM5\n"
#: the slot of setup 1 is 11 mm wide at Y-; turned by 180 deg about Z it is at Y = 19 to 30
TURNED = 'flip = { axis = "z" }\nzero = ["x-", "y-", "z+"]'
RAPID = "S3000 M3\nG55 G0 X-10. Y{y}.\nG43 H1 Z20.\nZ-5.\nX50.\nZ20.\nY26.\nX-10.\nZ-10.\nG1 X50. F400.\nG0 Z20.\nM5\n"


@pytest.mark.parametrize(
    ("y", "setups", "exceeds"),
    [
        # through the slot that setup 1 has cut
        (26, TURNED, False),
        # through what it has left
        (15, TURNED, True),
        # of a new block nothing is cut yet
        (26, "stock = { low_mm = [0, 0, -20], high_mm = [40, 30, 0] }", True),
    ],
)
def test_a_rapid_in_what_an_earlier_setup_left(tmp_path: Path, y, setups, exceeds):
    result = run_job(load_job(job(tmp_path, SLOT, RAPID.format(y=y), setups))).result
    first, second = result.tracks
    assert "rapid-cuts" not in codes(first)
    assert ("rapid-cuts" in codes(second)) is exceeds
    assert (result.verdict == "exceeds") is exceeds
    if not exceeds:
        # the slot again, 10 mm instead of 8 mm deep and 10 mm of its width; faces are found within 1e-6 mm
        assert result.operations[1]["removed_mm3"] == pytest.approx(40 * 10 * 2, rel=1e-6)


def test_an_unproven_setup_leaves_an_unproven_stock(tmp_path: Path):
    """What is cut from a stock that an unproven setup leaves is unproven."""
    first = faced("G54", 1).replace("M5\n", "G12.3\nM5\n")
    path = job(tmp_path, first, faced("G55", 2), 'flip = { axis = "x" }\nzero = ["x-", "y-", "z+"]')
    second = run_job(load_job(path)).result.tracks[1]
    assert "setup-before" in codes(second)
    assert second.verdict == "unproven"


@pytest.mark.parametrize(
    ("setups", "message"),
    [
        ('flip = { axis = "x" }', r"setup\.1\.zero: missing: where is the program's zero on the part\?"),
        ('flip = { axis = "x", angle_deg = 30 }\nzero_mm = [0, 0, 0]', r"setup\.1\.flip\.angle_deg = 30: about X"),
        ('zero_mm = [0, 0, 0]\nzero = ["x-", "y-", "z+"]', r"setup\.1: zero and zero_mm: state one"),
        (
            "zero_mm = [0, 0, 0]\nstock = { low_mm = [0, 0, -20], high_mm = [40, 30, 0] }",
            r"setup\.1: flip, zero and zero_mm turn the stock of the setup before",
        ),
        ("zero_mm = [0, 0, 0]\n[[setup]]\nzero_mm = [0, 0, 0]", r"setup\.2\.lines: missing: setup\.0 and setup\.2 run"),
        ('zero_mm = [0, 0, 0]\n[part]\nfile = "a.stl"\nspacing_mm = 1', r"part: belongs to one setup"),
    ],
)
def test_what_is_refused(tmp_path: Path, setups, message):
    with pytest.raises(InputError, match=message):
        load_job(job(tmp_path, SLOT, RAPID.format(y=26), setups))


def test_a_draft_of_two_setups(tmp_path: Path):
    """A stop with another work offset behind it is a setup of its own, and one question."""
    text = f"{HEAD}{faced('G54', 1)}M0 (FLIP PART)\n{faced('G55', 2)}M98 P2\nM30\nO0002\nG0 Z50.\nM99\n%\n"
    (tmp_path / "part.nc").write_text(text)
    draft = draft_program(tmp_path / "part.nc", tmp_path)
    first, second = (t for t in draft.tables if t.name == "setup")
    stop = text.splitlines().index("M0 (FLIP PART)") + 1
    end = text.splitlines().index("M30") + 1
    assert {e.key: e.value for e in first.entries} == {"lines": [1, stop - 1], "work_offset": "G54"}
    stated = {e.key: e.value for e in second.entries}
    assert (stated["lines"], stated["work_offset"]) == ([stop, end], "G55")
    assert (stated["flip"]["axis"], stated["flip"]["angle_deg"]) == ("x", 180.0)
    assert [q for q in draft.questions if "setup" in q] == [q for q in draft.questions if q.startswith("[setup]")]
    assert sum("[setup]" in q for q in draft.questions) == 1
    assert len(draft.questions) <= 5


@pytest.mark.parametrize(
    "between",
    # a change of tool that stops, and several equal parts without a stop
    [f"M0\n{faced('G54', 2)}", faced("G55", 2)],
)
def test_one_setup_is_no_question(tmp_path: Path, between):
    (tmp_path / "part.nc").write_text(f"{HEAD}{faced('G54', 1)}{between}M30\n%\n")
    assert not [t for t in draft_program(tmp_path / "part.nc", tmp_path).tables if t.name == "setup"]


def test_rows_of_a_subprogram_stay_with_the_setup_that_calls_it(tmp_path: Path):
    text = (
        f"{HEAD}G54 G0 X0. Y0. Z5.\nM98 P2\nM0\nG55 G0 X9. Y0. Z5.\nM98 P2\nM30\nO0002\nG91 G1 X1. F100.\nG90\nM99\n%\n"
    )
    (tmp_path / "part.nc").write_text(text)
    reading = read_program(tmp_path / "part.nc", machine_named("vmc"))
    first = reading_of_lines(reading, (1, 7), [(8, 11)]).program
    second = reading_of_lines(reading, (8, 11), [(1, 7)]).program
    assert first.p_work[:, 0].tolist() == [0.0, 1.0]
    assert second.p_work[:, 0].tolist() == [9.0, 10.0]


def test_offsets_between_two_stops_are_asked_for(tmp_path: Path):
    """The same cuts in two offsets without a stop: equal parts or sides of one; the program does not say."""
    (tmp_path / "part.nc").write_text(f"{HEAD}{faced('G54', 1)}{faced('G55', 1)}M30\n%\n")
    draft = draft_program(tmp_path / "part.nc", tmp_path)
    assert draft.questions[0].startswith("program.work_offsets: do G55 hold equal parts, or sides of one")
    assert "[[setup]]" not in draft.text()
    (tmp_path / "one.nc").write_text(f"{HEAD}{faced('G55', 1)}M30\n%\n")
    assert not any("work_offsets" in q for q in draft_program(tmp_path / "one.nc", tmp_path).questions)
