"""Late imports: names of a package on first access (PEP 562), compiled functions and heavy libraries when the first of
their names is used, and libraries that an extra installs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from chipload.errors import InputError

__all__ = ["EXTRAS", "LateModule", "attach", "pa", "pa_csv", "pq", "require_extra", "scipy", "trimesh"]

#: extra of the package -> the module that it installs, and what needs it
EXTRAS: Mapping[str, tuple[str, str]] = {
    "cad": ("OCP", "reading STEP files"),
    "mcp": ("mcp", "the server of the Model Context Protocol"),
    "opcua": ("asyncua", "a log from an OPC UA server"),
    "web": ("nicegui", "the page in the browser"),
    "notebook": ("pandas", "a table of pandas or a dataset of xarray"),
    "cluster": ("distributed", "a sweep on a Dask cluster"),
    "export": ("fpdf", "setup.pdf"),
}


def require_extra(extra: str, module: str = "") -> None:
    """Refuse what needs an extra of the package that is not installed.

    Parameters
    ----------
    extra : name of the extra
    module : the module that is needed; empty: that of the extra

    Raises
    ------
    InputError
        The library of the extra is missing; the message names what needs it and the command that installs it.

    >>> require_extra("web")
    """
    first, use = EXTRAS[extra]
    if find_spec(module or first) is None:
        raise InputError(f"{use} needs the extra {extra!r}, which is not installed: pip install 'chipload[{extra}]'")


def attach(package: str, places: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of a package.

    Parameters
    ----------
    package : its ``__name__``
    places : module within the package, and the names that it gives, with spaces between them

    Examples
    --------
    >>> find, names = attach("chipload.cutter", {"fctb": "read_fctb", "table": "CutterTable"})
    >>> find("read_fctb").__module__, names()
    ('chipload.cutter.fctb', ['CutterTable', 'read_fctb'])
    """
    module_of = {name: module for module, names in places.items() for name in names.split()}

    def find(name: str) -> Any:
        if name not in module_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{module_of[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return find, lambda: sorted(module_of)


class LateModule:
    """A module that is imported on first access to one of its names: a library, or compiled functions.

    Functions with stated types are compiled when their module is imported: on a new machine that takes seconds, which
    a job that does not call them saves. A library takes tenths of a second.

    Parameters
    ----------
    module : its whole name

    Examples
    --------
    >>> late = LateModule("chipload.units")
    >>> late.rpm_from_rad_s.__module__
    'chipload.units'
    """

    def __init__(self, module: str) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        value = getattr(import_module(self._module), name)
        setattr(self, name, value)
        return value


if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.csv as pa_csv
    import pyarrow.parquet as pq
    import scipy as scipy
    import trimesh as trimesh
else:
    # half of what a check of a job takes, where it reads no mesh and solves nothing
    scipy, trimesh = LateModule("scipy"), LateModule("trimesh")
    pa, pa_csv, pq = LateModule("pyarrow"), LateModule("pyarrow.csv"), LateModule("pyarrow.parquet")
