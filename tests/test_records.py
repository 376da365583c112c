"""The size of what the source is made of: fields of a record, lines of a function and of a file, no assertions."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

import chipload

SOURCE = Path(chipload.__file__).parent
#: fields of a record, lines of a function and of a file
FIELDS, LINES, FILE = 12, 90, 500
#: keys that users write or read: to divide the record would move the keys, or write each of them twice
KEYS = {
    "checking/settings.CheckSettings": "[checks]",
    "control/hal.HalJob": "hal.toml",
    "control/override.Override": "[torque_control.override] and hal.toml",
    "control/_override.Rules": "the same, as plain numbers for the compiled controller",
    "control/spindle_model.Spindle": "[spindle] and spindle.toml",
    "cutter/cutter.Cutter": "[[cutter]] in mm and rad",
    "cutter/table.CutterTable": "[[cutter]]",
    "cutting/material.Material": "a material's file",
    "machine/machine.Machine": "a machine's file",
    "planning/contour/plan.Finishing": "[[operation]] of kind contour, in mm, s and rad",
    "planning/impeller/rough_settings.RoughingSetting": "[operation.rough]",
    "planning/pocket/request.Clearing": "[[operation]] of kind pocket, in mm, s and rad",
    "result/summary.LimitModel": "summary.json",
    "result/summary.Summary": "summary.json",
}
#: one first axis: a field is a column, and all have a row a motion, a step or a place
COLUMNS = {
    "control/plant.Outcome",
    "engagement/moves/stock.Engaged",
    "planning/impeller/patch.Patch",
    "planning/pocket/clearing_path.ClearingPath",
    "program/apt/track.AptRows",
    "program/commands.Commands",
    "program/program.Program",
    "program/segments.Segments",
}
#: the state of a reader: modal groups of a controller, one field a group
STATES = {"program/gcode/state.State"}


@cache
def nodes() -> tuple[tuple[str, ast.AST], ...]:
    """Classes, functions and assertions of every module."""
    return tuple(
        (path.relative_to(SOURCE).with_suffix("").as_posix(), node)
        for path in sorted(SOURCE.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef | ast.Assert)
    )


def records() -> dict[str, int]:
    """Fields of each class that annotates them; tables of job files are left out, their keys are the user's."""
    out = {}
    for module, node in nodes():
        if isinstance(node, ast.ClassDef) and not (module.startswith("jobs/") and module.endswith("tables")):
            fields = [x for x in node.body if isinstance(x, ast.AnnAssign)]
            out[f"{module}.{node.name}"] = sum("ClassVar" not in ast.unparse(x.annotation) for x in fields)
    return out


def functions() -> dict[str, int]:
    """Lines of each function."""
    return {
        f"{module}.{node.name}": int(node.end_lineno or 0) - node.lineno + 1
        for module, node in nodes()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }


def test_a_record_of_many_fields_is_several():
    large = {name for name, count in records().items() if count > FIELDS}
    assert large - KEYS.keys() - COLUMNS - STATES == set()


def test_no_exception_is_left_over():
    large = {name for name, count in records().items() if count > FIELDS}
    assert KEYS.keys() | COLUMNS | STATES <= large


def test_functions_fit_on_a_screen():
    assert {name for name, lines in functions().items() if lines > LINES} == set()


def test_files_are_short():
    lines = {p.relative_to(SOURCE).as_posix(): len(p.read_text().splitlines()) for p in SOURCE.rglob("*.py")}
    assert {name for name, count in lines.items() if count > FILE} == set()


def test_what_is_there_is_told_by_its_type():
    """``assert x is not None`` stands nowhere: a type, or an error that names what is missing."""
    found = {
        module for module, node in nodes() if isinstance(node, ast.Assert) and "is not None" in ast.unparse(node.test)
    }
    assert found == set()


@pytest.mark.parametrize("name", ["control/override.Override", "program/program.Program"])
def test_fields_are_counted(name):
    assert records()[name] > FIELDS
