"""Time of programs beside a real LinuxCNC, counted in servo cycles of 1 ms.

    python benchmarks/cycle_time.py [--data DIR] [--run | --record]
    python benchmarks/cycle_time.py --random N [--first SEED]

Without `--run` the counts are those that are recorded in `tests/cycle_counts/cycles.json`; `--run` counts them again
with the LinuxCNC of this computer (in real time: some ten minutes), `--record` counts the programs that are not
recorded there yet and writes them. `--random` counts new programs of lines and arcs that meet at corners, in G64
without and with P, which are recorded nowhere.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

HERE = Path(__file__).parents[1] / "tests" / "cycle_counts"
sys.path.insert(0, str(HERE.parent))

from cycle_counts.clock import cycles_of, machine_of  # noqa: E402
from cycle_counts.cycles import installed, servo_cycles  # noqa: E402
from cycle_counts.programs import digest, own_programs, random_programs, real_programs, recorded  # noqa: E402


def counted(programs: dict[str, tuple[str, str]]) -> dict[str, tuple[str, int]]:
    """Servo cycles of a real LinuxCNC."""
    out = {}
    for letters in ("XYZ", "XYZAC"):
        some = [(name, text) for name, (axes, text) in programs.items() if axes == letters]
        found = servo_cycles(some, letters) if some else []
        for (name, text), count in zip(some, found, strict=True):
            out[name] = (digest(text), count)
    return out


def main() -> int:
    """Count or read, compare, print."""
    parser = argparse.ArgumentParser(description="Time of programs beside a real LinuxCNC.")
    parser.add_argument("--data", type=Path, help="folder of real programs")
    parser.add_argument("--run", action="store_true", help="count again")
    parser.add_argument("--record", action="store_true", help="count what is not recorded yet, and keep it")
    parser.add_argument("--random", type=int, default=0, help="count this many new programs of lines and arcs")
    parser.add_argument("--first", type=int, default=1000, help="seed of the first of them")
    args = parser.parse_args()
    own = random_programs(args.first, args.random) if args.random else own_programs()
    args.run |= args.random > 0
    programs = own | (real_programs(args.data) if args.data else {})
    if (args.run or args.record) and not installed():
        print("linuxcnc is not installed: apt-get install linuxcnc-uspace", file=sys.stderr)
        return 2
    counts = counted(programs) if args.run else recorded()
    if args.record:
        known = {name for name, (_, text) in programs.items() if counts.get(name, ("", 0))[0] == digest(text)}
        counts |= counted({name: program for name, program in programs.items() if name not in known})
        (HERE / "cycles.json").write_text(json.dumps(counts, indent=1) + "\n")
    print(f"| {'program':44} | LinuxCNC s | chipload s | difference % |\n| :-- | --: | --: | --: |")
    differences = []
    for name, (letters, text) in programs.items():
        if name in counts and counts[name][0] == digest(text):
            ours, real = cycles_of(text, machine_of(letters)), counts[name][1]
            differences.append(100.0 * (ours / real - 1.0))
            print(f"| {name:44} | {1e-3 * real:10.3f} | {1e-3 * ours:10.3f} | {differences[-1]:12.2f} |")
    near = sum(abs(difference) <= 1.0 for difference in differences)
    print(f"\n{near} of {len(differences)} programs within 1 %, greatest difference {max(map(abs, differences)):.2f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
