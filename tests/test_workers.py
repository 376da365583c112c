"""A team of processes: it stays, shares a value, and begins again what a killed process had."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from chipload.workers import Workers
from worker_tasks import killed_once, process_of, shared_sum


def test_a_team_stays_and_shares_what_it_was_given_last() -> None:
    tasks = [(k,) for k in range(6)]
    with Workers(2).team() as team:
        team.share(np.arange(3.0))
        assert sorted(team.completed_shared(shared_sum, tasks)) == [(k, 3.0 + k) for k in range(6)]
        first = {pid for _, pid in team.completed(process_of, tasks)}
        team.share(np.arange(5.0))
        assert sorted(team.completed_shared(shared_sum, tasks)) == [(k, 10.0 + k) for k in range(6)]
        # either of the two may do all
        assert len({pid for _, pid in team.completed(process_of, tasks)} | first) <= 2
        # one task alone is not sent away
        assert [*team.completed_shared(shared_sum, tasks[:1])] == [(0, 10.0)]
        assert [*team.completed(process_of, tasks[:1])] == [(0, os.getpid())]
    assert os.getpid() not in first


def test_a_process_of_a_team_that_is_killed_is_replaced(tmp_path: Path) -> None:
    with Workers(2).team() as team:
        team.share(np.arange(3.0))
        tasks = [(str(tmp_path / "flag"), k) for k in range(4)]
        assert sorted(team.completed(killed_once, tasks)) == [(k, k * k) for k in range(4)]
        assert sorted(team.completed_shared(shared_sum, [(1,), (2,)])) == [(0, 4.0), (1, 5.0)]


@pytest.mark.parametrize("processes", [1, 2])
def test_what_a_task_raises_is_raised(processes: int) -> None:
    with Workers(processes).team() as team:
        team.share(np.arange(3.0))
        with pytest.raises(TypeError):
            list(team.completed_shared(shared_sum, [("a",), ("b",)]))
