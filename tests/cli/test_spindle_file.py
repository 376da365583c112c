"""A job whose spindle stands in the file that `chipload spindle` wrote: from logs to the limit that it can hold."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from chipload import examples
from chipload.control.spindle_file import IDENTIFIED
from chipload.jobs import load_job
from chipload.jobs.torque.spindle import estimate_range, spindle_of
from command import call
from spindle_logs import KT, spindle_log


@pytest.fixture(scope="module")
def job(tmp_path_factory) -> Path:
    """The example `tube` with its identified keys in a file."""
    folder = tmp_path_factory.mktemp("file")
    logs = [
        spindle_log(folder / f"{k}.csv", k, torques, speeds=(500.0, 660.0))
        for k, torques in enumerate(((0.1, 0.3, 0.5), (0.2, 0.4)))
    ]
    tube = examples.copy_example("tube", folder / "tube")
    assert call("spindle", *logs, "--out", tube / "spindle.toml")[0] == 0
    text = (tube / "job.toml").read_text()
    for key in IDENTIFIED:
        text, count = re.subn(rf"^{key} = .*\n", "", text, flags=re.MULTILINE)
        assert count == 1, key
    (tube / "job.toml").write_text(text.replace("[spindle] ", '[spindle]\nfile = "spindle.toml"  '))
    return tube / "job.toml"


def test_the_values_are_those_of_the_file(job):
    """With what the job states counting more."""
    loaded = load_job(job).job
    spindle = spindle_of(loaded, 628.0)
    assert spindle.torque_constant == pytest.approx(1e3 * KT, rel=0.01)
    assert spindle.torque_constant_error < 0.02
    assert estimate_range(loaded, spindle)[1] == pytest.approx(500.0, rel=0.01)
    stated = load_job(job, ("spindle.torque_constant_nm_a=0.4",)).job
    assert spindle_of(stated, 628.0).torque_constant == 400.0


def test_a_check_goes_through(job):
    code, out, err = call("check", job, "--set", "torque_control.override.light_nm=0.06")
    assert (code, err) == (0, "")
    assert "torque limit of about 0.19 N m" in out


def test_more_than_was_identified_is_refused(job):
    """A limit above the cuts of the logs, another speed, a key that is nowhere, a file that is none."""
    # of 0.7 N m the example holds 0.90
    code, _, err = call("check", job, "--set", "limits.torque_nm=0.7", "--set", "torque_control.override.overload_nm=2")
    assert code == 2
    assert "spindle: the estimate is valid up to 0.5 N m, the torque that is held is 0.63 N m: log heavier cuts" in err
    text = (job.parent / "spindle.toml").read_text()
    for old, new, wanted in (
        (r"^speed_rpm = .*$", "speed_rpm = [1000, 3000]", "the program turns at 6000: log an air run at that speed"),
        (r"^noise_a = .*$", "", "spindle.noise_a: missing: it is not in spindle.file = other.toml"),
        (r"^noise_a = ", "noise = ", "unknown key noise: the nearest known one is noise_"),
        (r"^torque_nm = .*$", "", "range.torque_nm = None: must be two numbers"),
    ):
        (job.parent / "other.toml").write_text(re.sub(old, new, text, flags=re.MULTILINE))
        code, _, err = call("check", job, "--set", "spindle.file=other.toml")
        assert code == 2
        assert wanted in err


def test_less_than_was_identified_is_refused(job):
    """A torque that is held below the range of the estimate; the check states the least limit, range over hold."""
    text = (job.parent / "spindle.toml").read_text()
    (job.parent / "least.toml").write_text(re.sub(r"^torque_nm = .*$", "torque_nm = [0.27, 0.5]", text, flags=re.M))
    own = ("--set", "spindle.file=least.toml", "--set", "torque_control.override.light_nm=0.06")
    code, out, _ = call("check", job, *own)
    assert code == 0
    assert "the controller can hold torque limits from 0.3 N m up" in out
    code, _, err = call("check", job, *own, "--set", "limits.torque_nm=0.2")
    assert code == 2
    assert "spindle: the estimate is valid from 0.27 N m up, the torque that is held is 0.18 N m: log lighter" in err
