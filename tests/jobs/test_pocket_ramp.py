"""A pocket entered by a ramp to and fro: its slope, its depth of cut, and what is cleared from it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.checking.settings import CheckSettings
from chipload.errors import InputError, Severity
from chipload.jobs import load_job
from chipload.jobs.contour.result import findings_of
from chipload.jobs.tables import value_of
from chipload.planning.pocket.clearing_path import ENTRY, LIFT
from chipload.planning.pocket.motions import Heights, Motions, entries
from chipload.program.program import LINE, RAPID
from pocket_job import checked, done, operation, swept, written

#: a slot of 11 mm for a cutter of 8 mm: a bore in it would be 1.5 mm beside its middle
SLOT = [(0, 0), (40, 0), (40, 11), (0, 11)]
WIDE = [(0, 0), (24, 0), (24, 20), (0, 20)]
SHORT = [(0, 0), (24, 0), (24, 11), (0, 11)]
RAMP = 'radial_depth_mm = 1.2\ndepth_mm = 5.0\nentry = "ramp"\n'


def depths_by_hand(x, z):
    """Greatest depth that each leg of a path along a line takes off a surface, which each lowers to itself."""
    at = np.linspace(x.min(), x.max(), 400)
    surface, out = np.zeros(400), []
    for k in range(1, len(x)):
        if x[k] == x[k - 1]:
            continue
        ends = (x[k - 1], x[k]) if x[k] > x[k - 1] else (x[k], x[k - 1])
        heights = (z[k - 1], z[k]) if x[k] > x[k - 1] else (z[k], z[k - 1])
        leg = np.interp(at, ends, heights)
        out.append(float((surface - leg).max()))
        surface = np.minimum(surface, leg)
    return out


def test_a_ramp_in_a_slot(tmp_path):
    """3 deg of slope at most; no leg is deeper than what its loads are planned with; all is cleared from it."""
    (strategy,), _ = done(written(tmp_path, {"0": [SLOT]}, operation(RAMP)))
    p, names = strategy.program, np.array(strategy.program.labels, dtype=object)[strategy.program.label]
    rows = np.flatnonzero((names == "entry") & (p.motion == LINE))
    first = rows[p.p_work[rows, 2] > -2.5 + 1e-9]  # above the floor of the first level
    way = p.p_work[first[0] : first[-1] + 2]
    assert len(way) > 6
    flat = np.hypot(*np.diff(way[:, :2], axis=0).T)
    slopes = -np.diff(way[:, 2])[flat > 0.0] / flat[flat > 0.0]
    assert slopes.min() > 0.0
    assert slopes.max() <= math.tan(math.radians(3.0)) + 1e-9
    assert flat.max() > 2.0 * 4.0
    assert (way[:, :2].min(axis=0) >= 4.0 - 1e-9).all()
    assert (way[:, :2].max(axis=0) <= np.array([36.0, 7.0]) + 1e-9).all()
    line = (way[:, :2] - way[0, :2]) @ (way[1:, :2] - way[0, :2])[flat.argmax()] / flat.max()
    motions = Motions(
        np.array([[0.0, 0.0, *way[0, :2], 0.0, 0.0, 0.0], [*way[0, :2], *way[1, :2], 0.0, 0.0, 0.0]]),
        np.full(2, -2.5), np.array([LIFT, ENTRY]), np.ones(2), Heights(-2.5, -2.4, 0.0, 5.0),
    )  # fmt: skip
    assert max(depths_by_hand(line, way[:, 2])) == pytest.approx(entries(motions, 2.5)[0], rel=0.01)
    h = strategy.history
    assert (h["pass"] == "entry").any()
    wanted = strategy.summary["engagement_deg"]["wanted"]
    assert h["engagement_deg"][h["pass"] == "pocket"].max() <= wanted + 0.01
    assert strategy.summary["cleared_percent"] > 99.5
    gone = swept(strategy.program, 4.0, -5.0)
    assert gone.bounds == pytest.approx((0.0, 0.0, 40.0, 11.0), abs=2e-3)


def test_circles_need_a_bore(tmp_path):
    more = RAMP + 'strategies = ["pocket", "trochoidal"]\nuse = "pocket"\n'
    with pytest.raises(InputError, match="entry = 'ramp': trochoidal passes begin at a bore: state helix"):
        checked(written(tmp_path, {"0": [SLOT]}, operation(more)))


@pytest.mark.parametrize("entry", ["ramp", "helix"])
def test_an_entry_is_no_steeper_than_its_cutter_allows(tmp_path, entry):
    more = RAMP.replace('"ramp"', f'"{entry}"').replace("depth_mm = 5.0", "depth_mm = 3.0")
    job = written(tmp_path, {"0": [WIDE]}, operation(more))
    text = job.read_text()
    job.write_text(text.replace("diameter_mm = 8.0\n", "diameter_mm = 8.0\nramp_angle_deg = 1.0\n"))
    (strategy,), outcome = done(job)
    p, names = strategy.program, np.array(strategy.program.labels, dtype=object)[strategy.program.label]
    rows = np.flatnonzero((names == "entry") & (p.motion != RAPID))
    ends = np.hypot(*(p.p_work[rows, :2] - p.p_work[rows - 1, :2]).T)
    radius = np.hypot(*(p.p_work[rows, :2] - p.centre[rows, :2]).T)
    chord = np.clip(0.5 * ends / np.where(radius > 0.0, radius, 1.0), 0.0, 1.0)
    arc = np.where(ends < 1e-9, math.tau, 2.0 * np.arcsin(chord))
    along = np.where(p.motion[rows] == LINE, ends, radius * arc)
    down = p.p_work[rows - 1, 2] - p.p_work[rows, 2]
    flat = along > 1e-6
    steepest = float(np.degrees(np.arctan(down[flat] / along[flat])).max())
    assert 0.8 < steepest <= 1.0 + 1e-6
    assert strategy.history["ramp_deg"].max() == pytest.approx(steepest, abs=1e-3)
    assert not (strategy.history["ramp_deg"] > 0.0)[strategy.history["pass"] == "pocket"].any()
    assert [f.code for f in findings_of(outcome.operations[0], "pocket") if f.code == "plunge"] == []


def test_an_entry_of_a_cutter_without_teeth_at_its_centre_is_unproven(tmp_path):
    job = written(tmp_path, {"0": [SHORT]}, operation(RAMP))
    text = job.read_text()
    job.write_text(text.replace("diameter_mm = 8.0\n", "diameter_mm = 8.0\ncentre_cutting = false\n"))
    _, outcome = done(job)
    (op,) = outcome.operations
    (found,) = (f for f in findings_of(outcome.operations[0], "pocket") if f.code == "plunge")
    assert found.severity is Severity.UNPROVEN
    assert "tool 1 ramps into solid material at 2." in found.text
    assert "state ramp_angle_deg (RMPX)" in found.text
    job.write_text(job.read_text() + "[checks]\nplunge = false\n")
    off = value_of(CheckSettings, load_job(job).job.table.checks).off
    assert off == ("plunge",)
    without = replace(op, checks=replace(op.checks, off=off))
    assert [f.code for f in findings_of(without, "pocket") if f.code == "plunge"] == []
