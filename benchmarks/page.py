"""The page with a history of 100,000 steps: time to the first picture and until it moves, bytes sent, memory.

    python benchmarks/page.py [--steps 100000]
    python benchmarks/page.py --pictures 3

With ``--pictures`` results of 1,000 and of 100,000 steps are opened in turn, so often each: time to the first picture,
and the processor time of server and browser until then, in which other work on the computer does not count.

Makes a result by formula (a spiral through a block), serves it, opens it in Chromium without a window. Frames a second
are those of software GL: no graphics card draws. Also the processor time of making the stock over all rows, and the
size of report.html.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh

from chipload.cutter.cutter import Cutter
from chipload.report.folder import write_result
from chipload.report.presentation import Blank, Presentation
from chipload.report.removal import removal_meshes
from chipload.result import LimitCheck, Provenance, Result, Track, TrackKind, Verdict, in_memory

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
VIEW = "chiploadViewer.of(document.querySelector('.cl-stage').id)"


def made(steps: int) -> tuple[Result, dict[str, Blank]]:
    """A spiral of ``steps`` steps of 0.1 mm through a block of 200 x 200 mm, over and over, deeper each time."""
    s = 0.1 * np.arange(steps)
    radius = 4.0 + (0.02 * s) % 90.0
    turn = np.cumsum(0.1 / radius)
    table = {
        "t_s": s / 20.0, "s_mm": s, "x_mm": radius * np.cos(turn), "y_mm": radius * np.sin(turn),
        "z_mm": -2.0 - 2.0 * np.floor(0.02 * s / 90.0), "line": np.arange(steps) // 10 + 1,
        "tool": np.ones(steps, dtype=np.int64), "force_n": 300.0 + 100.0 * np.sin(3.0 * turn),
        "torque_nm": 3.0 + np.sin(5.0 * turn),
    }  # fmt: skip
    limits = (
        LimitCheck(
            "force_n", 500.0, float(table["force_n"].max()), Verdict.HOLDS, "program", 10, 1, resolution_error=0.0
        ),
    )
    track = Track("program", TrackKind.PROGRAM, True, float(table["t_s"][-1]), limits, (), (), blocks=in_memory(table))
    result = Result("program", "spiral", (track,), ({"kind": "simulate"},), (), (), Provenance({}, (), "vmc", {}, {}))
    block = trimesh.creation.box(bounds=[[-110.0, -110.0, -30.0], [110.0, 110.0, 0.0]])
    return result, {"program": Blank(block, {1: Cutter(10.0, 3, 0.5, 30.0, 45.0, 6e5)})}


def memory_mb(process: int) -> float:
    """Resident memory of a process [MB]."""
    return float(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{process}/status").read_text())[1]) / 1e3  # type: ignore[index]


def processor_s(process: int) -> float:
    """Processor time of a process and of all that it started [s]."""
    own = {int(p.parent.name): p.read_text().rsplit(")", 1)[1].split() for p in Path("/proc").glob("[0-9]*/stat")}
    family, ticks = [process], 0
    for one in family:
        family += [number for number, fields in own.items() if int(fields[1]) == one]
        # its own time, and that of children that have ended
        ticks += sum(map(int, own[one][11:15]))
    return ticks / os.sysconf("SC_CLK_TCK")


def written(steps: int, folder: Path) -> Path:
    """A result of so many steps in a folder."""
    result, blanks = made(steps)
    scene = trimesh.Scene([trimesh.creation.box()]).export(file_type="glb", extension_webp=False)
    return write_result(result, Presentation(lambda _: [], lambda: scene, blanks=lambda: blanks), folder)


def pictures(count: int) -> None:
    """Print the time to the first picture of a short and of a long history, opened in turn."""
    from playwright.sync_api import sync_playwright

    sizes = (1_000, 100_000)
    with tempfile.TemporaryDirectory() as folder:
        for steps in sizes:
            written(steps, Path(folder) / f"r{steps}")
        words = [sys.executable, "-m", "chipload", "view", folder, "--no-open"]
        server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env={**os.environ})
        try:
            address = next(m[0] for line in server.stdout if (m := re.search(r"http://\S+", line)))  # type: ignore[union-attr]
            found: dict[int, list[tuple[float, ...]]] = {steps: [] for steps in sizes}
            with sync_playwright() as p:
                # the first window loads the libraries of the server
                for k in range(count + 1):
                    for steps in sizes:
                        browser = p.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
                        page = browser.new_page(viewport={"width": 1280, "height": 720})
                        page.set_default_timeout(300_000)
                        start, spent = time.monotonic(), [processor_s(one) for one in (os.getpid(), server.pid)]
                        page.goto(f"{address}&show=r{steps}")
                        page.wait_for_selector(".cv-ramp")
                        page.wait_for_function(f"{VIEW}.frames > 0")
                        if k:
                            now = [processor_s(one) for one in (os.getpid(), server.pid)]
                            took = (after - before for after, before in zip(now, spent, strict=True))
                            found[steps].append((time.monotonic() - start, *took))
                        browser.close()
            least = {steps: tuple(min(one[i] for one in found[steps]) for i in (0, 1, 2)) for steps in sizes}
            for steps, (wall, all_s, server_s) in least.items():
                print(f"{steps} steps: first picture after {wall:.1f} s, {all_s:.1f} s of processor time, of which the "
                      f"server took {server_s:.1f} s")  # fmt: skip
            short, long = (least[steps] for steps in sizes)
            print(f"ratio: {long[0] / short[0]:.2f} by the clock, {long[1] / short[1]:.2f} by processor time")
        finally:
            server.send_signal(signal.SIGINT)
            server.wait(30)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--pictures", type=int, metavar="N", help="compare first pictures, opened N times each")
    given = parser.parse_args()
    if given.pictures is not None:
        pictures(given.pictures)
        return
    steps = given.steps
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder:
        result, blanks = made(steps)
        start = time.process_time()
        mesh = removal_meshes(result, blanks).meshes[0]
        print(f"stock at all rows: {time.process_time() - start:.1f} s processor time, {len(mesh.corners)} quads, "
              f"{len(mesh.rows)} frames, cells of {mesh.cell.max():.2g} mm")  # fmt: skip
        scene = trimesh.Scene([trimesh.creation.box()]).export(file_type="glb", extension_webp=False)
        out = write_result(result, Presentation(lambda _: [], lambda: scene, blanks=lambda: blanks), Path(folder) / "r")
        for name in ("report.html", "removal.npz"):
            print(f"{name}: {(out / name).stat().st_size / 1e6:.2f} MB")
        words = [sys.executable, "-m", "chipload", "view", folder, "--no-open"]
        server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env={**os.environ})
        try:
            address = next(m[0] for line in server.stdout if (m := re.search(r"http://\S+", line)))  # type: ignore[union-attr]
            with sync_playwright() as p:
                browser = p.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
                page = browser.new_page(viewport={"width": 1280, "height": 720})
                page.set_default_timeout(300_000)
                sent = [0]
                page.on("response", lambda r: sent.__setitem__(0, sent[0] + int(r.headers.get("content-length", 0))))
                page.on("websocket", lambda w: w.on(
                    "framereceived", lambda d: sent.__setitem__(0, sent[0] + len(d))))  # fmt: skip
                start = time.monotonic()
                page.goto(f"{address}&show=r")
                page.wait_for_selector(".cv-ramp")
                page.wait_for_function(f"{VIEW}.frames > 0")
                print(f"first picture after {time.monotonic() - start:.1f} s")
                page.keyboard.press("End")
                page.wait_for_function(f"{VIEW}.row == {steps - 1}")
                print(f"moves after {time.monotonic() - start:.1f} s")
                print(f"sent: {sent[0] / 1e6:.1f} MB; server: {memory_mb(server.pid):.0f} MB resident")
                page.keyboard.press("Home")
                page.wait_for_function(f"{VIEW}.row == 0")
                page.keyboard.press("Space")
                before = page.evaluate(f"{VIEW}.frames")
                page.wait_for_timeout(5000)
                print(f"playing: {(page.evaluate(f'{VIEW}.frames') - before) / 5.0:.1f} frames a second, software GL")
                browser.close()
        finally:
            server.send_signal(signal.SIGINT)
            server.wait(30)


if __name__ == "__main__":
    main()
