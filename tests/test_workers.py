"""A team of processes: it stays, shares a value, and begins again what a killed process had."""

from __future__ import annotations

import os
import subprocess
import sys
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


SCRIPT = """import os, sys
from chipload.workers import Workers
from worker_tasks import process_of, waits

print("main", flush=True)
with Workers(2).team() as team:
    print(*{pid for _, pid in team.completed(process_of, [(k,) for k in range(8)])}, flush=True)
    list(team.completed(waits, [(k,) for k in range(2)]))
"""


def test_processes_do_not_outlive_a_killed_caller_nor_run_its_script(tmp_path: Path) -> None:
    """The script has no guard: its processes would run it again."""
    (tmp_path / "script.py").write_text(SCRIPT)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    words = [sys.executable, str(tmp_path / "script.py")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, env=environment, text=True) as caller:
        assert caller.stdout is not None
        assert caller.stdout.readline() == "main\n"
        assert caller.stdout.readline().split()
        caller.kill()
        # the pipe ends with the last of them
        assert caller.communicate(timeout=60.0) == ("", None)
