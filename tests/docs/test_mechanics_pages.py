"""The code of docs/mechanics runs as it is shown and prints what is shown; each page has its picture."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from mechanics_pictures import FIGURES, FOLDER, run_page

PAGES = sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index")
#: figures that the pages of the mechanics print: numbers at the last digit may differ between processors
NUMBER = r"-?\d+(?:\.\d+)?"


def test_each_page_has_a_figure_and_a_line_in_the_index():
    assert sorted(FIGURES) == PAGES
    index = (FOLDER / "index.md").read_text(encoding="utf-8")
    for name in PAGES:
        assert f"({name}.md)" in index
        assert f"({name}.png)" in (FOLDER / f"{name}.md").read_text(encoding="utf-8")
        assert (FOLDER / f"{name}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", PAGES)
def test_a_page_prints_what_it_shows_and_its_figure_is_drawn(name):
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    made, names = run_page(text)
    assert re.sub(NUMBER, "#", made) == re.sub(NUMBER, "#", text), "run python tools/mechanics_pictures.py"
    shown, own = (list(map(float, re.findall(NUMBER, page))) for page in (text, made))
    assert own == pytest.approx(shown, rel=2e-3, abs=0.011)
    assert len(FIGURES[name](names).data) >= 1


def test_ten_lines_are_about_ten_lines():
    """Pages name themselves so; the import, the prints and lines of one call that is divided do not count."""
    for name in PAGES:
        text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
        code = re.search(r"```python\n(.*?)```", text, re.DOTALL)[1]
        if "in ten lines" in text.splitlines()[0]:
            import ast

            lines = [node for node in ast.parse(code).body if "print" not in ast.unparse(node)[:40]]
            assert len(lines) <= 12, (name, Path(name))
