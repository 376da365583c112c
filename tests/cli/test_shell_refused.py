"""Jobs on thin tubes: what is refused, what no torque can do, and what comes with the examples."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from chipload import examples
from command import call
from torque_job import TUBE_JOB


@pytest.fixture
def job(tmp_path: Path) -> Path:
    (tmp_path / "job.toml").write_text(TUBE_JOB)
    return tmp_path / "job.toml"


def test_unattainable_is_a_result(job, tmp_path):
    """3 um: the edge alone takes more. No controller is run, the verdict says why."""
    code, out, err = call("run", job, "--out", tmp_path / "r", "--set", "limits.form_error_um=3.0")
    assert (code, err) == (3, "")
    assert "no torque is allowable" in out
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    assert summary["operations"][0]["torque_limit_nm"] == 0.0
    assert "controllers" not in summary["operations"][0]
    assert (tmp_path / "r" / "report.html").stat().st_size > 1000
    assert "no feed keeps the limits; one of these changes does: a depth of cut of at most" in out
    assert call("check", job)[0] == 0


def test_what_would_do_does(job):
    """Found by `check`, before a run; the wall that it names is then enough."""
    hard = ("--set", "limits.form_error_um=9")
    code, out, _ = call("check", job, *hard)
    assert code == 3
    assert "no torque is allowable, by the wall's deflection" in out
    wall = float(out.split("a wall of at least ")[1].split(" mm")[0])
    code, out, _ = call("check", job, *hard, "--set", f"torque_control.shell.wall_mm={wall}")
    assert code == 0, out
    assert "torque limit of about" in out


def test_check(job):
    code, out, err = call("check", job)
    assert (code, err) == (0, "")
    assert "a tube, radius 12, length 30, wall 1.5 mm" in out


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("wall_mm = 1.5", "wall_mm = 3.0", "shell.wall_mm = 3: must be at most a fifth of the least radius 12"),
        ("modulus_gpa = 70.0", "modulus_gpa = 70000.0", "shell.modulus_gpa = 70000: must be at most 1000"),
        ("poisson = 0.33", "poisson = 0.5", "torque_control.shell.poisson = 0.5: must be below 0.5"),
        ("strength_mpa = 250.0", "strength_mpa = 2.5e8", "shell.strength_mpa = 2.5e+08: must be at most 5000"),
        ("wall_tolerance_mm = 0.1", "wall_tolerance_mm = 0.8", "tolerance_mm = 0.8: must be below half of wall_mm"),
        ("ramp_mm = 4.0\n", "", "surprise.1.ramp_mm: missing: state it"),
        ("at_deg = -90.0", "at_deg = -90.0\nwidth_mm = 3.0", "surprise.0.width_mm: not used by kind = thicker-side"),
        ('kind = "hard-spot"', 'kind = "soft-spot"', "must be one of 'thicker-side', 'hard-spot'"),
        ("bottom_mm = -2.0", "bottom_mm = -0.5", "round.bottom_mm = -0.5: must be below top_mm = -1"),
        ("control.shell]", "control.shell]\nangle_deg = -5.0", "taper_deg = 0: must be 5, that of the wall"),
        ("control.shell]", "control.shell]\nangle_deg = 5.0", "this wall is wider upwards: clamp its other end"),
        ("[round]", '[program]\nfile = "x.ngc"\n[round]', "program, round: both are stated"),
        ("acceleration_mm_s2 = 1000.0", "acceleration_mm_s2 = 9000.0", "must be at most 3000, that of machine vmc"),
        ("cutter = 1", "cutter = 2", "round.cutter = 2: no [[cutter]] has this number"),
        ("hold = 0.9\n", "", "override.hold: missing: state it (set point, as a share of the torque limit)"),
        ("form_error_um = 30.0\n", "", "limits.form_error_um: missing: state it"),
        ("torque_over_percent = 5.0\n", "", "limits.torque_over_percent: missing: state it"),
        ("idle_error_share = 0.01\n", "", "spindle.idle_error_share: missing: state it"),
        ("idle_error_share = 0.01", "idle_error_share = 0.05", "light = 0.03 N m: below the resolution of the spindle"),
    ],
)  # fmt: skip
def test_refused(job, tmp_path, old, new, says):
    assert old in TUBE_JOB
    job.write_text(TUBE_JOB.replace(old, new, 1))
    code, out, err = call("run", job, "--out", tmp_path / "r")
    assert code == 2, out + err
    assert says in err
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "r").exists()


def test_tables_by_their_old_names(job, tmp_path):
    """`[shell]` and `[control]` are refused with what they are called now; `--set` too."""
    job.write_text(
        TUBE_JOB.replace("[torque_control.shell]", "[shell]").replace("[torque_control.override]", "[control.override]")
    )
    code, _, err = call("check", job)
    assert code == 2
    assert err.splitlines() == [
        "chipload: job.toml: shell: renamed: write [torque_control.shell]",
        "chipload: job.toml: control: renamed: write [torque_control]",
    ]
    job.write_text(TUBE_JOB)
    code, _, err = call("check", job, "--set", "shell.wall_mm=1.2")
    assert code == 2
    assert "--set shell.wall_mm=1.2: shell: renamed: write torque_control.shell.wall_mm" in err


def test_a_spindle_that_cannot_hold_the_limit(job, tmp_path):
    """Its light cuts are told from air, but not the limit from what is held: refused with both numbers."""
    code, _, err = call(
        "run", job, "--out", tmp_path / "r", "--set", "spindle.idle_error_share=0.05", "--set",
        "torque_control.override.light_nm=0.06", "--set", "limits.torque_over_percent=0",
    )  # fmt: skip
    assert code == 2
    assert "spindle: it resolves 0.0394 N m" in err
    assert "the limit is " in err
    assert "this spindle holds limits from 0.433 N m" in err
    assert not (tmp_path / "r").exists()


def test_a_controller_that_is_slower_than_the_constant_feed(job, tmp_path):
    """Where the limit is never reached the constant feed is the programmed one, and holding the torque costs time."""
    code, out, err = call(
        "run", job, "--out", tmp_path / "r", "--set", "limits.form_error_um=5000", "--set", "limits.strength_share=1",
        "--set", "torque_control.shell.strength_mpa=5000", "--set", "torque_control.override.overload_nm=90", "--set",
        "torque_control.override.torque_most_nm=100",
    )  # fmt: skip
    assert code == 3, out + err
    operation = json.loads((tmp_path / "r" / "summary.json").read_text())["operations"][0]
    runs = operation["with_latency"]["controllers"]
    late = runs["fuzzy_feedforward"]
    assert late["time_s"] > runs["constant"]["time_s"]
    assert f"takes {late['time_s']:.3g} s, longer than the" in (tmp_path / "r" / "report.html").read_text()


def test_the_spindle_of_a_large_machine_is_refused(tmp_path):
    """The example with the constants of a spindle of 70 N m: at once, by `check` too."""
    folder = examples.copy_example("tube", tmp_path / "tube")
    large = [
        "--set", "spindle.torque_constant_nm_a=1.5", "--set", "spindle.noise_a=0.2",
        "--set", "spindle.idle_a=[8, 0.01]", "--set", "spindle.most_current_a=60",
    ]  # fmt: skip
    for words in (("check", folder / "job.toml"), ("run", folder / "job.toml", "--out", tmp_path / "r")):
        code, _, err = call(*words, *large)
        assert code == 2
        assert "below the resolution of the spindle, 1.42 N m (noise 0.35, quantisation 0.0037, idle map 1.1)" in err


def test_the_example_takes_its_controller_along(tmp_path):
    """What starts LinuxCNC comes along with the example, which is checked with the others: tests/cli/test_cli.py."""
    folder = examples.copy_example("tube", tmp_path / "tube")
    assert {p.name for p in (folder / "linuxcnc").iterdir()} >= {
        "run.py",
        "drive.py",
        "tube.ini",
        "tube.hal",
        "tube.tbl",
    }
