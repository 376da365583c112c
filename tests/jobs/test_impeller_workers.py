"""An impeller whose paths, links, rest passes and checks other processes make has the bytes of one process."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from chipload.errors import Cancelled
from chipload.jobs import FinishedJob, load_job, run_job
from chipload.jobs.impeller import paths as checks
from chipload.jobs.impeller import surface_search
from chipload.jobs.impeller.checkpoint import part_bytes
from chipload.planning.impeller import settings
from chipload.simulation.checkpoint import Checkpoint
from chipload.workers import Workers
from impeller_job import STOCK, impeller_job, impeller_outcome


def test_programs_made_by_processes_are_those_of_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = impeller_job(tmp_path)
    made: list[str] = []
    for module, name in ((settings, "finish_tracks"), (checks, "left_on"), (checks, "deepest_gouge")):
        here = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *a, name=name, here=here, **k: (made.append(name), here(*a, **k))[1])
    alone = impeller_outcome(run_job(load_job(file)))
    assert len(alone[0]) > 1
    first = {name: made.count(name) for name in made}
    assert len(first) == 3
    made.clear()
    assert impeller_outcome(run_job(load_job(file), workers=Workers(2))) == alone
    # other processes import their own; what stands alone in its round is made by this one
    assert all(made.count(name) <= first[name] - 2 for name in first)


def searched(done: FinishedJob) -> list[bytes]:
    """Answer and one cutter of each surface as bytes."""
    return [part_bytes((s.answer, s.one.cutter, s.one.table, s.one.ranges)) for s in done.outcome.surfaces]


def test_one_surface_is_searched_by_processes_in_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the run is stopped after the first blocks and goes on."""
    file = impeller_job(tmp_path)
    text = file.read_text().replace(STOCK, "")
    first = text.index("[[surface]]")
    text = (
        text[: text.index("[[surface]]", first + 1)]
        + text[text.index("[[operation]]") : text.index("[operation.paths]")]
    )
    file.write_text(re.sub(r"^points = .*$", "points = [4, 3]", text, flags=re.MULTILINE))
    alone = searched(run_job(load_job(file)))
    monkeypatch.setattr(surface_search, "PAIRS", 9)
    told: list[str] = []

    def progress(_: float, what: str) -> None:
        told.append(what)
        if what.startswith("search, 2 of"):
            raise Cancelled("stopped")

    with pytest.raises(Cancelled), Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        run_job(load_job(file), progress, checkpoint, workers=Workers(2))
    assert "search, 1 of 4 parts" in told
    told.clear()
    with Checkpoint(tmp_path / "kept", 0.0) as checkpoint:
        done = run_job(load_job(file), lambda _, what: told.append(what), checkpoint, workers=Workers(2))
    # two of the four blocks were kept
    assert [what for what in told if what.startswith("search, ")] == ["search, 1 of 2 parts", "search, 2 of 2 parts"]
    assert searched(done) == alone
