"""Stability of programs: margins against the library, limits and their states, new speeds, what is refused."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chipload.checking.dynamics import Dynamics
from chipload.checking.stability import StabilityResult
from chipload.checking.stability_watch import StabilityWatch
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.errors import InputError
from chipload.jobs import FinishedJob, load_job, run_job
from chipload.machine.machine import machine_named
from chipload.program.gcode.speed_words import SpeedWord, speed_words, with_speeds
from chipload.report.page import page_bytes
from chipload.result import Verdict
from chipload.result.limits import LimitCheck, check_limit, state_of
from chipload.simulation.loads import Cuts
from chipload.stability.cuts import dynamic_cuts
from chipload.stability.margin import stability_margins
from chipload.stability.modes import Modes
from chipload.stability.process_damping import ProcessDamping
from mill import made_up_job, made_up_material

MATERIAL = made_up_material(700.0, 210.0, 100.0, 10.0, 12.0, 2.0)
JOB = made_up_job(
    3,
    4.0,
    """SPEEDS
[dynamics]
MODES
[limits]
force_n = 5000.0
LIMITS
""",
)
MODES = """[[dynamics.mode]]
frequency_hz = 650.0
damping_ratio = 0.02
stiffness_n_um = 5.0
direction = "x"
[[dynamics.mode]]
frequency_hz = 720.0
damping_ratio = 0.025
stiffness_n_um = 7.0
direction = "y"
"""
#: down milling of half the diameter, 1.5 mm deep, along x
TEXT = "G21 G90 G94 G17\nT1 M6\nS9000 M3\nG0 X-8 Y20 Z5\nG0 Z-1.5\nG1 X48 F1350 (side)\nG0 Z5\nM2\n"
OMEGA = math.tau / 60.0


def done(folder: Path, *, text: str = TEXT, modes: str = MODES, limits: str = "", speeds: str = "") -> FinishedJob:
    (folder / "m.toml").write_text(MATERIAL)
    (folder / "a.ngc").write_text(text)
    job = JOB.replace("MODES", modes).replace("LIMITS", limits).replace("SPEEDS", speeds)
    (folder / "job.toml").write_text(job)
    return run_job(load_job(folder / "job.toml", ["checks.confidence=0.5"]))


def library_margin(rpm: float, depth: float, T=(1.0, 0.0)) -> float:
    """The same cut asked directly: the wall is on the right, material from pi / 2 to pi."""
    cutter = Cutter(10.0, 3, 0.0, 20.0, 30.0, 5.8e5)
    metal = Material("m", 700.0, 210.0, 100.0, 10.0, 12.0, 2.0, source="made up for tests")
    modes = Modes([650.0, 720.0], [0.02, 0.025], [5000.0, 7000.0], [[1.0, 0.0], [0.0, 1.0]])
    met = engagement_of_arcs([math.pi / 2], [math.pi], 0.05, cutter, depth)
    n = (-T[1], T[0])
    return float(stability_margins(dynamic_cuts(met, cutter, metal, modes, rpm * OMEGA, [T], [n])).margin[0])


def check_of(read: FinishedJob, name: str = "stability_margin") -> LimitCheck:
    (check,) = (c for c in read.result.limits if c.name == name)
    return check


@pytest.mark.parametrize(("rpm", "depth"), [(9000, 1.5), (6000, 3.0), (8000, 3.0)])
def test_the_margin_of_a_side_cut_is_that_of_the_library(tmp_path: Path, rpm: int, depth: float) -> None:
    read = done(tmp_path, text=TEXT.replace("S9000", f"S{rpm}").replace("Z-1.5", f"Z-{depth}"))
    columns = read.result.in_use[0].columns
    cuts = (columns["x_mm"] > 8.0) & (columns["x_mm"] < 36.0) & ~columns["rapid"]
    assert cuts.sum() > 5
    exact = library_margin(rpm, depth)
    assert np.allclose(columns["stability_margin"][cuts], exact, rtol=0.01)
    assert (columns["stability_margin"][~cuts & (columns["chip_areas"] == 0)] == 3.0).all()
    check = check_of(read)
    assert (check.limit, check.column.least) == (1.0, True)
    assert check.state is (Verdict.EXCEEDS if exact < 0.98 else Verdict.HOLDS)
    assert read.result.verdict.exit_code == (3 if exact < 0.98 else 0)
    told = read.result.operations[0]["stability"]
    assert (told["margin_min"], told["line"]) == (check.worst, check.line)
    assert told["speed_rpm"] == pytest.approx(rpm)
    if exact < 1.0:
        assert told["mode"] in ("cutter 650 Hz", "cutter 720 Hz")
        assert 500.0 < told["chatter_hz"] < 900.0
        assert "stability margin" in read.result.message
        assert f"is below 1 in line {check.line}" in read.result.message
    json.dumps(read.result.operations[0], allow_nan=False)


def test_the_direction_of_the_feed_counts(tmp_path: Path) -> None:
    along_y = TEXT.replace("X-8 Y20", "X0 Y-28").replace("X48 F1350", "Y28 F1350").replace("S9000", "S8000")
    read = done(tmp_path, text=along_y.replace("Z-1.5", "Z-3"))
    columns = read.result.in_use[0].columns
    steady = (columns["y_mm"] > -10.0) & (columns["y_mm"] < 14.0) & ~columns["rapid"]
    exact, other = library_margin(8000, 3.0, (0.0, 1.0)), library_margin(8000, 3.0)
    assert abs(exact - other) > 0.1 * exact
    assert np.allclose(columns["stability_margin"][steady], exact, rtol=0.01)


@pytest.mark.parametrize(
    ("modes", "reason"),
    [
        (MODES.replace("damping_ratio = 0.02\n", ""), "damping of mode 1 is not stated"),
        (MODES.replace("stiffness_n_um = 7.0\n", ""), "stiffness of mode 2 is not stated"),
        (MODES.replace("direction", 'of = "workpiece"\ndirection'), "modes of tool 1 is not stated"),
    ],
)
def test_what_is_not_stated_leaves_the_margin_unproven(tmp_path: Path, modes: str, reason: str) -> None:
    check = check_of(done(tmp_path, modes=modes, text=TEXT.replace("Z-1.5", "Z-0.5")))
    assert check.state is Verdict.UNPROVEN
    assert check.reason == reason
    assert "at least 1" in check.text


def test_a_limit_of_the_margin_and_of_the_surface_location_error(tmp_path: Path) -> None:
    read = done(
        tmp_path,
        text=TEXT.replace("S9000", "S12000").replace("F1350", "F1800"),
        limits="stability_margin = 1.5\nsle_um = 3.0",
    )
    margin, sle = check_of(read), check_of(read, "sle_um")
    assert margin.limit == 1.5
    assert sle.worst == pytest.approx(np.abs(read.result.in_use[0].columns["sle_um"]).max())
    assert sle.worst > 3.0
    assert margin.worst > 1.5
    assert (margin.state, sle.state) == (Verdict.HOLDS, Verdict.EXCEEDS)


def test_an_error_of_the_wall_is_no_number_where_the_step_chatters(tmp_path: Path) -> None:
    read = done(tmp_path, text=TEXT.replace("Z-1.5", "Z-5").replace("S9000", "S8000"), limits="sle_um = 500.0")
    assert (
        read.result.in_use[0].columns["sle_um"][read.result.in_use[0].columns["stability_margin"] < 1.0] == 0.0
    ).all()
    assert check_of(read, "sle_um").state is Verdict.UNPROVEN


def test_harmonics_that_do_not_reach_a_mode_leave_the_error_of_the_wall_unproven(tmp_path: Path) -> None:
    # 400 harmonics of three teeth reach 4 times 720 Hz from 144 rpm on
    states = []
    for rpm in (140, 150):
        text = TEXT.replace("S9000", f"S{rpm}").replace("F1350", f"F{0.15 * rpm:g}")
        check = check_of(done(tmp_path, text=text, limits="sle_um = 500.0"), "sle_um")
        states.append((check.state, "harmonics" in check.reason))
    assert states == [(Verdict.UNPROVEN, True), (Verdict.HOLDS, False)]


def test_new_speeds_are_written_read_and_simulated_again(tmp_path: Path) -> None:
    text = TEXT.replace("S9000", "S8000").replace("Z-1.5", "Z-3").replace("F1350", "F1200")
    read = done(
        tmp_path,
        text=text,
        limits="stability_margin = 1.1",
        speeds="[operation.speeds]\nleast_rpm = 6000.0\nmost_rpm = 14000.0",
    )
    assert read.outcome.speeds is not None
    (tool,) = read.outcome.speeds.tools
    assert tool.before == (8000.0,)
    assert 6000.0 <= tool.rpm <= 14000.0
    new = read.outcome.speeds.text
    assert [(w.line, w.rpm) for w in speed_words(new)] == [(3, tool.rpm)]
    strip = re.compile(r"[SF][\d.]+")
    assert strip.sub("", new) == strip.sub("", text)
    feed = float(re.search(r"F([\d.]+)", new)[1])
    assert feed / tool.rpm == pytest.approx(1200.0 / 8000.0, rel=1e-3)
    assert feed / tool.rpm <= 1200.0 / 8000.0 * (1 + 1e-9)
    after, before = read.result.tracks
    assert (after.in_use, before.in_use) == (True, False)
    worst = {t.name: next(c for c in t.limits if c.name == "stability_margin").worst for t in (after, before)}
    assert worst["original"] < 1.0 < 1.1 < worst["optimised"]
    assert worst["optimised"] == pytest.approx(min(library_margin(tool.rpm, 3.0), 3.0), rel=0.02)
    told = read.result.operations[0]["speeds"]
    assert told["after"]["margin_min"] == worst["optimised"]
    assert told["tools"][0]["margin_expected"] == pytest.approx(worst["optimised"], rel=0.02)
    windows = read.result.operations[0]["stability"]["windows"]
    assert any(w["low_rpm"] <= tool.rpm <= w["high_rpm"] for w in windows)
    assert after.programs[0] == "0-speeds.ngc"
    folder = read.save(tmp_path / "r")
    assert ((folder / "0-speeds.ngc").read_text() == new) == (read.result.verdict is Verdict.HOLDS)
    assert b"Stability" in page_bytes(read.result, read.presentation)


def test_speed_words_of_other_dialects() -> None:
    assert speed_words("N1 S1=5000 M3\n(S9)\ns2500.5") == (SpeedWord(1, 5000.0), SpeedWord(3, 2500.5))
    assert with_speeds("S1=5000 M3\nG1 X1 F100", {1: 6000.0}, {2: 1.2}) == "S1=6000 M3\nG1 X1 F120"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("S#1 M3", "line 1: S#1 M3: a speed that is calculated"),
        ("G96 S200", "line 1: G96"),
        ("M3\nS1000 S2000", "line 2: two S words"),
    ],
)
def test_speeds_that_cannot_be_changed_are_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        speed_words(text)


def test_one_s_word_for_two_tools_is_refused(tmp_path: Path) -> None:
    text = TEXT.replace("G0 Z5\nM2", "G0 Z5\nT2 M6\nG0 X-8 Y10\nM3\nG0 Z-1.5\nG1 X48\nG0 Z5\nM2")
    second = JOB[JOB.index("[[cutter]]") : JOB.index("[[operation]]")].replace("number = 1", "number = 2")
    (tmp_path / "m.toml").write_text(MATERIAL)
    (tmp_path / "a.ngc").write_text(text)
    job = JOB.replace("[[operation]]", second + "[[operation]]").replace("MODES", MODES).replace("LIMITS", "")
    (tmp_path / "job.toml").write_text(job.replace("SPEEDS", "[operation.speeds]"))
    with pytest.raises(InputError, match="line 3: S9000 applies to tools 1, 2"):
        run_job(load_job(tmp_path / "job.toml"))


@pytest.mark.parametrize(
    ("modes", "message"),
    [
        (MODES.replace("0.02\n", "-0.02\n"), "damping_ratio"),
        (MODES.replace("= 650.0", "= 90000.0"), "modes.frequency = 90000 Hz"),
        (MODES.replace("stiffness_n_um = 5.0", "stiffness_n_um = 5e-6"), "modes.stiffness = 0.005 N/mm"),
        (MODES.replace('"x"', "[0.0, 0.0]"), "modes.direction"),
        (MODES.replace("stiffness_n_um = 5.0", "stiffness_n_um = 5.0\nmass_kg = 0.3"), "state one of them"),
        (MODES.replace('direction = "x"', 'direction = "x"\ntool = 4'), "tool = 4: no [[cutter]]"),
        ('file = "gone.toml"\n', "gone.toml"),
        ("", "no mode: state [[dynamics.mode]]"),
    ],
)
def test_modes_that_cannot_be_are_refused_before_anything_is_cut(tmp_path: Path, modes: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        done(tmp_path, modes=modes)


def test_a_margin_needs_modes(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(MATERIAL)
    (tmp_path / "a.ngc").write_text(TEXT)
    job = (
        JOB.replace("[dynamics]\nMODES", "")
        .replace("SPEEDS", "[operation.speeds]")
        .replace("LIMITS", "stability_margin = 1.2")
    )
    (tmp_path / "job.toml").write_text(job)
    with pytest.raises(InputError) as err:
        load_job(tmp_path / "job.toml")
    assert "limits.stability_margin: needs modes" in str(err.value)
    assert "operation.0.speeds: needs modes" in str(err.value)


def test_a_limit_that_is_a_least_value() -> None:
    assert [state_of(x, 1.0, 0.05, least=True)[0].value for x in (0.9, 1.02, 1.1)] == ["exceeds", "unproven", "holds"]
    rows = {"stability_margin": np.array([2.0, 1.3, 3.0]), "line": np.array([1, 2, 3])}
    check = check_limit("stability_margin", 1.2, rows, error=0.0)
    assert (check.worst, check.line, check.state, check.text) == (
        1.3,
        2,
        Verdict.HOLDS,
        "stability margin 1.3 of at least 1.2",
    )
    assert check_limit("stability_margin", 1.4, rows, error=0.0).text == "stability margin 1.3 is below 1.4 in line 2"


def test_a_mirrored_program_has_the_same_margins(tmp_path: Path) -> None:
    """M4, the other side and mirrored modes: each step has the margin of its mirror image."""
    text = TEXT.replace("Z-1.5", "Z-3")
    mirrored = text.replace("M3", "M4").replace("Y20", "Y-20")
    skew = MODES.replace('"x"', "[1.0, 0.4]").replace('"y"', "[-0.3, 1.0]")
    other = MODES.replace('"x"', "[1.0, -0.4]").replace('"y"', "[-0.3, -1.0]")
    one = done(tmp_path, text=text, modes=skew).result.in_use[0].columns["stability_margin"]
    two = done(tmp_path, text=mirrored, modes=other).result.in_use[0].columns["stability_margin"]
    wrong = done(tmp_path, text=mirrored, modes=skew).result.in_use[0].columns["stability_margin"]
    assert one.min() < 3.0
    # where the cutter enters, two instants whose forces differ by less than a thousandth may change places
    assert two == pytest.approx(one, rel=0.01)
    assert np.median(abs(two / one - 1.0)) < 1e-6
    assert abs(wrong.min() - one.min()) > 0.05


def test_plain_values_give_margins_too() -> None:
    import chipload

    cutter = chipload.Cutter(
        number=1, diameter_mm=10.0, flutes=3, helix_deg=30.0, flute_length_mm=20.0, overhang_mm=40.0, modulus_gpa=580.0
    )
    from chipload.program.build import plunge, rapid
    from chipload.program.program import Program

    path = [rapid([-6, 0, -2], 900.0, 1, "link"), plunge([30, 0, -2], 20.0, 900.0, 1, "cut")]
    mode = chipload.Mode(frequency_hz=800.0, damping_ratio=0.03, stiffness_n_um=12.0, direction="y")
    block = chipload.Stock.block((0, -9, -5), (20, 9, 0))
    values = {"stock": block, "cutters": cutter, "material": "al7075-t6", "machine": "vmc"}
    modes = chipload.Vibration(modes=(mode,))
    history = chipload.simulate(Program.join(path), dynamics=modes, step_mm=6.0, **values)
    (check,) = (c for c in history.limits if c.name == "stability_margin")
    assert check.worst == history["stability_margin"].min()
    sure = chipload.simulate(
        Program.join(path), dynamics=modes, step_mm=6.0, checks=chipload.CheckSettings(confidence=0.95), **values
    )
    (lower,) = (c for c in sure.limits if c.name == "stability_margin")
    # the material has a spread of 25 %, and the margin is inversely proportional to its coefficients
    expected = check.worst / (1.0 + check.resolution_error) / math.exp(1.6448536 * 0.25)
    assert lower.worst == check.worst
    assert lower.value_at_confidence == pytest.approx(expected)
    with pytest.raises(InputError, match=r"limits.stability_margin: needs modes"):
        chipload.simulate(Program.join(path), limits=chipload.Limits(stability_margin=1.2), **values)


def test_a_cutter_that_leans_has_no_known_margin() -> None:
    cutter = Cutter(10.0, 3, 0.0, 20.0, 30.0, 5.8e5)
    metal = Material("m", 700.0, 210.0, 100.0, 10.0, 12.0, 2.0, source="made up for tests")
    dynamics = Dynamics({1: Modes([650.0], [0.02], [5000.0], [[1.0, 0.0]])}, {1: (1,)}, {1: "one"}, ())
    watch = StabilityWatch(dynamics, metal)
    frame = np.eye(3)[None].copy()
    lean = np.array([[[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, -0.6, 0.8]]])
    flank = np.array([[0.0, 5.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
    rows = [[math.pi / 2, math.pi, 0.0, 3.0, 0.05, 0.0, 0.0]]
    for axes in (frame, lean):
        met = ToothEngagement([0, 1], rows, [-1], [0], flank, axes)
        columns = watch(Cuts(1, cutter, np.array([0]), np.zeros((1, 12)), met, met, np.array([900.0])))
        assert (columns["stability_margin"][0] > 0.0) == (axes is frame)
    result = StabilityResult(watch, machine_named("vmc"), 1.0, {1: 5.0}, {})
    assert result.reason(np.array([1])) == "tool 1 leans: modes are known for an upright axis only"
    assert result.reason(np.array([2])) == ""


def test_spreads_of_the_modes_give_a_probability(tmp_path: Path) -> None:
    spreads = "frequency_percent = 2.0\ndamping_percent = 15.0\nstiffness_percent = 5.0\n"
    text = TEXT.replace("S9000", "S6000").replace("Z-1.5", "Z-2").replace("F1350", "F900")
    read = done(tmp_path, text=text, modes=spreads + MODES, limits="stable_probability = 0.9")
    columns, check = read.result.in_use[0].columns, check_of(read, "stable_probability")
    assert check.column.least
    assert check.worst == columns["stable_probability"].min()
    assert check.worst == read.result.operations[0]["stability"]["stable_probability"]
    # the material states no spread: only the modes are unsure
    assert 0.9 < check.worst <= 1.0
    assert check.state is Verdict.HOLDS
    assert (columns["stable_probability"][columns["chip_areas"] == 0] == 1.0).all()
    chatters = done(tmp_path, text=text.replace("Z-2", "Z-5"), modes=spreads + MODES, limits="stable_probability = 0.9")
    assert check_of(chatters, "stable_probability").state is Verdict.EXCEEDS


def test_windows_that_are_quiet_with_some_probability(tmp_path: Path) -> None:
    """A surer window lies within a less sure one, and a program posted at its middle is as sure."""
    spreads = "frequency_percent = 2.0\ndamping_percent = 15.0\nstiffness_percent = 5.0\n"
    text = TEXT.replace("S9000", "S6000").replace("Z-1.5", "Z-3").replace("F1350", "F900")
    numbers = done(tmp_path, text=text, modes=spreads + MODES).result.operations[0]["stability"]
    shares = list(numbers["variance_shares"].values())
    assert shares == sorted(shares, reverse=True)
    assert sum(shares) == pytest.approx(1.0)
    assert next(iter(numbers["variance_shares"])).startswith("frequency of cutter ")
    half, sure = numbers["windows_50_percent"], numbers["windows_95_percent"]
    assert sure
    assert all(any(a["low_rpm"] <= b["low_rpm"] and b["high_rpm"] <= a["high_rpm"] for a in half) for b in sure)
    width = [sum(w["high_rpm"] - w["low_rpm"] for w in some) for some in (half, sure)]
    assert 0.0 < width[1] < width[0]
    best = max(sure, key=lambda w: w["high_rpm"] - w["low_rpm"])
    rpm = round(0.5 * (best["low_rpm"] + best["high_rpm"]))
    faster = text.replace("S6000", f"S{rpm}").replace("F900", f"F{0.15 * rpm:.0f}")
    again = done(tmp_path, text=faster, modes=spreads + MODES)
    assert again.result.operations[0]["stability"]["stable_probability"] >= 0.95


def test_a_probability_needs_all_three_spreads(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="state all of frequency_percent, damping_percent, stiffness_percent"):
        done(tmp_path, modes="damping_percent = 20.0\n" + MODES)
    with pytest.raises(InputError, match=r"limits\.stable_probability: needs deviations"):
        done(tmp_path, limits="stable_probability = 0.9")


def test_process_damping_counts_where_it_is_stated(tmp_path):
    """At a low speed a worn edge damps; the margin is that of the same cut asked directly, and the report says so."""
    slow = TEXT.replace("S9000", "S2400").replace("F1350", "F360")
    stated = "[dynamics.process_damping]\nindentation_n_mm3 = 3e4\nwear_land_mm = 0.05\nfriction = 0.3\n"
    found = {}
    for name, more in (("bare", ""), ("worn", stated)):
        (tmp_path / name).mkdir()
        one = done(tmp_path / name, text=slow, modes=MODES + more)
        found[name] = one.result.operations[0]["stability"]
        assert ("process damping is included" in page_bytes(one.result, one.presentation).decode()) == bool(more)
    assert found["bare"]["process_damping"] is None
    assert found["worn"]["process_damping"] == {"indentation": 3e4, "wear_land": 0.05, "friction": 0.3}
    cutter = Cutter(10.0, 3, 0.0, 20.0, 30.0, 5.8e5)
    metal = Material("m", 700.0, 210.0, 100.0, 10.0, 12.0, 2.0, source="made up for tests")
    modes = Modes([650.0, 720.0], [0.02, 0.025], [5000.0, 7000.0], [[1.0, 0.0], [0.0, 1.0]])
    met = engagement_of_arcs([math.pi / 2], [math.pi], 0.05, cutter, 1.5)
    cut = dynamic_cuts(
        met, cutter, metal, modes, 2400 * OMEGA, [[1.0, 0.0]], [[0.0, 1.0]], ProcessDamping(3e4, 0.05, 0.3)
    )
    assert found["worn"]["margin_min"] == pytest.approx(float(stability_margins(cut).margin[0]), rel=0.01)
    assert found["worn"]["margin_min"] > 1.1 * found["bare"]["margin_min"]


def test_teeth_that_are_not_evenly_spaced_have_a_margin_of_their_own(tmp_path):
    """The margin of the program is that of the cut asked directly; where the vibration leaves the wall is not known."""
    (tmp_path / "m.toml").write_text(MATERIAL)
    (tmp_path / "a.ngc").write_text(TEXT)
    job = JOB.replace("MODES", MODES).replace("LIMITS", "sle_um = 500.0").replace("SPEEDS", "")
    (tmp_path / "job.toml").write_text(job.replace("helix_deg", "pitch_deg = [104, 120, 136]\nhelix_deg", 1))
    one = run_job(load_job(tmp_path / "job.toml"))
    found = one.result.operations[0]["stability"]
    cutter = Cutter(10.0, 3, 0.0, 20.0, 30.0, 5.8e5, pitch=tuple(np.radians([104.0, 120.0, 136.0])))
    metal = Material("m", 700.0, 210.0, 100.0, 10.0, 12.0, 2.0, source="made up for tests")
    modes = Modes([650.0, 720.0], [0.02, 0.025], [5000.0, 7000.0], [[1.0, 0.0], [0.0, 1.0]])
    met = engagement_of_arcs([math.pi / 2], [math.pi], 0.05, replace(cutter, pitch=()), 1.5)
    cut = dynamic_cuts(met, cutter, metal, modes, 9000 * OMEGA, [[1.0, 0.0]], [[0.0, 1.0]])
    assert found["margin_min"] == pytest.approx(float(stability_margins(cut).margin[0]), rel=0.02)
    assert found["margin_min"] != pytest.approx(library_margin(9000, 1.5), rel=0.05)
    assert found["windows"]
    check = check_of(one, "sle_um")
    assert (check.state, check.reason) == (Verdict.UNPROVEN, "the teeth of tool 1 differ")


#: two passes along x, the second after a retract: 3 mm deep at half the diameter, then 0.4 of the depth in a full slot
TWO = (
    "G21 G90 G94 G17\nT1 M6\nS8000 M3\nG0 X-8 Y20 Z5\nG0 Z-3\nG1 X48 F1200 (side)\nG0 Z5 (up)\nG0 X-8 Y-3\nG0 Z-0.9\n"
    "G1 X48 (slot)\nG1 Z2\nG0 Z5\nM2\n"
)


def test_speeds_by_zone_change_between_two_passes_and_are_simulated_again(tmp_path):
    """Where no speed is quiet for both passes the second has an S word of its own in the line that leaves the first."""
    modes = MODES + MODES.replace("650.0", "450.0").replace("720.0", "480.0")
    found = {}
    for by in ("tool", "zone"):
        (tmp_path / by).mkdir()
        speeds = f'[operation.speeds]\nby = "{by}"\nleast_rpm = 6000.0\nmost_rpm = 14000.0'
        found[by] = done(tmp_path / by, text=TWO, modes=modes, limits="stability_margin = 2.0", speeds=speeds)
    one, two = (found[by].result.operations[0]["speeds"] for by in ("tool", "zone"))
    assert len(one["tools"]) == 1
    first, second = two["tools"]
    assert (first["first_line"], first["last_line"], second["first_line"], second["last_line"]) == (6, 6, 10, 10)
    new = found["zone"].outcome.speeds.text
    words = [(w.line, w.rpm) for w in speed_words(new)]
    assert words == [(3, first["rpm"]), (7, second["rpm"])]
    strip = re.compile(r" ?[SF][\d.]+")
    assert strip.sub("", new) == strip.sub("", TWO)
    # both are simulated from fresh stock: each pass has what was expected, and one of them more than at one speed
    least = {
        by: [
            columns["stability_margin"][(columns["line"] == line) & (columns["chip_areas"] > 0)].min()
            for line in (6, 10)
        ]
        for by in found
        for columns in [found[by].result.in_use[0].columns]
    }
    assert least["zone"] == pytest.approx([first["margin_expected"], second["margin_expected"]], rel=0.02)
    gain = np.array(least["zone"]) / least["tool"]
    assert gain.min() > 0.97
    assert gain.max() > 1.1
    columns = found["zone"].result.in_use[0].columns
    for zone in (first, second):
        steps = (columns["line"] == zone["first_line"]) & (columns["torque_mean_nm"] > 0.0)
        speed = columns["power_w"][steps] / columns["torque_mean_nm"][steps] / OMEGA
        assert speed == pytest.approx(np.full(steps.sum(), zone["rpm"]))
    assert "lines 10 to 10" in found["zone"].result.note


def test_an_s_word_that_holds_in_two_zones_is_named() -> None:
    with pytest.raises(InputError, match="line 2: has an S word: change it"):
        with_speeds("G0 X1\nS500 M3", {}, {}, {2: 600.0})
