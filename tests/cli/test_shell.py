"""Jobs on thin tubes and cones, by the command line: what is written, what holds, what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from chipload.control.hal_file import load_hal
from chipload.control.plant import Loop
from chipload.control.plant import run as play
from chipload.cutter.cutter import Cutter
from chipload.jobs import load_job
from chipload.jobs.torque.cut import cut, off_centre, shell_stock
from chipload.jobs.torque.result import over_allowable
from chipload.jobs.torque.run import open_inputs
from chipload.machine.machine import machine_named
from chipload.program.motions import lengths
from chipload.program.program import RAPID
from chipload.program.read import read_program, times_of
from chipload.progress import silent
from chipload.report.removal import read_removal
from chipload.result import LimitCheck, Verdict, load_result
from chipload.structure import beam
from chipload.structure.shell import Shell, compliance, ritz
from command import call
from torque_job import TUBE_JOB

NAMES = ["constant", "model", "model_not_derated", "pi", "fuzzy", "fuzzy_feedforward"]


@pytest.fixture
def job(tmp_path: Path) -> Path:
    (tmp_path / "job.toml").write_text(TUBE_JOB)
    return tmp_path / "job.toml"


@pytest.fixture(scope="module")
def result(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("shell")
    (folder / "job.toml").write_text(TUBE_JOB)
    code, out, err = call("run", folder / "job.toml", "--out", folder / "r", "--debug")
    assert code in (0, 3), out + err
    return folder / "r"


@pytest.fixture(scope="module")
def what(result):
    return json.loads((result / "summary.json").read_text())["operations"][0]


def test_every_controller_twice(what):
    for controllers in (what["controllers"], what["with_latency"]["controllers"]):
        assert list(controllers) == NAMES
        for numbers in controllers.values():
            assert {"time_s", "torque_nm_max", "torque_over_limit_s", "form_error_um_max"} <= set(numbers)
    assert what["with_latency"]["latency_ms"] == 50.0
    assert what["with_latency"]["override_step"] == 0.01
    lost = what["with_latency"]["lost"]["fuzzy_feedforward"]["time_s"]
    late, plain = (x["fuzzy_feedforward"]["time_s"] for x in (what["with_latency"]["controllers"], what["controllers"]))
    assert lost == pytest.approx(late - plain)


def test_work_is_that_of_the_volume(what):
    assert set(what["energy_balance"]) == {"planned", "real"}
    assert all(abs(each["1"]) < 0.05 for each in what["energy_balance"].values())


def test_each_limit_of_a_load_has_its_error_and_is_unproven_inside_it(result):
    """5 % of excess are allowed, and the torque over what is allowed has the error of the torque."""
    tracks = json.loads((result / "summary.json").read_text())["tracks"]
    loads = ("form_error_um", "strength_share", "spindle_power_w", "cutter_stress_mpa", "deflection_share")
    for track in tracks:
        checks = {check["name"]: check for check in track["limits"]}
        for name in loads:
            check = checks[name]
            assert 0.01 <= check["resolution_error"] < 1.0, (track["name"], name)
            inside = check["worst"] * (1.0 + check["resolution_error"]) > check["limit"]
            assert (check["state"] == "holds") == (not inside), (track["name"], name)
        over = checks["torque_over_percent"]
        assert over["resolution_error"] == checks["spindle_torque_nm"]["resolution_error"] > 0.01
        if over["worst"] > 0.0 and (1.0 + over["worst"] / 100.0) * (1.0 + over["resolution_error"]) > 1.05:
            assert over["state"] != "holds", track["name"]
        assert checks["axial_overrun_mm"]["resolution_error"] == 0.0


@pytest.mark.parametrize(("share", "state"), [(0.9, "holds"), (0.97, "unproven"), (1.02, "unproven"), (1.2, "exceeds")])
def test_an_excess_over_the_allowable_torque_has_the_error_of_the_torque(share, state):
    """No excess is allowed, and the torque is known to 5 %: 0.97 of what is allowed may be 1.02 of it."""
    columns = {"torque_nm": np.array([0.1, share]), "torque_allowable_nm": np.ones(2)}
    excess = 100.0 * max(share - 1.0, 0.0)
    without = Verdict.EXCEEDS if excess > 0.0 else Verdict.HOLDS
    plain = LimitCheck("torque_over_percent", 0.0, excess, without, resolution_error=0.0)
    found = over_allowable(plain, columns, 0.05)
    assert (found.state.value, found.resolution_error, found.worst) == (state, 0.05, excess)
    assert bool(found.reason) == (state == "unproven")
    assert over_allowable(plain, columns, math.inf).state is Verdict.UNPROVEN


def test_the_errors_cover_layers_and_steps_of_a_quarter(job):
    """The greatest loads of the truth, simulated with layers and steps a quarter as thick and long."""
    found = []
    for share in (1.0, 0.25):
        sets = (f"simulation.step_mm={2.0 * share}", f"simulation.layer_mm={0.5 * share}")
        real = load_job(job, sets).job
        machine, material, _, written, _ = open_inputs(real)
        program = written.program
        stock = shell_stock(real, program, off_centre(real.shell.stock_mm, real.table.surprise))
        found.append(cut(real, program, stock, material, machine.rapid, silent, accuracy=True))
    coarse, fine = ([each.loads.torque_edge + each.loads.torque_cut, each.loads.force_edge + each.loads.force_cut]
                    for each in found)  # fmt: skip
    errors = found[0].removal.resolution_error
    for name, a, b in zip(("torque_mean_nm", "force_n"), coarse, fine, strict=True):
        assert 0.0 < abs(b.max() - a.max()) <= errors[name] * a.max(), name


def test_the_verdict_is_what_was_measured(result, what):
    """The verdict follows from the limits of the controller with the model and the latency of the job, only these."""
    summary = json.loads((result / "summary.json").read_text())
    found = what["with_latency"]["controllers"]["fuzzy_feedforward"]
    track = summary["tracks"][0]
    assert (track["name"], track["in_use"]) == ("fuzzy_feedforward, 50 ms", True)
    assert not any(other["in_use"] for other in summary["tracks"][1:])
    assert len(summary["tracks"]) == 2 * len(NAMES)
    worst = {check["name"]: check["worst"] for check in track["limits"]}
    assert worst["form_error_um"] == pytest.approx(found["form_error_um_max"])
    assert worst["strength_share"] == pytest.approx(found["stress_mpa_max"] / 250.0)
    assert worst["torque_over_percent"] == pytest.approx(
        max(100.0 * (found["torque_nm_max"] / what["torque_limit_nm"] - 1.0), 0.0), abs=0.1
    )
    kept = (
        found["ended"] == "path" and worst["torque_over_percent"] <= 5.0 and found["form_error_um_max"] <= 30.0
        and found["stress_mpa_max"] <= 225.0 and found["override_max"] <= 1.0
    )  # fmt: skip
    defaults = [
        c for c in track["limits"] if c["name"] in ("cutter_stress_mpa", "axial_overrun_mm", "deflection_share")
    ]
    assert len(defaults) == 3
    assert (track["verdict"] == "exceeds") == (not kept)
    assert found["verdict"] == track["verdict"]
    assert what["verdict"] == summary["verdict"]
    rows = {x["name"]: x["verdict"] for x in summary["tracks"]}
    for name in NAMES:
        assert what["controllers"][name]["verdict"] == rows[name]
        assert what["with_latency"]["controllers"][name]["verdict"] == rows[f"{name}, 50 ms"]
    both = (what["controllers"], what["with_latency"]["controllers"])
    assert all(x["fuzzy_feedforward"]["torque_nm_max"] < x["fuzzy"]["torque_nm_max"] for x in both)


def test_a_cutter_that_would_break(job, tmp_path):
    """2 mm across, 30 mm long: the stress of its shank is far above what carbide takes."""
    thin = ["--set", "cutter.0.diameter_mm=2", "--set", "limits.form_error_um=5000", "--set", "limits.strength_share=1"]
    thin += ["--set", "torque_control.override.overload_nm=90", "--set", "torque_control.override.torque_most_nm=100"]
    code, out, err = call("run", job, "--out", tmp_path / "r", *thin, "--set", "torque_control.shell.strength_mpa=5000")
    assert code == 3, out + err
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    (stress,) = (c for c in summary["limits"] if c["name"] == "cutter_stress_mpa")
    assert stress["state"] == "exceeds"
    assert stress["worst"] > 2.0 * stress["limit"]
    rows = pq.read_table(tmp_path / "r" / "history.parquet").to_pydict()
    own = np.array(rows["track"]) == summary["tracks"][0]["name"]
    assert np.array(rows["cutter_stress_mpa"])[own].max() == pytest.approx(stress["worst"])


def test_what_is_compared_with(result, what):
    """No controller is faster than the feed at the limit at every instant, and the estimate says how far it holds."""
    summary = json.loads((result / "summary.json").read_text())
    for controllers in (what["controllers"], what["with_latency"]["controllers"]):
        for name, run in controllers.items():
            assert what["ideal_time_s"] < run["time_s"] or run["torque_nm_max"] > what["torque_limit_nm"], name
    e = what["estimate"]
    assert e["range_nm"] == [pytest.approx(0.03), pytest.approx(0.15 * (40.0 - 2.0 - 0.004 * 628.3), rel=1e-3)]
    assert math.prod(1.0 + (math.tau * e["bandwidth_hz"] * x) ** 2 for x in (0.01, 0.02)) == pytest.approx(2.0)
    # 30 mA at 0.15 N m/A, behind a filter that takes half of each reading
    assert e["noise_nm"] == pytest.approx(0.15 * 0.03 * math.sqrt(0.5 / 1.5))
    # 3 flutes at 6000 rpm, read every 10 ms
    assert (e["tooth_passing_hz"], e["tooth_passing_seen_hz"]) == (pytest.approx(300.0), pytest.approx(0.0, abs=1e-6))
    assert what["spindle_deviation"]["torque_constant_percent"] == 0.5
    assert 0.0 < what["with_latency"]["compared"]["of_possible_percent"] < 100.0
    assert summary["operations"][0]["kind"] == "torque"


def test_the_derated_schedule_respects_the_limit(what):
    """Open loop, with the model's feeds lowered until the truth is within the limit, and no further."""
    limit = what["torque_limit_nm"]
    for controllers in (what["controllers"], what["with_latency"]["controllers"]):
        derated, alone = controllers["model"], controllers["model_not_derated"]
        assert derated["ended"] == "path"
        assert 0.97 * limit < derated["torque_nm_max"] <= limit
        assert derated["time_s"] > alone["time_s"]
        assert derated["time_s"] < controllers["constant"]["time_s"]


def test_the_constant_feed_respects_the_limit_everywhere(what):
    """Its greatest torque is the limit, so that a faster one would not."""
    constant = what["controllers"]["constant"]
    assert constant["torque_nm_max"] == pytest.approx(what["torque_limit_nm"], rel=2e-3)
    assert constant["override_min"] == constant["override_max"]
    assert constant["time_s"] > 1.2 * what["controllers"]["fuzzy_feedforward"]["time_s"]


def test_the_limit_is_what_the_wall_bears(what):
    """The force at the limit bends the thinnest wall and the cutter by 30 um, or strains it to 225 MPa."""
    where = what["torque_limit"]
    assert where["source"] == "deflection"
    modes = ritz(Shell(12.0, 30.0, 1.4, 70e3, 0.33))
    z = where["place"][2]
    width = math.sqrt(1.5 * (10.0 - 1.5))
    # within a layer of 0.5 mm of where the tip is, up to the rim
    soft = [
        float(compliance(modes, 0.5 * (30.0 + s), s_point=30.0, length=30.0 - s, width=width)[2, 2])
        for s in (30.0 + z - 0.5, min(30.0 + z + 0.5, 29.5))
    ]
    mill = Cutter(10.0, 3, math.radians(30.0), 22.0, 30.0, 580e3)
    tool = [float(beam.compliance(mill, x, x)) for x in (0.0, 2.0)]
    assert 30e-3 / (soft[1] + tool[0]) <= where["force_n"] <= 30e-3 / (soft[0] + tool[1])
    assert where["held_nm"] == pytest.approx(0.9 * what["torque_limit_nm"])


def test_the_error_is_the_force_of_the_moment(result, what):
    """The greatest wall error is at most F_lim (C_w + C_t) times torque over limit, with the thinner wall and the thick
    side: within a fifth; and it is that of the history."""
    rows = pq.read_table(result / "history.parquet").to_pydict()
    track = np.array(rows["track"])
    for case, controllers in (("", what["controllers"]), (", 50 ms", what["with_latency"]["controllers"])):
        for x in NAMES:
            own = track == f"{x}{case}"
            assert np.array(rows["form_error_um"])[own].max() == pytest.approx(controllers[x]["form_error_um_max"])
            ratio = np.array(rows["torque_nm"])[own] / np.array(rows["torque_allowable_nm"])[own]
            assert ratio.max() * what["torque_limit_nm"] == pytest.approx(controllers[x]["torque_nm_max"], rel=0.02)


def test_the_stock_is_kept_over_the_path(result):
    """A ring from 11.25 to 14.25 mm, its outer edge 0.45 mm off, 30 mm high; the upper 2 mm are cut to 12.75 mm."""
    names = [t["name"] for t in json.loads((result / "summary.json").read_text())["tracks"]]
    whole, cut = math.pi * 30.0 * (14.25**2 - 11.25**2), math.pi * 2.0 * (14.25**2 - 12.75**2)
    for name in ("fuzzy_feedforward, 50 ms", "constant, 50 ms"):
        mesh = read_removal(result / "removal.npz", names.index(name))
        assert mesh is not None
        assert mesh.volumes[0] == pytest.approx(whole, rel=0.02)
        assert mesh.volumes[0] - mesh.volumes[-1] == pytest.approx(cut, rel=0.05)
    assert read_removal(result / "removal.npz", names.index("pi")) is None


def test_the_report_shows_the_surprises_on_the_unrolled_wall(result):
    """At -90 degrees, which is 270, and at 180, in each of four planes."""
    text = (result / "report.html").read_text()
    assert "On the unrolled wall" in text
    assert text.count('"x0":270.0') == text.count('"x0":180.0') == 4


def test_the_program_leaves_the_wall(what):
    """Flank at the finished surface: what is left lies on it within the chords."""
    assert -25.0 < what["surface_off_um"]["min"] <= what["surface_off_um"]["max"] < 25.0


def test_second_opinion(what):
    assert what["second_opinion"]["apart_percent_max"] < 5.0
    assert what["ovalisation"]["shell_over_beam"] > 10.0


def test_it_can_be_handed_to_the_machine(result, what):
    """hal.toml is the controller of the run: the loop that it describes gives the same time and torque again."""
    job = load_hal(result / "hal.toml")
    assert job.override.torque_ref == pytest.approx(900.0 * what["torque_limit_nm"])
    late = what["with_latency"]
    limit = 1e3 * what["torque_limit_nm"]
    loop = Loop(job.acceleration, job.period, job.latency)
    again = play(
        job.path.truth,
        job.path.model,
        job.override,
        job.table,
        job.spindle,
        loop,
        limit,
        relief=job.path.relief,
        deviation=job.deviation,
    )
    # hal.toml has the feeds alone; the rapids before and behind them are timed by the text
    machine = machine_named("vmc")
    reading = read_program(result / "0-override.ngc", machine)
    around = float(times_of(reading, machine)[reading.program.motion == RAPID].sum())
    assert around > 0.1
    assert again.time + around == pytest.approx(late["controllers"]["fuzzy_feedforward"]["time_s"], rel=1e-3)
    assert 1e-3 * again.load_max == pytest.approx(late["controllers"]["fuzzy_feedforward"]["torque_nm_max"], rel=2e-3)


def test_the_history_is_the_whole_program(result):
    """From the place to which the first lines go to where the last one retracts; its times are those of the text."""
    machine = machine_named("vmc")
    reading = read_program(result / "0-override.ngc", machine)
    program, seconds = reading.program, times_of(reading, machine)
    tracks = load_result(result).tracks
    assert len(tracks) == 2 * len(NAMES)
    for track in tracks:
        c = track.columns
        places = np.column_stack([c[f"{x}_mm"] for x in "xyz"])
        assert c["duration_s"].sum() == pytest.approx(c["t_s"][-1], rel=1e-12)
        assert c["t_s"][-1] == pytest.approx(track.time_s, rel=1e-12)
        assert (c["override_state"] == "rapid").sum() == 2
        np.testing.assert_allclose(places[0], program.p_work[1], atol=1e-9)
        if c["override_state"][-1] != "rapid":
            continue
        np.testing.assert_allclose(places[-1], program.p_work[-1], atol=1e-9)
        assert c["s_mm"][-1] == pytest.approx(lengths(program)[2:].sum(), rel=1e-3)
        # down to the first feed, and away behind the last
        assert c["t_s"][1] == pytest.approx(seconds[:3].sum(), rel=1e-6)
        assert c["duration_s"][-1] == pytest.approx(seconds[-1], rel=1e-6)


def test_both_programs_go_the_same_way(result, what):
    """Read back: the same path, one with the programmed feed and the override switched on, one with lower feeds."""
    machine = machine_named("vmc")
    first = (result / "0-override.ngc").read_text().splitlines()
    held = json.loads((result / "summary.json").read_text())["verdict"] == "holds"
    verified = "(chipload: verified by independent simulation with chipload hal)"
    assert first[0] == verified if held else first[0].startswith("(NOT VERIFIED: ")
    assert "M52 P1" in first
    plain, fed = (read_program(result / f"0-{x}.ngc", machine).program for x in ("override", "feedforward"))
    assert lengths(fed).sum() == pytest.approx(lengths(plain).sum(), rel=1e-6)
    assert len(fed) > len(plain)
    assert set(np.round(plain.feed[plain.motion != RAPID], 6)) == {30.0}
    feeds = fed.feed[fed.motion != RAPID]
    assert feeds.max() <= 30.0 + 1e-9
    # in time they take what the model alone takes, but for the acceleration and the steps of 5 %
    seconds = (lengths(fed)[fed.motion != RAPID] / feeds).sum()
    alone = what["controllers"]["model_not_derated"]["time_s"]
    assert alone - 0.5 < seconds < 1.25 * alone


def test_a_shank_in_the_stock_is_a_collision(job, tmp_path):
    """Flutes of 1.2 mm, 2 mm below the rim: a shank of 16 mm is 3 mm wider, and goes into the wall."""
    wide = ["--set", "cutter.0.flute_length_mm=1.2", "--set", "cutter.0.shank_diameter_mm=16"]
    code, out, err = call("run", job, "--out", tmp_path / "r", *wide)
    assert code == 3, out + err
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    assert "collision" in {finding["code"] for finding in summary["findings"]}
