"""Every key of every kind of job, as a page: made from the tables that read the file, so that it can't differ."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from chipload.job.load import KINDS

HEAD = """# The job file

One TOML file says what is made, of what, on which machine, with which cutters, and the limits. Its kind is that of the
table which only that kind has. Every key carries its unit in its name. Unknown keys are refused with the nearest known
one; nothing that matters has a default. Paths are relative to the job file.

`chipload check job.toml` reads the job and every file that it names. `--set key.path=value` overrides a key.
"""
_NAMES = {float: "number", int: "whole number", str: "text", bool: "true or false", type(None): ""}
_BOUNDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


def reference() -> str:
    """The page, in Markdown."""
    out = [HEAD]
    for kind, (root, _) in KINDS.items():
        out.append(f"\n## Jobs with `[{kind}]`\n")
        out.append(_summary(root) + "\n")
        for name, field in root.model_fields.items():
            table = _table_in(field.annotation)
            if table is None:
                continue
            many = "tuple" in str(field.annotation)
            heading = f"[[{name}]]" if many else f"[{name}]"
            out += [f"\n### `{heading}`\n", _summary(table) + "\n", *_rows(table)]
    return "\n".join(out) + "\n"


def _rows(table: type[BaseModel], prefix: str = "") -> Iterator[str]:
    """The keys of a table; those of tables within it behind their name."""
    if not prefix:
        yield "| key | value | must it be there | meaning |"
        yield "|---|---|---|---|"
    for key, field in table.model_fields.items():
        inner = _table_in(field.annotation)
        if inner is not None:
            yield from _rows(inner, f"{prefix}{key}.")
            continue
        need = "yes" if field.is_required() else f"no{_default(field)}"
        yield f"| `{prefix}{key}` | {_value(field)} | {need} | {(field.description or '').replace('|', '/')} |"


def _summary(table: type[BaseModel]) -> str:
    return " ".join((table.__doc__ or "").split("\n\n")[0].split())


def _default(field: FieldInfo) -> str:
    value = field.get_default(call_default_factory=True, validated_data={})
    return "" if value is None or value == () else f"; {value}"


def _value(field: FieldInfo) -> str:
    bounds: list[str] = []
    words = _said(field.annotation, bounds)
    bounds += _limits(field.metadata)
    return ", ".join([words, *dict.fromkeys(bounds)])


def _limits(metadata: list[Any] | tuple[Any, ...]) -> list[str]:
    return [
        f"{word} {getattr(m, name):g}"
        for m in metadata
        for name, word in _BOUNDS.items()
        if isinstance(getattr(m, name, None), (int, float))
    ]


def _said(annotation: Any, bounds: list[str]) -> str:
    """A type in words; bounds that stand in it are collected."""
    if annotation in _NAMES:
        return _NAMES[annotation]
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        for m in args[1:]:
            bounds += _limits(getattr(m, "metadata", None) or [m])
        return _said(args[0], bounds)
    if origin is typing.Literal:
        return ", ".join(f"`{a}`" for a in args)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(w for w in (_said(a, bounds) for a in args) if w)
    if origin is tuple:
        if args[-1:] == (Ellipsis,):
            return f"list of {_said(args[0], bounds)}"
        return f"[{', '.join(_said(a, bounds) for a in args)}]"
    return getattr(annotation, "__name__", str(annotation))


def _table_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    return next((t for t in map(_table_in, typing.get_args(annotation)) if t is not None), None)
