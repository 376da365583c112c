"""The stocks of several tracks of one blank, made side by side, are those made one after the other."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chipload.report import removal
from chipload.report.presentation import Blank
from chipload.report.removal import removal_bytes, removal_meshes
from square import MILL, ROWS, STOCK, square_result


def test_stocks_made_by_threads_are_those_made_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    one = square_result("cut")
    (own,) = one.tracks
    parts = {f"part {k}": {name: column[: ROWS // k] for name, column in own.columns.items()} for k in (1, 2, 3, 4)}
    tracks = tuple(
        replace(own, name=name, limits=(), findings=(), blocks=lambda table=table: iter([table]))
        for name, table in parts.items()
    )
    result = replace(one, tracks=tracks)
    blanks = {name: Blank(STOCK, {1: MILL}) for name in parts}
    # the third is refused: its bottom is open
    open_box = STOCK.copy()
    open_box.update_faces(open_box.face_normals[:, 2] > -0.5)
    blanks["part 3"] = Blank(open_box, {1: MILL})
    written = []
    for threads in (1, 3):
        monkeypatch.setattr(removal, "threads", lambda threads=threads: threads)
        stocks = removal_meshes(result, blanks)
        assert [*stocks.meshes] == [0, 1, 3]
        assert "the mesh is not closed" in stocks.refused[2]
        written.append(removal_bytes(result, stocks, blanks))
    assert written[0] == written[1]
    # each has its own rows
    assert len({mesh.volumes[-1] for mesh in stocks.meshes.values()}) == 3
