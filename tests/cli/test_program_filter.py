"""`chipload filter`: what the screen of LinuxCNC runs on a program before it loads it."""

from __future__ import annotations

import ast
import gc
import gettext
import os
import re
import select
import shlex
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chipload.cli import app
from chipload.machine.saved_offsets import saved_offsets
from command import TIME_LEFT

AXIS = Path("/usr/bin/axis")
#: a LinuxCNC machine of three axes: travel 400 x 300 x 200 mm about no particular zero
INI = """[KINS]
KINEMATICS = trivkins
JOINTS = 3
[TRAJ]
COORDINATES = XYZ
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
MAX_LINEAR_VELOCITY = 100
""" + "".join(
    f"[AXIS_{letter}]\nMIN_LIMIT = 0\nMAX_LIMIT = {high}\nMAX_VELOCITY = 100\nMAX_ACCELERATION = 500\n"
    f"[JOINT_{k}]\nTYPE = LINEAR\nMIN_LIMIT = 0\nMAX_LIMIT = {high}\nMAX_VELOCITY = 100\nMAX_ACCELERATION = 500\n"
    for k, (letter, high) in enumerate(zip("XYZ", (400, 300, 200), strict=True))
)
GOOD = b"G21 G90 G94 G17 G54\r\nT1 M6\r\nS3000 M3\r\nG0 X-10 Y5 Z5\r\nG1 Z-1 F100\r\nX30 F400 (\xfc)\r\nG0 Z5\r\nM2\r\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mill.ini").write_text(INI)
    (tmp_path / "it's good.ngc").write_bytes(GOOD)
    (tmp_path / "bad.ngc").write_bytes(GOOD.replace(b"F400", b"F40000"))
    (tmp_path / "open.ngc").write_bytes(GOOD.replace(b"X30 F400", b"G55\r\nX30 F400"))
    return tmp_path


def call(folder: Path, name: str, *words: str, **variables: str) -> tuple[int, bytes, str]:
    """The command in this process."""
    own = {"INI_FILE_NAME": str(folder / "mill.ini"), **variables}
    done = CliRunner().invoke(app, ["filter", *words, str(folder / name)], env=own)
    return done.exit_code, done.stdout_bytes, TIME_LEFT.sub("", done.stderr)


def call_by_shell(folder: Path, name: str, *words: str, **variables: str) -> tuple[int, bytes, str]:
    """As the screen does it: the words of the ini and the file in quotes, by a shell."""
    line = f"{sys.executable} -m chipload filter {shlex.join(words)} {shlex.quote(str(folder / name))}"
    own = os.environ | {"INI_FILE_NAME": str(folder / "mill.ini")} | variables
    done = subprocess.run(["sh", "-c", line], capture_output=True, stdin=subprocess.DEVNULL, env=own)
    return done.returncode, done.stdout, done.stderr.decode()


def test_a_good_program_passes_byte_by_byte(folder: Path) -> None:
    code, out, err = call_by_shell(folder, "it's good.ngc", AXIS_PROGRESS_BAR="1")
    assert (code, out) == (0, GOOD)
    assert err.splitlines()[-1] == "FILTER_PROGRESS=100"
    # X -10 is outside the travel of 0 to 400 mm only with the work offset at zero, and none is saved
    assert "not checked: travel: work offset not stated" in err
    assert "travels" not in err


def test_a_limit_of_the_machine_holds_it_back(folder: Path) -> None:
    code, out, err = call(folder, "bad.ngc")
    assert (code, out) == (3, b"")
    assert "line 6: " in err
    assert "feed 40000 mm/min" in err
    assert err.splitlines()[-1] == "bad.ngc is not loaded: a limit is exceeded"


def test_what_could_not_be_checked_holds_it_back_until_allowed(folder: Path) -> None:
    code, out, err = call(folder, "open.ngc")
    assert (code, out) == (3, b"")
    assert err.splitlines()[-1].startswith(
        "open.ngc is not loaded: something could not be checked; add `--allow-unproven`"
    )
    code, out, _ = call(folder, "open.ngc", "--allow-unproven")
    assert (code, out) == (0, (folder / "open.ngc").read_bytes())


def test_work_offsets_that_linuxcnc_saved(folder: Path) -> None:
    """Two work offsets are a gap until the parameter file states both; one that is turned is not taken."""
    with (folder / "mill.ini").open("a") as file:
        file.write("[RS274NGC]\nPARAMETER_FILE = mill.var\n")
    rows = {5221: 1.0, 5222: 2.0, 5223: 3.0, 5230: 0.0, 5241: 100.0, 5242: 0.0, 5243: 0.0, 5250: 0.0}
    text = "".join(f"{number}\t{value:f}\n" for number, value in rows.items())
    (folder / "mill.var").write_text(text)
    assert saved_offsets(folder / "mill.ini") == {
        "G54": [1.0, 2.0, 3.0, *[0.0] * 6], "G55": [100.0, *[0.0] * 8],
    }  # fmt: skip
    assert call(folder, "open.ngc")[0] == 0
    (folder / "mill.var").write_text(text.replace("5250\t0", "5250\t9"))
    assert call(folder, "open.ngc")[0] == 3
    (folder / "mill.var").write_text("5221 x\n")
    code, _, err = call(folder, "open.ngc")
    assert (code, err.splitlines()[-1]) == (2, "chipload: mill.var: parameter 5221 = x: must be a number")


def test_without_a_machine_it_is_refused(folder: Path) -> None:
    code, out, err = call(folder, "bad.ngc", INI_FILE_NAME="")
    assert (code, out) == (2, b"")
    assert "--machine: missing" in err


JOB = """[program]
file = "{file}"
[machine]
file = "mill.toml"
[stock]
low_mm = [-20.0, -5.0, -5.0]
high_mm = [40.0, 15.0, 0.0]
layer_mm = 2.5
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 6.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 15.0
overhang_mm = 25.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = 5.0
[limits]
force_n = {force}
"""


def test_a_job_beside_it_is_run(folder: Path) -> None:
    """A slot 1 mm deep at 0.067 mm a tooth takes about 100 N: far above 5 N, far below 5000 N."""
    name = "it's good.ngc"
    job = folder / "it's good.toml"
    for force, code in ((5.0, 3), (5000.0, 0)):
        job.write_text(JOB.format(file=name, force=force).replace('file = "mill.toml"', 'name = "vmc"'))
        found, out, err = call(folder, name)
        assert found == code, err
        assert out == (GOOD if code == 0 else b"")
        assert (folder / "it's good-checked" / "report.html").is_file()
    job.write_text(JOB.format(file="bad.ngc", force=5.0).replace('file = "mill.toml"', 'name = "vmc"'))
    found, out, err = call(folder, name)
    assert (found, out) == (2, b"")
    assert "is not a job of it's good.ngc" in err


@pytest.mark.skipif(not AXIS.exists(), reason="LinuxCNC's screen is not installed")
def test_the_screen_of_linuxcnc_takes_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """AXIS's own function that runs a filter, taken from the installed screen, with a window that shows nothing."""
    tree = ast.parse(AXIS.read_text(encoding="utf-8"))
    one = next(n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == "filter_program")
    shown: list[int] = []

    class Window:
        def __init__(self, *_: object) -> None: ...
        def update(self, *values: int) -> None:
            shown.extend(values[:1])

        def set_text(self, _: str) -> None: ...
        def done(self) -> None: ...

    space = {
        "os": os, "sys": sys, "select": select, "Progress": Window, "t": Window(), "_": gettext.gettext,
        "progress_re": re.compile("^FILTER_PROGRESS=(\\d*)$"),
    }  # fmt: skip
    exec(compile(ast.Module([one], []), str(AXIS), "exec"), space)
    monkeypatch.setenv("INI_FILE_NAME", str(folder / "mill.ini"))

    def run(*values: str) -> tuple[int, str]:
        # the screen leaves its files open
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            found = space["filter_program"](*values)
            gc.collect()
        return found

    loaded = folder / "loaded.ngc"
    code, _ = run(f"{sys.executable} -m chipload filter", str(folder / "it's good.ngc"), str(loaded))
    assert (code, loaded.read_bytes()) == (0, GOOD)
    assert all(0 <= x <= 100 for x in shown)
    code, err = run(f"{sys.executable} -m chipload filter", str(folder / "bad.ngc"), str(loaded))
    assert code == 3
    assert "feed 40000 mm/min" in err
