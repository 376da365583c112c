"""What is left out of the covered areas because no material is in the way changes nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.program.program import Program
from chipload.simulation import swept_area
from chipload.simulation.chips import remove
from chipload.simulation.removal import Resolution
from chipload.simulation.steps import step_boxes, steps_of
from chipload.stock.layers import LayeredStock
from simulation.test_steps import five_axis

CUTTERS = {1: Cutter(10.0, 4, 0.5, 30.0, 60.0, 6e5)}
ROUGH = Resolution(step_mm=2.0, tolerance=0.01, corner_slices=4, flank_mm=2.0, rotation=math.radians(10.0))


def leaning(turn: float) -> Program:
    """A flute along a wall, twice, that meets it with its upper half; the axis turns by up to ``turn`` [rad]."""
    rng = np.random.default_rng(8)
    x = np.tile(np.linspace(-4.0, 34.0, 14), 2)
    p = np.column_stack([x, np.repeat([-6.5, -7.0], 14), -12.0 + 2.0 * np.sin(x)])
    a = np.column_stack([turn * rng.uniform(-1.0, 1.0, 28), 0.4 + turn * rng.uniform(-1.0, 1.0, 28), np.ones(28)])
    return five_axis(p.tolist(), a.tolist())


@pytest.mark.parametrize("turn", [0.0, 0.02, 0.2])
def test_layers_without_material_are_left_out_and_no_others(turn: float, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[np.ndarray] = []
    left = swept_area._layers_left

    def run() -> list[bytes]:
        stock = LayeredStock.block((0.0, 0.0, -16.0), (30.0, 30.0, 0.0), 1.0, 15.0)
        columns = remove(leaning(turn), stock, CUTTERS, material_named("al7075-t6"), ROUGH, engine="layers").columns
        return [stock.to_bytes(), *(np.ascontiguousarray(v).tobytes() for v in columns.values())]

    def watched(*words):
        found = left(*words)
        asked.extend(found.values())
        return found

    monkeypatch.setattr(swept_area, "_layers_left", watched)
    some = run()
    monkeypatch.setattr(
        swept_area, "_layers_left", lambda *words: {k: np.ones(len(f), dtype=bool) for k, f in left(*words).items()}
    )
    assert run() == some
    assert np.concatenate(asked).mean() < 0.97


def test_a_box_holds_all_that_its_layer_is_covered_by() -> None:
    """Blocks of material that are only just in the way of a turning axis are seen."""
    steps = steps_of(leaning(0.3), 2.0, 0.01)
    low, high = step_boxes(steps, CUTTERS)
    stock = LayeredStock.block((-60.0, -60.0, -16.0), (60.0, 60.0, 0.0), 2.0, 120.0)
    seen = 0
    for k, found in swept_area.swept_ahead(steps, stock, CUTTERS, 0.01, 1):
        for i, shape in zip(found.met[::3].tolist(), found.shape[::3].tolist(), strict=True):
            x, y = shapely.get_coordinates(found.areas.polygon(shape))[0]
            tiny = shapely.box(x - 1e-6, y - 1e-6, x + 1e-6, y + 1e-6)
            stock.tiles[:] = shapely.Polygon()
            stock.tiles[i, 0, 0] = tiny
            left = swept_area._layers_left(steps, {k: range(i, i + 1)}, low, high, CUTTERS, stock)
            assert left[k].tolist() == [True]
            seen += 1
        stock.tiles[:] = shapely.box(-60.0, -60.0, 60.0, 60.0)
    assert seen > 40
