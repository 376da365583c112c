"""An impeller whose paths, links, rest passes and checks other processes make has the bytes of one process."""

from __future__ import annotations

from pathlib import Path

import pytest

from chipload.jobs import load_job, run_job
from chipload.jobs.impeller import paths as checks
from chipload.planning.impeller import settings
from chipload.workers import Workers
from impeller_job import impeller_job, impeller_outcome


def test_programs_made_by_processes_are_those_of_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = impeller_job(tmp_path)
    made: list[str] = []
    for module, name in ((settings, "finishing"), (checks, "left_on"), (checks, "deepest_gouge")):
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
