"""The pages state what the shipped examples give at their own settings: a result, the stored numbers, and the pages."""

from __future__ import annotations

import os
import re
from pathlib import Path

import page_values
import pytest
from page_values import MARK, PAGES, ROOT, SOURCES, Run, fingerprint, numbered, read_values, values_of
from typer.testing import CliRunner

from chipload.cli import app

STORED = read_values()
RENEW = "run make figures, and look at what it changes"
#: verdict and exit code of each example; the pages state these in words
VERDICTS = {
    "contour": "holds", "pocket": "holds", "trunnion": "unproven", "chips": "holds", "chips_blade": "holds",
    "chatter": "holds", "bracket": "exceeds", "feeds": "holds", "part": "holds", "plate": "holds", "blade": "holds",
    "tube": "holds", "cone": "holds", "frame_pockets": "holds", "frame_roughing": "holds", "frame": "holds",
    "frame_distortion": "holds", "notebooks": "holds", "impeller": "holds", "hecc": "exceeds",
}  # fmt: skip
NAMES = [name for name, source in SOURCES.items() if not source.long]


#: numbers of the gallery that neither a result nor a job states: exit codes, a swing of the geometry, cutters table
#: angles, the confidence
STATED = {
    "trunnion": {3.0}, "chips": {44.0}, "impeller": {14.0, 1.5, 15.0}, "hecc": {3.0}, "frame": {95.0},
}  # fmt: skip


def check(name: str, folder: Path) -> None:
    """A result against its verdict, the stored numbers and the digests of its pictures."""
    assert Run(folder).summary["verdict"] == VERDICTS[name]
    assert values_of(name, folder) == STORED[name], RENEW
    for picture in SOURCES[name].pictures:
        assert STORED["pictures"].get(picture) == fingerprint(folder, picture), (picture, RENEW)


@pytest.mark.parametrize("name", NAMES)
def test_the_pages_state_what_the_example_gives(example, name):
    done = example(name)
    assert done.exit_code == (0 if VERDICTS[name] == "holds" else 3)
    check(name, done.folder)


@pytest.mark.skipif(os.environ.get("CHIPLOAD_LONG") != "1", reason="takes many minutes: make real")
@pytest.mark.parametrize("name", [name for name, source in SOURCES.items() if source.long])
def test_the_pages_state_what_a_long_example_gives(name, tmp_path):
    source = SOURCES[name]
    job = page_values.EXAMPLES / source.example / source.job
    done = CliRunner().invoke(app, ["run", str(job), "--out", str(tmp_path / name)])
    assert done.exit_code == (0 if VERDICTS[name] == "holds" else 3)
    check(name, tmp_path / name)


@pytest.mark.parametrize("page", PAGES, ids=[page.relative_to(ROOT).as_posix() for page in PAGES])
def test_a_page_has_the_stored_numbers(page):
    text = page.read_text(encoding="utf-8")
    assert numbered(text, STORED) == text, RENEW


def test_every_mark_stands_behind_a_number_or_a_word():
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        assert len(MARK.findall(text)) == len(re.findall(r"<!--\S+-->", text)), page.name


def test_the_gallery_and_the_readme_mark_what_is_measured():
    """Each number of an entry of the gallery is marked, or the job or its name states it."""
    gallery = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    for name, source in SOURCES.items():
        entry = re.search(rf"^## {name}\n\n(.*?)\n!\[", gallery, re.MULTILINE | re.DOTALL)
        if entry is None:
            continue
        assert MARK.search(entry[1]), name
        plain = MARK.sub("", entry[1])
        files = (page_values.EXAMPLES / source.example).glob("*.toml")
        stated = "".join(path.read_text(encoding="utf-8") for path in files)
        known = {float(x) for x in re.findall(r"\d+(?:\.\d+)?", stated)} | STATED.get(name, set())
        found = {float(x.replace(",", "")) for x in re.findall(r"(?<![\w.])\d[\d,]*(?:\.\d+)?(?![\w.])", plain)}
        assert found <= known, (name, found - known)


def test_a_page_that_differs_is_found():
    text = "in 3.06<!--plate.variable_min--> min, holds<!--plate.verdict-->"
    values = {"plate": {"variable_min": "3.14", "verdict": "unproven"}}
    assert numbered(text, values) == "in 3.14<!--plate.variable_min--> min, unproven<!--plate.verdict-->"


def test_every_stored_number_is_of_a_source_and_some_page_shows_most():
    assert set(STORED) == {*SOURCES, "pictures"}
    shown = {(a, b) for page in PAGES for _, a, b in MARK.findall(page.read_text(encoding="utf-8"))}
    assert {a for a, _ in shown} == set(SOURCES)
