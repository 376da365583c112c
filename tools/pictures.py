"""Photographs of the reports and of the page of results, for README.md and the pages of docs/; see tools/figures.py.

Needs Chromium and playwright.
"""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from web_lists import choose
from web_questions import QUESTIONS, ask, take_back

DOCS = Path(__file__).parent.parent / "docs"
EXAMPLES = Path(__file__).parent.parent / "src" / "chipload" / "examples"
CHROMIUM = "/usr/bin/chromium"
FLAGS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
#: pictures of the report: figures side by side, each with width and height [pixels]
FIGURES: dict[str, tuple[tuple[str, int, int], ...]] = {
    "contour": (("along-0", 860, 760),),
    "pocket": (("plan-0", 900, 560),),
    "trunnion": (("view3d", 900, 520),),
    "chips": (("chip", 960, 560),),
    "feeds": (("feeds", 1000, 760),),
    "chatter": (("stability", 500, 460), ("margin", 500, 460)),
    "bracket": (("view3d", 560, 640), ("loads", 430, 860)),
    "part": (("bent", 700, 480),),
    "frame": (("view3d", 860, 620),),
    "tube": (("path", 900, 860),),
    "cone": (("allowable", 900, 380),),
    "plate": (("depth", 940, 520),),
    "blade": (("space", 940, 560),),
    "notebooks": (("loads", 960, 900),),
    "impeller": (("view3d", 920, 660),),
    "hecc": (("space-0", 920, 580),),
}
#: the 3D view of the page, and that it and the plots are drawn
VIEW = "chiploadViewer.of(document.querySelector('.cl-stage').id)"
SECOND = "chiploadViewer.of(document.querySelector('.cl-second').id)"
DRAWN = f"{VIEW}.frames > 0 && document.querySelectorAll('.cl-figure .trace').length > 0"
#: pictures of the page: the example that each shows, and the track that it is compared with; none: none
PAGES = {"page": ("bracket", ""), "page_compare": ("feeds", "original"), "page_impeller": ("impeller", "")}
#: what the 3D view of a picture does: where it stands, from where it is looked at, from how far
POSED = {
    "page_impeller": f"{{ const v = {VIEW}, c = v.camera.position; "
    "v.lookFrom(c.clone().set(0.85, -0.45, 0.75).normalize()); v.closer(0.35); }"
}
#: pictures of the 3D view alone: the example, and what the view does; the greatest deflection is that of one step
SCENES = {
    "part_deflection": (
        "part",
        f"""{{ const v = {VIEW}, map = v.header.maps.find(m => m.moved), at = v.doc.f4(map.positions),
        values = v.doc.f4(map.values); let k = 0; values.forEach((x, i) => {{ if (x > values[k]) k = i; }});
        const p = [0, 1, 2].map(i => at[3 * k + i]);
        // the step whose tip is nearest to the place that is bent most, at a depth that cuts
        let best = 0, least = Infinity;
        for (let r = 0; r < v.path.count; r++) {{
          const q = v.path.points.slice(3 * r, 3 * r + 3);
          const d = Math.hypot(q[0] - p[0], q[1] - p[1], 0.3 * (q[2] - p[2]));
          if (q[2] < p[2] && d < least) {{ least = d; best = r; }} }}
        v.go(best);
        const factor = v.map(map.name, 0.8).toFixed(0);
        for (const name of ['path', 'marks', 'engagement', 'part']) v.layer(name, false);
        v.lookFrom(v.camera.position.clone().set(0.95, -0.75, 0.72).normalize()); v.closer(0.12);
        v.colouring = null; v.legend();
        const far = values[k].toFixed(1);
        v.overlay.message(`wall bent by ${{far}} \u00b5m under the cutter, drawn \u00d7 ${{factor}}`, true);
        }}""",
    ),
}
#: examples of the picture of the first page
HOME = ("feeds", "part", "pocket", "contour")
#: the example that the questions are asked of, and what is chosen in each list
ASKED = "part"
CHOSEN = {"compare with": "original", "surface map": "workpiece: workpiece deflection"}
#: the 3D view without its controls
ALONE = """{ document.querySelectorAll('.cl-controls, .cl-buttons').forEach(e => { e.style.display = 'none'; });
    document.querySelector('.cl-space').style.gridTemplate = 'minmax(0, 1fr) / minmax(0, 1fr)';
    document.querySelector('.cl-stage').style.gridArea = '1 / 1'; }"""
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
    page.evaluate(SHEET, wanted)
    page.wait_for_timeout(3000)
    page.evaluate(RESIZE, wanted)
    page.wait_for_timeout(1000)
    page.locator("#sheet").screenshot(path=DOCS / f"{name}.png")


@contextmanager
def opened_page(chromium: Browser, folder: Path, query: str, size: tuple[int, int] = (1280, 720)) -> Iterator[Page]:
    """The page of a folder, in a window of a size."""
    words = [sys.executable, "-m", "chipload", "view", str(folder), "--no-open"]
    server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+", line)))
        page = chromium.new_page(viewport={"width": size[0], "height": size[1]})
        page.set_default_timeout(120_000)
        page.goto(f"{address}{query}")
        if query:
            page.wait_for_selector(".cv-ramp")
            page.wait_for_selector(".cl-now")
        yield page
        page.close()
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(60)


def photograph_page(chromium: Browser, folder: Path, name: str) -> None:
    """Write docs/NAME.png: the page of a folder with one result, by itself or beside another track along the path."""
    with opened_page(chromium, folder, "&show=result") as page:
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


def photograph_scene(chromium: Browser, folder: Path, name: str) -> None:
    """Write docs/NAME.png: the 3D view of a result alone, as :data:`SCENES` poses it."""
    with opened_page(chromium, folder, "&show=result", (1500, 1000)) as page:
        page.wait_for_function(DRAWN)
        page.evaluate(ALONE)
        page.wait_for_timeout(1000)
        page.evaluate(SCENES[name][1])
        page.wait_for_function(f"!{VIEW}.dirty")
        page.wait_for_timeout(1000)
        page.locator(".cl-stage").screenshot(path=DOCS / f"{name}.png")


def photograph_home(chromium: Browser, results: Path) -> None:
    """Write docs/page_home.png: the first page of a folder of results, those of :data:`HOME` that are there."""
    with tempfile.TemporaryDirectory() as above:
        folder = Path(above) / "parts"
        for name in HOME:
            if (results / name / "summary.json").exists():
                shutil.copytree(EXAMPLES / name, folder / name)
                shutil.copytree(results / name, folder / name / "result")
        with opened_page(chromium, folder, "", (1280, 640)) as page:
            page.wait_for_selector(".cl-result")
            page.evaluate("document.querySelectorAll('.cl-result img').forEach(i => { i.loading = 'eager'; })")
            page.wait_for_function("[...document.querySelectorAll('.cl-result img')].every(i => i.naturalWidth)")
            page.screenshot(path=DOCS / "page_home.png")


def photograph_questions(chromium: Browser, folder: Path) -> None:
    """Write docs/how-to/questions/K.png: the answer to each question of a shop, after its clicks."""
    shown = DOCS / "how-to" / "questions"
    shown.mkdir(exist_ok=True)
    with opened_page(chromium, folder, "&show=result") as page:
        page.wait_for_function(DRAWN)
        for k, question in enumerate(QUESTIONS, 1):
            ask(page, question, CHOSEN)
            if ("choose", "compare with") in question.clicks:
                page.wait_for_function(f"{VIEW}.paired && {SECOND}.frames > 0")
            page.wait_for_timeout(2500)
            page.screenshot(path=shown / f"{k}.png")
            fewer_colours(shown / f"{k}.png")
            take_back(page, question, CHOSEN)


def fewer_colours(path: Path) -> None:
    """Store a picture with at most 256 colours: half the size and less."""
    with Image.open(path) as picture:
        picture.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


def take(names: Sequence[str], results: Path) -> None:
    """Write docs/NAME.png for each name; ``results`` holds the result of each job of the examples by its name."""
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        page = chromium.new_page(viewport={"width": 860, "height": 1266})
        for name in names:
            if name == "page_home":
                photograph_home(chromium, results)
            elif name in PAGES or name in SCENES or name == "questions":
                example = PAGES[name][0] if name in PAGES else SCENES[name][0] if name in SCENES else ASKED
                with tempfile.TemporaryDirectory() as folder:
                    # with the files of the example beside it: the page shows the program of the job
                    shutil.copytree(EXAMPLES / example, Path(folder) / "job")
                    shutil.copytree(results / example, Path(folder) / "result")
                    if name == "questions":
                        photograph_questions(chromium, Path(folder))
                        print("docs/how-to/questions", flush=True)
                        continue
                    (photograph_page if name in PAGES else photograph_scene)(chromium, Path(folder), name)
            else:
                photograph(page, results / name / "report.html", name)
            if name not in SCENES:  # its shades would become bands
                fewer_colours(DOCS / f"{name}.png")
            print(f"docs/{name}.png", flush=True)
        chromium.close()
