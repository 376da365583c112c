"""A sweep on a scheduler and two workers that are processes of their own, one of which is killed in the middle."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

import chipload.sweep.workers as workers_module
from chipload.sweep.run import run_sweep
from chipload.sweep.workers import WorkerDied, completed
from killed_tasks import always_killed

pytest.importorskip("distributed", reason="no distributed: no sweep on a cluster")

SLOT = "G21 G90 G94\nT1 M6\nS3000 M3\nG0 X-8 Y5 Z5\nG1 Z-2 F300\nX8\nG0 Z5\nM2\n"
JOB = """[program]
file = "slot.ngc"
[machine]
name = "vmc"
[stock]
low_mm = [0.0, 0.0, -6.0]
high_mm = [20.0, 10.0, 0.0]
[material]
name = "al7075-t6"
[[cutter]]
number = 1
diameter_mm = 6.0
flutes = 2
helix_deg = 30.0
flute_length_mm = 18.0
overhang_mm = 25.0
modulus_gpa = 580.0
[[operation]]
kind = "simulate"
step_mm = 2.0
[limits]
torque_nm = 5.0
"""
#: 12 small jobs
OVER = ("limits.torque_nm=0.2,0.3,0.4,0.5,0.6,0.7", "operation.0.step_mm=2.0,1.5")


@pytest.fixture
def cluster(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a scheduler, and its two workers: no process restarts one that ends. Its parameter: environment."""
    environment = os.environ | getattr(request, "param", {})
    file = tmp_path / "scheduler.json"
    words = [sys.executable, "-m", "dask"]
    named = ["--scheduler-file", str(file)]
    with ExitStack() as stack:

        def begun(*more: str) -> subprocess.Popen[bytes]:
            with (tmp_path / f"{more[0]}.log").open("ab") as log:
                process = subprocess.Popen(
                    [*words, *more, *named], stdout=log, stderr=log, cwd=tmp_path, env=environment
                )
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        begun("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        begin = time.monotonic()
        while not file.exists() and time.monotonic() - begin < 120.0:
            time.sleep(0.05)
        workers = [begun("worker", "--no-nanny", "--nthreads", "1", "--no-dashboard") for _ in range(2)]
        yield json.loads(file.read_text())["address"], workers


def tree(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_a_worker_that_is_killed_in_the_middle_loses_nothing(cluster, tmp_path):
    """The bytes are those of one process, and the worker that is left did the rest."""
    address, workers = cluster
    (tmp_path / "slot.ngc").write_text(SLOT)
    job = tmp_path / "job.toml"
    job.write_text(JOB)
    ended: list[int] = []

    def progress(done: float, _: str) -> None:
        cases = round(12 * done)
        if cases == 3:
            os.kill(workers[0].pid, signal.SIGKILL)
            workers[0].wait()
            ended.append(cases)

    alone = run_sweep(job, OVER, tmp_path / "alone")
    swept = run_sweep(job, OVER, tmp_path / "dask", dask=address, progress=progress)
    assert ended == [3]
    assert workers[1].poll() is None
    assert tree(tmp_path / "alone") == tree(tmp_path / "dask")
    assert [r["state"] for r in swept.records] == [r["state"] for r in alone.records]
    assert {r["state"] for r in swept.records} == {"holds", "exceeds"}


def test_a_cluster_whose_workers_are_all_gone_is_said(cluster, monkeypatch):
    address, _ = cluster
    monkeypatch.setattr(workers_module, "PATIENCE_S", 1.0)
    with pytest.raises(WorkerDied, match="no worker is left: start workers; the same command continues"):
        list(completed(always_killed, [(1,)], dask=address))


@pytest.mark.parametrize("cluster", [{"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}], indirect=True)
def test_a_task_that_kills_as_many_workers_as_are_allowed_is_named(cluster):
    address, _ = cluster
    with pytest.raises(WorkerDied, match="task 1"):
        list(completed(always_killed, [(1,)], dask=address))
