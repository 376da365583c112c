"""The depth's force against the simulation: two rows through a layered block, the second one beside the first."""

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.planning.thinwall.depth import Limits, largest_depths, normal_force
from chipload.planning.thinwall.engaged import Posture
from chipload.planning.thinwall.paths import Going, program_of, rows_of
from chipload.planning.thinwall.wall import Surface
from chipload.simulation.chips import Resolution, remove
from chipload.stock.layers import LayeredStock

STEEL = Material("steel", 1900.0, 600.0, 300.0, 24.0, 20.0, 5.0, source="made up, of the usual size")
BALL = Cutter(8.0, 2, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=4.0)
BULL = Cutter(8.0, 4, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=2.0)


@pytest.mark.parametrize(("cutter", "lead", "tilt", "step"), [(BALL, 15.0, 0.0, -0.5), (BULL, 8.0, 5.0, 0.5)])
def test_simulated_row(cutter, lead, tilt, step):
    """Normal force in the middle of the second row is that of its depth, and below the threshold within 1 %."""
    feed, spindle = 10.0, 628.0
    tooth = feed * math.tau / (spindle * cutter.flutes)
    posture = Posture(cutter, tooth, step, math.radians(lead), math.radians(tilt))
    found = largest_depths(posture, STEEL, [14.0], Limits(0.02, 0.8, 1e-5), measure="greatest")
    d = float(found.depth[0])
    assert 0.1 < d < 0.7
    x, y = np.meshgrid(np.linspace(0.0, 24.0, 13), [0.0, 0.5], indexing="ij")
    points = np.stack([x, y, 0.0 * x], axis=-1)
    surface = Surface(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape), d)
    none = np.zeros(x.shape)
    program = program_of(rows_of(surface, none, none + d, posture), Going(posture, feed, 100.0, spindle, 8.0), "rows")
    bounds = np.concatenate([[-1.0], np.linspace(-0.008, 0.0, 3)[:-1], np.linspace(0.0, d, 81)])
    stock = LayeredStock.block((-10.0, -12.0, -1.0), (34.0, 12.0, d), bounds, 16.0)
    run = remove(program, stock, {1: cutter}, STEEL, Resolution(1.0, 0.002, 96, 0.5))
    column = run.columns
    rows = np.flatnonzero(~column["rapid"] & (np.abs(column["x_mm"] - 12.5) < 3.0) & (column["chip_volume_mm3"] > 0.0))
    second = rows[rows > rows[0] + len(rows) // 2]
    force = np.maximum(column["force_z_max_n"], -column["force_z_min_n"])[second]
    assert len(second) >= 3
    predicted = float(normal_force(posture, STEEL, [d], measure="greatest")[0])
    assert force == pytest.approx(predicted, rel=0.02)
    assert (force <= 14.0 * 1.01).all()
