"""Measured slots with a flat end mill of two teeth: fit on 300 and 1500 mm/min, predict 900 mm/min.

What the data state: 6000 rpm, feed, 3 mm deep, channels, units; the publisher's scripts: slotting, two teeth, feed
along Fy, across Fx. Inferred: the diameter 25 mm (`ae25` of a slot), the helix (30 deg; what is fitted hardly
depends on either), signs (of a slot, below), Fz down into the table (a right-handed frame with these signs).
"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chipload.checking.load_budget import budget_parts
from chipload.cutting.fit import fit_average
from chipload.cutting.load_parts import load_parts
from chipload.cutting.measured import read_forces
from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.jobs import load_job
from chipload.jobs.fit.run import peak_excess, read_cuts, run
from chipload.result.budget import ErrorBudget

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
FOLDER = DATA / "measured" / "li_flat_slotting"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="no measured slots here")

JOB = """
name = "slot"
source = "slotting of 2018-03-15, published with ForceCalculation by leekunhwee"
method = "instantaneous"
band_hz = 500.0
[cutter]
number = 1
diameter_mm = {diameter}
flutes = 2
helix_deg = {helix}
flute_length_mm = 30.0
overhang_mm = 60.0
modulus_gpa = 580.0
[engagement]
milling = "slot"
axial_depth_mm = 3.0
[channels]
feed = "-Fy"
across = "-Fx"
axis = "-Fz"
on = "work"
[dynamometer]
feed_hz = 1000.0
across_hz = 785.0
"""
MORE = """
[[measurement]]
file = '{folder}/6-n6000f{feed}ap3ae25.csv'
use = "{use}"
feed_mm_min = {feed}.0
speed_rpm = 6000.0
"""


def job(tmp_path, diameter=25.0, helix=30.0):
    text = JOB.format(diameter=diameter, helix=helix)
    for feed, use in ((300, "fit"), (900, "predict"), (1500, "fit")):
        text += MORE.format(folder=FOLDER, feed=feed, use=use)
    path = tmp_path / "fit.toml"
    path.write_text(text)
    return load_job(path).job


def test_header():
    got, findings = read_forces(FOLDER / "6-n6000f900ap3ae25.csv")
    assert got.header["DynoWare"] == "Version 2.5.1.2"
    assert (got.names, got.rate, got.start, len(got.force)) == (("Fx", "Fy", "Fz"), 10_000.0, 3.0, 10_001)
    assert got.force[0].tolist() == [341.217, -154.358, 109.497]
    assert not findings


def test_signs_and_teeth(tmp_path):
    """On the cutter a slot pushes back along the feed and to the left across it; two teeth pass a turn, and the
    spindle's own frequency, which equal teeth would not show, is almost as strong at the least feed: runout.
    """
    read = job(tmp_path)
    for cut in read_cuts(read)[0]:
        t, n, _ = cut.force.mean(axis=0)
        assert t < 0.0 < n
        spectrum = np.abs(np.fft.rfft(cut.force[:10_000, 1]))
        assert 190 <= 150 + int(np.argmax(spectrum[150:300])) <= 210
        if cut.feed < 6.0:
            assert 0.7 < spectrum[100] / spectrum[200] < 1.3


def test_means_of_the_third_feed(tmp_path):
    done = run(job(tmp_path))
    assert done.fit.search.converged
    third = next(c for c in done.comparisons if c.use == "predict")
    assert np.all(np.abs(third.mean_percent) < 5.0), third.mean_percent
    # the measured mean lies in the band
    assert np.all(np.abs(third.predicted.mean - third.forces.mean) < third.predicted.half[0])
    # at 300 mm/min the second tooth is all but out of the cut: 2 e close to f_z = 0.025 mm
    assert 0.011 < done.fit.cutter.runout[0] < 0.013
    assert math.isclose(done.fit.turns[0].speed * 60.0 / math.tau, 6000.0, rel_tol=1e-4)
    assert 600.0 < done.fit.coefficients.values[0] < 1000.0
    # peaks: across within 12 %; along the feed and the axis the dynamometer rings more than an oscillator explains
    assert abs(third.peak_percent[1]) < 12.0
    assert 20.0 < third.peak_percent[0] < 40.0
    # with the runout known, and compared below the ringing, the excess of all runs is under 20 %, and that of the two
    # fitted ones covers the turns of the third; by every sample it was 114 %
    assert 0.05 < done.material.peak_excess < 0.2
    fitted, _ = peak_excess([c.peaks for c in done.comparisons if c.use == "fit"])
    assert np.mean(third.peaks.measured[:, 3] <= third.peaks.predicted[3] * (1.0 + fitted)) >= 0.9


def test_means_without_runout_are_no_straight_line(tmp_path):
    """The average method cannot know that a tooth is out of the cut: along the feed it misses by a sixth."""
    read = job(tmp_path)
    cuts, _ = read_cuts(read)
    fit = fit_average([cuts[0], cuts[2]], read.cutter)
    third = cuts[1].force[:10_000].mean(axis=0)
    line = 0.5 * (cuts[0].force[:10_000].mean(axis=0) + cuts[2].force[:10_000].mean(axis=0))
    c = 900.0 / 12_000.0
    n = 2 * 3.0 / 4 * fit.coefficients.values[0] * c + 2 * 3.0 / math.pi * fit.coefficients.values[3]
    # the edge is in cut for pi + f / R of a revolution, 0.2 % longer than on circles
    assert math.isclose(n, line[1], rel_tol=2e-3)
    off = (line - third) / np.abs(third) * 100.0
    assert abs(off[1]) < 1.0
    assert 15.0 < off[0] < 20.0
    assert abs(off[2]) > 12.0


@pytest.mark.parametrize(("diameter", "helix"), [(25.0, 0.0), (25.0, 45.0), (16.0, 30.0)])
def test_what_is_inferred_hardly_matters(tmp_path, diameter, helix):
    third = next(c for c in run(job(tmp_path, diameter, helix)).comparisons if c.use == "predict")
    assert np.all(np.abs(third.mean_percent) < 6.5), third.mean_percent


def test_peaks_of_the_third_feed_are_within_their_value_at_95_percent(tmp_path):
    """The cut that was not fitted: the greatest force across, in the direction in which the dynamometer rings least, is
    within the value at 95 % in at least 93 of 100 turns; few are within the nominal value and its resolution error. The
    value is 10 to 16 % above the nominal one: with one cut of each feed the coefficients are known to 7 %.
    """
    done = run(job(tmp_path))
    third = next(c for c in done.comparisons if c.use == "predict")
    cutter, metal = done.fit.cutter, done.material
    slot = engagement_of_arcs([0.0], [math.pi], 900.0 / 6000.0 / 2, cutter, 3.0)
    (own,) = load_parts(replace(slot, frame=np.eye(3)[None]), cutter, metal)["force_n"]
    assert own.rise == 0.0  # the fit knows the runout
    parts = budget_parts(own, "force_n", cutter, metal, 0.01, 0.0, 0.0)
    factor = ErrorBudget(0.95, parts).value(1.0)
    assert 1.10 < factor < 1.16
    peaks, nominal = third.turns.high[:, 1], third.predicted.high[1]
    assert len(peaks) == 100
    assert np.mean(peaks <= factor * nominal) >= 0.93
    assert np.mean(peaks <= 1.01 * nominal) < 0.2
