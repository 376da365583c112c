"""Names of files, classes, fields, functions, job keys and columns use the words of docs/glossary.md.

A name is split into its words (``StepBite`` and ``step_bite`` into step and bite). Names that still hold a forbidden
word are listed in :data:`PRIVATE`; the list only becomes shorter.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel

import chipload
from chipload.jobs import CAPABILITIES
from chipload.result import COLUMNS

DOCS = Path(__file__).parents[1] / "docs"
SOURCE = Path(chipload.__file__).parent


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


def names_of_source() -> set[str]:
    """``kind module:name`` of every file, class, field of a class and function."""
    out = set()
    for path in sorted(SOURCE.rglob("*.py")):
        module = path.relative_to(SOURCE).with_suffix("").as_posix()
        out |= {f"file {module}:{part}" for part in module.split("/")[-1:]}
        for node in ast.walk(ast.parse(path.read_text())):
            kind = {ast.ClassDef: "class", ast.FunctionDef: "function", ast.AsyncFunctionDef: "function"}.get(
                type(node)
            )
            if kind:
                out.add(f"{kind} {module}:{node.name}")
            if isinstance(node, ast.ClassDef):
                fields = [
                    x.target.id for x in node.body if isinstance(x, ast.AnnAssign) and isinstance(x.target, ast.Name)
                ]
                out |= {f"field {module}:{node.name}.{name}" for name in fields}
    return out


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


def private() -> set[str]:
    """Names that hold a forbidden word."""
    names = names_of_source() | job_keys() | {f"column result:{name}" for name in COLUMNS}
    return {name for name in names if bad(re.split(r"[:.]", name)[-1])}


#: names that still hold a forbidden word: geometry (inside, gap, pieces), a turning tool's front angle, and what is
#: renamed together with its package
PRIVATE = {
    "class geometry/offset:_Pieces",
    "class geometry/step_faces:Inside",
    "class machine/linearise:Pieces",
    "class simulation/removal:ChipPieces",
    "column result:chip_pieces",
    "field control/_override:Rules.gap_s",
    "field control/override:Override.gap_s",
    "field jobs/thinwall/tables:WallTable.front",
    "field jobs/torque/tables:OverrideTable.gap_s",
    "field machine/trajectory:TrajectoryPlanner.gap_cycles",
    "field planning/impeller/lines:Line.pieces",
    "field program/apt/frames:Coordinates.given",
    "field program/gcode/tools:Tool.front",
    "field simulation/removal:Resolution.bottom_pieces",
    "field simulation/removal:Resolution.corner_pieces",
    "field simulation/deflection:FormError.gap",
    "field simulation/loads:Cuts.bites",
    "field simulation/loads:Cuts.way",
    "field engagement/moves/stock:Engaged.pieces",
    "field simulation/moves:MoveRun.corner_pieces",
    "field simulation/surface:Difference.look",
    "field structure/removal:StructureRemoval.inside",
    "field structure/solid:SolidWorkpiece.held",
    "function cutting/fit:said",
    "function engagement/_kernels:front_part",
    "function engagement/chips/covered:_pieces",
    "function engagement/chips/faces/_kernels:pieces",
    "function engagement/immersion/_kernels:inside",
    "function files:_held",
    "function geometry/fillet:gap",
    "function geometry/step_faces:inside",
    "function jobs/feeds/allowed:held",
    "function jobs/simulation/workpiece:inside",
    "function jobs/thinwall/inputs:_pieces",
    "function planning/contour/offsets:_open_inside",
    "function planning/impeller/patches:gap",
    "function planning/impeller/paths:_crest",
    "function planning/impeller/ranges/_kernels:inside",
    "function planning/impeller/ranges/_kernels:widest_gap",
    "function program/apt/track:gap",
    "function program/gcode/controller:gap",
    "function program/gcode/modal:axes_given",
    "function program/read:_held",
    "function report/diagram:_pieces",
    "function report/shape:pieces",
    "function simulation/checkpoint:pieces",
    "function simulation/chips:bites",
    "function simulation/section_deviation:beside",
    "function stock/tile_grid:_pieces",
    "function structure/shell:_held",
    "function structure/shell:_inside",
    "function terminal:say",
    "function web/page:_look",
    "key thinwall:front",
    "key torque:gap_s",
}
#: how many there are; the number only falls
MOST = 55


def test_the_list_of_forbidden_words_is_read():
    assert len(FORBIDDEN) > 40
    assert FORBIDDEN["bites"] == "tooth engagement"
    assert bad("StepBite")
    assert bad("step_bites")
    assert bad("_HeldBy")
    assert not bad("heading")
    assert not bad("withheld")


def test_no_new_name_holds_a_forbidden_word():
    new = private() - PRIVATE
    assert not new, {name: [FORBIDDEN[w] for w in words(name) if w in FORBIDDEN] for name in new}


def test_the_number_of_private_names_does_not_grow(capsys: pytest.CaptureFixture[str]):
    left = private()
    by_word = Counter(w for name in left for w in words(name.rsplit(":", 1)[-1].rsplit(".", 1)[-1]) if w in FORBIDDEN)
    with capsys.disabled():
        print(f"\n{len(left)} names with private words: {', '.join(f'{w} {n}' for w, n in by_word.most_common())}")
    assert len(PRIVATE) <= MOST
    assert len(left) <= MOST


#: class names that two files define; the list only becomes shorter
SHARED = {
    "Blank", "Body", "Flow", "Measured", "Region", "Remainder", "Run", "Samples", "Source", "State", "Statement",
    "ToolPath", "WorkpieceTable", "_Job", "_Model", "_Row",
}  # fmt: skip


def test_a_class_name_stands_for_one_class():
    classes = Counter(name.rsplit(":", 1)[1] for name in names_of_source() if name.startswith("class "))
    assert {name for name, count in classes.items() if count > 1} == SHARED
