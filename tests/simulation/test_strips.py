"""Strips of a layered stock in processes: the same bytes as one process gives, also where a run was stopped."""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import Cancelled, InputError
from chipload.program.build import rapid, rows
from chipload.program.program import LINE, Program
from chipload.simulation import chips, swept_area
from chipload.simulation import strips as of_strips
from chipload.simulation.checkpoint import Checkpoint
from chipload.simulation.chips import remove
from chipload.simulation.chunks import remove_in_chunks
from chipload.simulation.removal import Removal, Resolution, TakenByLayers
from chipload.simulation.strips import Strips, strips_of
from chipload.stock.layers import LayeredStock
from simulation.test_chunks import BALL as ROUND
from simulation.test_chunks import MATERIAL, bytes_of, some_rows
from simulation.test_chunks import MILL as WIDE
from simulation.test_chunks import ROUGH as COARSE
from simulation.test_steps import five_axis

MILL = Cutter(6.0, 3, 0.5, 12.0, 30.0, 6e5)
BALL = Cutter(6.0, 2, 0.5, 12.0, 30.0, 6e5, corner_radius=3.0)
CUTTERS = {1: MILL, 2: BALL}
ROUGH = Resolution(step_mm=1.0, tolerance=0.01, corner_slices=3, flank_mm=3.0, rotation=math.radians(30.0))


def block() -> LayeredStock:
    """90 x 30 mm in 6 x 2 tiles."""
    return LayeredStock.block((0.0, 0.0, -4.0), (90.0, 30.0, 0.0), 1.0, 15.0)


def across() -> Program:
    """Rows over all of the block, the last by a ball nose that leans a little, and a rapid through what is left."""
    corners = [[90.0, 8.0, -2.0], [90.0, 14.0, -2.0], [0.0, 14.0, -3.0], [30.0, 25.0, -3.0]]
    flat = rows([LINE] * 4, corners, (0.0, 0.0), 20.0, 300.0, 1, "cut")
    p = [[44.0 + 2.0 * k, 20.0, -1.5] for k in range(8)]
    lean = five_axis(p, [[0.1, 0.02 * k, 1.0] for k in range(8)])
    lean = replace(lean, tool=np.full(8, 2), line=100 + lean.line)
    return Program.join(
        [rapid([0.0, 8.0, -2.0], 300.0, 1, "link"), flat, rapid([5.0, 25.0, -3.0], 300.0, 1, "x"), lean]
    )


def one(program: Program) -> tuple[Removal, list[bytes]]:
    stock = block()
    found = remove(program, stock, CUTTERS, MATERIAL, ROUGH, engine="layers")
    return found, bytes_of(found, stock)


def test_strips_have_their_own_columns_and_a_halo() -> None:
    # 6 columns of 15 mm; a step of 0.5 mm with a cutter of 6 mm reaches over a border at most
    flat = across()
    upright = Program.join([rapid([0.0, 8.0, -2.0], 300.0, 1, "link"), rows(
        [LINE] * 2, [[90.0, 8.0, -2.0], [0.0, 8.0, -2.0]], (0.0, 0.0), 20.0, 300.0, 1, "cut")])  # fmt: skip
    strips = strips_of(upright, block(), CUTTERS, 0.5, 0.01, 2)
    assert [s.axis for s in strips] == [0, 0]
    assert [s.own for s in strips] == [(0, 2), (3, 5)]
    assert [s.whole for s in strips] == [(0, 3), (2, 5)]
    # two columns of rows, both under all of its steps
    assert (
        strips_of(flat, LayeredStock.block((0.0, 0.0, -6.0), (8.0, 30.0, 0.0), 0.5, 15.0), CUTTERS, 0.5, 0.01, 2) == []
    )


def test_every_process_count_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(of_strips, "GAIN", 9.0)
    monkeypatch.setattr(of_strips, "ROUND", 2)
    monkeypatch.setattr(chips, "BLOCK", 64)
    program = across()
    known, whole = one(program)
    used = list[int]()
    begin = Strips.__init__
    monkeypatch.setattr(Strips, "__init__", lambda self, s, *more: (used.append(len(s)), begin(self, s, *more))[1])
    stock = block()
    found = remove(program, stock, CUTTERS, MATERIAL, ROUGH, processes=2, engine="layers")
    assert used == [2]
    assert bytes_of(found, stock) == whole
    assert found.energy_balance == known.energy_balance
    assert found.resolution_error == known.resolution_error

    # stopped after some blocks, and on in one process; then in strips from what one process kept
    def stop(done: float, _: str) -> None:
        if done > 0.6:
            raise Cancelled("stopped")

    for first, then in ((2, 1), (1, 2)):
        folder = tmp_path / f"{first}"
        with pytest.raises(Cancelled), Checkpoint(folder, 0.0, notice=lambda _: None) as kept:
            remove_in_chunks(
                program, block(), CUTTERS, MATERIAL, ROUGH, kept, processes=first, progress=stop, engine="layers"
            )
        said, stock = list[str](), block()
        with Checkpoint(folder, 0.0, notice=said.append) as kept:
            found = remove_in_chunks(program, stock, CUTTERS, MATERIAL, ROUGH, kept, processes=then, engine="layers")
            assert bytes_of(found, stock) == whole
        assert "continues after step" in said[0]


def test_an_error_of_a_strip_is_that_of_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(of_strips, "GAIN", 9.0)
    lies = five_axis([[10.0, 8.0, -2.0], [12.0, 8.0, -2.0]], [[0.0, 0.0, 1.0], [1.0, 0.0, 0.001]])
    program = Program.join([across(), lies])
    told = []
    for processes in (1, 2):
        with pytest.raises(InputError, match=r"the axis has A_z = 0\.001") as found:
            remove(program, block(), CUTTERS, MATERIAL, ROUGH, processes=processes, engine="layers")
        told.append(str(found.value))
    assert told[0] == told[1]


def test_a_process_that_is_killed_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(of_strips, "GAIN", 9.0)
    monkeypatch.setattr(of_strips, "ROUND", 1)
    monkeypatch.setattr(chips, "BLOCK", 64)
    program = across()
    _, whole = one(program)
    killed, take = list[int](), Strips.next

    def broken(self: Any, *more: Any) -> TakenByLayers:
        found = take(self, *more)
        if not killed:
            killed.append(min(self._team._executor._processes))
            os.kill(killed[0], signal.SIGKILL)
        return found

    monkeypatch.setattr(Strips, "next", broken)
    stock = block()
    assert bytes_of(remove(program, stock, CUTTERS, MATERIAL, ROUGH, processes=2, engine="layers"), stock) == whole
    assert killed


class _Late:
    """An executor that finds each part when it is asked for it."""

    early = False

    def __init__(self, _: int) -> None:
        pass

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def map(self, function: Callable[[range], object], parts: list[range]) -> Iterable[object]:
        found = map(function, parts)
        return list(found) if self.early else found


class _Early(_Late):
    """An executor that finds all parts of a block before the first step of it is removed."""

    early = True


def test_areas_that_are_found_early_or_late_remove_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    # also the sign of a zero: a step that finds nothing is one that was not asked
    monkeypatch.setattr(swept_area, "TOGETHER", 1)
    found = []
    for when in (_Late, _Early):
        monkeypatch.setattr(swept_area, "ThreadPoolExecutor", when)
        stock = LayeredStock.block((0.0, 0.0, -6.0), (40.0, 30.0, 0.0), 0.5, 12.0)
        removal = remove(some_rows(), stock, {1: WIDE, 2: ROUND}, MATERIAL, COARSE, accuracy=False, engine="layers")
        found.append(bytes_of(removal, stock))
    assert found[0] == found[1]
