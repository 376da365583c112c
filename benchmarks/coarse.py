"""`chipload run --coarse` beside `chipload run`: processor time and the worst value of each limit.

    python benchmarks/coarse.py [EXAMPLE ...]

Start-up (libraries, report) is part of both times: about 3 s.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

EXAMPLES = ("bracket", "plate", "blade")


def seconds(job: Path, out: Path, *more: str) -> tuple[float, dict[str, float]]:
    """Processor time [s] of a run, and the worst value of each limit."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "chipload", "run", job, "--out", out, *more], stdout=subprocess.DEVNULL, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    limits = json.loads((out / "summary.json").read_text())["limits"]
    return after.ru_utime - before.ru_utime, {c["name"]: c["worst"] for c in limits}


def main() -> None:
    """Run each example both ways."""
    for name in sys.argv[1:] or EXAMPLES:
        with tempfile.TemporaryDirectory() as above:
            folder = Path(above) / name
            subprocess.run([sys.executable, "-m", "chipload", "example", name, folder], check=True, capture_output=True)
            fine, whole = seconds(folder / "job.toml", Path(above) / "fine")
            quick, first = seconds(folder / "job.toml", Path(above) / "coarse", "--coarse")
        values = ", ".join(f"{k} {first[k]:.4g} ({v:.4g})" for k, v in whole.items() if v and first.get(k) is not None)
        print(f"{name}: {quick:.1f} s of {fine:.1f} s ({100.0 * quick / fine:.0f} %); {values}", flush=True)


if __name__ == "__main__":
    main()
