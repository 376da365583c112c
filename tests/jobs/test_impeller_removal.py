"""Removal of written impeller programs, step by step: closed forms, an ordinary program job, changed texts."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

import chipload
from chipload.checking.settings import CheckSettings
from chipload.checking.workpiece import Stock
from chipload.cutter.catalogue import CatalogueCutter
from chipload.cutting.material import material_named
from chipload.errors import Severity
from chipload.jobs.impeller import read_program
from chipload.jobs.impeller.channels import turn_channel
from chipload.jobs.impeller.read_program import read_program_of
from chipload.jobs.impeller.removal import ImpellerProgram, inputs_of, removal_of_programs, tool_with_teeth
from chipload.machine.machine import machine_named
from chipload.planning.impeller.feeds import ForceTerms
from chipload.program.check import SPINDLE_OFF
from chipload.program.gcode.writer import write_gcode
from chipload.program.program import LINE, RAPID, Program
from chipload.program.release import NOT_SIMULATED

MACHINE = machine_named("horizontal-b")
#: a block whose sides stand across x and y; its corners [mm]
LOW, HIGH = (-20.0, -15.0, 0.0), (20.0, 15.0, 30.0)
DEEP, WIDE, LONG = 3.0, 10.0, 30.0
CUTTER = CatalogueCutter(WIDE, 0.0, cutting_length=20.0)
SPINDLE = 300.0


def slot(tool: int, lying: bool, depth: float = DEEP, feed: float = 5.0) -> Program:
    """A slot along y through the block: in its side at x = 20 with a lying axis, or in its top with an upright one."""
    axis = (1.0, 0.0, 0.0) if lying else (0.0, 0.0, 1.0)

    def tip(y: float, out: float) -> tuple[float, float, float]:
        return (HIGH[0] + out, y, 15.0) if lying else (0.0, y, HIGH[2] + out)

    ends = [tip(-30.0, 20.0), tip(-30.0, -depth), tip(30.0, -depth), tip(30.0, 20.0)]
    motion = np.array([RAPID, RAPID, LINE, RAPID])
    n = len(motion)
    return Program(
        motion, np.array(ends), np.tile(axis, (n, 1)), np.zeros((n, 3)), np.tile((0.0, 0.0, 1.0), (n, 1)),
        np.zeros(n, dtype=np.int64), np.where(motion == LINE, feed, 0.0), np.full(n, SPINDLE),
        np.full(n, tool, dtype=np.int64), np.zeros(n, dtype=np.int64), np.where(motion == LINE, 1, 0),
        ("link", "finish"),
    )  # fmt: skip


def written(program: Program, cutter: CatalogueCutter = CUTTER) -> ImpellerProgram:
    number = int(program.tool[0])
    return ImpellerProgram(f"{number}-slot", read_program_of(program, MACHINE, cutter), cutter)


TERMS = ForceTerms(
    material_named("al7075-t6"), 2, math.radians(30.0), 580e3, 0.5, 0.05, SPINDLE, 40.0
)  # fmt: skip
BLOCK = Stock.block(LOW, HIGH, 1.0)


def removed(*programs: ImpellerProgram, terms: ForceTerms | None = None, stock: Stock = BLOCK):
    return removal_of_programs(programs, stock, MACHINE, terms)


@pytest.fixture(scope="module")
def side_and_top():
    """A slot in the side, then one in the top that is so deep that it comes into the first; no forces."""
    return removed(written(slot(1, True)), written(slot(2, False, 12.0)))


def test_each_program_begins_with_what_the_one_before_leaves(side_and_top) -> None:
    """Volumes by hand: the two slots do not meet, and each is its depth, its width and the length of the block."""
    side, top = side_and_top
    for one, depth in ((side, DEEP), (top, 12.0)):
        assert one.columns["chip_volume_mm3"].sum() == pytest.approx(depth * WIDE * LONG, rel=2e-3)
        assert not one.findings
        assert {c.name for c in one.limits} == {"axial_overrun_mm"}
        assert all(c.state is chipload.Verdict.HOLDS for c in one.limits)
    assert side.stock[0] == pytest.approx(40.0 * 30.0 * 30.0)
    assert side.stock[0] - side.stock[1] == pytest.approx((DEEP + 12.0) * WIDE * LONG, rel=2e-3)
    (again,) = removed(written(slot(2, True)))[:1]
    twice = removed(written(slot(1, True)), written(slot(2, True)))
    assert again.columns["chip_volume_mm3"].sum() == pytest.approx(DEEP * WIDE * LONG, rel=2e-3)
    assert twice[1].columns["chip_volume_mm3"].sum() == pytest.approx(0.0, abs=1e-6)


def test_earlier_programs_only_make_room() -> None:
    """Of a second slot in the same place nothing is left, and where the slots cross only what is beside the first."""
    side = written(slot(1, True))
    same, across = (removal_of_programs([second], BLOCK, MACHINE, None, earlier=[side])[0] for second in (
        written(slot(2, True)), written(slot(2, False, 12.0))
    ))  # fmt: skip
    assert same.columns["chip_volume_mm3"].sum() == pytest.approx(0.0, abs=1e-6)
    assert across.columns["chip_volume_mm3"].sum() == pytest.approx(12.0 * WIDE * LONG, rel=2e-3)
    assert across.columns["line"].tolist() == written(slot(2, False, 12.0)).read.program.line[1:].tolist()
    # what the first slot takes is not counted
    assert across.stock[0] - across.stock[1] == pytest.approx(12.0 * WIDE * LONG, rel=2e-3)


def test_what_needs_outlines_is_refused_without_them() -> None:
    given = inputs_of({1: tool_with_teeth(CUTTER, slot(1, True), None)}, BLOCK, MACHINE, None)
    with pytest.raises(chipload.InputError, match=r"outlines: without them checks\.loose_stock"):
        replace(given, checks=replace(given.checks, loose_stock=True))


def test_a_history_has_the_lines_and_the_time_of_its_own_text(side_and_top) -> None:
    for one, program in zip(side_and_top, (slot(1, True), slot(2, False, 12.0)), strict=True):
        read, c = written(program).read, one.columns
        assert c["t_s"][-1] == pytest.approx(read.seconds, rel=1e-12)
        assert c["s_mm"][0] == pytest.approx(np.linalg.norm(np.diff(read.program.p_work[:2], axis=0)))
        assert c["s_mm"][-1] == pytest.approx(np.linalg.norm(np.diff(read.program.p_work, axis=0), axis=1).sum())
        assert c["line"][-1] == read.program.line[-1]
        for k in range(1, len(read.program)):
            end = [c[f"{x}_mm"][one.step[k]] for x in "xyz"]
            assert end == pytest.approx(read.program.p_work[k].tolist(), abs=1e-6)
        assert {"force_n", "torque_nm", "chip_max_mm"}.isdisjoint(c)
        assert set(c["pass"].tolist()) == {"link", "finish"}


def test_loads_are_those_of_the_text_as_a_program_job(tmp_path) -> None:
    """The same text by the front door of program jobs: equal numbers in every step that both have."""
    program = slot(1, True)
    (one,) = removed(written(program), terms=TERMS)
    file = tmp_path / "slot.ngc"
    text = write_gcode(program, MACHINE, title="slot", release=NOT_SIMULATED, comments=read_program.COMMENTS)
    file.write_text(text)
    tool = replace(tool_with_teeth(CUTTER, program, TERMS), number=1)
    checks = CheckSettings(loose_stock=False, slender_walls=False, plunge=False)
    job = chipload.simulate(file, BLOCK, tool, "al7075-t6", MACHINE, checks=checks)
    own, other = one.columns, job.columns
    n = len(own["line"])
    np.testing.assert_array_equal(own["line"], other["line"][-n:])
    for name in ("force_n", "torque_nm", "power_w", "chip_max_mm", "chip_volume_mm3", "deflection_cutter_um"):
        np.testing.assert_allclose(own[name], other[name][-n:], rtol=1e-9, atol=1e-9, err_msg=name)
    # a full slot: the thickest chip is the feed per tooth, the mean power that of the volume in time and the edge
    tooth = 5.0 * math.tau / (SPINDLE * 2)
    assert own["chip_max_mm"].max() == pytest.approx(tooth, rel=1e-3)
    steady = np.argmax(own["power_w"])
    material = TERMS.material
    work = material.Ktc * DEEP * WIDE * 5.0 + material.Kte * DEEP * SPINDLE * WIDE / 2.0 * 2 * 0.5
    assert own["power_w"][steady] == pytest.approx(work / 1000.0, rel=0.02)
    states = {c.name for c in one.limits}
    assert {"cutter_stress_mpa", "deflection_cutter_um", "deflection_share"} <= states
    assert one.numbers()["force_n"] == own["force_n"].max()


def test_another_channel_is_the_first_one_turned() -> None:
    """The block is the same after half a turn: so is what a turned program removes, less what was cut before it."""
    long = replace(CUTTER, cutting_length=30.0)
    for depth, share in ((DEEP, 1.0), (24.0, 16.0 / 24.0)):
        one, on = slot(1, True, depth), turn_channel(slot(2, True, depth), math.pi)
        (alone,), (first, second) = removed(written(on, long)), removed(written(one, long), written(on, long))
        np.testing.assert_allclose(
            alone.columns["chip_volume_mm3"], first.columns["chip_volume_mm3"], rtol=1e-6, atol=1e-6
        )  # fmt: skip
        steps = second.columns["chip_volume_mm3"] - alone.columns["chip_volume_mm3"]
        assert steps.max() < 1e-3 * WIDE * depth
        # two slots 24 mm deep of 40 mm meet: the second takes 16 of 24
        taken = [x.columns["chip_volume_mm3"].sum() for x in (second, alone)]
        assert taken[0] / taken[1] == pytest.approx(share, rel=5e-3)


CHANGES = {
    "deeper": (lambda t: re.sub(r"Z(-?[\d.]+)", lambda m: f"Z{float(m[1]) - 2.0:.6f}", t), "volume"),
    "faster": (lambda t: re.sub(r"F([\d.]+)", lambda m: f"F{2.0 * float(m[1]):.6g}", t), "chip"),
    "rapid": (lambda t: re.sub(r"\nG1 ", "\nG0 ", t), "rapid"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_text_is_seen(change, monkeypatch) -> None:
    changed, what = CHANGES[change]
    program = slot(1, False)
    (before,) = removed(written(program), terms=TERMS)
    own = read_program.write_gcode
    monkeypatch.setattr(read_program, "write_gcode", lambda *a, **k: changed(own(*a, **k)))
    (after,) = removed(written(program), terms=TERMS)
    a, b = before.columns, after.columns
    if what == "volume":
        grown = b["chip_volume_mm3"].sum() - a["chip_volume_mm3"].sum()
        assert grown == pytest.approx(2.0 * WIDE * LONG, rel=0.01)
        assert b["force_n"].max() > 1.2 * a["force_n"].max()
    elif what == "chip":
        assert b["chip_max_mm"].max() == pytest.approx(2.0 * a["chip_max_mm"].max(), rel=1e-3)
    else:
        assert [f.code for f in after.findings if f.severity is Severity.EXCEEDS] == ["rapid-cuts"]
        # what the job allows a rapid to take in one row
        most = DEEP * WIDE * LONG
        for touch, codes in ((0.9 * most, ["rapid-cuts"]), (1.1 * most, [])):
            (one,) = removal_of_programs([written(program)], BLOCK, MACHINE, None, touch)
            assert [f.code for f in one.findings] == codes


def test_a_shank_in_material_exceeds_and_the_next_program_cuts_what_the_flutes_left() -> None:
    """Flutes of 2 mm in a slot that is deeper: the shank stands in the rest, which the second program cuts."""
    short = replace(CUTTER, cutting_length=2.0, shank_diameter=WIDE)
    one, two = removed(written(slot(1, True), short), written(slot(2, True)))
    (shank,) = (c for c in one.limits if c.name == "axial_overrun_mm")
    assert (shank.state, shank.worst) == (chipload.Verdict.EXCEEDS, pytest.approx(DEEP - 2.0, abs=1e-6))
    assert one.columns["chip_volume_mm3"].sum() == pytest.approx(2.0 * WIDE * LONG, rel=2e-3)
    assert two.columns["chip_volume_mm3"].sum() == pytest.approx((DEEP - 2.0) * WIDE * LONG, rel=2e-3)
    assert not two.findings


def test_a_holder_in_the_stock_is_a_collision() -> None:
    stubby = replace(CUTTER, cutting_length=4.0, shank_diameter=WIDE, reach=5.0, holder_diameter=40.0)
    (one,) = removed(written(slot(1, True, 9.0), replace(stubby, cutting_length=4.5)))
    assert any(f.code == "collision" and f.severity is Severity.EXCEEDS for f in one.findings)


@pytest.mark.parametrize("lying", [True, False])
def test_a_rapid_and_a_spindle_at_rest_or_reversed_in_the_stock_exceed(lying: bool) -> None:
    """The cutter leaves the block in the same step, so the last instants of that step take next to nothing."""
    cut = slot(1, lying)
    still = replace(cut, spindle=np.zeros(len(cut)))
    hasty = replace(cut, motion=np.full(len(cut), RAPID), feed=np.zeros(len(cut)))
    against = replace(cut, spindle=-cut.spindle)
    for program, code in ((still, SPINDLE_OFF), (hasty, "rapid-cuts"), (against, "spindle-reversed")):
        (one,) = removed(written(program))
        assert [(f.code, f.severity) for f in one.findings] == [(code, Severity.EXCEEDS)]
