"""The limits of a program while it is simulated: the worst values so far grow to those of the result."""

from __future__ import annotations

import re

import numpy as np
import pytest

from chipload.checking.partial import PartialLimits
from chipload.jobs import load_job, run_job
from slot_job import slot_job


def test_worst_values_so_far_are_the_greatest_sizes_with_their_lines() -> None:
    partial = PartialLimits({"force_n": 500.0, "torque_nm": 2.0, "stability_margin": 1.0, "gouge_mm": 0.1})
    assert partial.text() == ""
    partial.take({"force_n": np.array([100.0, np.nan]), "torque_nm": np.array([-2.5, 1.0]), "line": np.array([4, 5])})
    assert partial.text() == "so far torque 2.5 of 2 N m in line 4, beyond the limit, force 100 of 500 N in line 4"
    # smaller ones change nothing; a margin is least, and no column of a gouge is known yet
    partial.take({"force_n": np.array([90.0]), "stability_margin": np.array([0.5]), "line": np.array([9])})
    partial.take({"force_n": np.array([450.0]), "torque_nm": np.array([0.0]), "line": np.array([12])})
    assert partial.text(1) == "so far torque 2.5 of 2 N m in line 4, beyond the limit"
    assert partial.worst["force_n"] == (450.0, 12)
    shown = []
    partial.with_text(lambda done, what: shown.append((done, what)))(0.5, "removing")
    assert shown[0][0] == 0.5
    assert shown[0][1].startswith("removing \u00b7 so far torque 2.5 of 2 N m")


def test_the_last_worst_value_is_that_of_the_result(tmp_path, monkeypatch) -> None:
    """A line of 16 mm in steps of 0.02 mm, in blocks of 512."""
    monkeypatch.setattr("chipload.simulation.chips.MOVES", 1)
    job, seen = load_job(slot_job(tmp_path / "slot", step=0.02)), dict[str, float]()

    def progress(done: float, what: str) -> None:
        if "so far" in what:
            seen.setdefault(what, done)

    done = run_job(job, progress)
    torque = next(c for c in done.result.limits if c.column.name == "torque_nm")
    assert len(seen) > 1
    assert min(seen.values()) < 0.8
    last = list(seen)[-1]
    value = float(re.search(r"torque ([\d.]+) of 5 N m in line 6", last)[1])
    assert value == pytest.approx(torque.worst, rel=1e-3)
