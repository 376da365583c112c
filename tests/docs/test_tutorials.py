"""The commands of docs/tutorials run as they are shown, and print what is shown.

A block ``console`` has commands behind ``$ chipload`` and below each the first lines of its output. Words are compared
as they are, numbers within 2 %. Pages whose
commands take longer are marked slow.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chipload.cli import app

FOLDER = Path(__file__).parents[2] / "docs" / "tutorials"
PAGES = sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index")
#: pages whose commands take over 20 s of processor time together
SLOW = {"workpiece", "thin_wall"}
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"


def commands(text: str) -> list[tuple[str, list[str]]]:
    """Each command of a page's console blocks, without ``chipload``, and the lines shown below it."""
    found: list[tuple[str, list[str]]] = []
    for block in re.findall(r"^```console\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ chipload "):
                found.append((line.removeprefix("$ chipload "), []))
            else:
                found[-1][1].append(line)
    return found


def same(shown: str, line: str) -> bool:
    """Whether a line begins as shown: the words are equal, the numbers within 2 %.

    >>> same("force 483.4 of 1500 N", "force 483.1 of 1500 N, torque 2 N m")
    True
    >>> same("force 483.4 of 1500 N", "force 383.4 of 1500 N")
    False
    >>> same("force 483.4 N", "torque 483.4 N")
    False
    """
    parts = re.split(f"({NUMBER})", shown)
    pattern = "".join(f"({NUMBER})" if k % 2 else re.escape(part) for k, part in enumerate(parts))
    if not (match := re.match(pattern, line)):
        return False
    return all(float(a) == pytest.approx(float(b), rel=0.02) for a, b in zip(match.groups(), parts[1::2], strict=True))


def test_there_is_one_for_each_capability():
    assert sorted(("contour", "program", "feeds", "thin_wall", "impeller", "torque", "stability", "workpiece")) == PAGES


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in PAGES]
)
def test_a_tutorial_prints_what_it_shows(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = commands((FOLDER / f"{name}.md").read_text(encoding="utf-8"))
    assert found
    for command, shown in found:
        done = CliRunner().invoke(app, shlex.split(command))
        lines = done.stdout.splitlines()
        assert shown
        for k, wanted in enumerate(shown):
            assert same(wanted, lines[k] if k < len(lines) else ""), (command, wanted, done.output)


def test_every_command_of_the_documentation_exists():
    """Also those in blocks that are only shown, on every page of docs/."""
    known = {command.name or command.callback.__name__ for command in app.registered_commands}
    for page in FOLDER.parent.rglob("*.md"):
        for line in page.read_text(encoding="utf-8").splitlines():
            if found := re.match(r"(?:    |\$ )chipload ([a-z]+)", line):
                assert found[1] in known, (page.name, line)
