"""Sizes that no run can have are refused before anything is allocated, with the key, its value and the limit."""

from __future__ import annotations

import math
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from chipload.checking.workpiece import stock_points
from chipload.cutter.cutter import Cutter
from chipload.engagement.moves.stock import MoveStock, work_room
from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.jobs import check_job, load_job
from chipload.program.build import rapid, rows
from chipload.program.program import LINE, Program
from chipload.simulation.chips import count_steps
from chipload.simulation.removal import Resolution
from chipload.stock.layers import LayeredStock

LOW, HIGH = (0.0, 0.0, 0.0), (100.0, 80.0, 40.0)


def cutter(**changed: float) -> Cutter:
    numbers = {"diameter": 10.0, "flutes": 4, "helix": 0.5, "flute_length": 20.0, "overhang": 30.0, "modulus": 6e5}
    return Cutter(**{**numbers, **changed})


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"diameter": 1e-9}, r"cutter\.diameter_mm = 1e-09: must be from 0\.01 to 1000"),
        ({"diameter": 1e9}, r"cutter\.diameter_mm = 1e\+09: must be from 0\.01 to 1000"),
        ({"flutes": 10**9}, r"cutter\.flutes = 1e\+09: must be at most 200"),
        ({"overhang": 1e6}, r"cutter\.overhang_mm = 1e\+06: must be at most 3000"),
    ],
)
def test_a_cutter_that_cannot_be(changed: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        cutter(**changed)


@pytest.mark.parametrize("flutes", ["1e9", str(10**9), str(10**30)])
def test_flutes_of_a_job(tmp_path: Path, flutes: str) -> None:
    copy_example("bracket", tmp_path / "b")
    with pytest.raises(InputError, match=r"cutter\.0\.flutes"):
        load_job(tmp_path / "b" / "job.toml", [f"cutter.0.flutes={flutes}"])


def refused(work: object, message: str) -> None:
    """Refused, and no more than 10 MB were taken on the way."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=message):
            work()  # type: ignore[operator]
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_layers_and_tiles() -> None:
    refused(lambda: LayeredStock.block(LOW, HIGH, 1e-9, 40.0), r"stock\.layer_mm = 1e-09: 40 mm in 4e\+10 pieces: must")
    refused(lambda: LayeredStock.block(LOW, HIGH, 1.0, 1e-9), r"stock\.tile_mm = 1e-09: 100 mm in 1e\+11 pieces: must")
    refused(lambda: LayeredStock.block(LOW, HIGH, 1.0, 0.01), r"stock: 40 layers of 10000 x 8000 tiles: at most")
    stock = LayeredStock.block(LOW, HIGH, 1.0, 40.0)
    refused(lambda: stock.refine(0.0, 40.0, 1e-9), r"stock\.layer_mm = 1e-09: 4e\+10 layers: must be at most 200000")
    assert stock.layers == 40


def test_points_of_the_stock() -> None:
    """447 GiB at a pitch of 1e-9 mm."""
    stock = LayeredStock.block(LOW, HIGH, 10.0, 40.0)
    refused(lambda: stock_points(stock, 1e-9), r"stock_points_mm = 1e-09: 3\.2e32 points: must be at most 4000000")
    assert len(stock_points(stock, 10.0)) == 10 * 8 * 4


def straight(length: float) -> Program:
    there = rows([LINE], [[length, 0.0, 0.0]], (0.0, 0.0), 20.0, 300.0, 1, "cut")
    return Program.join([rapid([0.0, 0.0, 0.0], 300.0, 1, "link"), there])


def test_steps_of_a_simulation() -> None:
    tip = Resolution(step_mm=1e-7, tolerance=0.01, corner_slices=4, flank_mm=2.0, rotation=math.radians(10.0))
    refused(
        lambda: count_steps(straight(100.0), {1: cutter()}, tip), r"step_mm = 1e-07: 1e9 steps: must be at most 5000"
    )
    coarse = Resolution(step_mm=0.5, tolerance=0.01, corner_slices=4, flank_mm=2.0, rotation=math.radians(10.0))
    assert count_steps(straight(100.0), {1: cutter()}, coarse) == 200
    assert np.isfinite(coarse.step_mm)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("round.pitch_mm=1e-9", r"round\.pitch_mm = 1e-09: .* points: must be at most 2000000"),
        ("round.top_mm=1e9", r"round\.pitch_mm = .* points: must be at most 2000000|round\.top_mm"),
        ("simulation.layer_mm=1e-9", r"simulation\.layer_mm = 1e-09: .* layers: must be at most 200000"),
    ],
)
def test_a_helix_and_its_layers(tmp_path: Path, change: str, message: str) -> None:
    copy_example("cone", tmp_path / "c")
    with pytest.raises(InputError, match=message):
        check_job(load_job(tmp_path / "c" / "job.toml", [change]))


@pytest.mark.parametrize("side", range(3))
def test_a_stock_without_thickness(side: int) -> None:
    """1e-9 mm wide: the cells that the cutter covers would take 8 TiB."""
    high = np.where(np.arange(3) == side, 1e-9, HIGH)
    refused(lambda: LayeredStock.block(LOW, high, 1.0, 40.0), r"stock: 1e-09 mm from .*: each side must be at least 0")
    thin = np.where(np.arange(3) == side, 1e-3, HIGH)
    assert LayeredStock.block(LOW, thin, 1.0, 40.0).volume() > 0.0


def test_room_for_a_stock_thinner_than_a_cell_of_its_index() -> None:
    index = MoveStock(np.zeros(3), np.array([1e-3, 1e-3, 9.0]), {1: cutter()})
    assert len(work_room(index.grid, index.cutters, 4, np.array([2.0]))[0]) < 1_000_000


@pytest.mark.parametrize(
    ("example", "key", "value", "limit"),
    [
        ("impeller", "impeller.outer_diameter_mm", "1e300", r"must be within 1e\+15"),
        ("impeller", "impeller.outer_diameter_mm", "2e6", r"must be within 1e\+06 mm"),
        ("impeller", "impeller.shape.wrap_deg", "-1e9", "must be at least -360"),
        ("impeller", "impeller.shape.outlet_height_mm", "1e-9", r"must be at least 0\.1"),
        ("pocket", "operation.0.allowance_mm", "1e300", r"must be within 1e\+15"),
        ("contour", "stock.top_mm", "-1.1e6", r"must be within 1e\+06 mm"),
        ("chips", "stock.high_mm", "[10.0, 2e6, 10.0]", r"must be within 1e\+06 mm"),
    ],
)
def test_lengths_beyond_any_machine(tmp_path: Path, example: str, key: str, value: str, limit: str) -> None:
    copy_example(example, tmp_path / "job")
    with pytest.raises(InputError, match=f"{key} = .*: {limit}"):
        load_job(tmp_path / "job" / "job.toml", [f"{key}={value}"])
