"""Names of files, classes, fields, functions, job keys and columns use the words of docs/glossary.md.

A name is split into its words (``StepBite`` and ``step_bite`` into step and bite). Terms of a standard that hold a
forbidden word are listed with their reason in :data:`STANDARD`. Of parameters, variables and functions named by one
participle the number that is reached is held: it only becomes smaller.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel

import chipload
from chipload.jobs import CAPABILITIES
from chipload.result import COLUMNS

DOCS = Path(__file__).parents[1] / "docs"
SOURCE = Path(chipload.__file__).parent


def _tool(name):
    """A program of ``tools/`` as a module."""
    spec = spec_from_file_location(name, DOCS.parent / "tools" / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


source_size = _tool("source_size")


def forbidden() -> dict[str, str]:
    """Each forbidden word and what stands instead."""
    table = (DOCS / "glossary.md").read_text().split("## Words that names do not use")[1]
    rows = re.findall(r"^\| ([a-z, ]+) \| ([^|]+) \|$", table, re.MULTILINE)
    return {word.strip(): instead for words, instead in rows for word in words.split(",") if instead != "instead"}


FORBIDDEN = forbidden()


def words(name: str) -> list[str]:
    """The words of a name, in small letters."""
    return [w.lower() for part in name.split("_") for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", part)]


def bad(name: str) -> bool:
    """Whether a name has a forbidden word."""
    return not FORBIDDEN.keys().isdisjoint(words(name))


@cache
def trees() -> dict[str, ast.Module]:
    """The syntax tree of every file by its module, ``machine/axis``."""
    files = sorted(SOURCE.rglob("*.py"))
    return {path.relative_to(SOURCE).with_suffix("").as_posix(): ast.parse(path.read_text()) for path in files}


@cache
def names_by_kind() -> dict[str, tuple[str, ...]]:
    """``module:name`` of every file, class, field of a class, function, parameter and variable, by kind."""
    out: dict[str, list[str]] = {kind: [] for kind in ("file", "class", "field", "function", "parameter", "variable")}
    for module, tree in trees().items():
        out["file"].append(f"{module}:{module.split('/')[-1]}")
        for node in ast.walk(tree):
            match node:
                case ast.Name(id=name, ctx=ast.Store()):
                    out["variable"].append(f"{module}:{name}")
                case ast.arg(arg=name):
                    out["parameter"].append(f"{module}:{name}")
                case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                    out["function"].append(f"{module}:{name}")
                case ast.ClassDef(name=name, body=body):
                    out["class"].append(f"{module}:{name}")
                    targets = [x.target for x in body if isinstance(x, ast.AnnAssign)]
                    out["field"] += [f"{module}:{name}.{x.id}" for x in targets if isinstance(x, ast.Name)]
    return {kind: tuple(names) for kind, names in out.items()}


def names_of_source() -> frozenset[str]:
    """``kind module:name`` of every file, class, field of a class and function."""
    kinds = ("file", "class", "field", "function")
    return frozenset(f"{kind} {name}" for kind in kinds for name in names_by_kind()[kind])


def job_keys() -> set[str]:
    """Every key of every job file, with its capability."""
    out: set[str] = set()

    def walk(capability: str, kind: object, seen: frozenset[type]) -> None:
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            if kind in seen:
                return
            for name, field in kind.model_fields.items():
                out.add(f"key {capability}:{field.alias or name}")
                walk(capability, field.annotation, seen | {kind})
        for inner in get_args(kind):
            walk(capability, inner, seen)

    for capability in CAPABILITIES:
        walk(capability.name, capability.root, frozenset())
    return out


@cache
def private() -> frozenset[str]:
    """Names that hold a forbidden word."""
    names = names_of_source() | job_keys() | {f"column result:{name}" for name in COLUMNS}
    return frozenset(name for name in names if bad(re.split(r"[:.]", name)[-1]))


#: standard terms that hold a forbidden word, and whose they are; the list only becomes shorter
STANDARD = {
    "function files:tell": "position in a file, of the interface of Python's files",
    "field machine/trajectory:TrajectoryPlanner.gap_cycles": "ARC_BLEND_GAP_CYCLES of LinuxCNC's configuration",
    "field program/gcode/tools:Tool.front": "front angle of a turning tool in LinuxCNC's tool table",
    "field jobs/thinwall/tables:WallTable.front": "front and back face of a wall; the word stood for a pocket's path",
    "key thinwall:front": "the same, as a key of the job file",
}


def test_the_list_of_forbidden_words_is_read():
    assert len(FORBIDDEN) > 40
    assert FORBIDDEN["bites"] == "tooth engagement"
    assert bad("StepBite")
    assert bad("step_bites")
    assert bad("_HeldBy")
    assert not bad("heading")
    assert not bad("withheld")


def test_no_new_name_holds_a_forbidden_word():
    new = private() - STANDARD.keys()
    assert not new, {name: [FORBIDDEN[w] for w in words(name) if w in FORBIDDEN] for name in new}


#: reached: distinct names of parameters and variables with a forbidden word, by file; these numbers only become smaller
REACHED = {"parameter": 83, "variable": 274}
#: reached: shares of the functions that are one participle or one preposition
PARTICIPLES, PREPOSITIONS = 0.021, 0.012


@pytest.mark.parametrize("kind", REACHED)
def test_no_more_parameters_and_variables_hold_a_forbidden_word(kind):
    found = {name for name in names_by_kind()[kind] if bad(name.split(":")[1])}
    assert len(found) <= REACHED[kind], sorted(found)


def test_no_more_functions_are_a_bare_participle_or_preposition():
    names = [name.split(":")[1] for name in names_by_kind()["function"] if not name.split(":")[1].startswith("__")]
    assert sum(map(source_size.is_participle, names)) <= PARTICIPLES * len(names)
    assert sum(name.strip("_") in source_size.PREPOSITIONS for name in names) <= PREPOSITIONS * len(names)
    assert source_size.is_participle("_joined")
    assert not source_size.is_participle("join_parts")


def test_no_exception_is_left_over():
    assert STANDARD.keys() <= private()


def test_a_class_name_stands_for_one_class():
    classes = Counter(name.rsplit(":", 1)[1] for name in names_of_source() if name.startswith("class "))
    assert {name for name, count in classes.items() if count > 1} == set()
