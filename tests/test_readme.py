"""The Python of the README runs and prints the number that stands beside it."""

import contextlib
import io
import re
from pathlib import Path

from chipload import examples

README = (Path(__file__).parent.parent / "README.md").read_text()


def test_examples(tmp_path, monkeypatch):
    """One after the other, as in one notebook."""
    examples.copy_example("notebooks", tmp_path / "my-notebooks")
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


def test_files_of_the_table_exist():
    root = Path(__file__).parent.parent / "src" / "chipload"
    rows = re.findall(r"^\| [^|]*\? \| ([^|]*) \| ([^|]*) \|", README, re.MULTILINE)
    assert len(rows) >= 10
    for rooms, files in rows:
        for name in re.findall(r"`([a-z_]+\.py)`", files):
            places = [root / room.strip() / name for room in rooms.split(",")] if rooms.strip() else [root / name]
            assert any(p.exists() for p in places), (rooms, name)
