"""The gallery shows every example, each with a picture that a page can bear."""

import re
import struct
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"
EXAMPLES = Path(__file__).parent.parent / "src" / "chipload" / "examples"
NAMES = sorted(p.parent.name for p in EXAMPLES.glob("*/README.md"))
GALLERY = (DOCS / "gallery.md").read_text()
#: width [pixels] and size [bytes] of a picture at most
WIDTH, SIZE = 1000, 150_000


def test_there_are_examples():
    assert len(NAMES) >= 10
    assert {p.name for p in EXAMPLES.iterdir() if p.is_dir() and p.name[0] != "_"} == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_example_has_its_entry_with_a_picture(name):
    found = re.findall(rf"^## {name}\n\n(.*?)\n\n!\[[^\]]+\]\({name}\.png\)$", GALLERY, re.MULTILINE | re.DOTALL)
    assert len(found) == 1
    assert "##" not in found[0]
    assert re.search(r"\d", found[0])


@pytest.mark.parametrize("name", NAMES)
def test_its_picture_is_small(name):
    data = (DOCS / f"{name}.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert 300 <= width <= WIDTH
    assert height >= 200
    assert len(data) < SIZE


def test_it_shows_no_example_that_is_gone():
    assert set(re.findall(r"^## ([a-z]\w*)$", GALLERY, re.MULTILINE)) == set(NAMES)


def test_all_pictures_are_shown():
    shown = set(re.findall(r"\]\((\w+\.png)\)", GALLERY))
    assert shown == {p.name for p in DOCS.glob("*.png")}
