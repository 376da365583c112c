"""The history of a pocket is that of its written text: from the first line to the end, entries and links included."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError, Severity
from chipload.jobs import load_job
from chipload.jobs.contour.programs import program_text
from chipload.jobs.contour.result import findings_of, history_of, limits_of, result_of, samples_of
from chipload.jobs.contour.run import _plan, read_inputs, verify
from chipload.jobs.contour.text_simulation import CutColumns, PlaneStock, simulate_text
from chipload.machine.machine import machine_named
from chipload.planning.hand import require_hand
from chipload.program.release import NOT_SIMULATED
from chipload.progress import silent
from chipload.result import Verdict
from pocket_job import done, operation, swept, written

SMALL = [(0, 0), (18, 0), (18, 14), (0, 13)]
MIRRORED = [(x, -y) for x, y in SMALL]
MORE = "radial_depth_mm = 1.2\n"
DEPTH = 4.0


def pocket(folder, outline, left):
    path = written(folder, {"0": [outline]}, operation(MORE))
    if left:
        path.write_text(path.read_text().replace("number = 1\n", "number = 1\nleft_hand = true\n", 1))
    (strategy,), outcome = done(path)
    (op,) = outcome.operations
    text = program_text("pocket", outcome.machine, 0, op.result, "pocket", op.cutter, op.top, NOT_SIMULATED)
    return strategy, op, outcome, text


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    return pocket(tmp_path_factory.mktemp("right"), SMALL, False)


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    return pocket(tmp_path_factory.mktemp("left"), MIRRORED, True)


def test_each_line_that_moves_has_rows(right):
    strategy, _, _, text = right
    lines = text.splitlines()
    moves = {n for n, line in enumerate(lines, 1) if re.match(r"(G[0123] )?[XYZ]", line)}
    # where the tool comes from is not known until X, Y and Z are
    unknown = {n for n in moves if n <= next(n for n, line in enumerate(lines, 1) if line.startswith("Z"))}
    assert len(unknown) == 2
    assert set(strategy.history["line"]) == moves - unknown
    assert lines[-1] == "M2"
    assert strategy.history["t_s"][-1] == pytest.approx(strategy.summary["time_s"])


def test_the_chips_of_the_whole_program_are_what_it_sweeps(right):
    """Conservation of volume: area of the union of discs along the path, by shapely, times the depth."""
    strategy, op, _, _ = right
    area = swept(strategy.program, op.cutter.radius, -DEPTH).area
    assert strategy.history["chip_volume_mm3"].sum() == pytest.approx(area * DEPTH, rel=3e-3)


def test_the_entry_cuts_with_the_power_of_its_chips_and_edges(right):
    """A turn of the bore removes a disc of R + r, one pitch thick, and the whole bottom edge rubs: the power is between
    that and the same with the flank engaged over half a turn by one pitch.
    """
    strategy, op, _, _ = right
    h, c, m = strategy.history, op.cutter, op.checks.material
    entry = h["pass"] == "entry"
    z = h["z_mm"]
    p = strategy.program
    k = int(np.flatnonzero(np.array(p.labels)[p.label] == "entry")[2])
    r = float(np.hypot(*(p.p_work[k, :2] - p.centre[k, :2])))
    pitch = 2.0 * abs(p.p_work[k + 1, 2] - p.p_work[k, 2])
    # the second turn: that above is cut, the floor below is not
    own = entry & (z <= -pitch - 1e-9) & (z >= -2.0 * pitch - 1e-9)
    seconds = h["duration_s"][own].sum()
    removed = math.pi * (c.radius + r) ** 2 * pitch
    assert h["chip_volume_mm3"][own].sum() == pytest.approx(removed, rel=0.02)
    omega = float(p.spindle[k])
    chips = m.Ktc * removed / (math.tau * r / float(p.feed[k])) / 1000.0
    bottom = c.flutes * m.Kte * omega * c.radius**2 / 2.0 / 1000.0
    flank = c.flutes * m.Kte * omega * c.radius * pitch / 2.0 / 1000.0
    power = (h["power_w"][own] * h["duration_s"][own]).sum() / seconds
    assert chips + bottom < power < chips + bottom + flank
    assert h["engagement_deg"][entry].max() == pytest.approx(180.0, abs=0.1)


def test_a_machine_too_weak_for_the_entry_is_told_its_line(right):
    strategy, op, outcome, text = right
    h = strategy.history
    entry = h["pass"] == "entry"
    inside, passes = h["power_w"][entry].max(), h["power_w"][~entry].max()
    assert inside > 1.05 * passes
    machine = replace(outcome.machine, power_w=0.5 * (inside + passes))
    (check,) = [c for c in limits_of(machine, op, strategy, "pocket") if c.name == "spindle_power_w"]
    assert check.state is Verdict.EXCEEDS
    assert check.worst == inside
    lines = text.splitlines()
    assert lines[: check.line].count("(entry)") == 1
    assert "(pocket)" not in lines[: check.line]


def test_the_limit_of_engagement_covers_the_passes(right):
    strategy, op, _, _ = right
    (check,) = [c for c in limits_of(machine_named("vmc"), op, strategy, "pocket") if c.name == "engagement_deg"]
    assert check.state is Verdict.HOLDS
    assert strategy.history["pass"][check.row] == "pocket"


def test_a_left_hand_pocket_is_the_mirror_image(right, left):
    """The loads are those of the mirror image: down milling, the material on the left of the path, the bore alike."""
    a, b = right[0].history, left[0].history
    assert "S7960 M3" in right[3]
    assert "S7960 M4" in left[3]
    assert "M3" not in left[3].replace("M30", "")
    bore = [h["pass"] == "entry" for h in (a, b)]
    for name in ("force_xy_n", "torque_nm", "power_w", "chip_volume_mm3"):
        assert a[name][bore[0]].max() == pytest.approx(b[name][bore[1]].max(), rel=0.01)
    # passes begin elsewhere; their engagement is the same, and ends where the tooth leaves the wall
    assert a["engagement_deg"][~bore[0]].max() == pytest.approx(b["engagement_deg"][~bore[1]].max(), abs=0.1)
    for _, _, outcome, _ in (right, left):
        (found,) = samples_of(outcome).values()
        rows = history_of(outcome.operations[0], outcome.operations[0].result.strategies["pocket"])
        passes = np.flatnonzero(rows["pass"][found.row] == "pocket")
        ends = np.array([found.ranges[found.start[k] : found.start[k + 1], 1].max() for k in passes])
        assert np.isclose(ends, math.pi, atol=0.2).mean() > 0.9
    assert [result_of(one[2]).verdict for one in (left, right)] == [Verdict.HOLDS] * 2


def test_the_read_back_finds_a_wrong_sense_of_the_spindle(left):
    strategy, op, outcome, text = left
    columns = CutColumns(op.checks, "down", DEPTH, ())
    stock = PlaneStock.of((), -DEPTH, 0.0)
    found = simulate_text(
        text.replace("M4", "M3"), "0-pocket", outcome.machine, op.cutter, stock, columns, strategy.program.labels, 2.0,
        silent,
    ).findings  # fmt: skip
    (only,) = [f for f in found if f.code == "spindle-reversed"]
    assert only.severity is Severity.EXCEEDS
    assert not [f for f in findings_of(op, "pocket") if f.code == "spindle-reversed"]


def test_a_machine_without_m4_refuses_a_left_hand_cutter(left):
    machine = replace(left[2].machine, counter_clockwise=False)
    with pytest.raises(InputError, match=r"cutter 1: left_hand = true: cuts under M4, and machine vmc states"):
        require_hand(machine, left[1].cutter)


def test_a_plan_that_differs_from_its_path_is_unproven_in_one_sentence(tmp_path):
    """By 0.2 deg it holds, the difference of two methods; by 5 deg nothing of the plan is proved."""
    job = load_job(written(tmp_path, {"0": [SMALL]}, operation(MORE))).job
    inputs = read_inputs(job)
    (op,) = job.operations
    cutter = job.cutters[1]
    (planned,) = _plan(job, inputs, op, cutter, [], silent).strategies.values()
    cuts = planned.history["engagement_deg"] > 10.0
    found = []
    for more in (0.2, 5.0):
        history = {**planned.history, "engagement_deg": planned.history["engagement_deg"] + more * cuts}
        found.append(verify(replace(planned, history=history), op, cutter, 0.0, silent))
    assert [one.verdict for one in found] == [Verdict.HOLDS, Verdict.UNPROVEN]
    assert re.fullmatch(
        r"the planned engagement differs by \S+ deg from that of its path at .*, more than 0.5 deg", found[1].text
    )
