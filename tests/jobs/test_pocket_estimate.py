"""`chipload check` says how many steps a pocket takes; the plan takes about as many."""

from __future__ import annotations

from pathlib import Path

import pytest

from chipload.errors import InputError
from chipload.jobs import load_job
from chipload.jobs.coarse import coarser
from pocket_job import SQUARE, checked, done, operation, written


def test_steps_of_a_pocket_before_and_after_it_is_planned(tmp_path: Path) -> None:
    """30 x 24 mm in passes of 1.5 mm, steps of 0.4 mm become 0.06 R: 720 / 1.5 / 0.24 = 2000; two levels, one path."""
    more = 'radial_depth_mm = 1.5\ndepth_mm = 8.0\nstrategies = ["pocket"]\n'
    path = written(tmp_path, {"0": [SQUARE]}, operation(more))
    lines, _ = checked(path)
    # 4 to 12 s, and 0.05 to 1.5 ms a step
    assert lines[-1] == "estimate: 2000 steps, 351 MB of memory, 4 to 15 s"
    (strategy,), _ = done(path)
    # the bore that the cutter enters by spares passes, corners ask for more
    assert 0.6 < len(next(iter(strategy.history.values()))) / (2 * 2000) < 1.8


def test_each_strategy_of_each_pocket_counts(tmp_path: Path) -> None:
    one = operation('radial_depth_mm = 1.5\nstrategies = ["pocket", "trochoidal"]\nuse = "pocket"\n')
    lines, _ = checked(written(tmp_path, {"0": [SQUARE]}, one))
    assert lines[-1].startswith("estimate: 4000 steps")


def test_a_pocket_has_no_coarse_run(tmp_path: Path) -> None:
    """One drawing took 35 s as its job stated it, and 48 s coarse."""
    path = written(tmp_path, {"0": [SQUARE]}, operation('radial_depth_mm = 1.5\nstrategies = ["pocket"]\n'))
    with pytest.raises(InputError, match="longer steps take more passes to clear a pocket, and leave more: leave it"):
        coarser(load_job(path))
