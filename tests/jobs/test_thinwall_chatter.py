"""A small plate whose passes are planned within chatter: depths, speeds, margins, what is told and what is unproven."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import load_job, run_job
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


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return run_job(job_of(tmp_path_factory.mktemp("wall"), DYNAMICS + MODE))


def test_passes_are_no_deeper_than_chatter_allows_at_their_speed(finished):
    for m in finished.outcome.variants["variable"].plan.maps:
        assert (m.depth <= np.maximum(m.stable, 0.0) + 1e-6).all() or finished.outcome.variants[
            "variable"
        ].plan.infeasible
        assert 2500.0 <= m.speed * 60.0 / math.tau <= 6000.0 + 1e-6


def test_the_program_has_the_speed_of_each_pass_and_the_feed_per_tooth_stays(finished):
    one = finished.outcome.variants["variable"]
    program = one.program
    for k, m in enumerate(one.plan.maps):
        rows = (program.label == k) & (program.feed > 0.0)
        assert np.abs(program.spindle[rows]) == pytest.approx(np.full(rows.sum(), m.speed))
    cutter, per_tooth = finished.outcome.planning.cutter, finished.outcome.planning.feed_per_tooth
    free = finished.outcome.variants["unconstrained"].program
    for some in (program, free):
        feeds = some.feed > 0.0
        ratio = some.feed[feeds] / np.abs(some.spindle[feeds]) * math.tau / cutter.flutes
        assert np.median(ratio) == pytest.approx(per_tooth, rel=0.3)


def test_the_margin_of_the_simulated_passes_is_checked_and_told(finished):
    result = finished.result
    (check,) = (c for c in result.tracks[0].limits if c.name == "stability_margin")
    told = result.operations[0]["variants"]["variable"]["stability"]
    assert check.limit == 1.2
    assert check.worst == told["margin_min"]
    assert check.state is not Verdict.UNPROVEN or "error" in check.reason or check.worst < 1.3
    assert len(told["passes"]) == result.operations[0]["variants"]["variable"]["passes"]
    assert all(0.0 <= p["governed_by_chatter"] <= 1.0 for p in told["passes"])
    assert told["start_state_margin_min"] > 0.0
    assert not any("chatter" in text for text in result.unchecked)
    assert any(m.name.startswith("stable depth, pass 1") for m in result.maps)
    assert "stability_margin" in result.in_use[0].columns


def test_without_modes_of_the_cutter_the_margin_is_unproven(finished):
    from chipload.jobs.thinwall.chatter import chatter_limits

    columns = finished.outcome.variants["variable"].columns
    (check,) = chatter_limits({"margin": 1.0, "mode": []}, columns, "variable")
    assert (check.state, check.reason) == (Verdict.UNPROVEN, "modes of the cutter are not stated")
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
