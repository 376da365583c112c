"""One line for what is wrong in a job file: the dotted key, the value, the limit and what to do."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Iterable, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from chipload.job.tables import JobTable, ProgramJobTable


def first_error(err: ValidationError, root: type[BaseModel]) -> str:
    """One line for the error that explains most: a misspelt key before the key that it leaves missing."""
    found = err.errors(include_url=False)
    # a list whose entry is refused is also called too short: the entry says more
    errors = [e for e in found if not any(o["loc"][: len(e["loc"])] == e["loc"] and o is not e for o in found)]
    unknown = [e for e in errors if e["type"] == "extra_forbidden"]
    if root is ProgramJobTable:
        planned = [e["loc"][0] for e in unknown if len(e["loc"]) == 1 and e["loc"][0] in JobTable.model_fields]
        if planned:
            return f"{planned[0]}: not used where a [program] is run: leave it out"
    others = [e for e in errors if e["type"] != "extra_forbidden"]
    meant = {(*e["loc"][:-1], nearest_key(str(e["loc"][-1]), keys_at(e["loc"][:-1], root))) for e in unknown}
    rest = unknown + [e for e in others if not (e["type"] == "missing" and e["loc"] in meant)]
    more = f" (and {len(rest) - 1} more)" if len(rest) > 1 else ""
    return _line(rest[0], root) + more


def _line(e: Any, root: type[BaseModel]) -> str:
    """`cutter.0.diameter_mm = -5: must be above 0`."""
    loc, kind, context = e["loc"], e["type"], e.get("ctx", {})
    # a union or a validator may add words of its own to the place: keep keys and indices of the file only
    key = ".".join(str(x) for x in loc if isinstance(x, int) or str(x).isidentifier())
    if kind == "extra_forbidden":
        known = keys_at(loc[:-1], root)
        return f"{key}: unknown key; did you mean {nearest_key(str(loc[-1]), known)}?"
    if kind == "missing":
        return f"{key}: missing: state it{_meaning(loc, root)}"
    value = _short(e["input"])
    bounds = {"greater_than": ("gt", "above"), "greater_than_equal": ("ge", "at least")}
    bounds |= {"less_than": ("lt", "below"), "less_than_equal": ("le", "at most")}
    if kind in bounds:
        name, word = bounds[kind]
        return f"{key} = {value}: must be {word} {context[name]:g}{_meaning(loc, root)}"
    if kind == "finite_number":
        return f"{key} = {value}: must be a finite number{_meaning(loc, root)}"
    if kind == "literal_error":
        return f"{key} = {value}: must be one of {str(context['expected']).replace(' or ', ', ')}"
    if kind in ("value_error", "assertion_error"):
        return f"{key} = {value}: {context['error']}{_meaning(loc, root)}"
    if kind == "too_short":
        return f"{key}: has no entry: state at least one [[{key}]]"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {value}: must be a table, [{key}]"
    words = {
        "string_type": "must be a text",
        "string_too_short": "must not be empty",
        "tuple_type": f"must be a list, as [{value}]",
        "float_type": "must be a number",
        "int_type": "must be a whole number",
    }
    return f"{key} = {value}: {words.get(kind, e['msg'])}"


def _short(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _meaning(loc: tuple[int | str, ...], root: type[BaseModel]) -> str:
    """The description of a key in brackets, where it has one."""
    model = _model_at(loc[:-1], root)
    field = model.model_fields.get(str(loc[-1])) if model is not None else None
    return f" ({field.description})" if field is not None and field.description else ""


def _model_at(loc: Iterable[int | str], root: type[BaseModel]) -> type[BaseModel] | None:
    """The model of the table at a place in the file."""
    model: type[BaseModel] | None = root
    for key in loc:
        if isinstance(key, int):
            continue
        field = model.model_fields.get(key) if model is not None else None
        model = None if field is None else _model_in(field.annotation)
    return model


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    found = [m for m in map(_model_in, typing.get_args(annotation)) if m is not None]
    return found[0] if found else None


def keys_at(loc: Iterable[int | str], root: type[BaseModel]) -> tuple[str, ...]:
    """The keys of the table at a place in the file."""
    model = _model_at(loc, root)
    return tuple(model.model_fields) if model is not None else ()


def nearest_key(key: str, known: Sequence[str]) -> str:
    """The known key with the same first word (so that a wrong unit finds its key), else the nearest in spelling."""
    word = key.split("_")[0]
    same = [k for k in known if k.split("_")[0] == word]
    return (difflib.get_close_matches(key, same or list(known), 1, 0.0) or ["none: this is no table"])[0]
