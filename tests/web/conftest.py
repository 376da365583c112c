"""A folder of results made by formula, the page that shows it, and a browser."""

import base64
import contextlib
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from square import PROGRAM, make_cut_result, make_result
from web_lists import settle
from web_served import Served

EXAMPLES = Path(__file__).parents[2] / "src" / "chipload" / "examples"


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The opened folder: two hand-made results, a hostile one, the contour example with one strategy."""
    root = tmp_path_factory.mktemp("opened")
    (root / "square.ngc").write_text(PROGRAM)
    make_result(root / "square")
    make_cut_result(root / "cut")
    make_result(root / "bare", job="<img src=x onerror='window.hacked=1'>", scene=False)
    path = root / "bare" / "summary.json"
    hostile = json.loads(path.read_text())
    track = hostile["tracks"][0]
    track["findings"][0]["text"] = "<script>window.hacked=1</script>"
    track["findings"].append({**track["findings"][0], "text": "<img src=x onerror='window.hacked=1'> in line 8"})
    track["parameters"] = {"<img src=x onerror='window.hacked=1'>": 1.0}
    hostile["unchecked"] = ["</td><img src=x onerror='window.hacked=1'>"]
    hostile["provenance"]["inputs"]["program"] = "<svg onload='window.hacked=1'> sha256 00"
    path.write_text(json.dumps(hostile))
    (root / "bare" / "report.html").write_text("<script>fetch('/')</script>")
    (root / "older").mkdir()
    (root / "older" / "summary.json").write_text('{"schema_version": 0, "verdict": "holds"}')
    shutil.copytree(EXAMPLES / "contour", root / "contour")
    job = root / "contour" / "job.toml"
    text = job.read_text().replace('["plain", "backward", "feed"]', '["backward"]')
    job.write_text(text.replace("step_mm = 0.05", "step_mm = 0.5"))
    secret = tmp_path_factory.mktemp("outside")  # its name ends in 0
    (secret / "secret.txt").write_text("secret")
    make_result(secret / "result")
    (root / "leaves").symlink_to(secret, target_is_directory=True)
    (root / "link").mkdir()
    shutil.copy(root / "square" / "summary.json", root / "link" / "summary.json")
    for name in ("history.parquet", "report.html"):
        (root / "link" / name).symlink_to(secret / "result" / name)
    return root


@pytest.fixture(scope="session")
def served(folder: Path) -> Iterator[Served]:
    """The page of the folder."""
    page = Served(folder)
    yield page
    with contextlib.suppress(Exception):
        page.end()


class Windows:
    """Opens pages, and knows which hosts they asked and what went wrong in them."""

    def __init__(self, browser: object, served: Served) -> None:
        self.browser, self.served = browser, served
        self.opened: list[object] = []
        self.hosts: set[str] = set()
        self.wrong: list[str] = []

    def __call__(self, address: str) -> object:
        """A page of the folder."""
        page = self.browser.new_page(viewport={"width": 1280, "height": 720})
        page.set_default_timeout(60_000)
        page.on("request", lambda r: self.hosts.add(r.url.split("/")[2]) if r.url.startswith(("http", "ws")) else None)
        page.on("pageerror", lambda e: self.wrong.append(str(e)))
        page.on("console", lambda m: self.wrong.append(m.text) if m.type == "error" else None)
        self.opened.append(page)
        page.goto(self.served.address(address))
        return page

    def close(self) -> None:
        """No other host was asked and nothing went wrong."""
        for page in self.opened:
            page.close()
        assert self.hosts <= {f"127.0.0.1:{self.served.port}"}
        assert self.wrong == []


@pytest.fixture
def window(browser: object, served: Served) -> Iterator[Windows]:
    """Opens pages of the folder."""
    windows = Windows(browser, served)
    yield windows
    windows.close()


@pytest.fixture(scope="module")
def shared(browser: object, served: Served) -> Iterator[object]:
    """The page of the hand-made result, opened once for all tests of a file."""
    windows = Windows(browser, served)
    page = windows("?show=square")
    page.wait_for_selector(".cl-limits", state="visible")
    page.wait_for_function("document.querySelectorAll('.cl-figure .trace').length > 0")
    page.wait_for_selector(".cv-ramp")
    page.wait_for_selector(".cl-now")
    yield page
    windows.close()


@pytest.fixture
def square(shared: object) -> object:
    """The page of the hand-made result at its beginning."""
    shared.keyboard.press("Home")
    settle(shared, 0)
    return shared


@pytest.fixture
def pixels(browser: object) -> Callable[[bytes], np.ndarray]:
    """(height, width, 3) of a PNG, decoded by the browser."""
    script = """async (data) => {
      const image = new Image(); image.src = 'data:image/png;base64,' + data; await image.decode();
      const c = document.createElement('canvas'); c.width = image.width; c.height = image.height;
      const g = c.getContext('2d'); g.drawImage(image, 0, 0);
      let out = ''; const d = g.getImageData(0, 0, c.width, c.height).data;
      for (let k = 0; k < d.length; k += 8192) out += String.fromCharCode(...d.subarray(k, k + 8192));
      return [c.height, c.width, btoa(out)]; }"""

    def decoded(png: bytes) -> np.ndarray:
        blank = browser.new_page()
        height, width, data = blank.evaluate(script, base64.b64encode(png).decode())
        blank.close()
        return np.frombuffer(base64.b64decode(data), dtype=np.uint8).reshape(height, width, 4)[..., :3]

    return decoded
