"""No link of a page in Markdown is broken: its file exists, and the heading that it names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    path
    for pattern in ("*.md", ".github/**/*.md", "docs/**/*.md", "src/chipload/examples/**/*.md")
    for path in ROOT.glob(pattern)
)
#: `[text](target#heading)` and `![text](target)`; links to other sites are left out
LINK = re.compile(r"\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]+))?\)")


def prose(path: Path) -> str:
    """A page without its blocks of code."""
    return re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


def anchors(path: Path) -> set[str]:
    """What the headings of a page are called in a link."""
    plain = (re.sub(r"[^\w\s-]", "", heading) for heading in re.findall(r"^#+ (.*)$", prose(path), re.MULTILINE))
    return {re.sub(r"[-\s]+", "-", text.strip().lower()) for text in plain}


def broken(path: Path) -> list[str]:
    """Links of a page that lead nowhere."""
    out = []
    for target, heading in LINK.findall(prose(path)):
        to = path.parent / target if target else path
        if not to.exists() or (heading and heading not in anchors(to)):
            out.append(f"{target}#{heading}" if heading else target)
    return out


def test_every_page_is_looked_at() -> None:
    names = {path.relative_to(ROOT).as_posix() for path in PAGES}
    assert {"README.md", "docs/index.md", "docs/tutorials/index.md", "src/chipload/examples/plate/README.md"} <= names
    assert sum(len(LINK.findall(prose(path))) for path in PAGES) > 100


@pytest.mark.parametrize("path", PAGES, ids=[path.relative_to(ROOT).as_posix() for path in PAGES])
def test_no_link_is_broken(path: Path) -> None:
    assert broken(path) == []


def test_a_broken_link_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    (tmp_path / "other.md").write_text("# A `title`, and more\n")
    page.write_text(
        "# Here\n[a](other.md#a-title-and-more) [b](#here) [c](https://x.org/y)\n"
        "```\n[d](nowhere.md)\n```\n[e](none.md) ![f](other.md#no) [g](#there)\n"
    )
    assert broken(page) == ["none.md", "other.md#no", "#there"]
