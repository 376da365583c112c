"""A thin wall with [dynamics]: what is refused, and what leaves its margin unproven."""

from __future__ import annotations

import re

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job
from chipload.jobs.thinwall.chatter import chatter_limits
from chipload.result import Verdict
from jobs.test_thinwall import SMALL

DYNAMICS = """
[dynamics]
damping_ratio = 0.004
modes = 3
least_rpm = 2500.0
most_rpm = 6000.0
margin = 1.2
"""
MODE = """[[dynamics.mode]]
frequency_hz = 1400.0
damping_ratio = 0.03
stiffness_n_um = 12.0
"""


def job_of(folder, dynamics):
    path = copy_example("plate", folder / "plate") / "job.toml"
    text = re.sub(r"^(least_error|compensate_um).*$", "", path.read_text(), flags=re.M)
    path.write_text(text + dynamics)
    return load_job(path, (*SMALL, "wall.allowance_mm=[0.2, 0.0]"))


def test_without_modes_of_the_cutter_the_margin_is_unproven():
    columns = {
        "stability_margin": np.array([3.0, 1.4]), "chip_areas": np.array([0, 1]), "line": np.array([1, 2]),
        **{f"{x}_mm": np.zeros(2) for x in "xyz"},
    }  # fmt: skip
    (check,) = chatter_limits({"margin": 1.0, "mode": []}, columns, "variable")
    assert (check.state, check.reason) == (Verdict.UNPROVEN, "modes of the cutter are not stated")
    (known,) = chatter_limits({"margin": 1.0, "mode": [{}]}, columns, "variable")
    assert (known.state, known.worst, known.line) == (Verdict.HOLDS, 1.4, 2)
    assert chatter_limits(None, columns, "variable") == ()


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("damping_ratio = 0.004", "", r"dynamics.damping_ratio"),
        ("damping_ratio = 0.004", "damping_ratio = -0.1", r"dynamics.damping_ratio"),
        ("margin = 1.2", "margin = 0.5", r"dynamics.margin"),
        ("stiffness_n_um = 12.0", "", r"stiffness_n_um"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, old, new, text):
    with pytest.raises(InputError, match=text):
        job_of(tmp_path, (DYNAMICS + MODE).replace(old, new, 1))
