"""Sweeps: combinations, samples, the same bytes on any workers, and what is kept of a killed one."""

from __future__ import annotations

import csv
import itertools
import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from chipload import workers
from chipload.cli import app
from chipload.cutting.material import material_named, material_names, material_text, read_material
from chipload.errors import InputError
from chipload.jobs import load_job
from chipload.sweep.cases import Samples, cases_of
from chipload.sweep.run import Combination, SweepResult, run_sweep
from chipload.sweep.table import job_text, pareto
from chipload.workers import WorkerDied, run_tasks
from conftest import EXAMPLES
from slot_job import slot_job
from worker_tasks import always_killed, killed_once

OVER = ("cutter.0.diameter_mm=8,10", "operation.0.feed_mm_min=600,900")


@pytest.fixture(scope="module")
def job(tmp_path_factory) -> Path:
    """The contour example with coarse steps and one strategy: a third of a second for a case."""
    folder = tmp_path_factory.mktemp("job") / "contour"
    shutil.copytree(EXAMPLES / "contour", folder)
    text = (folder / "job.toml").read_text()
    for was, now in (("step_mm = 0.05", "step_mm = 0.2"), ('["plain", "backward", "feed"]', '["backward"]')):
        assert was in text
        text = text.replace(was, now)
    (folder / "job.toml").write_text(text + "[checks]\nconfidence = 0.5\n")
    return folder / "job.toml"


@pytest.fixture(scope="module")
def alone(job, tmp_path_factory) -> Path:
    """The sweep in one process."""
    out = tmp_path_factory.mktemp("alone")
    done = CliRunner().invoke(app, ["sweep", str(job), "--out", str(out), *(w for o in OVER for w in ("--over", o))])
    assert done.exit_code == 0, done.output
    assert "best: cutter.0.diameter_mm=10, operation.0.feed_mm_min=600: holds in 16.5 s" in done.output
    return out


def tree(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_combinations_are_those_of_the_product():
    cases = cases_of(["a=1,2", "b.c=x", 'd=[1, 2],"u,v",3'], samples=2)
    assert len(cases) == 12
    assert [c.number for c in cases] == list(range(1, 13))
    product = itertools.product(("a=1", "a=2"), ("b.c=x",), ("d=[1, 2]", 'd="u,v"', "d=3"))
    assert [c.overrides for c in cases if c.sample == 1] == list(product)
    assert [c.combination for c in cases] == [k for k in range(1, 7) for _ in (1, 2)]


@pytest.mark.parametrize(
    ("over", "words"),
    [
        (["diameter"], "must be key.path=value,value"),
        (["a=1,,2"], "a value is empty"),
        (["a=1", "a=2"], "named twice"),
        (["a=[1,2"], "Unclosed array"),
        (["a=" + ",".join(map(str, range(1001))), "b=" + ",".join(map(str, range(101)))], "at most 100000"),
    ],
)
def test_what_is_no_sweep_is_refused(over, words):
    with pytest.raises(InputError, match=words):
        cases_of(over)


def test_a_material_is_written_as_it_is_read(tmp_path):
    for name in material_names():
        (tmp_path / "m.toml").write_text(material_text(material_named(name)))
        again = read_material(tmp_path / "m.toml")
        for field in ("coefficients", "spread", "exponents", "chip", "tangential", "source", "cutter"):
            assert getattr(again, field) == getattr(material_named(name), field), (name, field)
        if again.speed is not None:
            assert again.speed == pytest.approx(material_named(name).speed, rel=1e-15)


def test_samples_have_the_spread_of_the_material():
    material = material_named("al7075-t6")
    drawn = np.array([m.coefficients for m in Samples(512).of(material)])
    stated = np.array(material.coefficients)
    np.testing.assert_allclose(drawn.mean(axis=0), stated, rtol=0.01)
    np.testing.assert_allclose(drawn.std(axis=0), material.spread * stated, rtol=0.05)
    np.testing.assert_allclose(np.corrcoef(drawn.T)[~np.eye(6, dtype=bool)], 0.5, atol=0.05)
    assert [m.coefficients for m in Samples(8, seed=3).of(material)] == [
        m.coefficients for m in Samples(8, seed=3).of(material)
    ]


def test_the_table_has_a_row_for_each_combination(alone):
    rows = list(csv.DictReader((alone / "sweep.csv").read_text().splitlines()))
    assert [(r["cutter.0.diameter_mm"], r["operation.0.feed_mm_min"]) for r in rows] == [
        ("8", "600"), ("8", "900"), ("10", "600"), ("10", "900"),
    ]  # fmt: skip
    assert [r["state"] for r in rows] == ["exceeds", "exceeds", "holds", "exceeds"]
    for k, row in enumerate(rows, 1):
        summary = json.loads((alone / "cases" / f"case-{k:06d}" / "summary.json").read_text())
        assert row["state"] == summary["verdict"]
        worst = {limit["name"]: limit["worst"] for limit in summary["limits"]}
        assert float(row["force_xy_n"]) == pytest.approx(worst["force_xy_n"], rel=1e-8)
        time_s = [t["time_s"] for t in summary["tracks"] if t["in_use"]]
        assert float(row["time_s"]) == pytest.approx(sum(time_s), rel=1e-8)


def test_the_best_job_is_a_job(alone):
    loaded = load_job(alone / "best.toml")
    assert loaded.job.table.cutter[0].diameter_mm == 10.0
    assert loaded.job.table.operation[0].feed_mm_min == 600.0
    assert "# " in (alone / "best.toml").read_text()


def test_the_best_job_has_the_values_as_its_cases_had_them(tmp_path):
    """A file of one's own replaces a name, its path is that from the sweep; .5 is a number."""
    job = slot_job(tmp_path / "job")
    (job.parent / "own.toml").write_text(material_text(material_named("al6082-t6")))
    values = (("material.file", "own.toml"), ("operation.0.step_mm", ".5"), ("checks.chip_space", "false"))
    out = tmp_path / "sweep"
    out.mkdir()
    (out / "best.toml").write_text(job_text(job, Combination(1, values, ()), out))
    table = load_job(out / "best.toml").job.table
    assert (table.material.name, table.material.file) == (None, "../job/own.toml")
    assert table.operation[0].step_mm == 0.5
    assert table.checks.chip_space is False


def test_a_pool_and_a_cluster_give_the_same_bytes(alone, job, tmp_path):
    run_sweep(job, OVER, tmp_path / "pool", workers=2)
    own = {name: data for name, data in tree(alone).items() if name.startswith("cases")}
    assert own == tree(tmp_path / "pool")
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0") as cluster:
        run_sweep(job, OVER, tmp_path / "dask", dask=cluster.scheduler_address)
    assert own == tree(tmp_path / "dask")


def test_a_finished_case_is_not_run_again(alone, job, tmp_path):
    out = tmp_path / "again"
    shutil.copytree(alone, out)
    marked = out / "cases" / "case-000002" / "history.parquet"
    marked.write_bytes(b"kept")
    (out / "cases" / "case-000003.json").unlink()
    shutil.rmtree(out / "cases" / "case-000003")
    run_sweep(job, OVER, out)
    assert marked.read_bytes() == b"kept"
    assert (out / "cases" / "case-000003" / "summary.json").is_file()
    # another value of a key is another case
    changed = run_sweep(job, ("cutter.0.diameter_mm=8,9",), out)
    assert changed.records[1]["overrides"] == ["cutter.0.diameter_mm=9"]


def test_a_refused_case_is_a_row(job, tmp_path):
    done = run_sweep(job, ("cutter.0.flutes=3,-1",), tmp_path)
    assert [c.refused for c in done.combinations] == [False, True]
    assert "cutter.0.flutes = -1" in done.records[1]["message"]


def test_the_probability_is_that_of_the_normal_distribution(tmp_path):
    """The torque is linear in the coefficients: the share below a limit follows from its mean and deviation."""
    limit = 0.38
    done = run_sweep(
        slot_job(tmp_path / "job"),
        (f"limits.torque_nm={limit}", "checks.confidence=0.5"),
        tmp_path,
        samples=Samples(32),
    )
    torque = np.array([record["limits"]["torque_nm"]["worst"] for record in done.records])
    (combination,) = done.combinations
    low, high = combination.interval
    assert low <= norm.cdf((limit - torque.mean()) / torque.std()) <= high
    # a sample within the resolution error of its limit is unproven
    assert int((1.02 * torque <= limit).sum()) <= combination.holding <= int((torque <= limit).sum())
    assert done.best is None


def test_a_killed_worker_loses_nothing(tmp_path):
    tasks = [(str(tmp_path / "flag"), k) for k in range(6)]
    assert sorted(run_tasks(killed_once, tasks, workers=2)) == [(k, k * k) for k in range(6)]


def test_a_task_that_always_kills_is_named():
    with pytest.raises(WorkerDied, match="its worker died 3 times"):
        list(run_tasks(always_killed, [(1,), (2,)], workers=2))


def test_a_stopped_sweep_goes_on(alone, job, tmp_path):
    words = [sys.executable, "-m", "chipload", "sweep", str(job), "--out", str(tmp_path / "s"), "--workers", "2"]
    process = subprocess.Popen([*words, *(w for o in OVER for w in ("--over", o))], stderr=subprocess.PIPE)
    cases = tmp_path / "s" / "cases"
    while process.poll() is None and not list(cases.glob("*.json")):
        time.sleep(0.05)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate()
    assert process.returncode in (0, 130), err
    run_sweep(job, OVER, tmp_path / "s")
    assert tree(cases) == tree(alone / "cases")


def test_the_pareto_front_by_brute_force():
    rng = np.random.default_rng(4)
    made = [
        Combination(k, (), ({"state": "holds", "time_s": float(t), "use_of_limits": float(u)},))
        for k, (t, u) in enumerate(rng.integers(0, 9, (60, 2)))
    ]
    front = {(c.time_s, c.use_of_limits) for c in pareto(made)}
    points = {(c.time_s, c.use_of_limits) for c in made}
    assert front == {p for p in points if not any(q != p and q[0] <= p[0] and q[1] <= p[1] for q in points)}


def test_numbers_out_of_range_are_refused(job, tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "ANSWER_S", 0.5)
    for given in ({"workers": 0}, {"confidence": 0.0}, {"dask": "tcp://127.0.0.1:1"}):
        with pytest.raises(InputError, match=r"workers|confidence|no scheduler answers"):
            run_sweep(job, OVER, tmp_path, **given)
    with pytest.raises(InputError, match="samples"):
        Samples(-1)
    assert SweepResult(cases_of([]), ({"state": "exceeds", "time_s": 1.0, "use_of_limits": 2.0},)).best is None
