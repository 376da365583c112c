"""Jobs that run a program through a stock, by the command line."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from chipload import examples
from chipload.cli import app
from chipload.stock.layers import LayeredStock

SLOT = """G21 G90 G17 G94
T1 M6
S3000 M3
G0 X-10 Y0 Z5
G0 Z-2
G1 X30 F600
G0 Z5
M2
"""
JOB = """[program]
file = "slot.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, -15.0, -5.0]
high_mm = [50.0, 15.0, 0.0]
layer_mm = 1.0
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 20.0
overhang_mm = 30.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = 2.0
[limits]
force_n = 1000.0
"""


def call(*words):
    done = CliRunner().invoke(app, [str(w) for w in words])
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture
def job(tmp_path: Path) -> Path:
    (tmp_path / "slot.ngc").write_text(SLOT)
    (tmp_path / "job.toml").write_text(JOB)
    return tmp_path / "job.toml"


def test_the_example_cuts_two_pieces_and_as_much_as_the_stock_loses(tmp_path: Path) -> None:
    folder = examples.copy_example("chips", tmp_path / "chips")
    code, out, err = call("run", folder / "job.toml", "--out", tmp_path / "r")
    assert (code, err) == (0, "")
    assert out.startswith("Every stated limit holds in the simulation: force ")
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    op = summary["operations"][0]
    assert op["kind"] == "simulate"
    assert op["chip_pieces_max"] == 2
    assert op["chip_volume_mm3"] == pytest.approx(op["stock_removed_mm3"], rel=1e-6)
    assert op["chip_volume_mm3"] > 100.0
    for x in "xyz":
        assert op["force_n"][x]["min"] <= op["force_n"][x]["mean"] <= op["force_n"][x]["max"]
    assert 0.0 < op["torque_nm"]["mean"] < op["torque_nm"]["max"] <= 6.0
    assert op["power_w"]["mean"] > 0.0
    page = (tmp_path / "r" / "report.html").read_text()
    assert "Chips, force, torque, power" in page
    assert "two" not in summary["says"]


def test_a_slot_in_numbers(job: Path, tmp_path: Path) -> None:
    code, _, err = call("run", job, "--out", tmp_path / "r")
    assert (code, err) == (0, "")
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    op = summary["operations"][0]
    # 2 mm deep, 30 mm long and half a disc at its end
    assert op["chip_volume_mm3"] == pytest.approx(2.0 * (300.0 + 0.5 * np.pi * 25.0), rel=1e-3)
    assert summary["program"]["status"] == "simulated"
    assert op["unchecked"] == ["torque_nm", "power_w", "chip_mm", "gouge_mm", "excess_mm"]
    t = pq.read_table(tmp_path / "r" / "history.parquet")
    assert sum(t["chip_volume_mm3"].to_pylist()) == pytest.approx(op["chip_volume_mm3"])


def test_what_is_left_is_the_stock_of_the_next_job(job: Path, tmp_path: Path) -> None:
    call("run", job, "--out", tmp_path / "r")
    left = LayeredStock.load(tmp_path / "r" / "stock.npz")
    (job.parent / "left.npz").write_bytes((tmp_path / "r" / "stock.npz").read_bytes())
    text = JOB.replace("low_mm = [0.0, -15.0, -5.0]\nhigh_mm = [50.0, 15.0, 0.0]\nlayer_mm = 1.0", 'file = "left.npz"')
    job.write_text(text)
    code, _, err = call("run", job, "--out", tmp_path / "s")
    assert (code, err) == (0, "")
    op = json.loads((tmp_path / "s" / "summary.json").read_text())["operations"][0]
    assert op["stock_before_mm3"] == pytest.approx(left.volume(), rel=1e-12)
    # the slot is cut already, but for films where its edges were made simpler
    assert op["chip_pieces_max"] == 0
    assert op["chip_volume_mm3"] == pytest.approx(op["films_mm3"])
    assert op["films_mm3"] == pytest.approx(0.0, abs=1e-2)
    assert op["force_n"]["max"] == 0.0


def test_a_limit_that_does_not_hold_is_said_and_is_the_exit_code(job: Path, tmp_path: Path) -> None:
    code, out, _ = call("run", job, "--out", tmp_path / "r", "--set", "limits.force_n=10")
    assert code == 3
    assert "Does not hold: force" in out
    assert "exceeds 10 N in line 6" in out
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    assert summary["holds"] is False
    assert summary["program"]["status"] == "failed"
    assert summary["operations"][0]["limits"][0]["holds"] is False


def test_a_rapid_through_material_is_said(job: Path, tmp_path: Path) -> None:
    (job.parent / "slot.ngc").write_text(SLOT.replace("G1 X30 F600", "G0 X30"))
    code, out, _ = call("run", job, "--out", tmp_path / "r")
    assert code == 3
    assert "Does not hold: line 6: a rapid goes through material" in out


def test_check_reads_the_stock_and_cuts_nothing(job: Path) -> None:
    code, out, _ = call("check", job)
    assert code == 0
    assert "what the cutter meets was not simulated" in out


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("high_mm = [50.0, 15.0, 0.0]\n", "", "stock: state either low_mm and high_mm of a block, or a file"),
        ("layer_mm = 1.0\n", "", "stock.layer_mm: missing: state it"),
        ("[material]\nname = \"al7075-t6\"\n", "", "material: missing: state it (kind = simulate needs it)"),
        ("force_n = 1000.0\n", "", "limits: none is stated, so nothing would be checked: state at least one of"),
        ("step_mm = 2.0", "step_mm = 0.0", "operation.0.step_mm = 0: must be above 0"),
        ("[[operation]]\nkind = \"simulate\"\nstep_mm = 2.0\n", "", "stock: not used where a program is only read"),
        ("number = 1\n", "number = 4\n", "line 5: tool 1: no [[cutter]] has this number: state one beside 4"),
        ("S3000", "S0", "cuts with the spindle at rest"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_line(job: Path, tmp_path: Path, old: str, new: str, said: str) -> None:
    job.write_text(job.read_text().replace(old, new))
    text = (job.parent / "slot.ngc").read_text()
    (job.parent / "slot.ngc").write_text(text.replace(old, new))
    code, _, err = call("run", job, "--out", tmp_path / "r")
    assert code == 2
    assert said in err
    assert err.count("\n") == 1
    assert not (tmp_path / "r").exists()
