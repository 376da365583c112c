"""Make the pictures of the documentation anew: each example is run as it is shipped, and its report photographed.

    python tools/pictures.py [NAME ...] [--results FOLDER]     all, or those of docs/NAME.png

With ``--results`` the examples are not run: FOLDER holds the result of each as EXAMPLE/result.

Needs Chromium and playwright, and as long as the examples take. Look at what changed before it is committed.
"""

from __future__ import annotations

import argparse
import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from chipload.examples import copy_example

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from web_lists import choose

DOCS = Path(__file__).parent.parent / "docs"
CHROMIUM = "/usr/bin/chromium"
FLAGS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
#: figures of the report side by side, each with width and height [pixels]; none: the top of the report
FIGURES: dict[str, tuple[tuple[str, int, int], ...]] = {
    "contour": (("along-0", 860, 760),),
    "feeds": (("feeds", 1000, 760),),
    "chatter": (("stability", 500, 460), ("margin", 500, 460)),
    "bracket": (("view3d", 560, 640), ("loads", 430, 860)),
    "part": (("bent", 700, 480),),
    "tube": (("path", 900, 860),),
    "cone": (("allowable", 900, 380),),
    "plate": (("depth", 940, 520),),
    "blade": (("space", 940, 560),),
}
#: the 3D view of the page, and that it and the plots are drawn
VIEW = "chiploadViewer.of(document.querySelector('.cl-stage').id)"
SECOND = "chiploadViewer.of(document.querySelector('.cl-second').id)"
DRAWN = f"{VIEW}.frames > 0 && document.querySelectorAll('.cl-figure .trace').length > 0"
#: pictures of the page: the example that each shows, and the track that it is compared with; none: none
PAGES = {"page": ("bracket", ""), "page_compare": ("feeds", "original"), "page_impeller": ("impeller", "")}
#: keys that shorten an example for its picture: a part of each surface, one cutter
SHORTER = {
    "page_impeller": (
        "operation.0.most_cutters=1",
        *(f"surface.{k}.{key}" for k in range(3) for key in ("along=[0.42, 0.58]", "points=[6, 5]")),
    )
}
#: what the 3D view of a picture does: where it stands, from where it is looked at, from how far
POSED = {
    "page_impeller": f"{{ const v = {VIEW}, c = v.camera.position; "
    "v.lookFrom(c.clone().set(0.85, -0.45, 0.75).normalize()); c.lerp(v.path.tip(v.place, c.clone()), 0.35);"
    "v.controls.update(); v.dirty = true; }"
}
#: moves figures into a sheet of their own, above the page
SHEET = """(wanted) => {
    const sheet = document.createElement('div');
    sheet.id = 'sheet';
    sheet.style = 'position:absolute;top:0;left:0;background:white;display:flex;z-index:9';
    document.body.appendChild(sheet);
    window.scrollTo(0, 0);
    for (const [name, width, height] of wanted) {
        const figure = document.getElementById(name);
        figure.style.width = width + 'px';
        figure.style.height = height + 'px';
        sheet.appendChild(figure);
    }
}"""
RESIZE = """async (wanted) => {
    for (const [name, width, height] of wanted) {
        const figure = document.getElementById(name);
        if (!figure.data) continue;
        await Plotly.newPlot(figure, figure.data, {...figure.layout, width, height}, {displayModeBar: false});
    }
}"""


def photograph(page: Page, report: Path, name: str) -> None:
    """Write docs/NAME.png from a report."""
    page.goto(report.as_uri())
    page.wait_for_timeout(3000)
    wanted = [list(figure) for figure in FIGURES[name]]
    out = DOCS / f"{name}.png"
    if not wanted:
        page.screenshot(path=out)
        return
    page.evaluate(SHEET, wanted)
    page.wait_for_timeout(3000)
    page.evaluate(RESIZE, wanted)
    page.wait_for_timeout(1000)
    page.locator("#sheet").screenshot(path=out)


def photograph_page(chromium: Browser, folder: Path, name: str) -> None:
    """Write docs/NAME.png: the page of a result, by itself or beside another track along the path."""
    words = [sys.executable, "-m", "chipload", "view", str(folder), "--no-open"]
    server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+", line)))
        page = chromium.new_page(viewport={"width": 1280, "height": 720})
        page.set_default_timeout(120_000)
        page.goto(f"{address}&show=result")
        page.wait_for_selector(".cv-ramp")
        page.wait_for_selector(".cl-now")
        other = PAGES[name][1]
        if name in POSED:
            page.locator(".cl-slider").click(
                position={"x": 0.8 * page.locator(".cl-slider").bounding_box()["width"], "y": 8}
            )
            page.wait_for_function(f"{VIEW}.row > 100")
        if other:
            choose(page, "compare with", other)
            page.wait_for_selector(".cl-compared", state="visible")
            page.locator(".cl-plots").get_by_text("path", exact=True).last.click()
            page.wait_for_function(f"{VIEW}.paired && {SECOND}.frames > 0")
            # near the end of the path
            page.locator(".cl-slider").click(
                position={"x": 0.9 * page.locator(".cl-slider").bounding_box()["width"], "y": 8}
            )
        page.wait_for_function(DRAWN, timeout=120_000)
        if other:
            page.wait_for_timeout(3000)
            page.wait_for_function(f"{VIEW}.row > 100 && !{VIEW}.dirty && !{SECOND}.dirty")
        if name in POSED:
            page.evaluate(POSED[name])
            page.wait_for_function(f"!{VIEW}.dirty")
            page.wait_for_timeout(2000)
        page.screenshot(path=DOCS / f"{name}.png")
        page.close()
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(30)


def fewer_colours(path: Path) -> None:
    """Store a picture with at most 256 colours: half the size and less."""
    with Image.open(path) as picture:
        picture.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


def run(job: Path, name: str) -> int:
    """Run the job of a folder as its picture wants it; the exit code."""
    words = [sys.executable, "-m", "chipload", "run", str(job / "job.toml"), "--out", str(job / "result")]
    words += [word for key in SHORTER.get(name, ()) for word in ("--set", key)]
    return subprocess.run(words, check=False).returncode


def main() -> int:
    """Run the examples and make their pictures."""
    parser = argparse.ArgumentParser(description="Make the pictures of the documentation anew.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join((*PAGES, *FIGURES))}")
    parser.add_argument("--results", type=Path, metavar="FOLDER", help="with results of the examples")
    given = parser.parse_args()
    names = given.names or [*PAGES, *FIGURES]
    unknown = set(names) - {*PAGES, *FIGURES}
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: must be of {', '.join((*PAGES, *FIGURES))}")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=CHROMIUM,
            args=list(FLAGS),
        )
        page = chromium.new_page(viewport={"width": 860, "height": 1266})
        for name in names:
            example = PAGES.get(name, (name, ""))[0]
            job = given.results / example if given.results else copy_example(example, Path(folder) / name / example)
            if not given.results and (code := run(job, name)) not in (0, 3):
                return code
            if name in PAGES:
                photograph_page(chromium, job, name)
            else:
                photograph(page, job / "result" / "report.html", name)
            fewer_colours(DOCS / f"{name}.png")
            print(f"docs/{name}.png", flush=True)
        chromium.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
