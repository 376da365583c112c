"""The commands of docs/tutorials run as they are shown, and print what is shown.

A block ``console`` has commands behind ``$ chipload`` and below each the first lines of its output, words and numbers
as they are; ``make figures`` writes them. Pages whose commands take longer are marked slow.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from figures import with_output
from typer.testing import CliRunner

from chipload.cli import app

FOLDER = Path(__file__).parents[2] / "docs" / "tutorials"
PAGES = sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index")
#: pages whose commands take over 20 s of processor time together
SLOW = {"workpiece", "thin_wall"}


def test_there_is_one_for_each_capability():
    assert sorted(("contour", "program", "feeds", "thin_wall", "impeller", "torque", "stability", "workpiece")) == PAGES


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in PAGES]
)
def test_a_tutorial_prints_what_it_shows(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    ran = []

    def output(command: str) -> list[str]:
        ran.append(command)
        return CliRunner().invoke(app, shlex.split(command)).stdout.splitlines()

    assert with_output(text, output) == text, "run make figures"
    assert ran


def test_a_page_shows_the_beginning_of_each_line():
    """As much of a line as before, its numbers anew; the whole line where its words are different."""
    page = "```console\n$ chipload run a\nforce 483.4 of 1500 N\nHolds: all\n$ chipload check b\nvalid\n```\n"
    shown = {"run a": ["force 4.9e+02 of 1500 N, torque 2 N m", "Exceeds: the force", "more"], "check b": []}
    assert with_output(page, shown.__getitem__) == (
        "```console\n$ chipload run a\nforce 4.9e+02 of 1500 N\nExceeds: the force\n$ chipload check b\n\n```\n"
    )


def test_every_command_of_the_documentation_exists():
    """Also those in blocks that are only shown, on every page of docs/."""
    known = {command.name or command.callback.__name__ for command in app.registered_commands}
    for page in FOLDER.parent.rglob("*.md"):
        for line in page.read_text(encoding="utf-8").splitlines():
            if found := re.match(r"(?:    |\$ )chipload ([a-z][a-z-]*)", line):
                assert found[1] in known, (page.name, line)
