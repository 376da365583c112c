"""chipload simulates, checks and plans CNC milling of parts that are hard to mill.

The public names are those of ``__all__``. Each is imported on first access, so that ``import chipload`` stays
light. The names of keys and columns state their units, as in the job file: ``Cutter(diameter_mm=10, ...)``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from chipload.api.jobs import check_job, load_result, run_job, write_result
    from chipload.api.loads import fit_coefficients, hold_torque, optimise_feeds
    from chipload.api.planning import plan_contour, plan_impeller, plan_pocket, plan_thin_wall
    from chipload.api.reading import read_machine, read_material, read_program
    from chipload.cutter.table import CutterTable as Cutter
    from chipload.cutting.material import Material
    from chipload.errors import Finding, InputError
    from chipload.geometry.contour import Contour
    from chipload.jobs.program.api import simulate
    from chipload.jobs.program.history import History
    from chipload.machine.machine import Machine
    from chipload.program.program import Program
    from chipload.result.columns import COLUMNS
    from chipload.result.limits import LimitCheck
    from chipload.result.result import Result
    from chipload.result.track import Track
    from chipload.result.verdict import Verdict
    from chipload.stock.layers import LayeredStock as Stock

    __version__: str

__all__ = [
    "COLUMNS",
    "Contour",
    "Cutter",
    "Finding",
    "History",
    "InputError",
    "LimitCheck",
    "Machine",
    "Material",
    "Program",
    "Result",
    "Stock",
    "Track",
    "Verdict",
    "check_job",
    "fit_coefficients",
    "hold_torque",
    "load_result",
    "optimise_feeds",
    "plan_contour",
    "plan_impeller",
    "plan_pocket",
    "plan_thin_wall",
    "read_machine",
    "read_material",
    "read_program",
    "run_job",
    "simulate",
    "write_result",
]

#: module and name of each that is not a function of ``chipload.api``
_PLACES = {
    "COLUMNS": ("chipload.result.columns", "COLUMNS"),
    "Contour": ("chipload.geometry.contour", "Contour"),
    "Cutter": ("chipload.cutter.table", "CutterTable"),
    "Finding": ("chipload.errors", "Finding"),
    "History": ("chipload.jobs.program.history", "History"),
    "InputError": ("chipload.errors", "InputError"),
    "LimitCheck": ("chipload.result.limits", "LimitCheck"),
    "Machine": ("chipload.machine.machine", "Machine"),
    "Material": ("chipload.cutting.material", "Material"),
    "Program": ("chipload.program.program", "Program"),
    "Result": ("chipload.result.result", "Result"),
    "Stock": ("chipload.stock.layers", "LayeredStock"),
    "Track": ("chipload.result.track", "Track"),
    "Verdict": ("chipload.result.verdict", "Verdict"),
    "simulate": ("chipload.jobs.program.api", "simulate"),
}

#: module of ``chipload.api`` of each function
_FUNCTIONS = {
    name: module
    for module, names in {
        "jobs": "check_job load_result run_job write_result",
        "loads": "fit_coefficients hold_torque optimise_feeds",
        "planning": "plan_contour plan_impeller plan_pocket plan_thin_wall",
        "reading": "read_machine read_material read_program",
    }.items()
    for name in names.split()
}


def __getattr__(name: str) -> Any:
    """Import a public name on first access."""
    if name == "__version__":
        from importlib.metadata import version

        return version("chipload")
    if name not in __all__:
        raise AttributeError(f"module 'chipload' has no attribute {name!r}")
    from importlib import import_module

    module, own = _PLACES.get(name) or (f"chipload.api.{_FUNCTIONS[name]}", name)
    value = globals()[name] = getattr(import_module(module), own)
    return value


def __dir__() -> list[str]:
    """The public names."""
    return sorted([*__all__, "__version__"])
