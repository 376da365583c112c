"""The reference page of the job file (docs/jobs.md), generated from the tables that validate a job."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from chipload.cutter.table import NEEDED, CutterTable
from chipload.jobs import CAPABILITIES, Capability
from chipload.jobs.tables import SourceTable

HEAD = """# The job file

A job is one TOML file. It states the part, the stock, the machine, the cutters, the material and the limits. The name
of a key contains its unit. chipload refuses an unknown key and names the nearest known one. Paths are relative to the
job file.

`chipload check job.toml` lists all errors in a job and in the files that it names. `--set key.path=value` changes a key
for one run. `chipload init FILE DIR` writes a job for a program, a drawing, a model or the sections of a blade. It
marks each table that holds guesses with `confirm = true`; `chipload run` refuses the job until you delete that key, or
runs it with all guesses as they are with `--accept`: what rests on them is then unproven. The most
common job simulates a program in a stock:

```toml
[program]
file = "part.ngc"

[machine]
name = "vmc"                    # a built-in name, or file = "mine.toml"

[stock]
low_mm = [0.0, 0.0, -20.0]
high_mm = [60.0, 40.0, 0.0]

[material]
name = "al7075-t6"              # a built-in name, or file = "mine.toml"

[[cutter]]
number = 1
diameter_mm = 10.0
flutes = 3
helix_deg = 30.0
flute_length_mm = 26.0
overhang_mm = 40.0
modulus_gpa = 580.0

[[operation]]
kind = "simulate"
step_mm = 0.5

[limits]
force_n = 1500.0
```

In the tables below a key is *required*, has a *default*, or is *optional*. Some optional keys are required by one kind
or one shape; their description, or the message of `chipload check`, states this. The column *example* shows how to
write a value; it is not a recommendation.
"""
#: kinds of jobs, most common first, and the heading of each
KINDS = {
    "program": "Jobs that simulate a program or choose its spindle speeds",
    "feeds": "Jobs that give a program new feeds",
    "contour": "Jobs that plan contours and pockets",
    "thinwall": "Jobs that plan thin walls",
    "impeller": "Jobs that plan an impeller",
    "torque": "Jobs that limit the torque on a thin tube, a cone or a workpiece",
    "fit": "Jobs that fit force coefficients to measured forces",
    "distortion": "Jobs that predict how a part springs when it is released",
}
#: how a value is written, by the key or by the table and the key
EXAMPLES = {
    "residual_stress.file": '"plate.csv"', "points_mpa": "[[0.0, -12.0, -8.0], [10.0, 9.0, 6.0], [40.0, -12.0, -8.0]]",
    "offset_mm": "[2.5, 5.0, 7.5]", "choices.stock_mm": "[0.5, 1.0]", "setup.stock_mm": "1.0",
    "window_s": "[0.5, 1.5]", "measurement.file": '"slot-900.csv"',
    "program.file": '"part.ngc"', "part.file": '"part.dxf"', "stock.file": '"stock.stl"',
    "fixture.file": '"vice.stl"', "cutter.file": '"tools.tbl"', "machine.file": '"mine.toml"',
    "material.file": '"mine.toml"', "catalogue.file": '"cutters.toml"', "threshold.file": '"cuts.csv"',
    "torque_control.file": '"rules.toml"', "wall.file": '"blade.step"', "machine.name": '"vmc"',
    "material.name": '"al7075-t6"', "catalogue.name": '"wu2019"', "cutter.name": '"end mill 10"',
    "workpiece.name": '"Ti-6Al-4V"', "tools": '"shop.tbl"', "parameters": '{ "#100" = 2.5 }',
    "work_offsets": "{ G55 = [80.0, 0.0, 0.0] }", "placed_in": '"G54"', "low_mm": "[0.0, 0.0, -20.0]",
    "body_mm": "[[0.0, 0.0], [8.0, 6.0], [8.0, 20.0]]", "at_mm": "[40.0, 0.0, 8.0]",
    "high_mm": "[60.0, 40.0, 0.0]", "holder_mm": "[[20.0, 25.0], [30.0, 40.0]]",
    "pitch_deg": "[88.0, 92.0, 88.0, 92.0]", "layers": '["WALL"]',
    "setup.lines": "[1, 40]", "setup.zero": '["x0", "y0", "z+"]', "setup.zero_mm": "[40.0, 0.0, 8.0]",
    "strategies": '["plain", "backward"]', "allowance_mm": "0.2", "wall.allowance_mm": "[0.3, 0.3]", "wall.face": "3",
    "opposite": "[10.0, 2.0, 15.0]", "places": "[8, 6]",
    "elements": "[8, 8]", "files": '["section_1.txt", "section_2.txt"]', "columns": '"X Y Z"', "span": "[0.1, 1.0]",
    "front": "3", "back": "[10.0, 0.0, 15.0]", "clamp": "5", "sections.blade": '["main_01.txt", "main_02.txt"]',
    "sections.splitter": '["splitter_01.txt"]', "hub": '"hub.txt"', "shroud": '"shroud.txt"',
    "step.file": '"impeller.step"', "step.plus": "4", "step.minus": "[40.0, 2.0, 10.0]", "step.splitter_plus": "12",
    "step.splitter_minus": "13", "step.hub": "[1, 2]", "step.shroud": "[7]", "along": "[0.05, 0.95]",
    "up": "[0.0, 1.0]", "points": "[20, 10]", "table_deg": "[40.0, 60.0]", "idle_a": "[2.0, 0.004]",
    "modulus_gpa": "580.0", "workpiece.modulus_gpa": "114.0", "torque_control.modulus_gpa": "70.0", "poisson": "0.33",
    "density_kg_m3": "4430.0", "diameter_mm": "10.0", "flutes": "4", "helix_deg": "30.0", "feed_mm_min": "600.0",
    "speed_rpm": "6000.0", "overhang_mm": "40.0", "flute_length_mm": "22.0", "axial_depth_mm": "5.0",
    "radial_depth_mm": "0.5", "step_mm": "0.5", "layer_mm": "0.5", "force_n": "800.0", "torque_nm": "4.0",
    "power_w": "3000.0", "number": "1", "cutter": "1", "confidence": "0.99", "fastest_percent": "200.0",
    "dynamics.file": '"modes.toml"', "frequency_hz": "812.0", "damping_ratio": "0.02", "stiffness_n_um": "8.0",
    "levels_reserve": "0.3", "mass_kg": "0.3", "least_rpm": "5000.0", "most_rpm": "12000.0", "stability_margin": "1.2",
    "stable_probability": "0.95", "frequency_percent": "2.0", "fit_mm": "0.001", "reserve": "0.1",
    "override_step": "0.01", "spacing_mm": "0.5", "stock_layers": '["STOCK"]', "part.lines": "[120, 180]",
    "part.labels": '["(WALL)", "(WALL END)"]',
    "operation.rows": '"finish.apt"', "origin_mm": "[20.0, 15.0]",
    "holes_mm": "[[20.0, 15.0, 8.0]]", "tabs.at_mm": "[[30.0, 17.0], [10.0, 17.0]]",
    "jaw_mm": "[125.0, 40.0, 20.0]", "fixture.step_mm": "[10.0, 3.0]", "fixture.at_mm": "30.0",
    "point_mm": "[-5.0, 20.0, 0.0]", "strap_mm": "[80.0, 25.0, 15.0]", "bolt_mm": "[12.0, 25.0]",
}  # fmt: skip
#: of a number by the unit at the end of its key, where none is stated above
BY_UNIT = {
    "um": "10.0", "mm": "1.0", "mm2": "8.0", "mm3": "1.0", "deg": "30.0", "n": "100.0", "nm": "2.0", "mpa": "900.0",
    "gpa": "210.0", "s": "1.0", "ms": "10.0", "a": "0.05", "percent": "50.0", "share": "0.5", "min": "2000.0",
    "s2": "500.0", "rad": "5000.0",
}  # fmt: skip
_NAMES = {float: "number", int: "whole number", str: "text", bool: "true or false", type(None): ""}
_BOUNDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


def reference() -> str:
    """The page, in Markdown."""
    out = [HEAD]
    by_name = {c.name: c for c in CAPABILITIES}
    for capability in (by_name[name] for name in KINDS):
        root = capability.root
        out.append(f"\n## {KINDS[capability.name]}\n")
        if capability.inner:
            out += _variant(capability, next(c for c in CAPABILITIES if c.key == capability.key and not c.inner))
            continue
        kinds = dict.fromkeys(repeated for _, repeated in tables_in(root.model_fields[capability.key].annotation))
        heads = [f"`[[{capability.key}]]`" if repeated else f"`[{capability.key}]`" for repeated in kinds]
        out.append(f"Such a job has a table {' or '.join(heads)}.")
        out.append(_summary(root) + "\n")
        if any(table_in(field.annotation) is None for field in root.model_fields.values()):
            out += ["\n### Keys before the first table\n", *_rows(root, "", tables=False)]
        for name, field in root.model_fields.items():
            for table, repeated in tables_in(field.annotation):
                heading = f"[[{name}]]" if repeated else f"[{name}]"
                out += [f"\n### `{heading}`\n", _summary(table) + "\n", *_rows(table, name)]
    return "\n".join(out) + "\n"


def _variant(capability: Capability, plain: Capability) -> Iterator[str]:
    """A kind of job that has the tables of another one, and one in its operation."""
    own = table_in(capability.root.model_fields["operation"].annotation)
    inner = None if own is None else table_in(own.model_fields[capability.inner].annotation)
    yield f"Such a job has the tables of jobs with `[{plain.key}]`, and a table `[operation.{capability.inner}]`."
    yield _summary(capability.root) + "\n"
    if inner is not None:
        yield f"\n### `[operation.{capability.inner}]`\n"
        yield _summary(inner) + "\n"
        yield from _rows(inner, capability.inner)


def _rows(table: type[BaseModel], name: str, prefix: str = "", tables: bool = True) -> Iterator[str]:
    """The keys of a table; those of tables within it behind their name, unless ``tables`` is false."""
    if not prefix:
        yield "| key | value | required | example | meaning |"
        yield "|---|---|---|---|---|"
    for key, field in table.model_fields.items():
        inner = table_in(field.annotation)
        if inner is not None:
            if tables:
                yield from _rows(inner, key, f"{prefix}{key}.")
            continue
        needed = field.is_required() or (table is CutterTable and key in NEEDED)
        need = "required" if needed else "name or file" if issubclass(table, SourceTable) else _default(field)
        meaning = _key_meaning(table, key, field).replace("|", "/")
        yield f"| `{prefix}{key}` | {value_words(field)} | {need} | `{_example(name, key, field)}` | {meaning} |"


def _key_meaning(table: type[BaseModel], key: str, field: FieldInfo) -> str:
    if issubclass(table, SourceTable):
        return "a built-in name; or `file`" if key == "name" else "path of a file of your own; or `name`"
    return field.description or ""


def _example(name: str, key: str, field: FieldInfo) -> str:
    """How the value of a key is written."""
    stated = EXAMPLES.get(f"{name}.{key}") or EXAMPLES.get(key)
    if stated is not None:
        return stated
    default = field.get_default(call_default_factory=True, validated_data={})
    if isinstance(default, bool):
        return str(not default).lower()
    if isinstance(default, (int, float)):
        return f"{default}"
    if isinstance(default, str) and default:
        return f'"{default}"'
    words = _text_of(field.annotation, [])
    if words.startswith("`"):
        first = words.split("`")[1]
        return first if first.isdigit() else f'"{first}"'
    if words in ("number", "whole number"):
        return BY_UNIT.get(key.split("_")[-1], "1.0") if words == "number" else "3"
    return "true" if words == "true or false" else "[...]" if words.startswith("list") else '"..."'


def _summary(table: type[BaseModel]) -> str:
    return " ".join((table.__doc__ or "").split("\n\n")[0].split())


def _default(field: FieldInfo) -> str:
    value = field.get_default(call_default_factory=True, validated_data={})
    if isinstance(value, bool):
        return f"default {str(value).lower()}"
    return "optional" if value is None or value in ((), {}) else f"default {value}"


def value_words(field: FieldInfo) -> str:
    """What a key takes, in words: its type and its range."""
    bounds: list[str] = []
    words = _text_of(field.annotation, bounds)
    bounds += _limits(field.metadata)
    return ", ".join([words, *dict.fromkeys(bounds)])


def _limits(metadata: list[Any] | tuple[Any, ...]) -> list[str]:
    return [
        f"{word} {getattr(m, name):g}"
        for m in metadata
        for name, word in _BOUNDS.items()
        if isinstance(getattr(m, name, None), (int, float))
    ]


def _text_of(annotation: Any, bounds: list[str]) -> str:
    """A type in words; bounds that stand in it are collected."""
    if annotation in _NAMES:
        return _NAMES[annotation]
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        for m in args[1:]:
            bounds += _limits(getattr(m, "metadata", None) or [m])
        return _text_of(args[0], bounds)
    if origin is typing.Literal:
        return ", ".join(f"`{a}`" for a in args)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(w for w in (_text_of(a, bounds) for a in args) if w)
    if origin is dict:
        return f"table of {_text_of(args[1], bounds)} by name"
    if origin is tuple:
        if args[-1:] == (Ellipsis,):
            return f"list of {_text_of(args[0], bounds)}"
        return f"[{', '.join(_text_of(a, bounds) for a in args)}]"
    return getattr(annotation, "__name__", str(annotation))


def tables_in(annotation: Any, repeated: bool = False) -> list[tuple[type[BaseModel], bool]]:
    """The tables that a key may hold, and whether as a list: one, or either a table or a list of another."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return [(annotation, repeated)] if issubclass(annotation, BaseModel) else []
    repeated = repeated or typing.get_origin(annotation) is tuple
    return [found for a in typing.get_args(annotation) for found in tables_in(a, repeated)]


def table_in(annotation: Any) -> type[BaseModel] | None:
    """The table that a key holds, itself or in a list; None: it holds a value."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    return next((t for t in map(table_in, typing.get_args(annotation)) if t is not None), None)
