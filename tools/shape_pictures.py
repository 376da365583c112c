"""Make the pictures of the impellers of others anew: each is planned, and the 3D view of its result photographed.

    CHIPLOAD_DATA=FOLDER python tools/shape_pictures.py [NAME ...] [--results FOLDER]

writes docs/design/impeller_NAME.png: blades, the path of the finishing program, its cutter in a pass. With
``--results`` nothing is planned: FOLDER is the ``--out`` of ``benchmarks/impeller_shapes.py``.

Needs Chromium and playwright. Look at what changed before it is committed.
"""

from __future__ import annotations

import argparse
import re
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

sys.path.insert(0, str(Path(__file__).parent.parent / "benchmarks"))
from impeller_shapes import SHAPES, row
from pictures import CHROMIUM, DRAWN, FLAGS, VIEW, fewer_colours

OUT = Path(__file__).parent.parent / "docs" / "design"
#: width and height of the window, in which the 3D view is a part [pixels]
WINDOW = {"width": 1600, "height": 1100}
#: turns the view: round beside the tip and up [deg], nearer to the tip
LOOK = f"""([beside, high, near]) => {{
    const v = {VIEW}, c = v.camera.position, tip = v.path.tip(v.place, c.clone());
    const round = Math.atan2(tip.y, tip.x) + beside * Math.PI / 180, up = high * Math.PI / 180;
    v.lookFrom(c.clone().set(Math.cos(round) * Math.cos(up), Math.sin(round) * Math.cos(up), Math.sin(up)));
    v.closer(near);
}}"""
#: the part of the page with the 3D view and its scales
BOX = """() => {
    const a = document.querySelector('.cl-stage').getBoundingClientRect();
    return {x: a.x, y: a.y, width: a.width, height: a.height};
}"""


@dataclass(frozen=True)
class Pose:
    """How a result is looked at: at which share of the time, from how far round beside the tip and from how high [deg],
    and how near to the tip the picture is (0 to 1).
    """

    time: float
    beside: float
    high: float
    near: float


POSES = {
    "kj66": Pose(0.5, 60.0, 25.0, 0.32),
    "pyturbo": Pose(0.7, -60.0, 35.0, 0.3),
    # from below, where the plus side of its blades is seen
    "rotor": Pose(0.3, 60.0, -35.0, 0.3),
}


def photograph(chromium: Browser, result: Path, pose: Pose, out: Path) -> None:
    """Write the 3D view of a result."""
    words = [sys.executable, "-m", "chipload", "view", str(result.parent), "--no-open"]
    server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+", line)))
        page = chromium.new_page(viewport=WINDOW)  # type: ignore[arg-type]
        page.set_default_timeout(120_000)
        page.goto(f"{address}&show={result.name}")
        page.wait_for_selector(".cv-ramp")
        page.wait_for_selector(".cl-now")
        page.wait_for_function(DRAWN)
        slider = page.locator(".cl-slider")
        slider.click(position={"x": pose.time * slider.bounding_box()["width"], "y": 8})
        page.wait_for_function(f"{VIEW}.row > 10")
        page.evaluate(LOOK, [pose.beside, pose.high, pose.near])
        page.wait_for_function(f"!{VIEW}.dirty")
        page.wait_for_timeout(2000)
        box = page.evaluate(BOX)
        page.screenshot(path=out, clip=box)
        page.close()
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(30)
    fewer_colours(out)


def main() -> None:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description="Make the pictures of the impellers of others anew.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(SHAPES)}")
    parser.add_argument(
        "--results", type=Path, metavar="FOLDER", help="with the results of benchmarks/impeller_shapes.py"
    )
    given = parser.parse_args()
    names = given.names or [*SHAPES]
    if unknown := set(names) - {*SHAPES}:
        parser.error(f"{', '.join(sorted(unknown))}: must be of {', '.join(SHAPES)}")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        for name in names:
            result = (given.results or Path(folder)) / name
            if not given.results:
                print(row(name, result, 1), flush=True)
            photograph(chromium, result, POSES[name], OUT / f"impeller_{name}.png")
        chromium.close()


if __name__ == "__main__":
    main()
