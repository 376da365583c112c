"""Chips, volumes and forces do not know where the work stands, how it is turned about z, or the unit of length."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import Move
from chipload.simulation.chips import remove
from chipload.simulation.removal import Removal, Resolution
from chipload.stock.layers import LayeredStock
from laws.test_chip_laws import BALL, BULL, FLAT, FORCES, HIGH, LOW, walk
from simulation.test_steps import five_axis

Floats = NDArray[np.float64]


def run(tips: Floats, axes: Floats, cutter: Cutter, stock: LayeredStock, k: float = 1.0) -> Removal:
    """A program with all lengths k times as long."""
    material = replace(material_named("al7075-t6"), source="scaled")
    material = replace(material, Kte=k * material.Kte, Kre=k * material.Kre, Kae=k * material.Kae)
    program = five_axis((k * tips).tolist(), axes.tolist(), feed=20.0 * k)
    return remove(program, stock, {1: cutter}, material, Resolution(3.0 * k, 2e-3 * k, 8, 1.0 * k))


@pytest.mark.parametrize(("cutter", "seed"), [(FLAT, 11), (BALL, 12)], ids=["flat", "ball"])
def test_a_rigid_motion_leaves_volumes_and_turns_forces(cutter: Cutter, seed: int) -> None:
    """The job moved and turned about z by an angle of no meaning: only the cells of the index lie otherwise."""
    tips, axes = walk(seed, 5)
    mesh = trimesh.creation.box(bounds=[LOW, HIGH])
    angle, shift = 0.7, np.array([310.0, -45.0, 12.5])
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    one = run(tips, axes, cutter, LayeredStock.of_mesh(mesh, 0.5, 15.0))
    mesh.vertices = mesh.vertices @ turn.T + shift
    two = run(tips @ turn.T + shift, axes @ turn.T, cutter, LayeredStock.of_mesh(mesh, 0.5, 15.0))
    a, b = one.columns, two.columns
    force, turned = (np.column_stack([c[name] for name in FORCES]) for c in (a, b))
    np.testing.assert_allclose(b["chip_volume_mm3"], a["chip_volume_mm3"], atol=2e-4 * a["chip_volume_mm3"].max())
    assert b["chip_volume_mm3"].sum() == pytest.approx(a["chip_volume_mm3"].sum(), rel=5e-5)
    np.testing.assert_allclose(turned, force @ turn.T, atol=1e-3 * np.abs(force).max())
    np.testing.assert_allclose(b["torque_mean_nm"], a["torque_mean_nm"], atol=1e-3 * a["torque_mean_nm"].max())


def scaled(cutter: Cutter, k: float) -> Cutter:
    return replace(
        cutter,
        diameter=k * cutter.diameter,
        flute_length=k * cutter.flute_length,
        overhang=k * cutter.overhang,
        corner_radius=k * cutter.corner_radius,
    )


@pytest.mark.parametrize("k", [0.1, 25.4])
@pytest.mark.parametrize(("cutter", "seed"), [(FLAT, 21), (BULL, 22)], ids=["flat", "bull"])
def test_the_unit_of_length_does_not_matter(cutter: Cutter, seed: int, k: float) -> None:
    """Areas grow by k^2, volumes by k^3, forces by k^2 where the edge terms grow by k; torques by k^3.

    Rounding may decide how many chords an edge gets, so that what a step loses follows to the share of the chords.
    """
    tips, axes = walk(seed, 5)
    move, larger = (Move.slerp(s * tips[0], axes[0], s * tips[1], axes[1]) for s in (1.0, k))
    heights = tips[0, 2] + np.array([0.2, 1.7, 4.0])
    for a, b in zip(
        covered_areas(move, cutter, heights, 1e-3),
        covered_areas(larger, scaled(cutter, k), k * heights, 1e-3 * k),
        strict=True,
    ):
        assert b.area == pytest.approx(k**2 * a.area, rel=1e-9)
    stocks = [LayeredStock.block(np.multiply(LOW, s), np.multiply(HIGH, s), 0.5 * s, 15.0 * s) for s in (1.0, k)]
    one = run(tips, axes, cutter, stocks[0]).columns
    two = run(tips, axes, scaled(cutter, k), stocks[1], k).columns
    for name, power in (("chip_volume_mm3", 3), *((f, 2) for f in FORCES), ("torque_mean_nm", 3), ("chip_max_mm", 1)):
        size = np.abs(one[name]).max()
        off = np.abs(two[name] / k**power - one[name])
        # one step, of which rounding changes the chords, may lie between the two
        assert off.max() <= 1e-4 * size, name
        assert (off > 1e-5 * size).sum() <= 1, name
        assert np.median(off) <= 1e-13 * size, name
    assert two["chip_volume_mm3"].sum() / k**3 == pytest.approx(one["chip_volume_mm3"].sum(), rel=1e-6)
