"""A small budget of tools/fuzz.py: no damaged input of any reader ends in a fault, a hang or 4 GiB."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[2] / "tools" / "fuzz.py"


def ran(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(TOOL), *words], capture_output=True, text=True, timeout=900, check=False)


def test_few_cases_of_every_reader() -> None:
    done = ran("--cases", "25", "--budget", "800")
    assert done.returncode == 0, done.stdout + done.stderr
    rows = re.findall(r"^\| (\w+) \| (\d+) \|", done.stdout, re.MULTILINE)
    assert len(rows) == 26
    assert all(int(count) > 0 for _, count in rows)


def test_a_case_is_the_same_each_time(tmp_path: Path) -> None:
    for name in ("a.stl", "b.stl"):
        ran("--reader", "stl", "--case", "7", "--keep", str(tmp_path / name))
    assert (tmp_path / "a.stl").read_bytes() == (tmp_path / "b.stl").read_bytes()


@pytest.mark.parametrize(("body", "end"), [
    ("raise ValueError('x')", "fault"), ("import os; os.abort()", "fault"), ("raise MemoryError", "memory"),
    ("import numpy as np; np.ones(1 << 30)", "memory"), ("finite([float('nan')])", "fault"),
    ("from chipload.errors import InputError; raise InputError('x')", "refused"),
])  # fmt: skip
def test_each_end_is_told_from_the_others(tmp_path: Path, body: str, end: str) -> None:
    """The tool itself, with a reader that ends in a known way."""
    for name in ("fuzz.py", "fuzz_jobs.py", "plate.step"):
        (tmp_path / name).write_bytes(TOOL.with_name(name).read_bytes())
    text = TOOL.with_name("fuzz_readers.py").read_text("utf-8")
    text = text.replace("def _meridian(path: Path) -> int:\n", f"def _meridian(path: Path) -> int:\n    {body}\n")
    (tmp_path / "fuzz_readers.py").write_text(text, "utf-8")
    words = [sys.executable, str(tmp_path / "fuzz.py"), "--reader", "meridian", "--cases", "1"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    head, row = (re.findall(r"[^|\s]+", line) for line in done.stdout.splitlines()[0:3:2])
    assert dict(zip(head, row, strict=True))[end] == "1"
    assert done.returncode == (0 if end == "refused" else 1)
