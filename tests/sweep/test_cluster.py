"""A sweep on a scheduler and two workers that are processes of their own, one of which is killed in the middle."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import chipload.workers as workers_module
from chipload.cli import app
from chipload.jobs import FinishedJob, load_job, run_job
from chipload.jobs.impeller import surface_search
from chipload.jobs.impeller.checkpoint import part_bytes
from chipload.result.summary import summary_bytes
from chipload.sweep.run import run_sweep
from chipload.workers import WorkerDied, Workers, run_tasks
from conftest import EXAMPLES
from impeller_job import impeller_job, impeller_outcome
from slot_job import slot_job
from worker_tasks import always_killed, shared_sum

distributed = pytest.importorskip("distributed", reason="no distributed: no sweep on a cluster")

#: 12 small jobs
OVER = ("limits.torque_nm=0.2,0.3,0.4,0.5,0.6,0.7", "operation.0.step_mm=2.0,1.5")


@pytest.fixture
def cluster(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a scheduler, and its two workers: no process restarts one that ends. Its parameter: environment."""
    # the tasks of a test are modules beside it
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)} | getattr(request, "param", {})
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

        begun("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--dashboard-address", "127.0.0.1:0")
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
    job = slot_job(tmp_path / "job")
    job.write_text(job.read_text() + "[checks]\nconfidence = 0.5\n")
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
    assert [r["state"] for r in swept.records] == ["exceeds"] * 4 + ["holds"] * 8


def test_a_cluster_whose_workers_are_all_gone_is_said(cluster, monkeypatch):
    address, _ = cluster
    monkeypatch.setattr(workers_module, "PATIENCE_S", 1.0)
    with pytest.raises(WorkerDied, match="no worker is left: start workers; the same command continues"):
        list(run_tasks(always_killed, [(1,)], dask=address))


def test_a_cluster_shares_a_value_for_its_tasks(cluster):
    address, _ = cluster
    with Workers(dask=address).team() as team:
        for size, total in ((3, 3.0), (5, 10.0)):
            team.share(np.arange(float(size)))
            assert sorted(team.completed_shared(shared_sum, [(k,) for k in range(4)])) == [
                (k, total + k) for k in range(4)
            ]


@pytest.mark.parametrize("cluster", [{"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}], indirect=True)
def test_a_task_that_kills_as_many_workers_as_are_allowed_is_named(cluster):
    address, _ = cluster
    with pytest.raises(WorkerDied, match="task 1"):
        list(run_tasks(always_killed, [(1,)], dask=address))


#: a piece of each side of a blade
SIDES = """[[surface]]
body = "blade"
side = "plus"
along = [0.30, 0.36]
up = [0.50, 0.60]
points = [2, 2]

[[surface]]
body = "blade"
side = "minus"
along = [0.30, 0.36]
up = [0.50, 0.60]
points = [2, 2]

"""


@pytest.fixture(scope="module")
def impeller(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example with two small surfaces and without programs."""
    text = (EXAMPLES / "impeller" / "job.toml").read_text()
    text = text[: text.index("[[surface]]")] + SIDES + text[text.index("[[operation]]") :]
    text = text[: text.index("[operation.rough]")]
    text = re.sub(r"^(hand_picked|tolerance_mm|most_cutters).*\n", "", text, flags=re.MULTILINE)
    text = text.replace("check_mm = 3.0\n", "check_mm = 4.0\ntable_deg = [55.0, 70.0]\nmost_cutters = 1\n")
    file = tmp_path_factory.mktemp("impeller") / "job.toml"
    file.write_text(text)
    return file


def numbers(done: FinishedJob) -> tuple[list[bytes], Any]:
    """The answer of each surface as bytes, and the summary but for the time that the search took."""

    def timeless(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: timeless(v) for k, v in value.items() if k != "search_s"}
        return [timeless(v) for v in value] if isinstance(value, list) else value

    return [part_bytes(s.answer) for s in done.outcome.surfaces], timeless(json.loads(summary_bytes(done.result, {})))


def test_surfaces_of_an_impeller_are_searched_by_processes_and_on_a_cluster(impeller, cluster, monkeypatch):
    """In two blocks of each surface."""
    address, _ = cluster
    alone = numbers(run_job(load_job(impeller)))
    assert len(alone[0]) == 2
    assert alone[0][0] != alone[0][1]
    monkeypatch.setattr(surface_search, "PAIRS", 4)
    for where in (Workers(dask=address), Workers(2)):
        told: list[str] = []
        spread = run_job(load_job(impeller), lambda _, what, told=told: told.append(what), workers=where)
        assert "search, 4 of 4 parts" in told
        assert numbers(spread) == alone


def test_programs_of_an_impeller_on_a_cluster_that_loses_a_worker_are_those_of_one_process(cluster, tmp_path):
    """Paths, links, rest passes and checks; the worker that is left does what the other had begun."""
    address, workers = cluster
    job = impeller_job(tmp_path)
    alone = impeller_outcome(run_job(load_job(job)))
    assert len(alone[0]) > 1
    with distributed.Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=300)
    ended: list[str] = []

    def progress(_: float, what: str) -> None:
        if what.startswith("paths of patches, ") and not ended:
            os.kill(workers[0].pid, signal.SIGKILL)
            workers[0].wait()
            ended.append(what)

    spread = impeller_outcome(run_job(load_job(job), progress, workers=Workers(dask=address)))
    assert ended
    assert ended[0].split()[3] < ended[0].split()[5]
    assert workers[1].poll() is None
    assert spread == alone


def numbers_of(done: FinishedJob) -> Any:
    return json.loads(summary_bytes(done.result, {}))


def test_a_job_without_such_parts_is_refused(job_dir, tmp_path):
    slot = slot_job(tmp_path / "slot")
    words = ["--out", str(tmp_path / "result"), "--workers"]
    done = CliRunner().invoke(app, ["run", str(job_dir / "job.toml"), *words, "2"])
    assert done.exit_code == 2
    assert "a contour job has no parts that other processes can compute" in done.output
    assert not (tmp_path / "result").exists()
    words = ["run", str(slot), *words]
    assert "--workers = 0: must be from 1 to 1024" in CliRunner().invoke(app, [*words, "0"]).output
