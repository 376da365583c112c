"""Lines a second that our reader and LinuxCNC's interpreter read, on the same texts in one run.

    python benchmarks/reading.py [FILE ...]

Without files: a generated five-axis text of 100,000 lines (X Y Z A C at G94, then half of it at G93) and, where
CHIPLOAD_DATA names the data, its largest program. Each is read three times, the best counts; ``rs274 -g`` prints to
nothing. Without LinuxCNC its columns are empty.
"""

import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from chipload.program.gcode.reader import read_gcode_file


def generated(lines: int) -> str:
    """A path on a sphere, tilted: every block moves five axes."""
    out = ["G21 G17 G90 G94", "T1 M6", "S8000 M3", "G0 X0 Y0 Z60 A0 C0"]
    for k in range(lines - 6):
        a, b = 0.001 * k, 0.37 * k
        if k == lines // 2:
            out.append("G93")
        x, y, z = (50 * math.sin(a) * math.cos(b), 50 * math.sin(a) * math.sin(b), 50 * math.cos(a))
        feed = "F600" if k < lines // 2 else f"F{80 + k % 7}"
        out.append(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} A{20 * math.sin(a):.4f} C{math.degrees(b) % 360:.4f} {feed}")
    return "\n".join([*out, "G94", "M2"]) + "\n"


def best(call) -> float:
    """Least wall time of three."""
    times = []
    for _ in range(3):
        begun = time.perf_counter()
        call()
        times.append(time.perf_counter() - begun)
    return min(times)


def by_rs274(path: Path, folder: Path) -> None:
    """Let LinuxCNC's interpreter read a program."""
    table = folder / "tool.tbl"
    table.write_text("".join(f"T{n} P{n} D1\n" for n in range(1, 100)))
    call = ["rs274", "-g", "-t", str(table), "-v", str(folder / "rs274.var"), str(path)]
    env = {**os.environ, "HOME": str(folder)}
    subprocess.run(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True, cwd=folder, env=env)


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = [Path(x).absolute() for x in sys.argv[1:]]
        if not paths:
            (folder / "five-axis-100k.ngc").write_text(generated(100_000))
            paths = [folder / "five-axis-100k.ngc"]
            real = Path(os.environ.get("CHIPLOAD_DATA", "../shared/data")) / "nc" / "camotics" / "cameo" / "cameo.nc"
            paths += [real.absolute()] if real.is_file() else []
        print("| program | lines | ours [lines/s] | rs274 [lines/s] | ours / rs274 |\n|---|---|---|---|---|")
        for path in paths:
            lines = len(path.read_bytes().splitlines())
            ours = lines / best(lambda path=path: read_gcode_file(path))
            if shutil.which("rs274"):
                other = lines / best(lambda path=path: by_rs274(path, folder))
                print(f"| {path.name} | {lines} | {ours:.0f} | {other:.0f} | {ours / other:.2f} |")
            else:
                print(f"| {path.name} | {lines} | {ours:.0f} | not here | |")


if __name__ == "__main__":
    main()
