"""Jobs that run a program through a stock, by the command line."""

import json
import math
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from chipload import examples
from chipload.cutting.material import material_named
from chipload.errors import Cancelled
from chipload.jobs import load_job, run_job
from chipload.simulation.checkpoint import Checkpoint
from chipload.stock.layers import LayeredStock
from command import call
from mill import block_job, simulation

SLOT = """G21 G90 G17 G94
T1 M6
S3000 M3
G0 X-10 Y0 Z5
G0 Z-2
G1 X30 F600
G0 Z5
M2
"""
JOB = block_job("slot.ngc", "[0.0, -15.0, -5.0]", "[50.0, 15.0, 0.0]", simulation("force_n = 1000.0\n"))


def summary_of(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text())


def states(limits: list[dict[str, Any]]) -> dict[str, str]:
    """State of each limit by its name."""
    return {x["name"]: x["state"] for x in limits}


@pytest.fixture
def job(tmp_path: Path) -> Path:
    (tmp_path / "slot.ngc").write_text(SLOT)
    (tmp_path / "job.toml").write_text(JOB)
    return tmp_path / "job.toml"


def test_the_example_cuts_two_pieces_and_as_much_as_the_stock_loses(tmp_path: Path) -> None:
    folder = examples.copy_example("chips", tmp_path / "chips")
    code, out, _ = call("run", folder / "job.toml", "--out", tmp_path / "r")
    assert code == 0  # what errors prints is progress where kernels are compiled first
    assert out.startswith("Holds at 95 %: torque 3.6 + 0.39 of 6 N m, margin 33.6 %, in line 11 at ")
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    op = summary["operations"][0]
    assert op["kind"] == "simulate"
    # at an instant; the chip on a layer has two pieces
    assert op["chip_areas_max"] >= 2
    assert op["chip_volume_mm3"] == pytest.approx(op["removed_mm3"], rel=2e-4)
    assert op["chip_volume_mm3"] > 100.0
    for x in "xyz":
        assert op["force_n"][x]["min"] <= op["force_n"][x]["mean"] <= op["force_n"][x]["max"]
    assert 0.0 < op["torque_nm"]["mean"] < op["torque_nm"]["max"] <= 6.0
    assert op["power_w"]["mean"] > 0.0
    page = (tmp_path / "r" / "report.html").read_text()
    assert "Chips, force, torque, power" in page
    assert "The chip with most pieces (2)" in page
    assert summary["verdict"] == "holds"
    assert summary["tracks"][0]["findings"] == []
    assert {x["severity"] for x in summary["findings"]} <= {"note"}


def test_a_slot_in_numbers(job: Path, tmp_path: Path) -> None:
    code, _, _ = call("run", job, "--out", tmp_path / "r")
    assert code == 0
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    op = summary["operations"][0]
    # 2 mm deep, 30 mm long and half a disc at its end
    assert op["chip_volume_mm3"] == pytest.approx(2.0 * (300.0 + 0.5 * np.pi * 25.0), rel=1e-3)
    assert (summary["capability"], summary["verdict"], op["kind"]) == ("program", "holds", "simulate")
    names = (
        "torque_nm", "power_w", "chip_max_mm", "deflection_um", "deflection_workpiece_um", "form_error_um", "gouge_mm",
        "excess_mm", "stability_margin", "stable_probability", "sle_um",
    )  # fmt: skip
    assert [x for x in summary["unchecked"] if x.startswith("limit ")] == [f"limit {x}: not stated" for x in names]
    # by moves the stock that is left is found by itself: its outlines have chords
    assert op["removed_mm3"] == pytest.approx(op["chip_volume_mm3"], rel=1e-4)
    # the rim meets the stock when the tip is at x = -5, after 0.5 s at 10 mm/s; a step of 0.2 s cuts or does not
    assert 0.3 < op["air_cut_s"] <= 0.5
    # 40 mm at 10 mm/s, and the accelerations of the machine
    assert op["air_cut_s"] + op["cutting_s"] == pytest.approx(4.0, abs=0.1)
    parts = ("cutting_s", "air_cut_s", "rapid_s", "dwell_s", "other_s")
    assert sum(op[name] for name in parts) == pytest.approx(op["time_s"], rel=1e-12)
    assert op["time_s"] == op["program"]["time_s"] == summary["tracks"][0]["time_s"] > 4.0
    # mean torque of a full slot: teeth / (2 pi) R b (Ktc times the integral of h over the angle + Kte times the
    # angle); the paths of two teeth cross f / (2 R) before the full slot begins and behind its end; of the area
    # 2 R f of a chip, that is the integral of h - h^2 / (2 R), the integral of h is 2 f + pi f^2 / (4 R)
    al = material_named("al7075-t6")
    per_length = al.Ktc * (0.2 + math.pi * 0.1**2 / 20.0) + al.Kte * (math.pi + 0.1 / 5.0)
    torque = 2.0 / math.tau * 5.0 * 2.0 * per_length / 1000.0
    mean = {x["name"]: (x["limit"], x["worst"], x["state"]) for x in summary["limits"]}
    assert mean["spindle_torque_nm"] == (70.0, pytest.approx(torque, rel=1e-3), "holds")
    assert mean["spindle_power_w"] == (11000.0, pytest.approx(torque * 100.0 * math.pi, rel=1e-3), "holds")
    assert op["power_w"]["max"] == pytest.approx(torque * 100.0 * math.pi, rel=1e-3)
    # what the chips leave out of the trochoids is of the order (f / R)^2: these have f (1 + (f / (pi R))^2 / 2)
    assert op["chip_max_mm"]["max"] == pytest.approx(0.1, rel=(0.1 / 5.0) ** 2)
    assert op["gouge_mm"]["max"] is op["excess_mm"]["max"] is None
    t = pq.read_table(tmp_path / "r" / "history.parquet")
    assert max(t["deflection_um"].to_pylist()) == op["deflection_um"]["max"] > 1.0
    assert sum(t["chip_volume_mm3"].to_pylist()) == pytest.approx(op["chip_volume_mm3"])


def test_what_is_left_is_the_stock_of_the_next_job(job: Path, tmp_path: Path) -> None:
    call("run", job, "--out", tmp_path / "r")
    left = LayeredStock.load(tmp_path / "r" / "stock.npz")
    (job.parent / "left.npz").write_bytes((tmp_path / "r" / "stock.npz").read_bytes())
    text = JOB.replace("low_mm = [0.0, -15.0, -5.0]\nhigh_mm = [50.0, 15.0, 0.0]\nlayer_mm = 1.0", 'file = "left.npz"')
    job.write_text(text)
    code, said, err = call("run", job, "--out", tmp_path / "s")
    summary = summary_of(tmp_path / "s")
    op = summary["operations"][0]
    assert (code, err, summary["verdict"]) == (3, "", "unproven")
    assert said.startswith("Unproven: nothing is cut: ")
    assert op["stock_before_mm3"] == pytest.approx(left.volume(), rel=1e-12)
    # the slot is cut already
    assert op["chip_areas_max"] == 0
    assert op["chip_volume_mm3"] == pytest.approx(op["films_mm3"])
    assert op["films_mm3"] == pytest.approx(0.0, abs=1e-2)
    assert op["force_n"]["max"] == 0.0
    assert op["deflection_um"]["max"] == 0.0


def test_a_limit_that_does_not_hold_is_said_and_is_the_exit_code(job: Path, tmp_path: Path) -> None:
    code, out, _ = call("run", job, "--out", tmp_path / "r", "--set", "limits.force_n=10")
    assert code == 3
    assert out.startswith("Exceeds: force ")
    assert "exceeds 10 N in line 6" in out
    summary = summary_of(tmp_path / "r")
    assert summary["verdict"] == summary["tracks"][0]["verdict"] == "exceeds"
    assert (summary["limits"][0]["name"], summary["limits"][0]["state"]) == ("force_n", "exceeds")
    assert out.splitlines()[0] == summary["message"]


STIFF = """[stiffness]
holder_gpa = inf
grip_n_um = 100.0
grip_nm_rad = inf
spindle_n_um = 50.0
spindle_nm_rad = inf
work_n_um = inf
"""


def test_a_deflection_is_unproven_where_what_gives_way_is_not_stated(job: Path, tmp_path: Path) -> None:
    job.write_text(JOB.replace("force_n = 1000.0", "deflection_um = 20.0"))
    code, out, _ = call("run", job, "--out", tmp_path / "r")
    assert code == 3
    assert out.startswith("Unproven: deflection ")
    assert re.search(r"of 20 µm in line \d+ at \(.+\), unproven: stiffness.grip_n_um, stiffness.grip_nm_rad, stif", out)
    summary = summary_of(tmp_path / "r")
    op = summary["operations"][0]
    assert summary["verdict"] == summary["tracks"][0]["verdict"] == "unproven"
    assert set(states(summary["limits"]).values()) == {"unproven", "holds"}
    assert (summary["limits"][0]["name"], summary["limits"][0]["state"]) == ("deflection_um", "unproven")
    assert summary["limits"][0]["reason"].startswith("stiffness.grip_n_um")
    assert "stiffness.grip_n_um" in (tmp_path / "r" / "report.html").read_text()
    # stated, the cutter gives way more by two springs, and it is proved
    job.write_text(job.read_text() + STIFF)
    code, out, _ = call("run", job, "--out", tmp_path / "s", "--set", "checks.confidence=0.5")
    assert code == 0
    assert summary_of(tmp_path / "s")["verdict"] == "holds"
    found = summary_of(tmp_path / "s")["operations"][0]
    assert found["deflection_um"]["not_stated"] == []
    more = found["deflection_um"]["max"] - op["deflection_um"]["max"]
    lateral = max(math.hypot(found["force_n"][x]["max"], found["force_n"][y]["max"]) for x, y in ("xy", "yx"))
    assert 0.0 < more < 1e3 * lateral * (1e-5 + 2e-5)
    assert found["deflection_um"]["workpiece_max"] == 0.0
    # and exceeded it fails, whatever is stated
    code, out, _ = call("run", job, "--out", tmp_path / "t", "--set", "limits.deflection_um=8")
    assert code == 3
    assert out.startswith("Exceeds: deflection ")


def test_a_spindle_that_is_too_weak_does_not_hold(job: Path, tmp_path: Path) -> None:
    vmc = (files("chipload") / "data" / "machines" / "vmc.toml").read_text()
    (job.parent / "weak.toml").write_text(
        vmc.replace("torque_nm = 70.0", "torque_nm = 0.5").replace("11000.0", "100.0")
    )
    job.write_text(JOB.replace('name = "vmc"', 'file = "weak.toml"'))
    code, out, _ = call("run", job, "--out", tmp_path / "r")
    assert code == 3
    assert out.startswith("Exceeds: spindle power 242 W exceeds 100 W in line 6 at ")
    found = states(summary_of(tmp_path / "r")["limits"])
    assert [name for name, state in found.items() if state == "exceeds"] == ["spindle_torque_nm", "spindle_power_w"]


def test_the_spindle_gives_what_its_curve_says_at_the_speed_of_the_step(job: Path, tmp_path: Path) -> None:
    vmc = (files("chipload") / "data" / "machines" / "vmc.toml").read_text()
    curve = "torque_curve = [[0.0, 1.0], [6000.0, 0.4], [15000.0, 0.1]]"
    (job.parent / "weak.toml").write_text(vmc.replace("torque_nm = 70.0", curve))
    job.write_text(JOB.replace('name = "vmc"', 'file = "weak.toml"'))
    code, out, _ = call("run", job, "--out", tmp_path / "r")
    assert code == 3
    assert out.startswith("Exceeds: spindle torque 0.771 N m exceeds 0.7 N m in line 6")


def test_chips_that_the_flutes_have_no_room_for(job: Path, tmp_path: Path) -> None:
    """A tooth of a slot cuts f D b in a turn: f D q / A of the gullet over the depth b, whatever b is."""
    text = JOB.replace("modulus_gpa = 580.0", "modulus_gpa = 580.0\ngullet_mm2 = 12.0\nchip_ratio = 6.0")
    job.write_text(text)
    code, out, _ = call("run", job, "--out", tmp_path / "r")
    assert code == 0
    assert "chip space 0.5 of 1" in out
    fill = next(x for x in summary_of(tmp_path / "r")["limits"] if x["name"] == "flute_fill")
    assert (fill["limit"], fill["state"]) == (1.0, "holds")
    assert fill["worst"] == pytest.approx(0.1 * 10.0 * 6.0 / 12.0, rel=1e-3)
    job.write_text(text.replace("chip_ratio = 6.0", "chip_ratio = 13.0"))
    code, out, _ = call("run", job, "--out", tmp_path / "s")
    assert code == 3
    assert out.startswith("Exceeds: chip space 1.08 exceeds 1 in line 6")


def test_chips_thicker_than_the_coefficients_know_are_unproven(job: Path, tmp_path: Path) -> None:
    al = (files("chipload") / "data" / "materials" / "al7075-t6.toml").read_text()
    job.write_text(JOB.replace('name = "al7075-t6"', 'file = "al.toml"'))
    for most, code in ((0.1, 0), (0.08, 3)):
        (job.parent / "al.toml").write_text(f"{al}\nchip_min_mm = 0.01\nchip_max_mm = {most}\n")
        found, out, err = call("run", job, "--out", tmp_path / f"r{code}")
        assert (found, err) == (code, "")
        summary = summary_of(tmp_path / f"r{code}")
        assert summary["verdict"] == ("unproven" if code else "holds")
        assert [x["code"] for x in summary["tracks"][0]["findings"]] == ["chip-beyond-coefficients"] * (code == 3)
    assert "line 6: chips are up to 0.1 mm thick: the coefficients of al7075-t6 hold up to 0.08 mm" in out


def test_a_rapid_through_material_is_said(job: Path, tmp_path: Path) -> None:
    (job.parent / "slot.ngc").write_text(SLOT.replace("G1 X30 F600", "G0 X30"))
    code, out, _ = call("run", job, "--out", tmp_path / "r")
    assert code == 3
    assert out.startswith("Exceeds: line 6: a rapid goes through material")


def test_the_first_progress_comes_before_a_step_is_made(job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program of 10^6 steps: they are counted, not made."""

    def made(*_: object) -> None:
        raise AssertionError("a step was made")

    def stop(done: float, what: str) -> None:
        assert (done, what) == (pytest.approx(0.1, abs=0.1), "shank and holder in the stock")
        raise Cancelled("seen")

    monkeypatch.setattr("chipload.simulation.steps._cut", made)
    loaded = load_job(job, ["operation.0.step_mm=0.00005"])
    with pytest.raises(Cancelled):
        run_job(loaded, stop)
    with pytest.raises(Cancelled), Checkpoint(job.parent / "run") as kept:
        run_job(loaded, stop, kept)


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("engine='layers'", "operation.0.engine: removed: every program is simulated by the volume of its moves"),
        ("workers=2", "operation.0.workers: removed: chipload run --workers states how many threads share the "),
    ],
)
def test_keys_of_the_layered_engine_are_refused_with_their_remedy(job: Path, key: str, text: str) -> None:
    code, _, err = call("check", job, "--set", f"operation.0.{key}")
    assert code == 2
    assert text in err


def test_check_reads_the_stock_and_cuts_nothing(job: Path) -> None:
    code, out, _ = call("check", job)
    assert code == 0
    assert out.splitlines()[-2] == "job.toml: valid; the program stays within the limits of machine vmc"
    assert out.splitlines()[-1].startswith("estimate: 28 steps")
    assert sorted(p.name for p in job.parent.iterdir()) == ["job.toml", "slot.ngc"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("high_mm = [50.0, 15.0, 0.0]\n", "", "stock: state either low_mm and high_mm of a block, or a file"),
        ("layer_mm = 1.0\n", "layer_mm = 0.0\n", "stock.layer_mm = 0: must be above 0"),
        ("[material]\nname = \"al7075-t6\"\n", "", "material: missing: state it (kind = simulate needs it)"),
        ("force_n = 1000.0\n", "", "limits: none is stated, so nothing would be checked: state at least one of"),
        ("step_mm = 2.0", "step_mm = 0.0", "operation.0.step_mm = 0: must be above 0"),
        ("[[operation]]\nkind = \"simulate\"\nstep_mm = 2.0\n", "", "stock: not used where a program is only read"),
        ("number = 1\n", "number = 4\n", "line 5: tool 1: no [[cutter]] has this number: state one beside 4"),
        ("modulus_gpa = 580.0", "modulus_gpa = 580.0\ngullet_mm2 = 9.0", "cutter.0.chip_ratio is missing: give it"),
        ("modulus_gpa = 580.0", "modulus_gpa = 580.0\ngullet_mm2 = 99.0\nchip_ratio = 4.0",
         "cutter.0.gullet_mm2 = 99: must be above 0 and below the tooth's share of the section, 39.27"),
        ("modulus_gpa = 580.0", "modulus_gpa = 580.0\ngullet_mm2 = 9.0\nchip_ratio = 0.4",
         "cutter.0.chip_ratio = 0.4: must be at least 1"),
        ("[limits]", "[stiffness]\nspindle_n_um = \"stiff\"\n[limits]",
         "stiffness.spindle_n_um = 'stiff': must be a number, or inf where it is rigid"),
        ("[limits]", "[stiffness]\nspindle_n_um = 0.0\n[limits]", "stiffness.spindle_n_um = 0: must be above 0"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_line(job: Path, tmp_path: Path, old: str, new: str, said: str) -> None:
    job.write_text(job.read_text().replace(old, new))
    text = (job.parent / "slot.ngc").read_text()
    (job.parent / "slot.ngc").write_text(text.replace(old, new))
    code, _, err = call("run", job, "--out", tmp_path / "r")
    assert code == 2
    assert said in err
    assert all(line.startswith("chipload: ") for line in err.splitlines())
    assert not (tmp_path / "r").exists()


def test_a_load_whose_resolution_error_is_not_estimated_is_unproven(job: Path, tmp_path: Path) -> None:
    key = "operation.0.resolution_error=false"
    code, _, _ = call("run", job, "--out", tmp_path / "s", "--set", key)
    assert call("run", job, "--out", tmp_path / "r")[0] == 0
    summary, whole = summary_of(tmp_path / "s"), summary_of(tmp_path / "r")
    assert (code, summary["verdict"]) == (3, "unproven")
    for check, other in zip(summary["limits"], whole["limits"], strict=True):
        assert (check["name"], check["worst"]) == (other["name"], other["worst"])
        if check["name"] == "force_n":
            assert check["state"] == "unproven"
            assert other["state"] == "holds"
            assert check["reason"] == "the resolution error of force is not known"
            assert other["resolution_error"] > 0.0
