"""Limits of a simulated slot at a confidence: what the text says, what settles them, and what every result shows."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

import chipload
from chipload.checking.history import History
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.report.page import limits_table
from chipload.result import LimitCheck, Verdict
from chipload.result.summary import limit_from, summary_of

MILL = Cutter(8.0, 3, math.radians(30.0), 20.0, 30.0, 5.8e5)
AL = material_named("al7075-t6")


def slot(limit: float, confidence: float = 0.95, cutter: Cutter = MILL, material=AL, **limits: float) -> History:
    path = [rapid([-12.0, 0.0, -1.0], 300.0, 1, "link"), plunge([12.0, 0.0, -1.0], 8.0, 300.0, 1, "cut")]
    return chipload.simulate(
        Program.join(path), chipload.Stock.block((0.0, -9.0, -9.0), (20.0, 9.0, 0.0), layer_mm=0.5), cutter, material,
        "vmc", chipload.Limits(force_n=limit, **limits), step_mm=4.0,
        checks=chipload.CheckSettings(confidence=confidence),
    )  # fmt: skip


def force(history: History) -> LimitCheck:
    return next(c for c in history.limits if c.name == "force_n")


@pytest.fixture(scope="module")
def free() -> LimitCheck:
    return force(slot(1e4))


def test_the_text_states_the_nominal_value_and_what_the_error_adds(free: LimitCheck) -> None:
    assert free.text == f"force {free.worst:.3g} + {free.value_at_confidence - free.worst:.2g} of 10000 N"
    names = [p.name for p, _ in free.budget.in_order()]
    assert set(names) == {"coefficients", "runout that is not stated", "resolution and chip", "turns"}
    assert names[-1] == "turns" or names[-2] == "turns"
    sizes = [x for _, x in free.budget.in_order()]
    assert sizes == sorted(sizes, reverse=True)


def test_textbook_coefficients_and_unknown_runout_are_1_4_to_1_9_times_the_nominal_value(free: LimitCheck) -> None:
    assert 1.4 < free.value_at_confidence / free.worst < 1.9


def test_a_limit_names_the_one_statement_that_settles_it(free: LimitCheck) -> None:
    """A limit that holds without the runout asks for the runout, one that holds without the spread for a test cut."""
    without = {
        part.name: free.worst
        * replace(free.budget, parts=tuple(p for p in free.budget.parts if p is not part)).value(1.0)
        for part in free.budget.parts
    }
    assert without["coefficients"] < without["runout that is not stated"] < free.value_at_confidence
    both = force(slot(0.5 * (without["runout that is not stated"] + free.value_at_confidence)))
    assert both.state is Verdict.UNPROVEN
    assert both.worst == free.worst
    assert both.reason.startswith(f"at 95 % it may be {free.value_at_confidence:.3g} N (coefficients ")
    one = force(slot(0.5 * (without["coefficients"] + without["runout that is not stated"])))
    assert one.reason.endswith("measure the coefficients in a test cut (chipload fit)")
    # what is stated settles it
    limit = both.limit
    assert force(slot(limit, cutter=replace(MILL, runout_size=0.0))).state is Verdict.HOLDS
    assert force(slot(limit, material=replace(AL, spread=0.03))).state is Verdict.HOLDS
    assert force(slot(0.9 * free.worst)).state is Verdict.EXCEEDS


def test_a_power_that_only_the_spread_leaves_unproven_may_be_settled_by_the_spindle() -> None:
    power = next(c for c in slot(1e4, power_w=1e5).limits if c.name == "power_w")
    found = next(c for c in slot(1e4, power_w=1.1 * power.worst).limits if c.name == "power_w")
    assert found.state is Verdict.UNPROVEN
    assert found.reason.endswith("(chipload fit, or chipload spindle by its power)")
    assert {p.name for p in found.budget.parts} <= {"coefficients", "resolution and chip", "bending"}


def test_at_50_percent_the_nominal_value_counts_and_the_one_at_95_is_shown(free: LimitCheck) -> None:
    plain = slot(1.2 * free.worst, 0.5)
    check = force(plain)
    assert check.state is Verdict.HOLDS
    assert check.value_at_confidence == pytest.approx(free.value_at_confidence)
    assert check.text == f"force {check.worst:.3g} of {check.limit:.6g} N"
    assert plain.first_lines[-1].startswith(f"At 95 %: force {check.value_at_confidence:.3g} N (coefficients ")
    table = "".join(limits_table(plain.tracks))
    assert "at 95 %" in table
    assert check.budget.parts_text(check.worst) in table


def test_the_summary_keeps_the_budget(free: LimitCheck) -> None:
    history = slot(1e4)
    model = next(x for x in summary_of(history, {}).limits if x.name == "force_n")
    assert json.loads(model.model_dump_json())["budget"]["parts"][0]["name"] == "coefficients"
    assert limit_from(model).value_at_confidence == pytest.approx(free.value_at_confidence, rel=1e-12)


@pytest.mark.parametrize("level", [0.4, 1.0])
def test_a_confidence_outside_its_range_is_refused(level: float) -> None:
    with pytest.raises(InputError, match=r"checks\.confidence = "):
        chipload.CheckSettings(confidence=level)
