"""The Python of the README runs and prints the number that stands beside it."""

import ast
import contextlib
import io
import re
import tomllib
from pathlib import Path

from chipload import examples

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
SOURCE_MAP = (ROOT / "docs" / "design" / "architecture.md").read_text()


def test_examples(tmp_path, monkeypatch):
    """One after the other, as in one notebook."""
    examples.copy_example("notebooks", tmp_path / "my-notebooks")
    examples.copy_example("contour", tmp_path / "my-job")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len(blocks) == 2
    for code in blocks:
        assert len(code.strip().splitlines()) <= 16
        shown = code.strip().rsplit("# ", 1)[1]
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(code, "README.md", "exec"), names)
        assert out.getvalue().strip() == shown


def test_the_page_of_the_interface_shows_lines_of_the_readme():
    """So they run, and print what stands beside them."""
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    shown, run = ("".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)) for text in (page, README))
    assert len(ast.parse(shown).body) == 6
    assert {ast.dump(line) for line in ast.parse(shown).body} <= {ast.dump(line) for line in ast.parse(run).body}
    assert set(re.findall(r"  # (.*)", shown)) <= set(re.findall(r"  # (.*)", run))


def test_the_explained_job_is_the_example_but_for_its_defaults():
    block = tomllib.loads(re.search(r"```toml\n(.*?)```", README, re.DOTALL)[1])
    example = tomllib.loads((Path(examples.__file__).parent / "chips" / "job.toml").read_text())
    for key, table in block.items():
        for mine, theirs in zip(*([x] if isinstance(x, dict) else x for x in (table, example[key])), strict=True):
            assert mine.items() <= theirs.items(), key


def test_the_readme_is_short_and_its_links_lead_somewhere():
    assert len(README.splitlines()) < 250
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


def test_files_of_the_table_exist():
    root = ROOT / "src" / "chipload"
    rows = re.findall(r"^\| [^|]*\? \| ([^|]*) \| ([^|]*) \|", SOURCE_MAP, re.MULTILINE)
    assert len(rows) >= 10
    for rooms, files in rows:
        for name in re.findall(r"`([a-z_]+\.py)`", files):
            places = [root / room.strip() / name for room in rooms.split(",")] if rooms.strip() else [root / name]
            assert any(p.exists() for p in places), (rooms, name)
