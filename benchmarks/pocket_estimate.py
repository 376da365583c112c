"""Processor time of pocket jobs for each step that `chipload check` estimates.

    python benchmarks/pocket_estimate.py FILE ...

A file is a job or a drawing; a drawing becomes the job that `chipload init` drafts. `chipload run` of each job runs in
its own process, the first one once more before, so that its loops are compiled. Columns: estimated steps, processor
time of the run [s], the same without the start for each estimated step [ms], the range that the estimate states [s],
and whether the time lies in it.
"""

import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from chipload.jobs.contour.estimate import QUICK, SLOW
from chipload.simulation.estimate import START


def chipload(*words: object) -> tuple[str, float]:
    """Output of a command, and its processor time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-m", "chipload", *map(str, words)], capture_output=True, text=True, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1, 3):
        raise SystemExit(f"chipload {' '.join(map(str, words))}: {done.stdout}{done.stderr}")
    return done.stdout, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main(files: list[str]) -> None:
    """Print a row for each job."""
    with tempfile.TemporaryDirectory() as folder:
        jobs = []
        for k, file in enumerate(files):
            job = Path(file)
            if job.suffix != ".toml":
                job = Path(folder) / f"job{k}" / "job.toml"
                chipload("init", file, job.parent)
            jobs.append((Path(file), job))
        print("| job | steps | s | ms a step | estimated [s] | |")
        print("|---|---|---|---|---|---|", flush=True)
        for k, (file, job) in enumerate([jobs[0], *jobs]):
            said, _ = chipload("check", job)
            steps = re.search(r"^estimate: (\d+) steps", said, re.MULTILINE)
            if steps is None:
                raise SystemExit(f"{file}: no estimate: state a job that clears a pocket")
            _, seconds = chipload("run", job, "--accept", "--out", Path(folder) / f"out{k}")
            if k:
                count = int(steps[1])
                low, high = START[0] + QUICK * count, START[1] + SLOW * count
                inside = "inside" if low <= seconds <= high else "outside"
                each, name = 1e3 * (seconds - START[0]) / count, f"{file.stem} of {file.parent.name}"
                cells = (name, count, f"{seconds:.0f}", f"{each:.2f}", f"{low:.0f} to {high:.0f}", inside)
                print(f"| {' | '.join(map(str, cells))} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
