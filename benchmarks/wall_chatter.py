"""Chatter along the plate of the examples: frequencies followed through the removal, and those of the uncut wall.

The example is planned as it is shipped, by deflection alone. Its program with variable depth is simulated once more
with a cutter whose mode is stated, and every step is asked for its margin twice: with the modes that the wall has then,
the lesser of before and after the pass, and with those that it has before the first pass.

    python benchmarks/wall_chatter.py --set operation.0.scallop_um=60
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from chipload.examples import copy_example
from chipload.jobs import load_job
from chipload.jobs.thinwall.chatter import FIRST_STATE
from chipload.jobs.thinwall.inputs import read_wall
from chipload.jobs.thinwall.places import places_of
from chipload.jobs.thinwall.tries import Tried, constant_within, unlimited_plan, variable_within

DYNAMICS = """
[dynamics]
damping_ratio = {damping}
modes = {modes}
margin = 1.0
[[dynamics.mode]]
frequency_hz = 1400.0
damping_ratio = 0.03
stiffness_n_um = 12.0
"""


def told(share: float, what: str) -> None:
    """How far it is."""
    print(f"\r{100 * share:3.0f} % {what:40s}", end="", file=sys.stderr)


def main() -> None:
    """Print the margins of both, and where they lead to another verdict."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override of the job")
    parser.add_argument("--modes", type=int, default=2, help="modes of the wall")
    parser.add_argument("--damping", type=float, default=0.01, help="damping ratio of the wall")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = copy_example("plate", Path(folder) / "plate") / "job.toml"
        path.write_text(path.read_text("utf-8") + DYNAMICS.format(modes=args.modes, damping=args.damping), "utf-8")
        places = places_of(read_wall(load_job(path, tuple(args.set)).job))
        begun = time.process_time()
        planned = Tried(replace(places, chatter=None), told)
        free = planned.prove(unlimited_plan(planned.places), 0.25)
        constant, corrections = constant_within(planned, free)
        variable_within(planned, corrections, constant)
        planning = time.process_time() - begun
        begun = time.process_time()
        found = Tried(places, told).prove(planned.planned["variable"], 1.0)
    seconds = time.process_time() - begun
    columns = found.columns
    cuts = np.asarray(columns["chip_areas"]) > 0
    followed, start = (np.asarray(columns[name])[cuts] for name in ("stability_margin", FIRST_STATE))
    passes = np.asarray(columns["pass"])[cuts]
    print(f"\nplanned in {planning:.0f} s, simulated with margins in {seconds:.0f} s of processor time")
    print(f"{cuts.sum()} steps that cut, in {len(set(passes))} passes")
    print(f"least margin: followed {followed.min():.3f}, uncut wall {start.min():.3f}")
    print(f"steps below 1: followed {(followed < 1.0).sum()}, uncut wall {(start < 1.0).sum()}")
    print(
        f"chatters, though stable with the modes of the uncut wall: {((followed < 1.0) & (start >= 1.0)).sum()} steps"
    )
    print(f"stable, though not with the modes of the uncut wall: {((followed >= 1.0) & (start < 1.0)).sum()} steps")
    ratio = followed / start
    print("followed over uncut wall: " + ", ".join(f"p{q} {np.percentile(ratio, q):.3f}" for q in (1, 50, 99)))
    print("| pass | least margin, followed | of the uncut wall | steps with another verdict |")
    print("|---|---:|---:|---:|")
    for name in dict.fromkeys(passes.tolist()):
        own = passes == name
        differs = int(((followed[own] < 1.0) != (start[own] < 1.0)).sum())
        print(f"| {name} | {followed[own].min():.3f} | {start[own].min():.3f} | {differs} |")


if __name__ == "__main__":
    main()
