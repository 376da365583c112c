"""Peaks that were measured above predicted ones: the fit writes how far, and limits on peaks are held with it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from types import SimpleNamespace

import numpy as np
import pytest

from chipload.checking.default_checks import PEAKS, DefaultChecks, with_peaks
from chipload.checking.limits import program_limits
from chipload.checking.load_budget import TURNS
from chipload.cutter.cutter import Cutter
from chipload.cutting.load_parts import LoadParts
from chipload.cutting.material import material_named, material_text, read_material
from chipload.cutting.turns import MeasuredCut, peaks_in_band, turns_of
from chipload.errors import InputError
from chipload.jobs import load_job, run_job
from chipload.jobs.fit.outcome import ComparedPeaks
from chipload.jobs.fit.run import peak_excess
from chipload.result import COLUMNS, LimitCheck, Verdict

PROGRAM = "G21 G90 G94 G17 G54\nT1 M6\nS3000 M3\nG0 X-10 Y5 Z5\nG1 Z-1 F100\nX30 F400\nG0 Z5\nM2\n"
JOB = """[program]
file = "slot.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, -5.0, -5.0]
high_mm = [40.0, 15.0, 0.0]
layer_mm = 2.5
[material]
file = "own.toml"
[[cutter]]
number = 1
diameter_mm = 6.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 15.0
overhang_mm = 25.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = 10.0
[limits]
force_n = 1e5
torque_nm = 1e3
[checks]
confidence = 0.5
"""


@pytest.fixture
def job(tmp_path: Path) -> Path:
    (tmp_path / "slot.ngc").write_text(PROGRAM)
    (tmp_path / "own.toml").write_text(material_text(material_named("al7075-t6")) + "peak_excess = 0.4\n")
    (tmp_path / "job.toml").write_text(JOB)
    return tmp_path / "job.toml"


def limit(job: Path, *sets: str) -> LimitCheck:
    found = run_job(load_job(job, sets)).result.limits
    return next(check for check in found if check.name == "force_n")


def test_a_limit_on_a_peak_is_held_with_the_measured_band(job: Path) -> None:
    """The same force: a limit 1.3 times as high is within 40 %, one of 1.6 times is not, one below it is exceeded."""
    free = limit(job)
    assert free.state is Verdict.HOLDS
    force = free.worst * (1.0 + free.resolution_error)
    near = limit(job, f"limits.force_n={1.3 * force}")
    assert (near.state, near.worst) == (Verdict.UNPROVEN, free.worst)
    assert near.reason == "measured peaks of al7075-t6 were up to 40 % above predicted ones"
    assert limit(job, f"limits.force_n={1.6 * force}").state is Verdict.HOLDS
    assert limit(job, f"limits.force_n={0.5 * force}").state is Verdict.EXCEEDS
    (job.parent / "own.toml").write_text(material_text(material_named("al7075-t6")))
    assert limit(job, f"limits.force_n={1.3 * force}").state is Verdict.HOLDS


def test_a_chip_beyond_the_measured_ones_leaves_peaks_unproven(job: Path) -> None:
    """Feed per tooth 400 / 3000 / 2 mm: a limit far above the force holds up to it, and is unproven above it."""
    own = material_text(material_named("al7075-t6")) + "peak_excess = 0.4\nchip_min_mm = 0.0\n"
    (job.parent / "own.toml").write_text(own + "chip_max_mm = 0.067\n")
    assert limit(job).state is Verdict.HOLDS
    (job.parent / "own.toml").write_text(own + "chip_max_mm = 0.066\n")
    found = limit(job)
    assert found.state is Verdict.UNPROVEN
    assert found.reason == "chips are up to 0.06667 mm thick, al7075-t6 was measured up to 0.066 mm"
    assert limit(job, "limits.force_n=1.0").state is Verdict.EXCEEDS
    assert limit(job, "checks.chip_range=false").state is Verdict.HOLDS


def test_new_feeds_leave_room_for_the_band(job: Path) -> None:
    """Feeds as fast as a limit of force allows: the force that is predicted is the limit over 1.4 (and its error)."""
    feeds = ["operation.0.feeds.slowest_percent=20", "operation.0.feeds.fastest_percent=400"]
    force = limit(job).worst
    found = limit(job, f"limits.force_n={2.0 * force}", *feeds)
    assert found.state is Verdict.HOLDS
    assert 0.95 * 2.0 * force / 1.4 < found.worst <= 2.0 * force / 1.4


def test_means_are_not_peaks() -> None:
    """Every column of a greatest value of force, torque, stress or deflection is one; none of a mean or of a power."""
    assert set(PEAKS) <= set(COLUMNS)
    assert not {"torque_mean_nm", "power_w", "chip_max_mm"} & set(PEAKS)
    check = LimitCheck("spindle_torque_nm", 10.0, 9.9, Verdict.HOLDS, resolution_error=0.0)
    own = replace(material_named("al7075-t6"), peak_excess=0.4, chip=(0.0, 0.05))
    assert with_peaks(check, DefaultChecks({}, own), {"chip_max_mm": np.array([0.1])}) is check


def test_the_stress_of_a_workpiece_has_the_band_of_the_force() -> None:
    """0.5 MPa per N: 300 N with a deviation of 20 % count as 300 exp(0.2) N at one deviation; then peaks by 40 %."""
    strained = SimpleNamespace(strength=200.0, worst=lambda force: (0, 0.5 * float(force[0]), (0.0, 0.0, 0.0)))
    own = replace(material_named("al7075-t6"), peak_excess=0.0)
    columns = {"line": np.array([1]), "t_s": np.zeros(1), "force_n": np.array([300.0])}
    parts = {(1, "force_n"): LoadParts(300.0, coefficients=0.2)}
    mill = Cutter(6.0, 2, 0.5, 15.0, 25.0, 5.8e5)

    def stress(sigma: float, excess: float = 0.0) -> LimitCheck:
        simulation = SimpleNamespace(
            workpiece=SimpleNamespace(strained=strained, error=0.0), errors={"force_n": 0.0}, limits={}, stability=None,
            machine=None, left=None, checks=DefaultChecks(
                {1: mill}, replace(own, peak_excess=excess), ("spindle",), NormalDist().cdf(sigma), parts
            ),
        )  # fmt: skip
        (found,) = program_limits(simulation, columns, "program")
        return found

    assert stress(0.0).worst == stress(1.0).worst == 150.0
    held = stress(1.0)
    assert held.budget.value(150.0) == pytest.approx(150.0 * math.exp(math.hypot(0.2, TURNS)))
    assert stress(0.0, 0.3).state is Verdict.HOLDS
    assert stress(0.0, 0.4).state is Verdict.UNPROVEN
    assert stress(2.0).state is Verdict.UNPROVEN


def peaks(seen: float, across: float = 50.0) -> ComparedPeaks:
    """100 turns with peaks from 0.9 to 1.1 times ``seen`` in the plane; predicted are 100 N along the feed, across it
    and in the plane, and 20 N along the axis, where 30 N are measured.
    """
    turns = np.linspace(0.9, 1.1, 101)[:, None] * np.array([500.0, across, 30.0, seen])
    return ComparedPeaks(np.array([100.0, 100.0, 20.0, 100.0]), turns)


def test_the_excess_of_all_runs() -> None:
    """90 % of peaks spread evenly from 0.9 to 1.1 times 120 N are at most 1.08 times 120 N: 29.6 % above 100 N. A force
    along the feed alone is no limit's; the axis has an excess of its own, unless the force in the plane hides it.
    """
    assert peak_excess([peaks(120.0), peaks(90.0)]) == pytest.approx((0.296, 0.62))
    assert peak_excess([peaks(90.0), peaks(60.0, 120.0)]) == pytest.approx((0.296, 0.62))
    assert peak_excess([peaks(60.0)])[0] == 0.0
    hidden = peaks(120.0)
    assert peak_excess([replace(hidden, predicted=np.array([100.0, 100.0, 1.0, 100.0]))])[1] is None
    assert peak_excess([]) == (None, None)


def test_peaks_of_a_dynamometer_that_rings_are_those_of_its_band() -> None:
    """Two teeth at 10 Hz, 100 and 40 N at the spindle's first harmonics and 300 N at its 20th, which the dynamometer
    adds: 140 N in the band of 5 harmonics, whatever the phase; by every sample 440 N.
    """
    t = np.arange(4000) / 2000.0 + 0.013
    low = 100.0 * np.cos(math.tau * 10.0 * t) + 40.0 * np.cos(math.tau * 20.0 * t)
    force = np.column_stack([0.0 * t, low + 300.0 * np.cos(math.tau * 200.0 * t), np.nan * t])
    measured = MeasuredCut("ringing", 2000.0, force, 10.0, math.tau * 10.0, (0.0, math.pi), 1.0)
    turns = turns_of(measured, 40)
    found = peaks_in_band(measured, turns, 5)
    assert len(found) == 20
    assert found[:, 1] == pytest.approx(140.0, rel=1e-3)
    assert found[:, 3] == pytest.approx(140.0, rel=1e-3)
    assert np.isnan(found[:, 2]).all()
    assert turns.high[:, 1] == pytest.approx(440.0, rel=0.05)


def test_a_limit_on_the_axial_force_has_the_excess_along_the_axis(job: Path) -> None:
    text = material_text(material_named("al7075-t6")) + "peak_excess = 0.4\npeak_excess_axial = 0.9\n"
    (job.parent / "own.toml").write_text(text)
    found = run_job(load_job(job, ["limits.force_axial_n=1e5"])).result.limits
    force = next(check for check in found if check.name == "force_axial_n")
    assert force.state is Verdict.HOLDS
    high = force.worst * (1.0 + force.resolution_error)
    for times, state in ((1.8, Verdict.UNPROVEN), (2.0, Verdict.HOLDS)):
        found = run_job(load_job(job, [f"limits.force_axial_n={times * high}"])).result.limits
        assert next(check for check in found if check.name == "force_axial_n").state is state


def test_a_material_file_states_it(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    text = material_text(material_named("al7075-t6"))
    path.write_text(text + "peak_excess = 0.4\n")
    own = read_material(path)
    assert own.peak_excess == 0.4
    assert "peak_excess = 0.4\n" in material_text(own)
    path.write_text(text + "peak_excess = -0.1\n")
    with pytest.raises(InputError, match=r"peak_excess = -0.1: must be from 0 to 10 \(0.4 is 40 %\)"):
        read_material(path)
