"""Feeds of divided lines beside the optimum: cutting time, and the greatest force by an oracle of its own.

    python benchmarks/feeds_divided.py [PROGRAMS]

Each program is a slot, five passes of varied step-over, a corner and an arc in 14 lines, force limit 450 N. The optimum
is the time at which every place of the path has the feed that it allows by the oracle ``tests/slot_programs.py``, which
shares no code with the package, with the acceleration of the machine; no division of lines is faster. The exit code is
1 where a program takes over 8 % more, or a force exceeds the limit.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from chipload.jobs import load_job, run_job

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from mill import made_up_material
from slot_programs import (
    COEFFICIENTS,
    JOB,
    LIMIT_N,
    MACHINE,
    allowed_feeds,
    forces,
    lines_in,
    places_of,
    program,
    total_time,
    written_feeds,
)


def new_text(text: str, divide: bool) -> tuple[str, dict[int, range], str]:
    """The text with new feeds, the lines of it that each divided line became, and the verdict."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "a.ngc").write_text(text)
        (folder / "m.toml").write_text(made_up_material(*COEFFICIENTS))
        (folder / "machine.toml").write_text(MACHINE)
        (folder / "job.toml").write_text(JOB)
        done = run_job(load_job(folder / "job.toml", [f"operation.0.feeds.divide={str(divide).lower()}"]))
    feeds = done.outcome.feeds
    return feeds.text, dict(feeds.segments), done.result.verdict.value


def main() -> int:
    """Run the programs, compare, print."""
    number, bad = int(sys.argv[1]) if len(sys.argv) > 1 else 3, False
    for seed in range(number):
        text, lines = program(seed)
        places = places_of(lines)
        best = total_time(places, allowed_feeds(places))
        for divide in (False, True):
            new, segments, verdict = new_text(text, divide)
            feed = written_feeds(new, places, lines_in(lines, segments))
            time, force = total_time(places, feed), float(forces(places, feed).max())
            print(
                f"program {seed}, {'divided' if divide else 'one feed a line'}: {time:.2f} s, "
                f"{100.0 * (time / best - 1.0):+.1f} % of the optimum {best:.2f} s; greatest force {force:.1f} of "
                f"{LIMIT_N:g} N; {sum(map(len, segments.values()))} segments in {len(segments)} lines; {verdict}",
                flush=True,
            )
            bad |= divide and (time > 1.08 * best or force > LIMIT_N)
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
