"""What three logs of the spindle are worth to the feeds of the example ``feeds``: textbook coefficients, then learned.

The machine is the simulation with Ktc 6 % and Kte 10 % below the textbook, an efficiency of 0.85 that is known to 2 %,
2 % noise and the line of the program. The program of the CAM system runs three times; then its feeds are found with the
textbook spread of 25 %, and with what was learned.

    python benchmarks/knowledge_worth.py
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from chipload import examples, jobs
from chipload.cli import app


def main() -> int:
    """Print what ``chipload learn`` says."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "feeds"
        shutil.copytree(Path(examples.__file__).parent / "feeds", folder)
        text, metal = (folder / "job.toml").read_text(), (folder / "al7075-t6.toml").read_text()
        named = text.replace('file = "al7075-t6.toml"', 'name = "al7075-t6"')
        before, after = named.split("[operation.feeds]")
        ran = before + after[after.index("[limits]") :]
        (folder / "next.toml").write_text(named)
        (folder / "ran.toml").write_text(ran)
        (folder / "true.toml").write_text(metal.replace("767.01", "720.0").replace("= 27.7", "= 25.0"))
        (folder / "machine.toml").write_text(ran.replace('name = "al7075-t6"', 'file = "true.toml"'))
        history = jobs.run_job(jobs.load_job(folder / "machine.toml")).result.in_use[0].columns
        rng, logs = np.random.default_rng(0), []
        for k in range(3):
            t = np.arange(0.0, history["t_s"][-1], 0.05)
            row = np.searchsorted(history["t_s"], t)
            power = 300.0 + history["power_w"][row] / 0.85 * (1.0 + 0.02 * rng.standard_normal())
            rows = zip(t, power + 8.0 * rng.standard_normal(len(t)), history["line"][row], strict=True)
            logs.append(folder / f"log{k}.csv")
            logs[-1].write_text("time_s,power_w,line\n" + "".join(f"{a:.3f},{p:.2f},{line}\n" for a, p, line in rows))
        words = ["learn", *map(str, logs), "--job", str(folder / "ran.toml"), "--next", str(folder / "next.toml")]
        words += ["--out", str(folder / "shop.toml"), "--efficiency", "0.85", "--efficiency-error", "0.02"]
        done = CliRunner().invoke(app, words)
        print(done.output)
        return done.exit_code


if __name__ == "__main__":
    sys.exit(main())
