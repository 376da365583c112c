"""False alarms of the watch of a running program, and the faults that it finds, on synthetic streams.

Each stream is a cell that is drawn from the prior of coefficients and efficiency, with its own clock, idle power and
noise of 1 to 5 % of the greatest power. Without a fault: alarms and hours in the cut. With each fault: the share of
streams in which its alarm is raised, and the median time from its begin.

    python benchmarks/load_watch.py [--streams 400] [--faulty 100]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from synthetic_stream import FAULTS, alarms_of, stream, with_fault


def main() -> int:
    """Print alarms and faults; return 1 where more false alarms are raised than are stated, or a fault is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--streams", type=int, default=400)
    parser.add_argument("--faulty", type=int, default=100)
    given = parser.parse_args()
    begin, found, cut, judged = time.process_time(), 0, 0.0, 0.0
    for seed in range(given.streams):
        some, watch = alarms_of(stream(10_000 + seed))
        found, cut, judged = found + len(some), cut + watch.cut_seconds, judged + watch.judged_seconds
        for alarm in some:
            print(f"stream {10_000 + seed}: {alarm}")
    hours = cut / 3600.0
    print(
        f"{given.streams} streams without a fault: {found} alarms in {hours:.1f} h in the cut, "
        f"{100.0 * judged / cut:.0f} % of it judged; stated: at most {0.1 * hours:.1f}"
    )
    bad = found > 0.1 * hours + 2.0 * np.sqrt(0.1 * hours)
    for fault in FAULTS:
        hits, times, count = 0, [], 0
        for seed in range(given.faulty):
            one = stream(50_000 + seed)
            made = with_fault(one, fault)
            if made is None:
                continue
            count += 1
            own = [f for f in alarms_of(one, made[0])[0] if f.code == fault]
            hits += bool(own)
            start = one.time[one.cuts if made[1] is None else made[1]][0]
            times += [float(f.text.split()[0]) - start for f in own[:1]]
        print(f"{fault}: found in {hits} of {count}, {np.median(times):.1f} s after its begin (median)")
        bad |= hits < 0.95 * count
    print(f"{time.process_time() - begin:.0f} s of processor time")
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
