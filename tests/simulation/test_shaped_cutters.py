"""Lens, lollipop, dovetail cutters, thread mills and reamers by moves: volumes and forces against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.shapes import dovetail, lens, lollipop, reamer, thread_mill
from chipload.cutter.table import cutter_from_table
from chipload.cutting.drilling import drill_loads
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation.chips import remove
from chipload.simulation.removal import Removal, Resolution
from chipload.stock.earlier_moves import EarlierMoves
from chipload.stock.layers import LayeredStock
from simulation.discs import mean_loads_of_discs

Floats = NDArray[np.float64]

PLAIN = Material("plain", 800.0, 250.0, 150.0, 12.0, 9.0, 4.0, source="made up")
FINE = Resolution(step_mm=2.0, tolerance=1e-4, corner_slices=40, flank_mm=0.25)
D, NECK, TIP, CORNER, ANGLE = 12.0, 5.0, 30.0, 1.5, math.radians(55.0)
PITCH, WIDTH = 3.0, 0.375
TOPS = {"lens": 10.0, "lollipop": 6.0 + math.sqrt(6.0**2 - 2.5**2), "dovetail": 5.0, "thread mill": PITCH}
SHAPES = {
    "lens": lens(D, TIP, CORNER, TOPS["lens"]),
    "lollipop": lollipop(D, NECK),
    "dovetail": dovetail(D, ANGLE, 0.0, TOPS["dovetail"]),
    "thread mill": thread_mill(D, PITCH, math.radians(30.0), WIDTH, 5.0),
}
SHANKS = {"lens": D, "lollipop": NECK, "dovetail": 4.0, "thread mill": 5.0}
CUTTERS = {n: Cutter(D, 3, 0.5, TOPS[n], 50.0, 6e5, shape=s, shank_diameter=SHANKS[n]) for n, s in SHAPES.items()}
REST = 4.0  # distance of the stock's edge from the cutter's axis [mm]


def radii(name: str, z: Floats) -> Floats:
    """Closed forms of the profiles, without their pieces."""
    if name == "thread mill":
        return 0.5 * D - np.maximum(np.abs(z - 0.5 * PITCH) - 0.5 * WIDTH, 0.0) * math.sqrt(3.0)
    if name == "dovetail":
        return 0.5 * D - z / math.tan(ANGLE)
    if name == "lollipop":
        return np.sqrt(np.maximum(6.0**2 - (z - 6.0) ** 2, 0.0))
    e = 0.5 * D - CORNER
    f = TIP - math.sqrt((TIP - CORNER) ** 2 - e**2)
    # both circles touch on the line through their centres
    touch = TIP - TIP * (TIP - f) / (TIP - CORNER)
    tip = np.sqrt(np.maximum(TIP**2 - (TIP - z) ** 2, 0.0))
    corner = e + np.sqrt(np.maximum(CORNER**2 - np.minimum(z - f, 0.0) ** 2, 0.0))
    return np.where(z < touch, tip, corner)


def along(name: str, rest: float = REST, feed: float = 20.0, above: float = 0.0) -> Removal:
    """A pass along x beside an edge of the stock, whose top is ``above`` the end of the teeth."""
    return pass_beside_an_edge(CUTTERS[name], TOPS[name], feed, rest, above)


def pass_beside_an_edge(cutter: Cutter, deep: float, feed: float, rest: float = REST, above: float = 0.0) -> Removal:
    """The pass of :func:`along` of any cutter, ``deep`` [mm] below the top."""
    points = [-10.0, rest, -deep], [40.0, rest, -deep]
    program = Program.join([rapid(points[0], 300.0, 1, "link"), plunge(points[1], feed, 300.0, 1, "cut")])
    stock = LayeredStock.block((0.0, -20.0, -deep), (30.0, 0.0, above), 0.5, 30.0)
    return remove(program, stock, {1: cutter}, PLAIN, FINE, accuracy=False)


@pytest.mark.parametrize("name", SHAPES)
def test_a_wall_takes_the_volume_under_the_profile(name: str) -> None:
    found, deep = along(name), TOPS[name]
    z = (np.arange(40_000) + 0.5) * (deep / 40_000)
    area = np.maximum(radii(name, z) - REST, 0.0).mean() * deep
    assert area > 1.0
    assert found.findings == ()
    volume = found.columns["chip_volume_mm3"]
    # where it enters and leaves it is known to the instants of a step
    assert volume.sum() == pytest.approx(30.0 * area, rel=2e-3 if name == "lens" else 4e-3)
    k = int(np.flatnonzero(np.abs(found.columns["x_mm"] - 15.0) < 1.1)[0])
    step = float(found.columns["x_mm"][k] - found.columns["x_mm"][k - 1])
    assert volume[k] == pytest.approx(step * area, rel=1e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_forces_are_those_of_a_fine_stack_of_discs(name: str) -> None:
    found, deep = along(name, feed=1.0).columns, TOPS[name]
    k = int(np.flatnonzero(np.abs(found["x_mm"] - 15.0) < 1.1)[0])
    expected = mean_loads_of_discs(radii(name, np.linspace(0.0, deep, 8001)), deep, REST, CUTTERS[name], 1.0, PLAIN)
    for key, value in expected.items():
        assert abs(value) > 0.01
        assert found[key][k] == pytest.approx(value, rel=6e-3), key


def test_a_reamer_takes_the_ring_that_the_drill_left() -> None:
    """Each lip cuts h = f / N cos(lead) over its length of the ring: torque and thrust as of the lips of a drill."""
    drill = Cutter(9.7, 2, 0.5, 40.0, 60.0, 6e5, bottom=math.radians(31.0))
    own = Cutter(10.0, 6, 0.0, 40.0, 60.0, 6e5, shape=reamer(10.0, 0.5, math.radians(45.0), 40.0), number=2)
    feed, speed, parts = 5.0, 300.0, list[Program]()
    for number, deep in ((1, -24.0), (2, -16.0)):
        parts += [
            rapid((0.0, 0.0, 5.0), speed, number, "link"),
            plunge((0.0, 0.0, deep), feed, speed, number, "cut"),
            rapid((0.0, 0.0, 5.0), speed, number, "link"),
        ]
    program = Program.join(parts)
    stock = LayeredStock.block((-20.0, -20.0, -20.0), (20.0, 20.0, 0.0), 0.5, 20.0)
    coarse = Resolution(step_mm=2.0, tolerance=1e-3, corner_slices=8, flank_mm=0.5)
    found = remove(program, stock, {1: drill, 2: own}, PLAIN, coarse, accuracy=False)
    mine = found.columns["tool"] == 2
    turn = math.tau * feed / speed
    k = 6 * (PLAIN.Ktc * turn / 6 * math.cos(math.radians(45.0)) + PLAIN.Kte) / math.cos(math.radians(45.0))
    row = int(np.flatnonzero(mine & (np.abs(found.columns["z_mm"] + 8.0) < 1.1))[0])
    step = found.columns["z_mm"][row - 1] - found.columns["z_mm"][row]
    ring = math.pi * (5.0**2 - 4.85**2) * step
    assert found.columns["chip_volume_mm3"][row] == pytest.approx(ring, rel=1e-3)
    torque = found.columns["torque_mean_nm"][row]
    assert 1e3 * torque == pytest.approx(0.5 * k * (5.0**2 - 4.85**2), rel=1e-3)
    loads = drill_loads(own, PLAIN, [turn], [1e3 * torque], [True])
    assert loads.thrust[0] == pytest.approx(0.5 * k * 0.15, rel=2e-3)
    assert loads.chisel_torque[0] == 0.0


def test_rows_of_a_thread_mill_cut_as_often_as_one() -> None:
    """At one radial depth three rows take three times the chip of one, with three times its mean loads; with teeth that
    do not lag the greatest loads are three times those of one, too.
    """
    shape = SHAPES["thread mill"]
    one = replace(CUTTERS["thread mill"], helix=0.0, flutes=1)
    three = replace(one, tooth_rows=3, flute_length=3.0 * PITCH)
    assert three.segments == shape
    found = [pass_beside_an_edge(c, deep, 20.0).columns for c, deep in ((one, PITCH), (three, 3.0 * PITCH))]
    k = [int(np.flatnonzero(np.abs(c["x_mm"] - 15.0) < 1.1)[0]) for c in found]
    for key in ("chip_volume_mm3", "torque_mean_nm", "force_n", "torque_nm"):
        a, b = (c[key][i] for c, i in zip(found, k, strict=True))
        assert a > 0.01
        assert b == pytest.approx(3.0 * a, rel=1e-6), key
    assert found[1]["chip_max_mm"][k[1]] == pytest.approx(found[0]["chip_max_mm"][k[0]], rel=1e-6)


def test_a_turn_of_two_rows_is_two_turns_of_one() -> None:
    """A helix about a hole of 14 mm: what both take is one thread."""
    one = CUTTERS["thread mill"]
    two = replace(one, tooth_rows=2, flute_length=2.0 * PITCH)
    angle = np.linspace(0.0, math.tau, 25)
    taken = []
    for cutter, turns in ((one, 2), (two, 1)):
        parts = [
            rapid((0.0, 0.0, -9.0), 300.0, 1, "link"),
            plunge((1.5, 0.0, -9.0), 5.0, 300.0, 1, "cut"),
        ]
        for k in range(turns):
            rise = -9.0 + PITCH * (k + angle[1:] / math.tau)
            points = zip(1.5 * np.cos(angle[1:]), 1.5 * np.sin(angle[1:]), rise, strict=True)
            parts += [plunge((float(x), float(y), float(z)), 5.0, 300.0, 1, "cut") for x, y, z in points]
        plate = trimesh.creation.annulus(r_min=7.0, r_max=12.0, height=9.0, sections=36)
        plate.apply_translation((0.0, 0.0, -4.5))
        stock = LayeredStock.of_mesh(plate, 0.5, 30.0)
        coarse = Resolution(step_mm=2.0, tolerance=1e-3, corner_slices=8, flank_mm=0.5)
        found = remove(Program.join(parts), stock, {1: cutter}, PLAIN, coarse, accuracy=False)
        taken.append(float(found.columns["chip_volume_mm3"].sum()))
    assert taken[0] > 10.0
    assert taken[1] == pytest.approx(taken[0], rel=5e-3)


def test_the_neck_of_an_undercut_cutter_must_be_free() -> None:
    """It goes 4 mm beside the edge; a neck of 5 mm does not touch; where it goes through the stock, it does in 3 mm."""
    for rest, overrun in ((4.0, 0.0), (2.0, 3.0)):
        found = along("lollipop", rest=rest, above=3.0).columns["axial_overrun_mm"]
        assert found.max() == pytest.approx(overrun, abs=1e-6)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"diameter": 11.0}, "cutter.diameter_mm = 11: must be 12, as of its shape"),
        ({"flute_length": 4.0}, "cutter.flute_length_mm = 4: must be 5, as of its shape"),
        ({"shank_diameter": 6.0}, r"cutter.shank_diameter_mm = 6: must be above 0 and at most 4.99792, as wide as"),
        ({"taper": 0.1}, "cutter.shape: it has its own corner"),
    ],
)
def test_numbers_beside_a_shape_must_agree_with_it(given: dict[str, float], says: str) -> None:
    own = {"diameter": D, "flute_length": 5.0, "shank_diameter": 4.0} | given
    with pytest.raises(InputError, match=says):
        Cutter(flutes=3, helix=0.5, overhang=50.0, modulus=6e5, shape=SHAPES["dovetail"], **own)


@pytest.mark.parametrize("name", ["lens", "dovetail"])
def test_a_stock_keeps_the_shape_of_the_cutter_that_cut_it(name: str) -> None:
    """The same pass again finds nothing, also from a saved stock."""
    deep = TOPS[name]
    points = [-10.0, REST, -deep], [40.0, REST, -deep]
    program = Program.join([rapid(points[0], 300.0, 1, "link"), plunge(points[1], 20.0, 300.0, 1, "cut")])
    stock = LayeredStock.block((0.0, -20.0, -deep), (30.0, 0.0, 0.0), 0.5, 30.0)
    remove(program, stock, {1: CUTTERS[name]}, PLAIN, FINE, accuracy=False)
    assert stock.earlier is not None
    arrays = {k: v.copy() for k, v in stock.earlier.arrays().items()}
    stock.earlier = EarlierMoves.from_arrays(arrays)
    again = remove(program, stock, {1: CUTTERS[name]}, PLAIN, FINE, accuracy=False)
    assert float(again.columns["chip_volume_mm3"].sum()) == 0.0


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("lens", {"shape": "lens", "tip_radius_mm": TIP, "corner_radius_mm": CORNER, "flute_length_mm": 10.0}),
        ("lollipop", {"shape": "lollipop", "shank_diameter_mm": NECK}),
        ("thread mill", {"shape": "thread mill", "thread_pitch_mm": PITCH, "shank_diameter_mm": 5.0}),
        ("dovetail", {"shape": "dovetail", "flank_deg": 55.0, "flute_length_mm": 5.0, "shank_diameter_mm": 4.0}),
    ],
)
def test_a_job_states_a_shape_by_its_numbers(name: str, keys: dict[str, object]) -> None:
    plain = {"number": 1, "diameter_mm": D, "flutes": 3, "helix_deg": 30.0, "overhang_mm": 50.0, "modulus_gpa": 600.0}
    assert cutter_from_table(plain | keys).shape == SHAPES[name]
    missing = {
        "lens": "tip_radius_mm", "lollipop": "shank_diameter_mm", "dovetail": "flank_deg",
        "thread mill": "thread_pitch_mm",
    }[name]  # fmt: skip
    with pytest.raises(InputError, match=f"cutter.{missing} is missing"):
        cutter_from_table({"flute_length_mm": 5.0} | plain | {k: v for k, v in keys.items() if k != missing})
