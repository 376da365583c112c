"""The front doors of the packages: each has one, every name of ``__all__`` is there, nothing is imported too early."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import chipload

SOURCE = Path(chipload.__file__).parent
#: packages that import what they need at once: their names are few, or the parts of an application
AT_ONCE = {"api", "cli", "examples", "jobs", "result", "web.panels"}


def folders() -> dict[str, list[str]]:
    """Every package by its name below chipload, and the names of its files."""
    return {
        ".".join(path.parent.relative_to(SOURCE).parts): sorted(f.stem for f in path.parent.glob("*.py"))
        for path in SOURCE.rglob("__init__.py")
        if path.parent != SOURCE
    }


PACKAGES = sorted(folders().keys() - AT_ONCE)


def test_every_package_has_a_front_door():
    assert len(PACKAGES) > 30
    assert folders().keys() >= AT_ONCE
    assert [name for name in PACKAGES if not import_module(f"chipload.{name}").__all__] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_is_there(package):
    module = import_module(f"chipload.{package}")
    assert module.__all__ == sorted(module.__all__)
    assert dir(module) == module.__all__
    for name in module.__all__:
        value = getattr(module, name)
        assert callable(value)
        assert value.__module__.startswith(f"chipload.{package}.")
        assert value.__doc__
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        module.nothing  # noqa: B018


def test_a_package_imports_nothing_before_it_is_asked():
    names = ", ".join(f"chipload.{name}" for name in PACKAGES if name.split(".")[0] not in AT_ONCE)
    code = f"import {names}, sys; print([m for m in ('numpy', 'scipy', 'numba', 'pydantic') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
