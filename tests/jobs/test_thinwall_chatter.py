"""A thin wall with [dynamics]: depths within chatter, a speed for each pass, what is refused, what is unproven."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
from chipload.jobs.thinwall import chatter
from chipload.jobs.thinwall.chatter import chatter_limits
from chipload.result import Verdict
from jobs.test_thinwall import SMALL

DYNAMICS = """
[dynamics]
damping_ratio = 0.02
modes = 1
least_rpm = 2500.0
most_rpm = 6000.0
margin = 2.3
"""
MODE = """[[dynamics.mode]]
frequency_hz = 1400.0
damping_ratio = 0.05
stiffness_n_um = 40.0
"""


STIFF = (
    "operation.0.refine=false",
    "wall.allowance_mm=[0.2, 0.0]",
    "wall.thickness_mm=2.4",
    "wall.elements=[3, 4]",
    "operation.0.layer_mm=0.5",
    "operation.0.scallop_um=120",
)


def job_of(folder, dynamics):
    path = copy_example("plate", folder / "plate") / "job.toml"
    text = re.sub(r"^(least_error|compensate_um).*$", "", path.read_text(), flags=re.M)
    path.write_text(text + dynamics)
    return load_job(path, (*SMALL, *STIFF))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The job, with three speeds to choose from."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chatter, "SPEEDS", 3)
        return run_job(job_of(tmp_path_factory.mktemp("wall"), DYNAMICS + MODE))


def test_passes_are_no_deeper_than_chatter_allows_at_their_speed(finished):
    """The stock of 0.2 mm is too much at once for this margin, and half of it is not."""
    maps = finished.outcome.variants["variable"].plan.maps
    assert len(maps) > 1
    for m in maps:
        assert (m.depth <= m.stable + 1e-9).all()
        assert 2500.0 <= m.speed * 60.0 / math.tau <= 6000.0 + 1e-6
    assert min(float(m.stable.min()) for m in maps) < 0.2


def test_the_program_has_the_speed_of_each_pass_and_the_feed_per_tooth_stays(finished):
    one = finished.outcome.variants["variable"]
    program, cutter = one.program, finished.outcome.planning.last.cutter
    for k, m in enumerate(one.plan.maps):
        rows = (program.label == k) & (program.feed > 0.0)
        assert np.abs(program.spindle[rows]) == pytest.approx(np.full(rows.sum(), m.speed))
        ratio = program.feed[rows] / m.speed * math.tau / cutter.flutes
        assert np.median(ratio) == pytest.approx(finished.outcome.planning.last.feed_per_tooth, rel=0.3)


def test_the_margin_of_the_simulated_passes_is_checked_and_shown(finished):
    result = finished.result
    (check,) = (c for c in result.tracks[0].limits if c.name == "stability_margin")
    stated = result.operations[0]["variants"]["variable"]["stability"]
    assert check.limit == 2.3
    assert check.worst == stated["margin_min"]
    assert check.worst > 2.3  # planned depths are within it, and the simulated chips as well
    assert check.state is not Verdict.EXCEEDS
    assert len(stated["passes"]) == result.operations[0]["variants"]["variable"]["passes"]
    assert all(0.0 <= p["governed_by_chatter"] <= 1.0 for p in stated["passes"])
    assert stated["start_state_margin_min"] > 0.0
    assert not any("chatter" in text for text in result.unchecked)
    assert any(m.name.startswith("stable depth, pass 1") for m in result.maps)
    assert "stability_margin" in result.in_use[0].columns


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
        ("damping_ratio = 0.02", "", r"dynamics.damping_ratio"),
        ("damping_ratio = 0.02", "damping_ratio = -0.1", r"dynamics.damping_ratio"),
        ("margin = 2.3", "margin = 0.5", r"dynamics.margin"),
        ("stiffness_n_um = 40.0", "", r"stiffness_n_um"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, old, new, text):
    with pytest.raises(InputError, match=text):
        job_of(tmp_path, (DYNAMICS + MODE).replace(old, new, 1))
