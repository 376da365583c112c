"""What the source is made of: the fields of a record, and no assertions in place of types."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

import chipload

SOURCE = Path(chipload.__file__).parent
#: fields of a record
FIELDS = 12
#: keys that users write or read: to divide the record would move the keys, or write each of them twice
KEYS = {
    "checking/settings.CheckSettings": "[checks]",
    "checking/settings.Limits": "[limits]",
    "control/hal.HalJob": "hal.toml",
    "control/override.Override": "[torque_control.override] and hal.toml",
    "control/_override.Rules": "the same, as plain numbers for the compiled controller",
    "control/spindle_model.Spindle": "[spindle] and spindle.toml",
    "cutter/catalogue.CatalogueCutter": "[[cutter]] of a catalogue's file, in mm and rad",
    "cutter/catalogue._Cutter": "[[cutter]] of a catalogue's file",
    "cutter/cutter.Cutter": "[[cutter]] in mm and rad",
    "cutter/table.CutterTable": "[[cutter]]",
    "cutting/material.Material": "a material's file",
    "machine/machine.Machine": "a machine's file",
    "planning/contour/plan.Finishing": "[[operation]] of kind contour, in mm, s and rad",
    "planning/impeller/rough_settings.RoughingSetting": "[operation.rough]",
    "planning/pocket/request.Clearing": "[[operation]] of kind pocket, in mm, s and rad",
    "program/control.Control": "a control's file, one field a section",
    "result/limits.LimitCheck": "summary.json, a field a key of LimitModel",
    "result/summary.LimitModel": "summary.json",
    "result/summary.Summary": "summary.json",
    "result/summary.TrackModel": "summary.json",
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
#: what a reader fills in as it goes through the text
STATES = {
    "program/gcode/state.State": "modal groups of a controller, one field a group",
    "program/gcode/words.Block": "words and codes of one block, one field a kind of word",
}


@cache
def nodes() -> tuple[tuple[str, ast.AST], ...]:
    """Classes and assertions of every module."""
    return tuple(
        (path.relative_to(SOURCE).with_suffix("").as_posix(), node)
        for path in sorted(SOURCE.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef | ast.Assert)
    )


def records() -> dict[str, int]:
    """Fields of each class that annotates them; tables of job files are left out, their keys are the user's."""
    out = {}
    for module, node in nodes():
        if isinstance(node, ast.ClassDef) and not (module.startswith("jobs/") and module.endswith("tables")):
            fields = [x for x in node.body if isinstance(x, ast.AnnAssign)]
            out[f"{module}.{node.name}"] = sum("ClassVar" not in ast.unparse(x.annotation) for x in fields)
    return out


def test_a_record_of_many_fields_is_several():
    large = {name for name, count in records().items() if count > FIELDS}
    assert large - KEYS.keys() - COLUMNS - STATES.keys() == set()


def test_no_exception_is_left_over():
    large = {name for name, count in records().items() if count > FIELDS}
    assert KEYS.keys() | COLUMNS | STATES.keys() <= large


def test_what_is_there_is_told_by_its_type():
    """``assert x is not None`` stands nowhere: a type, or an error that names what is missing."""
    found = {
        module for module, node in nodes() if isinstance(node, ast.Assert) and "is not None" in ast.unparse(node.test)
    }
    assert found == set()


@pytest.mark.parametrize("name", ["control/override.Override", "program/program.Program"])
def test_fields_are_counted(name):
    assert records()[name] > FIELDS
