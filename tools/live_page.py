"""Write the page of a result that the first page of the documentation shows live; see tools/figures.py.

It is report.html without its figures: verdict, limits, and the view in space with its controls, in one file that asks
no server.
"""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).parent.parent / "docs"
#: the example, and the file that shows it
EXAMPLE, OUT = "feeds", DOCS / "live" / "feeds.html"
#: what stands beside the view of a report: by id of a script, and by text of a script without one
FIGURES, DRAWS = ("plotly", "figures"), "const figures"


def live_page(report: str) -> str:
    """Return the text of report.html with its heading, verdict, limits and view alone."""
    head, rest = report.split("<main>", 1)
    main, scripts = rest.split("</main>", 1)
    first = re.match(r".*?<h1>.*?</h1>\s*<div class=\"verdict.*?</div>(?=\s*<h2>|\s*<details|\s*$)", main, flags=re.S)
    if first is None:
        raise ValueError("report.html: has no verdict")
    sections = {
        re.sub("<[^>]*>", "", name): whole
        for whole, name in re.findall(
            r"(<details[^>]*><summary><h2>(.*?)</h2></summary>.*?</details>)", main, flags=re.S
        )
    }
    wanted = [sections["In space"], sections["Limits"].replace("<details open>", "<details>")]

    def kept(script: re.Match[str]) -> str:
        figures = script[1] in FIGURES or (script[1] is None and DRAWS in script[0])
        return "" if figures else script[0]

    verdict = re.sub(r'<span class="more">.*?</span>', "", first[0], flags=re.S)
    scripts = re.sub(r'<script(?: id="(\w+)")?[^>]*>.*?</script>\n?', kept, scripts, flags=re.S)
    return f"{head}<main>{verdict}\n{chr(10).join(wanted)}\n</main>{scripts}"


def write(result: Path) -> None:
    """Write the page of a result folder."""
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(live_page((result / "report.html").read_text(encoding="utf-8")), encoding="utf-8")
