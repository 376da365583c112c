"""Programs run through a layered stock, against closed forms, the energy of the cut and the planner's exact arcs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_along
from chipload.cutting.material import Material, material_named
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.chips import remove, remove_with_edge
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock
from engagement.tooth_paths import loads
from layer_oracle.removal import remove_by_layers
from simulation.test_steps import five_axis

MILL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
BALL = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
BULL = Cutter(12.0, 3, 0.4, 20.0, 30.0, 6e5, corner_radius=2.0)
FINE = Resolution(step_mm=1.0, tolerance=1e-4, corner_slices=60, flank_mm=0.25)
#: cutting without edge forces, and along the tooth's motion alone: its work is Ktc times the volume
ENERGY = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this test")


def block(layer_mm: float = 0.5, tile_mm: float = 15.0) -> LayeredStock:
    return LayeredStock.block((0.0, -20.0, -10.0), (40.0, 20.0, 0.0), layer_mm, tile_mm)


def straight(start: list[float], end: list[float], feed: float = 20.0, spindle: float = 300.0) -> Program:
    return Program.join([rapid(start, spindle, 1, "link"), plunge(end, feed, spindle, 1, "cut")])


def means_of_a_slot(teeth: int, depth: float, feed: float, K: object) -> tuple[np.ndarray, float]:
    """Mean force on a cutter of 10 mm along the feed, n and the axis [N], and torque [N mm], by the true paths of
    straight teeth.
    """
    theta = math.tau * (np.arange(2000) + 0.5) / 2000
    force, torque = np.zeros((2000, 3)), np.zeros(2000)
    edge, pitch = np.array([[5.0, 1.0, 0.0, 0.0, depth]]), np.full(teeth, math.tau / teeth)
    loads(edge, pitch, teeth * feed / math.tau, 0.0, 0.0, -50.0, 50.0, np.array(K), theta, force, torque, 0.0 * torque)
    return force.mean(axis=0), float(torque.mean())


def test_a_slot_takes_its_volume_and_costs_what_the_closed_form_says() -> None:
    stock = block()
    removal = remove(straight([-10, 0, -3], [30, 0, -3]), stock, {1: MILL}, material_named("al7075-t6"), FINE)
    c = removal.columns
    slot = 3.0 * (10.0 * 30.0 + 0.5 * math.pi * 25.0)
    assert c["chip_volume_mm3"].sum() == pytest.approx(slot, rel=1e-4)
    assert removal.volume_before - removal.volume_after == pytest.approx(c["chip_volume_mm3"].sum(), rel=1e-4)
    full = c["x_mm"] > 6.5
    m, a, n = material_named("al7075-t6"), 3.0, 4
    f = math.tau * 20.0 / (n * 300.0)
    force, torque = means_of_a_slot(n, a, f, m.coefficients)
    expected = {
        "force_x_mean_n": force[0],
        "force_y_mean_n": force[1],
        "force_z_mean_n": force[2],
        "torque_mean_nm": torque / 1000.0,
    }
    for name, value in expected.items():
        assert c[name][full] == pytest.approx(value, rel=1e-3), name
    assert c["power_w"][full] == pytest.approx(c["torque_mean_nm"][full] * 300.0, rel=1e-6)
    assert c["chip_max_mm"][full] == pytest.approx(f, rel=5e-4)


def test_loads_with_the_material_and_with_its_edge_alone_are_those_of_the_true_paths() -> None:
    alloy = material_named("al7075-t6")
    edge = replace(alloy, Ktc=10.0, Krc=0.0, Kac=0.0, spread=None, covariance=None)
    program = straight([-10, 0, -3], [30, 0, -3])
    both = remove_with_edge(program, block(), {1: MILL}, alloy, edge, FINE, accuracy=False)
    for removal, material in zip(both, (alloy, edge), strict=True):
        c, f = removal.columns, math.tau * 20.0 / (4 * 300.0)
        force, torque = means_of_a_slot(4, 3.0, f, material.coefficients)
        full = c["x_mm"] > 6.5
        assert c["torque_mean_nm"][full] == pytest.approx(torque / 1000.0, rel=1e-3)
        assert c["force_y_mean_n"][full] == pytest.approx(force[1], rel=1e-3)
        assert [cuts.tool for cuts in removal.cuts] == [1]


@pytest.mark.parametrize("spindle", ["cw", "ccw"])
def test_a_wall_costs_what_the_exact_arcs_say(spindle: str) -> None:
    """The planner's provider: closed arcs of a circle at a straight wall; here layers and polygons."""
    turn = 300.0 if spindle == "cw" else -300.0
    stock = LayeredStock.block((0.0, -20.0, -4.0), (40.0, 3.0, 0.0), 0.5, 15.0)
    program = straight([-10, 5.0, -4], [30, 5.0, -4], spindle=turn)
    c = remove_by_layers(program, stock, {1: MILL}, material_named("al7075-t6"), FINE).columns
    a = math.acos(1.0 - 3.0 / 5.0)
    f = math.tau * 20.0 / (4 * 300.0)
    load = forces_along(
        [math.pi - a], [math.pi], f, [[1.0, 0.0]], MILL, material_named("al7075-t6"), 4.0,
        spindle_speed=300.0, spindle=spindle,
    )  # fmt: skip
    row = int(np.flatnonzero(c["x_mm"] > 20.0)[0])
    for ours, theirs in (
        ("force_x_mean_n", "force_x_mean_n"),
        ("force_y_mean_n", "force_y_mean_n"),
        ("force_z_mean_n", "force_z_mean_n"),
        ("torque_mean_nm", "torque_mean_nm"),
        ("power_w", "power_w"),
        ("chip_max_mm", "chip_max_mm"),
    ):
        assert c[ours][row] == pytest.approx(load[theirs][0], rel=1e-6), ours
    # looked at every 3 degrees there, refined here
    assert load["torque_nm"][0] * 0.99 <= c["torque_nm"][row] <= load["torque_nm"][0] * (1 + 1e-9)


@pytest.mark.parametrize("cutter", [MILL, BULL, BALL], ids=["flat", "bull", "ball"])
@pytest.mark.parametrize(
    "path",
    [
        ([[-9, 0, -3], [20, 2, -4]], [[0, 0, 1], [0, 0, 1]]),
        ([[-9, 0, -3], [20, 2, -3]], [[0, 0.3, 1], [0.4, 0.1, 1]]),
        ([[8, 2, 3], [12, 2, -4]], [[0, 0, 1], [0, 0, 1]]),
        ([[15, 0, 2], [15, 0, -5]], [[0, 0, 1], [0, 0, 1]]),
        ([[-9, 3, -4], [20, 0, -2]], [[0.3, 0, 1], [0.3, -0.2, 1]]),
    ],
    ids=["slope", "turning", "ramp", "plunge", "lead"],
)
def test_the_torque_does_the_work_that_the_volume_asks_for(cutter: Cutter, path: list[list[list[float]]]) -> None:
    """Oracle: with Ktc alone, torque times angle is Ktc times the volume removed, whatever the engagement."""
    stock = block(0.2, 60.0)
    fine = Resolution(step_mm=0.5, tolerance=5e-4, corner_slices=40, flank_mm=0.5)
    # a small feed: the thickness is of first order in the feed per tooth, and so is what a step takes
    c = remove(five_axis(*path, feed=5.0), stock, {1: cutter}, ENERGY, fine).columns
    work = 1000.0 * (c["torque_mean_nm"] * 100.0 * c["seconds"]).sum()
    assert work == pytest.approx(1000.0 * c["chip_volume_mm3"].sum(), rel=0.03)


def test_a_rapid_through_material_is_found_and_costs_no_force() -> None:
    removal = remove(straight([-10, 0, 5], [30, 0, 5]), block(), {1: MILL}, ENERGY, FINE)
    assert removal.findings == ()
    assert removal.piece is None
    program = Program.join([rapid([[-10, 0, -3], [20, 0, -3]], 300.0, 1, "link")])
    removal = remove(program, block(), {1: MILL}, ENERGY, FINE)
    assert [f.code for f in removal.findings] == ["rapid-cuts"]
    assert not removal.columns["force_n"].any()
    assert removal.columns["chip_volume_mm3"].sum() > 0.0


def test_what_is_watched_becomes_columns_of_the_steps_that_cut() -> None:
    removal = remove(
        straight([-10, 0, -3], [30, 0, -3]), block(), {1: MILL}, ENERGY, FINE,
        watch=lambda cuts: {"thickest_mm": cuts.engagement.chip_max(), "step": cuts.step.astype(np.float64)}
    )  # fmt: skip
    c = removal.columns
    cut = c["chip_areas"] > 0
    assert not c["thickest_mm"][~cut].any()
    assert c["thickest_mm"][c["x_mm"] > 6.5] == pytest.approx(c["chip_max_mm"][c["x_mm"] > 6.5], rel=1e-9)
    assert c["step"][cut].tolist() == np.flatnonzero(cut).tolist()


def test_what_is_wrong_with_a_program_is_said() -> None:
    with pytest.raises(InputError, match=r"tool 1: no \[\[cutter\]\] has this number: state one beside 2"):
        remove(straight([-10, 0, -3], [30, 0, -3]), block(), {2: MILL}, ENERGY, FINE)


def test_a_feed_with_the_spindle_at_rest_is_named() -> None:
    """It removes what its body does, and has no loads; the rest of the program is simulated."""
    rest = remove(straight([-10, 0, -3], [30, 0, -3], spindle=0.0), block(), {1: MILL}, ENERGY, FINE)
    cut = remove(straight([-10, 0, -3], [30, 0, -3]), block(), {1: MILL}, ENERGY, FINE)
    assert [str(f) for f in rest.findings] == [
        "cuts with the spindle at rest: start it (M3 S) before the cut (machine-spindle-off)"
    ]
    assert cut.findings == ()
    assert rest.volume_after == pytest.approx(cut.volume_after, rel=1e-12)
    assert not rest.columns["force_n"].any()
    assert cut.columns["force_n"].any()


def test_the_same_in_another_place_and_turned_by_a_quarter() -> None:
    one = remove(straight([-10, 1, -3], [30, 2, -4]), block(), {1: BALL}, material_named("al7075-t6"), FINE).columns
    stock = LayeredStock.block((80.0, 100.0, 40.0), (120.0, 140.0, 50.0), 0.5, 15.0)
    program = straight([99, 90, 47], [98, 130, 46])
    two = remove(program, stock, {1: BALL}, material_named("al7075-t6"), FINE).columns
    for a, b, sign in (("force_x", "force_y", 1.0), ("force_y", "force_x", -1.0), ("force_z", "force_z", 1.0)):
        scale = np.abs(one["force_n"]).max()
        assert two[f"{b}_mean_n"] == pytest.approx(sign * one[f"{a}_mean_n"], abs=1e-6 * scale)
    # edges that are made simpler move by half the tolerance, and not alike in both places
    assert two["chip_volume_mm3"] == pytest.approx(one["chip_volume_mm3"], abs=1e-3)


def test_the_force_on_the_wall_is_the_component_along_its_normal() -> None:
    """A wall at y = 0 on the right of travel; the cutter, 2 mm deep in it, leaves the wall y = -2 + ... at its rim."""
    stock = LayeredStock.block((0.0, -20.0, -4.0), (40.0, 2.0, 0.0), 0.5, 60.0)
    c = remove(straight([-10, 5.0, -4], [30, 5.0, -4]), stock, {1: MILL}, material_named("al7075-t6"), FINE).columns
    row = int(np.flatnonzero(c["x_mm"] > 20.0)[0])
    # the wall that is left has the normal +y; what presses on it pushes the cutter towards +y
    assert c["force_normal_n"][row] == pytest.approx(c["force_y_max_n"][row], rel=1e-9)
    slot = remove(straight([-10, 0, -3], [30, 0, -3]), block(), {1: MILL}, material_named("al7075-t6"), FINE).columns
    assert slot["force_normal_n"][slot["x_mm"] > 8.0].max() == 0.0


def test_the_band_of_a_slot_is_that_of_its_coefficients() -> None:
    """Oracle: the mean forces of a slot by true paths, of each coefficient; their errors have the correlation 0.5."""
    m = replace(material_named("al7075-t6"), spread=0.1)
    removal = remove(straight([6, 0, -3], [30, 0, -3]), slotted(), {1: MILL}, m, FINE)
    a, n = 3.0, 4
    f = math.tau * 20.0 / (n * 300.0)
    each = [means_of_a_slot(n, a, f, np.eye(6)[k] * m.coefficients) for k in range(6)]
    along, turning = np.array([force[0] for force, _ in each]), np.array([t for _, t in each])
    x, torque = (0.1 * math.sqrt(0.5 * (v @ v) + 0.5 * v.sum() ** 2) for v in (along, turning / 1000.0))
    assert removal.mean_band is not None
    assert removal.mean_band[0] == pytest.approx(x, rel=1e-3)
    assert removal.mean_band[3] == pytest.approx(torque, rel=1e-3)
    assert remove(straight([6, 0, -3], [9, 0, -3]), slotted(), {1: MILL}, ENERGY, FINE).mean_band is None


def slotted() -> LayeredStock:
    """The block with the slot up to x = 6 cut already."""
    stock = block()
    remove(straight([-10, 0, -3], [6, 0, -3]), stock, {1: MILL}, ENERGY, FINE)
    return stock
