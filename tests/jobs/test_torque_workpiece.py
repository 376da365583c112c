"""A torque that the deflection of a clamped workpiece limits: a cantilever in closed form, a tube by its shell."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

import chipload.examples
from chipload.cutting.material import material_named
from chipload.errors import InputError
from chipload.jobs import load_job
from chipload.jobs.torque.allowable import limit_of
from chipload.jobs.torque.cut import cut, shell_stock
from chipload.jobs.torque.run import open_inputs
from chipload.jobs.torque.workpiece_cut import limit_on_workpiece, responses_of, workpiece_cut
from chipload.structure import beam
from command import call
from torque_job import OVERRIDE_AND_LOOP, SPINDLE

CUTTER = """
[machine]
name = "vmc"
[material]
name = "al6082-t6"
[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 3
helix_deg = 0.0
flute_length_mm = 22.0
overhang_mm = 30.0
modulus_gpa = 580.0
"""
#: by the nominal loads
LIMITS = """[checks]
confidence = 0.5
[limits]
form_error_um = 500.0
strength_share = 0.9
torque_over_percent = 5.0
"""
#: a bar of 6 x 20 mm that is clamped at x = 0, whose free end is milled along its whole height
BAR = (
    """
[program]
file = "bar.ngc"
[stock]
low_mm = [0.0, 0.0, -20.0]
high_mm = [50.0, 6.0, 0.0]
[workpiece]
modulus_gpa = 70.0
poisson = 0.0
yield_mpa = 1500.0
states = 2
[[workpiece.clamp]]
face = "x-"
[[surprise]]
kind = "worn-cutter"
share = 0.05
edge_share = 0.05
"""
    + CUTTER
    + SPINDLE
    + OVERRIDE_AND_LOOP
    + """[simulation]
step_mm = 3.0
layer_mm = 10.0
tolerance_mm = 0.002
"""
    + LIMITS
)
FEED, SPEED, AE, DEPTH, R = 30.0, 100.0, 0.4, 20.0, 5.0
#: down milling along y = 0, towards the clamp
PROGRAM = f"""G21 G90 G94 G17
S{60 * SPEED:.0f} M3 T1 M6
G0 X62 Y{AE - R} Z5
G0 Z-20
G1 X38 F{60 * FEED:.0f}
G0 Y-30
G0 Z5
M2
"""
HELICAL = ("--set", "cutter.0.helix_deg=30", "--set", "limits.form_error_um=140")
MATERIAL = material_named("al6082-t6")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    made = tmp_path_factory.mktemp("bar")
    (made / "job.toml").write_text(BAR)
    (made / "bar.ngc").write_text(PROGRAM)
    return made


def closed(x, tool):
    """Torque of edge and cut [N mm]; deflection at x of the edge and of all [mm], of a straight tooth.

    Its chip lies between trochoids, psi back from the new wall, and runs out along the face that the tooth before has
    cut: it touches f / (2 R) longer than a circle (2.5 % here), as the paths of tests/engagement/tooth_paths.py do.

    The tooth presses with F_t sin + F_r cos on the side of the bar, and pulls with F_t cos - F_r sin at it, half of the
    thickness from its middle, which bends it the same way.
    """
    f, m = FEED / (3.0 * SPEED), MATERIAL
    alpha = math.acos(1.0 - AE / R)
    psi = np.linspace(-f / (2.0 * R), alpha, 20_001)
    scale = 3.0 * DEPTH * R / math.tau
    E, G, area, inertia = 70e3, 70e3 / 2.0, 6.0 * DEPTH, DEPTH * 6.0**3 / 12.0
    across = x**3 / (3.0 * E * inertia) + x / (5.0 / 6.0 * G * area)
    along = 3.0 * x**2 / (2.0 * E * inertia)

    def bent(Kt, Kr):
        press, pull = (Kt * np.sin(psi) + Kr * np.cos(psi)), (Kt * np.cos(psi) - Kr * np.sin(psi))
        return DEPTH * float((press * (across + tool) + pull * along).max())

    h = f * np.sin(psi) * (1.0 + 3.0 * f / math.tau * np.cos(psi) / R) + (f * np.cos(psi)) ** 2 / (2.0 * R)
    h = np.minimum(h, R * (np.cos(psi) / math.cos(alpha) - 1.0)).clip(0.0)
    whole = bent(m.Kte + m.Ktc * h, m.Kre + m.Krc * h)
    return scale * m.Kte * (psi[-1] - psi[0]), scale * m.Ktc * np.trapezoid(h, psi), bent(m.Kte, m.Kre), whole


def test_the_torque_that_a_cantilever_allows(folder):
    """F_lim = d / (C_beam + C_tool); the torque at which that force is reached, in closed form, at every place."""
    job = load_job(folder / "job.toml").job
    machine, material, _, written, _ = open_inputs(job)
    program = written.program
    made = workpiece_cut(job, job.table.stock, program, material, machine.rapid)
    assert made.compliance.error < 0.12
    middle = 0.5 * (made.points[1:, 0] + made.points[:-1, 0])
    # the whole engagement lies on the bar
    whole = np.flatnonzero(middle < 49.0)
    assert len(whole) >= 4
    (mill,) = job.cutters.values()
    tool = float(beam.compliance(mill, 10.0, 10.0))
    limit = limit_on_workpiece(made.loads, responses_of(job, made))
    assert limit.by == "deflection"
    for k in whole.tolist():
        edge, torque, least, most = closed(middle[k], tool)
        assert made.loads.torque_edge[k] == pytest.approx(edge, rel=0.01)
        assert made.loads.torque_cut[k] == pytest.approx(torque, rel=0.01)
        assert made.error.edge[k] == pytest.approx(least, rel=0.03)
        assert made.error.edge[k] + made.error.cut[k] == pytest.approx(most, rel=0.03)
        assert limit.each[k] == pytest.approx(edge + torque * (0.5 - least) / (most - least), rel=0.06)
    # the farther from the clamp the less
    assert (np.diff(limit.each[whole[np.argsort(middle[whole])]]) < 0.0).all()


def test_a_workpiece_from_the_command_line(folder, tmp_path):
    """Same files, tables and summary as for a shell; the limit is made for the error of the compliance."""
    code, out, err = call("run", folder / "job.toml", "--out", tmp_path / "r", "--debug", *HELICAL)
    assert code in (0, 3), out + err
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    what = summary["operations"][0]
    assert what["torque_limit"]["source"] == "deflection"
    assert what["torque_limit"]["one_tooth_formula_nm"] is None
    assert what["workpiece"]["states"] == 3
    error = 1e-2 * what["workpiece"]["compliance_error_percent"]
    assert 0.01 <= error < 0.12
    assert what["ideal_time_s"] > 0.0
    assert {"noise_nm", "bandwidth_hz", "range_nm"} <= set(what["estimate"])
    (worst,) = (c for c in summary["tracks"][0]["limits"] if c["name"] == "form_error_um")
    # that of the compliance, and beside it that of the force by layers and steps
    assert error + 0.01 <= worst["resolution_error"] < error + 0.05
    held = what["with_latency"]["controllers"]["fuzzy_feedforward"]
    assert worst["worst"] == pytest.approx(held["form_error_um_max"])
    # wear makes torque and deflection greater alike: the truth allows nearly as much torque, without the margin
    assert what["torque_limit"]["true_wall_nm"] / what["torque_limit_nm"] == pytest.approx(1.0, abs=error + 0.01)
    assert held["ended"] == "path"
    assert what["ideal_time_s"] < held["time_s"]
    assert held["form_error_um_max"] < 140.0
    rows = pq.read_table(tmp_path / "r" / "history.parquet").to_pydict()
    own = np.array(rows["track"]) == summary["tracks"][0]["name"]
    work, both = (np.array(rows[x])[own] for x in ("deflection_workpiece_um", "deflection_um"))
    assert 0.0 < work.max() < both.max() < 1.2 * work.max()
    names = {p.name for p in (tmp_path / "r").iterdir()}
    assert {"path.csv", "hal.toml", "controller.toml", "0-override.ngc", "0-feedforward.ngc", "report.html"} <= names
    # the schedule of the model is a variant that is not released, whatever the verdict of the controller
    fed = {t["name"]: t["programs"] for t in summary["tracks"] if t["programs"]}
    used = summary["tracks"][0]["name"]
    assert fed == {
        used: ["0-override.ngc"],
        used.replace("fuzzy_feedforward", "model_not_derated"): ["0-feedforward.ngc"],
    }
    head = (tmp_path / "r" / "0-feedforward.ngc").read_text()[:600]
    assert f"NOT VERIFIED: not released: the job uses {used}" in head
    page = (tmp_path / "r" / "report.html").read_text()
    assert "Deflection of the workpiece" in page
    assert "ovalis" not in page.lower()


def test_no_torque_is_allowable(folder):
    """The edge alone bends the bar by more than 0.3 mm: the check says what would do, without a run."""
    code, out, _ = call("check", folder / "job.toml", "--set", "limits.form_error_um=200")
    assert code == 3
    assert "no torque is allowable, by the deflection of the workpiece in line 5: no feed keeps the limits" in out
    for remedy in ("a depth of cut of at most", "a support near (", "times as stiff there (a wall"):
        assert remedy in out, out
    # as it says: half of the depth, less a little
    half = ["--set", "stock.low_mm=[0,0,-6.5]", "--set", "limits.form_error_um=200"]
    code, out, _ = call("check", folder / "job.toml", *half)
    assert code in (0, 3), out
    code, out, _ = call("check", folder / "job.toml", *HELICAL)
    assert code == 0
    assert "a coarse simulation gives a torque limit of about" in out
    code, out, _ = call("check", folder / "job.toml", "--set", "limits.strength_share=0.01")
    assert code == 3
    assert "by the strength of the workpiece" in out


TUBE = (
    """
[program]
file = "round.ngc"
"""
    + CUTTER
    + SPINDLE
    + OVERRIDE_AND_LOOP
    + """[simulation]
step_mm = 4.0
layer_mm = 6.0
tolerance_mm = 0.005
[limits]
form_error_um = 60.0
strength_share = 1.0
torque_over_percent = 5.0
"""
)
SHELL = """[torque_control.shell]
mean_radius_mm = 10.0
length_mm = 18.0
wall_mm = 1.5
clamped = "low"
clamp_z_mm = -18.0
modulus_gpa = 70.0
poisson = 0.33
strength_mpa = 5000.0
stock_mm = 0.2
wall_tolerance_mm = 0.0
"""
WORKPIECE = """[stock]
file = "tube.stl"
units = "mm"
[workpiece]
modulus_gpa = 70.0
poisson = 0.33
yield_mpa = 5000.0
states = 2
cell_mm = 3.0
[[workpiece.clamp]]
face = "z-"
"""
#: once round at the full height, clockwise
ROUND = """G21 G90 G94 G17
S6000 M3 T1 M6
G0 X15.75 Y12 Z5
G0 Z-18
G1 Y0 F1800
G2 X15.75 Y0 I-15.75 J0
G1 Y-12
G0 Z5
M2
"""


def test_a_tube_by_its_shell_and_as_a_workpiece(tmp_path):
    """Where the round is nearly done the wall is as thin as the shell supposes: both allow the same torque."""
    (tmp_path / "round.ngc").write_text(ROUND)
    trimesh.creation.annulus(9.25, 10.95, 18.0, sections=96).apply_translation((0, 0, -9)).export(tmp_path / "tube.stl")
    (tmp_path / "shell.toml").write_text(TUBE + SHELL)
    (tmp_path / "cells.toml").write_text(TUBE + WORKPIECE)
    shell, cells = (load_job(tmp_path / f"{x}.toml", ["checks.confidence=0.5"]).job for x in ("shell", "cells"))
    machine, material, _, written, _ = open_inputs(shell)
    program = written.program
    one = cut(shell, program, shell_stock(shell, program), material, machine.rapid, lambda *_: None)
    _, by_shell = limit_of(shell, one, material)
    other = workpiece_cut(cells, cells.table.stock, open_inputs(cells)[3].program, material, machine.rapid)
    by_cells = limit_on_workpiece(other.loads, responses_of(cells, other))
    middle = 0.5 * (one.points[1:] + one.points[:-1])
    turn = np.degrees(np.arctan2(middle[:, 1], middle[:, 0]))
    last = np.flatnonzero((turn > 20.0) & (turn < 90.0) & (np.hypot(middle[:, 0], middle[:, 1]) < 15.8))
    assert len(last) >= 4
    assert other.points == pytest.approx(one.points)
    ratio = float(np.median(by_cells.each[last] / by_shell.each[last]))
    # the error that is stated of the cells, and the shear that a thin shell leaves out
    assert other.compliance.error < 0.25
    assert ratio == pytest.approx(1.0, abs=other.compliance.error + 0.03)


def test_keys_that_do_not_go_together(folder):
    """Each with what to do."""
    text = BAR.replace("yield_mpa = 1500.0", "density_kg_m3 = 2700.0").replace("worn-cutter", "thinner-wall")
    (folder / "bad.toml").write_text(text)
    with pytest.raises(InputError) as found:
        load_job(folder / "bad.toml")
    told = "\n".join(str(x) for x in found.value.args)
    assert "workpiece.yield_mpa: missing: state it (limits.strength_share needs it)" in told
    assert "workpiece.density_kg_m3: not used by a torque job: leave it out" in told
    assert (
        "surprise.0.kind = thinner-wall: applies to [torque_control.shell]: state [real_stock] for a workpiece" in told
    )
    (folder / "both.toml").write_text(BAR + SHELL)
    with pytest.raises(InputError, match=r"stock: cannot be used with \[torque_control\.shell\]"):
        load_job(folder / "both.toml")
    (folder / "none.toml").write_text(TUBE)
    with pytest.raises(InputError, match=r"torque_control\.shell, workpiece: neither is stated"):
        load_job(folder / "none.toml")


def test_the_example_bar(tmp_path):
    """A program, a stock that is not what was planned, and a clamp: it holds, sooner than the constant feed."""
    path = Path(chipload.examples.__file__).parent / "part" / "bar.toml"
    code, out, err = call("run", path, "--out", tmp_path / "r")
    assert code == 0, out + err
    what = json.loads((tmp_path / "r" / "summary.json").read_text())["operations"][0]
    held, constant = (what["with_latency"]["controllers"][x] for x in ("fuzzy_feedforward", "constant"))
    assert held["time_s"] < 0.76 * constant["time_s"]
    assert what["torque_limit"]["true_wall_nm"] != what["torque_limit_nm"]
