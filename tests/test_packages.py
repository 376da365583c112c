"""The front doors of the packages: every name of ``__all__`` is there; nothing is imported before it is asked for."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

PACKAGES = (
    "cutter", "machine", "stock", "geometry", "program", "engagement", "structure", "cutting", "control", "stability",
    "planning", "simulation",
)  # fmt: skip


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
    names = ", ".join(f"chipload.{name}" for name in PACKAGES)
    code = f"import {names}, sys; print([m for m in ('numpy', 'scipy', 'numba', 'pydantic') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
