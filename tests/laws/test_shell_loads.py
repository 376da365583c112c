"""A level round outside a tube: torque, normal force and depth of cut from the chips against closed forms.

Notation: D distance of the cutter's centre from the tube's, R its radius, R_s that of the stock; psi angle from the
wall's normal. A circle is engaged over 0 .. alpha, cos alpha = (D^2 + R^2 - R_s^2) / (2 D R), with the chip f sin psi,
because the path goes round the tube. Mean torque N b R / 2 pi [Ktc f (1 - cos alpha) + Kte alpha]; a straight tooth at
psi presses on the wall with (Ktc h + Kte) b sin psi + (Krc h + Kre) b cos psi. A tooth does not move on a circle: its
chip h is found between its path round the tube and that of the tooth before, or the stock's edge, by Newton's method,
and it leaves the cut about f / (2 R) behind psi = 0.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutting.material import material_named
from chipload.jobs import load_job
from chipload.jobs.torque.cut import Place, cut, off_centre, shell_stock, true_loads
from chipload.program.build import helix, plunge, rapid
from chipload.program.program import Program
from chipload.structure import beam
from torque_job import OVERRIDE_AND_LOOP, SPINDLE

JOB = (
    """
[program]
file = "none.ngc"
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
[torque_control.shell]
mean_radius_mm = 20.0
length_mm = 40.0
wall_mm = 2.0
clamped = "low"
clamp_z_mm = -40.0
modulus_gpa = 70.0
poisson = 0.33
strength_mpa = 250.0
stock_mm = 1.5
wall_tolerance_mm = 0.0
[[surprise]]
kind = "thicker-side"
share = 0.4
at_deg = 90.0
[[surprise]]
kind = "hard-spot"
share = 0.5
at_deg = 180.0
width_mm = 10.0
ramp_mm = 5.0
[[surprise]]
kind = "worn-cutter"
share = 0.1
edge_share = 0.3
"""
    + SPINDLE
    + OVERRIDE_AND_LOOP
    + """[simulation]
step_mm = 2.0
layer_mm = 0.5
tolerance_mm = 0.002
[limits]
form_error_um = 60.0
strength_share = 0.6
torque_over_percent = 5.0
"""
)
FEED, SPEED, DEPTH, R, FINISHED = 30.0, 628.3185307, 2.0, 5.0, 21.0
MATERIAL = material_named("al6082-t6")
CENTRE = FINISHED + R


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    file = tmp_path_factory.mktemp("law") / "job.toml"
    file.write_text(JOB)
    return load_job(file).job


@pytest.fixture(scope="module")
def program():
    return Program.join([
        rapid([[CENTRE, 12.0, 10.0], [CENTRE, 12.0, -DEPTH]], SPEED, 1, "link"),
        plunge([CENTRE, 0.0, -DEPTH], FEED, SPEED, 1, "lead"),
        helix((CENTRE, 0.0), (0.0, 0.0), (-DEPTH, -DEPTH), 1.0, FEED, SPEED, 1, "round", -1),
    ])  # fmt: skip


def done(job, program, centre=(0.0, 0.0)):
    return cut(job, program, shell_stock(job, program, centre), MATERIAL, 400.0, lambda *_: None)


def paths(stock_radius):
    """Angles psi (n,) and the chip (n,) [mm] between the path of a tooth and that of the one before; climb milling.

    Time is the rotation t of the spindle, clockwise; the centre is at D exp(-i w t). At t = 0 the tooth is on the ray
    from the centre along exp(i (pi + psi)); the one before was at this angle 2 pi / N earlier.
    """
    w = FEED / (CENTRE * SPEED)
    psi = np.linspace(-0.03, 1.0, 50_001)
    ray = np.exp(1j * (math.pi + psi))
    late = np.zeros(len(psi))
    for _ in range(20):
        t = late - math.tau / 3.0
        there = CENTRE * (np.exp(-1j * w * t) - 1.0) + R * ray * np.exp(-1j * late)
        speed = -1j * w * CENTRE * np.exp(-1j * w * t) - 1j * R * ray * np.exp(-1j * late)
        late -= (there / ray).imag / (speed / ray).imag
    assert abs((there / ray).imag).max() < 1e-9
    # where the ray enters the stock
    along = (CENTRE / ray).real
    edge = -along - np.sqrt(along**2 - CENTRE**2 + stock_radius**2 + 0j).real
    inside = abs(CENTRE + R * ray) < stock_radius
    return psi, np.where(inside, np.maximum(R - np.maximum((there / ray).real, edge), 0.0), 0.0)


def closed(stock_radius):
    """Torque of edge and cut [N mm], greatest normal force of the edge and of all [N]."""
    f = FEED / (3.0 * SPEED / math.tau)
    alpha = math.acos((CENTRE**2 + R**2 - stock_radius**2) / (2.0 * CENTRE * R))
    psi, h = paths(stock_radius)
    cuts = h > 0.0
    # circles are the first order of it: the arc to f / R of its length, the volume to the share c / R of the feed
    assert np.trapezoid(cuts.astype(float), psi) == pytest.approx(alpha, rel=f / R)
    assert np.trapezoid(h, psi) == pytest.approx(f * (1.0 - math.cos(alpha)), rel=2.0 * 3.0 * f / math.tau / R)
    scale = 3.0 * DEPTH * R / math.tau
    m = MATERIAL
    edge = DEPTH * (m.Kte * np.sin(psi) + m.Kre * np.cos(psi))
    whole = edge + DEPTH * h * (m.Ktc * np.sin(psi) + m.Krc * np.cos(psi))
    torque = scale * m.Kte * np.trapezoid(cuts.astype(float), psi), scale * m.Ktc * np.trapezoid(h, psi)
    return *torque, edge[cuts].max(), whole[cuts].max()


def at(made, degrees):
    """The step in the round whose middle is there, clockwise from +X: seen from the tube a quarter is -90."""
    middle = 0.5 * (made.points[1:] + made.points[:-1])
    on = np.flatnonzero(np.abs(np.hypot(middle[:, 0], middle[:, 1]) - CENTRE) < 0.1)
    turn = np.degrees(np.angle(np.exp(1j * (np.arctan2(middle[on, 1], middle[on, 0]) - math.radians(degrees)))))
    return int(on[np.argmin(np.abs(turn))])


def test_loads_in_closed_form(job, program):
    made = done(job, program)
    edge, whole, push_edge, push = closed(FINISHED + 1.5)
    for degrees in (-90.0, 180.0, 120.0):
        k = at(made, degrees)
        assert made.loads.torque_edge[k] == pytest.approx(edge, rel=0.01)
        assert made.loads.torque_cut[k] == pytest.approx(whole, rel=0.01)
        # the peak is where a tooth comes in, and the rotation is looked at every degree
        assert made.loads.force_edge[k] == pytest.approx(push_edge, rel=0.02)
        assert made.loads.force_edge[k] + made.loads.force_cut[k] == pytest.approx(push, rel=0.02)
        assert (made.near[k], made.far[k]) == pytest.approx((38.0, 40.0))
        assert made.makes[k]
        assert made.feed[k] == pytest.approx(FEED, rel=1e-3)
        (mill,) = job.cutters.values()
        assert made.tool[k] == pytest.approx(float(beam.compliance(mill, 1.0, 1.0)))
    assert not made.makes[:3].any()


def test_a_thicker_side_in_closed_form(job, program):
    """0.6 mm off centre towards +Y: there 2.1 mm are cut, opposite 0.9."""
    centre = off_centre(1.5, job.table.surprise)
    assert centre == pytest.approx((0.0, 0.6), abs=1e-12)
    made = done(job, program, centre)
    for degrees, depth in ((90.0, 2.1), (-90.0, 0.9)):
        edge, whole, _, _ = closed(FINISHED + depth)
        k = at(made, degrees)
        # the stock's edge is a circle about another centre: nearly the same arc
        assert made.loads.torque_edge[k] == pytest.approx(edge, rel=0.04)
        assert made.loads.torque_cut[k] == pytest.approx(whole, rel=0.06)


def test_a_hard_spot_and_a_worn_cutter(job, program):
    """Factors 1.1 and 1.3 everywhere, 1.5 in the middle of the spot, 1.25 where half of its ramp is over."""
    made = done(job, program)
    true = true_loads(made.loads, made.points, Place(job.table.torque_control.shell), job.table.surprise)
    spot, far = at(made, 180.0), at(made, -60.0)
    assert true.torque_cut[far] == pytest.approx(1.1 * made.loads.torque_cut[far])
    assert true.force_edge[far] == pytest.approx(1.3 * made.loads.force_edge[far])
    assert true.torque_cut[spot] == pytest.approx(1.5 * 1.1 * made.loads.torque_cut[spot])
    half = at(made, 180.0 - math.degrees(7.5 / FINISHED))
    assert true.force_cut[half] / made.loads.force_cut[half] == pytest.approx(1.1 * 1.25, rel=0.08)
