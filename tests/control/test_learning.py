"""Coefficients learned from logs of the spindle, on cells in closed form whose coefficients are drawn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.control.learning import Signal, SignalKind, learn_from_logs, learn_material, signal_of_logs
from chipload.control.log_alignment import align_log
from chipload.control.log_blocks import blocks_of
from chipload.control.logs import SpindleLog
from chipload.cutting.material import material_text, read_material
from chipload.errors import InputError
from synthetic_cell import EFFICIENCY, PRIOR, Truth, cell, closed_form_program, power_log

SIGNAL = Signal(SignalKind.POWER, 1.0 / EFFICIENCY, 0.02)
IDLE = (2e5, 100.0)
TRUTH = Truth(1.2, 0.85, 1.0, 0.0)


@pytest.fixture(scope="module")
def program():
    return closed_form_program(np.random.default_rng(3))


@pytest.fixture(scope="module")
def log(program):
    return power_log(np.random.default_rng(4), TRUTH, program, 0.0, IDLE)


def blocks(log, program, name="log", before=0.0):
    return blocks_of(align_log(name, log, log.power, program), program, {1: before})


def test_coverage():
    """Of 20 cells the 95 % intervals hold Ktc, Kte and the wear in 16 or more (99.7 % likely if they are right), and
    three logs leave a fourth of the prior's spread. benchmarks/learning.py does 500.
    """
    inside = np.zeros(3, dtype=int)
    for seed in range(20):
        logs, signal, truth = cell(seed)
        found = learn_material(logs, signal, PRIOR)
        sd = np.sqrt(np.diagonal(found.material.variances))
        rate, error = found.wear[1]
        inside += [
            abs(found.material.Ktc - truth.cutting * PRIOR.Ktc) < 1.96 * sd[0],
            abs(found.material.Kte - truth.edge * PRIOR.Kte) < 1.96 * sd[3],
            abs(rate - 3600.0 * truth.wear) < 1.96 * error,
        ]
        assert max(found.deviations[1]) < 0.3 * 0.25
    assert (inside >= 16).all()


def test_what_power_does_not_tell_stays(log, program):
    found = learn_material([blocks(log, program)], SIGNAL, PRIOR).material
    for name in ("Krc", "Kac", "Kre", "Kae"):
        assert getattr(found, name) == getattr(PRIOR, name)
    own = [1, 2, 4, 5]
    assert np.allclose(found.variances[np.ix_(own, own)], PRIOR.variances[np.ix_(own, own)], rtol=1e-12)
    assert np.linalg.eigvalsh(found.variances).min() > 0.0


@pytest.mark.parametrize(("error", "most", "least"), [(0.05, 0.054, 0.8), (0.0, 0.022, -1.0)])
def test_share_of_the_efficiency(log, program, error, most, least):
    """Five percent of efficiency are nearly all that is not known of the torque; none where it is known."""
    found = learn_material([blocks(log, program)], Signal(SignalKind.POWER, 1.0 / EFFICIENCY, error), PRIOR)
    deviation, share = found.torque_known
    assert 0.95 * error < deviation < most
    assert least < share <= 1.0
    if error == 0.0:
        assert share < 0.01


def test_clock_and_override(program):
    """The clock of a log is found, and an override that the log states is taken out of it."""
    log = power_log(np.random.default_rng(7), TRUTH, program, 0.0, IDLE)
    rng = np.random.default_rng(7)
    rng.standard_normal()
    lag, rate = rng.uniform(2.0, 20.0), rng.uniform(0.95, 1.2)
    found = align_log("log", log, log.power, program)
    assert found.lag == pytest.approx(lag, abs=0.1)
    assert found.rate == pytest.approx(rate, rel=1e-3)
    # half of the log at half of the feed: each sample lasts twice as long
    half = np.arange(len(log.time)) > len(log.time) // 2
    time = np.cumsum(np.where(half, 0.2, 0.1)) - 0.1
    slow = SpindleLog(time, power=log.power, override=np.where(half, 0.5, 1.0))
    assert align_log("log", slow, slow.power, program).rate == pytest.approx(rate, rel=1e-3)
    with pytest.raises(InputError, match="correlation"):
        align_log("log", replace(slow, override=None), slow.power, program)


def test_lines_align_what_a_lag_cannot(program):
    """The machine stood for 40 s in the middle: the lines of the log say where it was."""
    place = np.arange(0.0, program.time[-1], 0.1)
    row = np.searchsorted(program.time, place)
    middle = len(row) // 2
    row = np.concatenate([row[:middle], np.full(400, row[middle]), row[middle:]])
    torque = 1.2 * program.cutting + 0.85 * program.edge
    power = 2e5 + torque[row] * program.speed[row] / EFFICIENCY
    log = SpindleLog(0.1 * np.arange(len(row)), power=power, line=program.line[row].astype(float))
    aligned = align_log("log", log, log.power, program)
    assert aligned.correlation > 0.95
    found = learn_material(
        [blocks_of(aligned, program)], Signal(SignalKind.POWER, 1.0 / EFFICIENCY, 0.0), PRIOR
    ).material
    assert found.Ktc == pytest.approx(1.2 * PRIOR.Ktc, rel=0.06)


def test_lag_of_the_sensor_is_found():
    """A drive filters its power by 0.15 s and the lines are logged 0.1 s early: the filter in closed form, with
    cuts of 1 to 5 s. Without the lag each cut begins and ends wrong, and the idle power takes what follows it.
    """
    tau, early, step = 0.15, 0.1, 0.02
    short = closed_form_program(np.random.default_rng(3), lines=30)
    t = np.arange(0.0, short.time[-1], step)
    row = np.searchsorted(short.time, t)
    power = 2e5 + (1.2 * short.cutting + 0.85 * short.edge)[row] * short.speed[row] / EFFICIENCY
    shown = np.empty(len(power))
    shown[0] = 2e5
    for k in range(1, len(power)):
        shown[k] = power[k] + (shown[k - 1] - power[k]) * np.exp(-step / tau)
    line = short.line[np.searchsorted(short.time, np.minimum(t + early, short.time[-1]))]
    log = SpindleLog(t, power=shown, line=line.astype(float))
    aligned = align_log("log", log, log.power, short)
    assert aligned.sensor_lag == pytest.approx(tau, rel=0.1)
    found = learn_material([blocks_of(aligned, short)], Signal(SignalKind.POWER, 1.0 / EFFICIENCY, 0.0), PRIOR)
    assert found.material.Ktc == pytest.approx(1.2 * PRIOR.Ktc, rel=0.01)
    assert found.material.Kte == pytest.approx(0.85 * PRIOR.Kte, rel=0.03)


def test_a_clock_that_jumps_is_named(log, program):
    """Seconds are added in the middle of a program, fewer than it lasts: without its lines it is refused, and the jump
    is said.
    """
    time = np.where(np.arange(len(log.time)) > len(log.time) // 2, log.time + 40.0, log.time)
    said = r"another program.*its clock: 1 gap in time, the first of 40\.1 s at .*: log the line of the program"
    with pytest.raises(InputError, match=said):
        align_log("log", replace(log, time=time), log.power, program)


@pytest.mark.parametrize("lines", [False, True])
def test_a_clock_that_jumps_by_more_than_the_program_lasts(log, program, lines):
    """As one that becomes seconds since 1970: no sample can be missing for so long, so that it is the same log."""
    own = align_log("log", log, log.power, program)
    stated = replace(log, line=np.where(own.row < 0, 0, program.line[own.row]).astype(float)) if lines else log
    time = np.where(np.arange(len(log.time)) > len(log.time) // 2, log.time + 1e9, log.time)
    found = align_log("log", replace(stated, time=time), log.power, program)
    assert [(f.code, "the first of 1e9 s" in f.text) for f in found.findings] == [("log-gap", True)]
    assert found.correlation > 0.95
    learned = learn_material([blocks_of(found, program)], SIGNAL, PRIOR)
    assert learned.material.Ktc == pytest.approx(1.2 * PRIOR.Ktc, rel=3.0 * learned.deviations[1][0])


def test_blocks_of_a_clock_that_jumps_are_few(log, program):
    """A block is as long as without the jump: their number does not grow by it."""
    aligned = align_log("log", log, log.power, program)
    late = replace(aligned, time=np.where(np.arange(len(log.time)) > 1000, log.time + 1e7, log.time))
    few, usual = blocks_of(late, program, {}), blocks_of(aligned, program, {})
    assert abs(len(few.time) - len(usual.time)) < 10


def test_a_sample_far_out_of_range_is_left_out(log, program):
    """One sample of 1e9 W would be all that the correlation sees."""
    power = log.power.copy()
    power[700] = 1e12
    found = align_log("log", replace(log, power=power), power, program)
    assert len(found.time) == len(log.time) - 1
    assert found.correlation > 0.95
    assert [f.code for f in found.findings] == ["log-spike"]
    assert f"1 of its samples are left out: the one at {log.time[700]:g} s is" in found.findings[0].text


def test_what_is_odd_of_a_log_that_is_refused(log, program):
    """A quarter of the program, a clock in other units, a wrong sign, some samples: each is said."""
    some = len(log.time) // 4
    part = SpindleLog(log.time[:some], power=log.power[:some])
    for one, text in (
        (part, r"it lasts 60\.4 s, the program is calculated to last \d+(\.\d+)? s: a part of the program$"),
        (
            replace(log, time=1e3 * log.time),
            r"more than the program, or the unit of its time \(a factor of 0\.000[78]\d\)",
        ),
        (replace(log, time=log.time / 60.0), r"a part of the program, or the unit of its time \(a factor of 4\d\)"),
        (replace(log, power=-log.power), "most of its values are negative: check their sign"),
        (
            SpindleLog(log.time[:9], power=log.power[:9]),
            "log: 9 samples: at least 10 are needed: log the whole program",
        ),
    ):
        with pytest.raises(InputError, match=text):
            align_log("log", one, one.power, program)


@pytest.mark.parametrize("factor", [1e-3, 10.0, 1e3])
def test_unit_of_the_clock_is_named_by_its_lines(log, program, factor):
    """Lines align any clock: one in milliseconds would be taken as a program that lasts a thousand times as long."""
    place = np.arange(0.0, program.time[-1], 0.1)
    row = np.searchsorted(program.time, place)
    power = 2e5 + (program.cutting + program.edge)[row] * program.speed[row]
    known = SpindleLog(factor * place, power=power, line=program.line[row].astype(float))
    with pytest.raises(InputError, match=rf"check the unit of its time \(a factor of {factor:g}\)"):
        align_log("log", known, known.power, program)


def test_lines_of_another_program(log, program):
    """No line of the log is one of the program: it is aligned by its load, and refused by it."""
    other = closed_form_program(np.random.default_rng(99))
    with pytest.raises(InputError, match="it is the log of another program"):
        align_log("log", replace(log, line=np.full(len(log.time), 1e6)), log.power, other)
    found = align_log("log", replace(log, line=np.zeros(len(log.time))), log.power, program)
    assert found.correlation > 0.9
    assert [str(f) for f in found.findings] == [
        "log: its lines are not those of the program: it is aligned by its load (log-line)"
    ]


def test_missing_stock_is_named(log, program):
    """Air in five lines where the program cuts: the lines are named and do not enter the coefficients."""
    aligned = align_log("log", log, log.power, program)
    cut = np.unique(program.line[program.cutting > 0.0])[10:15]
    missing = (aligned.row >= 0) & np.isin(program.line[aligned.row], cut)
    power = np.where(missing, np.quantile(log.power, 0.05), log.power)
    found = learn_material([blocks(replace(log, power=power), program)], SIGNAL, PRIOR)
    air = [f for f in found.findings if f.code == "log-air"]
    assert len(air) == 1
    assert air[0].severity.name == "UNPROVEN"
    assert f"lines {cut[0]} to {cut[-1]}" in air[0].text
    assert found.material.Ktc == pytest.approx(1.2 * PRIOR.Ktc, rel=3.0 * found.deviations[1][0])


def test_a_block_alone_is_no_fault(log, program):
    """A block of the air with the power of a cut, as where a line begins late, is left out without a finding; two are
    one.
    """
    aligned = align_log("log", log, log.power, program)
    air = np.flatnonzero((aligned.row >= 0) & (program.cutting[aligned.row] == 0.0))
    long = np.split(air, np.flatnonzero(np.diff(air) > 1) + 1)
    own = max(long, key=len)
    length = (log.time[-1] - log.time[0]) / 240
    place = ((log.time - log.time[0]) / length).astype(int)
    middle = place[own[len(own) // 2]]
    for blocks_wrong, codes in ((1, []), (2, ["log-metal"])):
        changed = (place >= middle) & (place < middle + blocks_wrong)
        power = np.where(changed, np.quantile(log.power, 0.9), log.power)
        found = learn_material([blocks(replace(log, power=power), program)], SIGNAL, PRIOR)
        assert [f.code for f in found.findings] == codes
        assert found.left_out >= blocks_wrong


@pytest.mark.parametrize("factor", [1e-3, 10.0, 1e3])
def test_unit_of_the_power(log, program, factor):
    with pytest.raises(InputError, match=r"check its unit \(a factor of"):
        learn_material([blocks(replace(log, power=factor * log.power), program)], SIGNAL, PRIOR)


def test_another_program(log):
    other = closed_form_program(np.random.default_rng(99))
    with pytest.raises(InputError, match="it is the log of another program"):
        align_log("log", log, log.power, other)


def test_the_efficiency_is_one_however_often_is_learned(program, tmp_path):
    """Five logs one after another, by files: Ktc cannot be known better than the efficiency, to 2 %. Errors that are
    drawn anew with each log would leave 0.028 / sqrt(5), as efficiency and simulated torque are known to 2 % each.
    """
    material, truth = PRIOR, replace(TRUTH, wear=0.0)
    for k in range(5):
        own = power_log(np.random.default_rng(40 + k), truth, program, 0.0, IDLE)
        found, _ = learn_from_logs({f"log {k}": own}, predicted_with(program, material), SIGNAL, material)
        (tmp_path / "m.toml").write_text(material_text(found.material))
        material = read_material(tmp_path / "m.toml")
        assert material.learned.gain == found.gain
    bound = 1.0 / math.hypot(1.0 / 0.25, 1.0 / SIGNAL.gain_error)
    assert 0.95 * bound < found.deviations[1][0] < 1.3 * bound
    assert abs(material.Ktc / PRIOR.Ktc - TRUTH.cutting) < 2.0 * bound
    # by their product, but for what the error of the simulated torque leaves
    gain = material.learned.gain
    assert gain.with_ktc / (gain.deviation * found.deviations[1][0]) < -0.85
    product = material.Ktc / PRIOR.Ktc * gain.ratio
    assert product == pytest.approx(TRUTH.cutting * TRUTH.gain, rel=0.04)


def predicted_with(program, material):
    """The torque of a program with the coefficients of a material."""
    cutting, edge = material.Ktc / PRIOR.Ktc, material.Kte / PRIOR.Kte
    return replace(program, cutting=cutting * program.cutting, edge=edge * program.edge)


def test_a_worn_tool(program):
    """An edge force that doubles over 10 minutes of cutting is seen as wear, within its interval."""
    worn = Truth(1.0, 1.0, 1.0, 1.0 / 600.0)
    logs, before = [], 0.0
    for k in range(4):
        log = power_log(np.random.default_rng(20 + k), worn, program, before, IDLE)
        logs.append(blocks(log, program, f"log {k}", before))
        before += program.cut_seconds[1]
    found = learn_material(logs, SIGNAL, PRIOR)
    rate, error = found.wear[1]
    assert rate == pytest.approx(6.0, abs=2.0 * error)
    assert error < 1.0
    assert [f.code for f in found.findings] == ["log-wear"]
    # and what a tool that stays takes next: twice the edge force after 600 s
    after = learn_material(logs, SIGNAL, PRIOR, worn_s=before).material
    edge = PRIOR.Kte * (1.0 + before / 600.0)
    assert abs(after.Kte - edge) < 2.0 * after.variances[3, 3] ** 0.5
    assert after.variances[3, 3] ** 0.5 < 0.12 * edge
    assert after.Ktc == found.material.Ktc


def test_contradicting_logs(program):
    """A log with twice the force, beside two that agree, is refused by name."""
    logs = []
    for k, factor in enumerate((1.0, 1.0, 2.0)):
        truth = Truth(factor, factor, 1.0, 0.0)
        logs.append(blocks(power_log(np.random.default_rng(30 + k), truth, program, 0.0, IDLE), program, f"log {k}"))
    with pytest.raises(InputError, match=r"log 2: its cut takes \d+ % more than that of the other logs"):
        learn_material(logs, SIGNAL, PRIOR)


def test_another_material_is_named(program):
    """Forces of 2.2 times the prior, 4.8 of its standard deviations: they are learned, and not believed in silence."""
    log = power_log(np.random.default_rng(40), Truth(2.2, 2.2, 1.0, 0.0), program, 0.0, IDLE)
    found = learn_material([blocks(log, program)], SIGNAL, PRIOR)
    text = [f.text for f in found.findings if f.code == "log-material"]
    assert [t.split()[0] for t in text] == ["Ktc", "Kte"]
    assert "another material or tool, or a wrong efficiency" in text[0]
    assert found.material.Ktc == pytest.approx(2.2 * PRIOR.Ktc, rel=0.1)


def test_a_size_effect_without_edge_force(program):
    """Ktc of a material whose Kte is 0 and whose directions have spreads of their own."""
    prior = replace(
        PRIOR, Kte=0.0, Kre=0.0, Kae=0.0, exponents=(0.25, 0.25, 0.25), spread=0.3, spread_directions=(0.4, 0.5)
    )
    plain = replace(program, edge=np.zeros(len(program.edge)))
    log = power_log(np.random.default_rng(41), Truth(1.2, 1.0, 1.0, 0.0), plain, 0.0, IDLE)
    found = learn_material([blocks(log, plain)], SIGNAL, prior).material
    assert found.Kte == 0.0
    assert abs(found.Ktc - 1.2 * prior.Ktc) < 2.5 * np.sqrt(found.variances[0, 0]) < 0.15 * prior.Ktc
    assert np.allclose(np.sqrt(np.diagonal(found.variances))[1:3], [0.4 * prior.Krc, 0.5 * prior.Kac])


def test_override_in_percent(log, program):
    percent = replace(log, override=np.full(len(log.time), 100.0))
    with pytest.raises(InputError, match="override = 100: must be from 0 to 3, a share of the programmed feed"):
        align_log("log", percent, percent.power, program)


def test_an_efficiency_is_not_ignored(log):
    torque = replace(log, torque=log.power)
    assert signal_of_logs([torque]).kind is SignalKind.TORQUE
    with pytest.raises(InputError, match="efficiency: not used: the logs state the torque"):
        signal_of_logs([torque], 0.9)
    assert signal_of_logs([log], 0.9).gain_error == 0.05
    assert signal_of_logs([log]) == Signal(SignalKind.POWER, 1.25, 0.1)
