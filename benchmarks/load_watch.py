"""False alarms of the watch of a running program, and the faults that it finds, on synthetic streams.

Each stream is a cell that is drawn from the prior of coefficients and efficiency, with its own clock, idle power and
noise of 1 to 5 % of the greatest power. Without a fault: alarms and hours in the cut. With each fault: the share of
streams in which its alarm is raised, and the median time from its begin. Then the same of programs whose cuts last 0.3
to 1.5 s: without a fault, without the stock of one, two or three cuts, and with a tool that breaks.

    python benchmarks/load_watch.py [--streams 400] [--faulty 100]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from synthetic_stream import FAULTS, alarms_of, stream, with_fault, without_cuts


def is_false(streams: int, first: int, *, short: bool) -> bool:
    """Print the alarms of streams without a fault; whether they are more than are stated."""
    found, cut, judged = 0, 0.0, 0.0
    for seed in range(first, first + streams):
        some, watch = alarms_of(stream(seed, short=short))
        found, cut, judged = found + len(some), cut + watch.cut_seconds, judged + watch.judged_seconds
        for alarm in some:
            print(f"stream {seed}: {alarm}")
    hours = cut / 3600.0
    print(
        f"{streams} streams without a fault{', of short cuts' if short else ''}: {found} alarms in {hours:.1f} h in "
        f"the cut, {100.0 * judged / cut:.0f} % of it judged; stated: at most {0.1 * hours:.1f}"
    )
    return bool(found > 0.1 * hours + 2.0 * np.sqrt(0.1 * hours))


def main() -> int:
    """Print alarms and faults; return 1 where more false alarms are raised than are stated, or a fault is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--streams", type=int, default=400)
    parser.add_argument("--faulty", type=int, default=100)
    given = parser.parse_args()
    begin = time.process_time()
    bad = is_false(given.streams, 10_000, short=False)
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
    bad |= is_false(given.streams, 20_000, short=True)
    for count, name in ((1, "one short cut"), (2, "two short cuts"), (3, "three short cuts"), (None, "a broken tool")):
        hits, times = 0, []
        for seed in range(given.faulty):
            one = stream(70_000 + seed, short=True)
            power, start = without_cuts(one, count)
            own = [float(f.text.split()[0]) for f in alarms_of(one, power)[0] if f.code == "watch-air"]
            hits += bool(own)
            times += [x - start for x in own[:1]]
        after = f", {np.median(times):.1f} s after its begin (median)" if times else ""
        print(f"{name} without load: found in {hits} of {given.faulty}{after}")
    bad |= hits < 0.95 * given.faulty
    print(f"{time.process_time() - begin:.0f} s of processor time")
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
