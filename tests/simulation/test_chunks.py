"""Runs in pieces: what was stopped goes on, and nothing of the result tells of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import material_named
from chipload.errors import Cancelled, InputError
from chipload.program.build import rapid, rows
from chipload.program.program import ARC_CCW, LINE, Program
from chipload.simulation.checkpoint import LAST, Checkpoint, Stored, in_rows
from chipload.simulation.chips import remove
from chipload.simulation.chunks import remove_in_chunks
from chipload.simulation.removal import Removal, Resolution
from chipload.simulation.steps import Steps, steps_in_blocks, steps_of
from chipload.stock.layers import LayeredStock
from simulation.test_steps import five_axis

MILL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
BALL = Cutter(8.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=4.0)
CUTTERS = {1: MILL, 2: BALL}
ROUGH = Resolution(step_mm=1.0, tolerance=0.01, corner_slices=4, flank_mm=2.0, rotation=math.radians(10.0))
MATERIAL = replace(material_named("al7075-t6"), spread=0.05)


def some_rows(seed: int = 3) -> Program:
    """A square with a rapid through the stock, an arc, and a second cutter that leans as it goes."""
    corners = [[38.0, 4.0, -2.0], [38.0, 26.0, -2.0], [4.0, 26.0, -2.0], [4.0, 4.0, -2.0]]
    square = rows([LINE] * 4, corners, (0.0, 0.0), 20.0, 300.0, 1, "cut")
    arc = rows([ARC_CCW], [[24.0, 15.0, -3.0]], (20.0, 15.0), 15.0, 300.0, 1, "arc")
    down = [rapid(p, 300.0, 1, "link") for p in ([16.0, 15.0, 5.0], [16.0, 15.0, -3.0])]
    rng = np.random.default_rng(seed)
    p = np.column_stack([rng.uniform(2.0, 38.0, 12), rng.uniform(2.0, 28.0, 12), rng.uniform(-3.0, -1.0, 12)])
    a = np.column_stack([rng.uniform(-0.2, 0.2, (12, 2)), np.ones(12)])
    lean = five_axis(p.tolist(), a.tolist())
    lean = replace(lean, tool=np.full(12, 2), line=100 + lean.line)
    return Program.join([rapid([4.0, 4.0, -2.0], 300.0, 1, "link"), square, *down, arc, lean])


def block() -> LayeredStock:
    return LayeredStock.block((0.0, 0.0, -6.0), (40.0, 30.0, 0.0), 0.5, 12.0)


def bytes_of(removal: Removal, stock: LayeredStock) -> list[bytes]:
    """All that a result shows."""
    c = removal.columns
    whole = [removal.volume_before, removal.volume_after, removal.mean_band, removal.findings]
    numbers = [np.ascontiguousarray(c[k]).tobytes() for k in c]
    return [" ".join(c).encode(), repr(whole).encode(), stock.to_bytes(), *numbers]


def run(folder: Path, program: Program | None = None, every_s: float = 0.0, **more: Any) -> tuple[Removal, list[bytes]]:
    """A run in pieces and its bytes, read before the folder goes."""
    stock = block()
    with Checkpoint(folder, every_s, fresh=more.pop("fresh", False), notice=more.pop("notice", print)) as kept:
        program = program or some_rows()
        removal = remove_in_chunks(program, stock, CUTTERS, MATERIAL, ROUGH, kept, **more)
        out = bytes_of(removal, stock)
        kept.discard()
    return removal, out


def stopped(folder: Path, share: float, program: Program | None = None) -> None:
    """A run that is cancelled where ``share`` of it is done."""

    def progress(done: float, _: str) -> None:
        if done > share:
            raise Cancelled("stopped")

    with pytest.raises(Cancelled):
        run(folder, program, progress=progress)


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    for room in ("chips", "chunks"):
        monkeypatch.setattr(f"chipload.simulation.{room}.BLOCK", 40)


@pytest.fixture
def whole() -> list[bytes]:
    """What a run in memory gives."""
    stock = block()
    return bytes_of(remove(some_rows(), stock, CUTTERS, MATERIAL, ROUGH), stock)


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_blocks_of_steps_are_the_steps(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chipload.simulation.steps.ROWS", 3)
    program = some_rows()
    one = steps_of(program, 0.7, 0.01)
    for first in (0, 1, len(one) // 2, len(one)):
        some = list(steps_in_blocks(program, 0.7, 0.01, size=size, first=first))
        assert all(len(s) == size for s in some[:-1])
        for f in fields(Steps):
            joined = [getattr(s, f.name) for s in some] or [getattr(one, f.name)[:0]]
            assert np.array_equal(np.concatenate(joined), getattr(one, f.name)[first:]), f.name


def test_a_run_in_pieces_gives_the_bytes_of_one_in_memory(tmp_path: Path, whole: list[bytes]) -> None:
    removal, found = run(tmp_path / "u")
    assert isinstance(removal.columns, Stored)
    assert found == whole
    assert not (tmp_path / "u").exists()


def test_a_short_run_keeps_nothing_on_the_disk(tmp_path: Path, whole: list[bytes]) -> None:
    removal, found = run(tmp_path / "u", every_s=3600.0)
    assert not isinstance(removal.columns, Stored)
    assert found == whole


@pytest.mark.parametrize("shares", [(0.3,), (0.9,), (0.2, 0.5, 0.7)])
def test_a_run_that_was_stopped_goes_on_to_the_same_bytes(
    tmp_path: Path, whole: list[bytes], shares: tuple[float, ...]
) -> None:
    for share in shares:
        stopped(tmp_path / "u", share)
    said: list[str] = []
    done: list[float] = []
    _, found = run(tmp_path / "u", notice=said.append, progress=lambda share, _: done.append(share))
    assert found == whole
    assert done[0] > shares[-1] - 0.2
    assert len(said) == 1
    assert said[0].startswith("continues after step ")


def test_one_worker_and_two_give_the_same_bytes(tmp_path: Path, whole: list[bytes]) -> None:
    assert run(tmp_path / "u", workers=1)[1] == whole == run(tmp_path / "u", workers=2)[1]


def other_input(folder: Path, said: list[str]) -> None:
    run(folder, some_rows(4), notice=said.append)


def asked_to(folder: Path, said: list[str]) -> None:
    run(folder, fresh=True, notice=said.append)


def other_versions(folder: Path, said: list[str]) -> None:
    run(folder, also={"numpy": "1.0"}, notice=said.append)


@pytest.mark.parametrize("again", [other_input, asked_to, other_versions])
def test_another_run_begins_at_its_beginning(tmp_path: Path, again: Callable[[Path, list[str]], None]) -> None:
    stopped(tmp_path / "u", 0.5)
    said: list[str] = []
    again(tmp_path / "u", said)
    assert said in (
        ["starts from the beginning: the checkpoint belongs to another input"],
        ["starts from the beginning, as requested"],
    )  # fmt: skip


@pytest.mark.parametrize("pattern", ["*.parquet", "sums-*.npz", LAST])
def test_what_is_damaged_is_simulated_again(tmp_path: Path, whole: list[bytes], pattern: str) -> None:
    stopped(tmp_path / "u", 0.5)
    file = sorted((tmp_path / "u").glob(pattern))[0]
    data = bytearray(file.read_bytes())
    # of the list a brace, of the others a value
    data[0 if pattern == LAST else len(data) // 2] ^= 1
    file.write_bytes(bytes(data))
    said: list[str] = []
    assert run(tmp_path / "u", notice=said.append)[1] == whole
    aside = tmp_path / "u.damaged-1"
    assert said == [f"starts from the beginning: {file.name} cannot be read: the checkpoint is moved to {aside}"]
    assert (aside / file.name).read_bytes() == bytes(data)


def test_a_piece_that_was_not_committed_does_not_count(tmp_path: Path, whole: list[bytes]) -> None:
    stopped(tmp_path / "u", 0.5)
    number = len(list((tmp_path / "u").glob("*.parquet")))
    (tmp_path / "u" / f"{number:06d}.parquet").write_bytes(b"half of a")
    (tmp_path / "u" / ".chipload-x").write_bytes(b"half of a")
    assert run(tmp_path / "u")[1] == whole


def test_a_watched_column_that_comes_late_is_0_before(tmp_path: Path) -> None:
    def watch(cuts: Any) -> dict[str, np.ndarray]:
        return {f"tool_{cuts.tool}": cuts.step + 1.0}

    one = remove(some_rows(), block(), CUTTERS, MATERIAL, ROUGH, watch=watch).columns
    stopped(tmp_path / "u", 0.3)
    with Checkpoint(tmp_path / "u", 0.0) as kept:
        two = remove_in_chunks(some_rows(), block(), CUTTERS, MATERIAL, ROUGH, kept, watch=watch).columns
        assert list(one) == list(two)
        at = np.flatnonzero(two["tool_2"])
        assert np.array_equal(two["tool_2"][at], at + 1.0)
        assert at[0] > 40
        for name in one:
            assert np.array_equal(one[name], two[name])


def test_a_folder_belongs_to_one_run(tmp_path: Path) -> None:
    stopped(tmp_path / "u", 0.5)
    with (
        Checkpoint(tmp_path / "u"),
        pytest.raises(InputError, match="another run uses this folder: wait for it or name"),
    ):
        Checkpoint(tmp_path / "u")
    first, second = Checkpoint(tmp_path / "v"), Checkpoint(tmp_path / "v")
    for each in (first, second):
        each.begin("key")
    first.add({"line": np.zeros(3)})
    with pytest.raises(InputError, match="another run has started there: name another result"):
        second.add({"line": np.zeros(3)})
    second.discard()
    assert (tmp_path / "v").exists()
    first.discard()
    assert not (tmp_path / "v").exists()


def test_a_folder_with_other_files_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "u").mkdir()
    (tmp_path / "u" / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="holds other files: move it or name another result"):
        Checkpoint(tmp_path / "u")
    assert (tmp_path / "u" / "letter.txt").read_text() == "dear"
    with pytest.raises(InputError, match="every_s = -1: must be at least 0 s"):
        Checkpoint(tmp_path / "w", -1.0)


def test_refused_input_leaves_nothing(tmp_path: Path) -> None:
    program = some_rows()
    unknown = replace(program, tool=np.where(np.arange(len(program)) > 12, 9, program.tool))
    with pytest.raises(InputError, match="tool 9: no"):
        run(tmp_path / "u", unknown)
    assert not (tmp_path / "u").exists()


def test_a_run_that_was_killed_before_its_result_was_written_simulates_nothing(tmp_path: Path) -> None:
    with Checkpoint(tmp_path / "u", 0.0) as kept:
        first = remove_in_chunks(some_rows(), block(), CUTTERS, MATERIAL, ROUGH, kept)
        force = first.columns["force_n"]
    stock, said = block(), list[str]()
    with Checkpoint(tmp_path / "u", notice=said.append) as kept:
        again = remove_in_chunks(some_rows(), stock, CUTTERS, MATERIAL, ROUGH, kept)
        assert np.array_equal(again.columns["force_n"], force)
    assert (again.volume_after, stock.volume()) == (first.volume_after, first.volume_after)
    assert said[0].startswith(f"continues after step {len(force)} of {len(force)}")


def test_rows_of_uneven_pieces(tmp_path: Path) -> None:
    with Checkpoint(tmp_path / "u") as kept:
        kept.begin("key")
        for first, count in ((0, 3), (3, 5), (8, 2)):
            late = {"late": first + np.arange(count) + 0.5} if first else {}
            kept.add({"line": first + np.arange(count), "rapid": np.arange(count) == 1, **late})
        some = list(in_rows(kept.columns(), 4))
        few = [{k: v.tolist() for k, v in part.items()} for part in in_rows(kept.columns(), 4, ("late",))]
    assert few == [{"late": s["late"].tolist()} for s in some]
    assert [s["line"].tolist() for s in some] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9]]
    assert [s["late"].tolist() for s in some] == [[0.0, 0.0, 0.0, 3.5], [4.5, 5.5, 6.5, 7.5], [8.5, 9.5]]
    assert [s["rapid"].dtype for s in some] == [np.bool_] * 3
