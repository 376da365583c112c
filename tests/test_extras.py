"""What an extra of the package installs: a missing one is named with the command that installs it; the page of the
Python interface has every public name.
"""

from __future__ import annotations

import importlib.util
import tomllib
from pathlib import Path

import pytest

import chipload
from chipload.errors import InputError
from chipload.geometry.isolated import Isolated
from chipload.lazy import EXTRAS, require_extra
from chipload.result.provenance import versions
from chipload.web.serve import serve

ROOT = Path(__file__).parents[1]


@pytest.fixture
def bare(monkeypatch):
    """An installation without extras."""
    find = importlib.util.find_spec
    absent = {module for module, _ in EXTRAS.values()}
    monkeypatch.setattr("chipload.lazy.find_spec", lambda name: None if name in absent else find(name))


@pytest.mark.parametrize("extra", EXTRAS)
def test_every_extra_is_one_of_the_package(extra):
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert extra in extras
    require_extra(extra)


@pytest.mark.usefixtures("bare")
def test_a_missing_extra_is_named(tmp_path):
    part = tmp_path / "part.step"
    part.write_text("ISO-10303-21;")
    with pytest.raises(InputError, match=r"reading STEP files needs the extra 'cad', .* pip install 'chipload\[cad\]'"):
        Isolated(part, "part.file", "step.read_shape").call("step.levels")
    with pytest.raises(InputError, match=r"the page in the browser needs the extra 'web'"):
        serve(tmp_path, None, False, print)


def test_versions_are_those_of_what_is_installed():
    assert versions()["numpy"] == importlib.import_module("numpy").__version__


def test_the_interface_page_has_every_public_name():
    text = (ROOT / "docs" / "api.md").read_text()
    absent = [
        n for n in chipload.__all__ if f".{n}\n" not in text and f"heading: {n}\n" not in text and f"`{n}`" not in text
    ]
    assert absent == []
