"""A sweep of many small jobs on one process, on two and on Dask, the last two also with a worker killed: equal bytes.

    python benchmarks/sweep.py [--jobs 200] [--write]

The job is a slot of 36 mm; step and limit vary. ``--write`` puts the table into docs/sweep.md. Times are by the clock
and in processor time of all processes with their start, all in one run. On two cores that have nothing else to do two
processes take half of their processor time by the clock. A case holds what chipload was when it ran: do not edit the
source meanwhile.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import re
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from chipload.sweep.run import run_sweep
from slot_job import slot_job

PAGE = Path(__file__).parents[1] / "docs" / "sweep.md"
BEGIN, END = "<!-- benchmarks/sweep.py -->", "<!-- end -->"


def tree(folder: Path) -> str:
    """One hash of the names and bytes of all cases."""
    out = sha256()
    for path in sorted((folder / "cases").rglob("*")):
        if path.is_file():
            out.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
    return out.hexdigest()


@contextmanager
def one_killed(cases: Path, after: int, named: Callable[[], int]) -> Iterator[None]:
    """Kill the worker whose process ``named`` gives with SIGKILL as soon as ``after`` cases are done."""
    done = threading.Event()

    def watch() -> None:
        while not done.wait(0.05):
            if len(list(cases.glob("*.json"))) >= after:
                os.kill(named(), signal.SIGKILL)
                return

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def own_process() -> int:
    """The first of the processes that this one started."""
    return next(child.pid for child in multiprocessing.active_children() if child.pid is not None)


def measured(run: Callable[[], object], out: Path) -> tuple[float, str]:
    """Time by the clock [s] and hash of the cases."""
    begin = time.perf_counter()
    run()
    return time.perf_counter() - begin, tree(out)


def processor_time() -> float:
    """Processor time [s] of this process and of all that it started and that have ended."""
    for child in multiprocessing.active_children():
        child.join(10.0)
    return sum(os.times()[:4])


def table(jobs: int) -> list[str]:
    """The rows: where it ran, both times, whether the bytes are those of the first."""
    from distributed import LocalCluster

    rows: list[tuple[str, float, str]] = []
    spent = [processor_time()]
    with tempfile.TemporaryDirectory(prefix="chipload-sweep-") as above:
        folder = Path(above)
        job = slot_job(folder, step=0.5, end=28.0)
        steps = ",".join(f"{0.4 + 0.02 * k:.2f}" for k in range(10))
        limits = ",".join(f"{0.2 + 0.05 * k:.2f}" for k in range(-(-jobs // 10)))
        over = (f"operation.0.step_mm={steps}", f"limits.torque_nm={limits}")

        def of(name: str, **where: object) -> None:
            out = folder / name
            rows.append((name, *measured(lambda: run_sweep(job, over, out, **where), out)))
            print(f"{name}: {rows[-1][1]:.1f} s, load {os.getloadavg()[0]:.0f}", file=sys.stderr)

        of("one process")
        spent.append(processor_time())
        of("two processes", workers=2)
        spent.append(processor_time())
        with one_killed(folder / "two, one killed" / "cases", jobs // 2, own_process):
            of("two, one killed", workers=2)
        spent.append(processor_time())
        with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
            of("Dask, two workers", dask=cluster.scheduler_address)
        spent.append(processor_time())
        with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
            first_worker = next(iter(cluster.workers.values()))
            with one_killed(folder / "Dask, one killed" / "cases", jobs // 2, lambda: int(first_worker.pid)):
                of("Dask, one killed", dask=cluster.scheduler_address)
        spent.append(processor_time())
    first = rows[0]
    return [
        f"| {name} | {seconds:.1f} | {spent[k + 1] - spent[k]:.1f} | "
        f"{'the same' if found == first[2] else 'DIFFERENT'} |"
        for k, (name, seconds, found) in enumerate(rows)
    ]


def main() -> None:
    """Print the table, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=200, help="a multiple of 10")
    parser.add_argument("--write", action="store_true", help="into docs/sweep.md")
    chosen = parser.parse_args()
    head = f"| {chosen.jobs // 10 * 10} jobs on | time [s] | processor time [s] | bytes of all cases |"
    lines = [head, "|---|---:|---:|---|", *table(chosen.jobs)]
    load = f"Load of the computer during the measurement: {os.getloadavg()[1]:.0f}, on {os.cpu_count()} cores."
    text = "\n".join([*lines, "", load])
    print(text)
    if chosen.write:
        page = PAGE.read_text(encoding="utf-8")
        if BEGIN not in page:
            page += f"\n## Measured\n\nBy `python benchmarks/sweep.py --write`, times by the clock.\n\n{BEGIN}{END}\n"
        made = re.sub(f"{BEGIN}.*{END}", lambda _: f"{BEGIN}\n\n{text}\n\n{END}", page, flags=re.DOTALL)
        PAGE.write_text(made, encoding="utf-8")


if __name__ == "__main__":
    main()
