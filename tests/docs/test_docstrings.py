"""Every name of the public API and its public methods have a docstring, and docs/api.md shows every name."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

import chipload

API = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
#: values, described by another page
VALUES = {"COLUMNS"}


def documented(name: str) -> list[str]:
    """Names of what is public in ``chipload.name`` and has no docstring of its own."""
    value = getattr(chipload, name)
    missing = [] if (value.__doc__ or "").strip() else [name]
    if inspect.isclass(value):
        for key, member in list(vars(value).items()):
            inner = member.fget if isinstance(member, property) else getattr(member, "func", member)
            inner = getattr(inner, "__func__", inner)
            own = inspect.isfunction(inner) and inner.__name__ == key  # not the default of a field
            if own and not key.startswith("_") and not (inner.__doc__ or "").strip():
                missing.append(f"{name}.{key}")
    return missing


@pytest.mark.parametrize("name", sorted(set(chipload.__all__) - {"__version__"}))
def test_it_has_a_docstring(name):
    assert not documented(name)


def test_the_page_shows_every_public_name():
    shown = set(re.findall(r"^::: chipload[\w.]*\.(\w+)$", API, re.MULTILINE)) | set(
        re.findall(r"heading: (\w+)$", API, re.MULTILINE)
    )
    assert set(chipload.__all__) - {"__version__"} - shown <= VALUES


def test_a_missing_docstring_is_found(monkeypatch):
    class Bare:
        def method(self):
            return 1

    monkeypatch.setattr(chipload, "Verdict", Bare)
    assert documented("Verdict") == ["Verdict", "Verdict.method"]
