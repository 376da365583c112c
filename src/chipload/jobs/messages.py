"""A line for each error of a job file: the dotted key, the value, the limit and what to do."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from pydantic import BaseModel, Tag, ValidationError
from pydantic.fields import FieldInfo

from chipload.cutter.table import BARREL, BARREL_NAMES
from chipload.errors import InputError, InputErrors

#: tables of a job file that have another name now
RENAMED = {"shell": "torque_control.shell", "control": "torque_control"}
#: keys of an operation that are no more
REMOVED = {
    "engine": "removed: every program is simulated by the volume of its moves: leave it out",
    "workers": "removed: chipload run --workers states how many threads share the simulation: leave it out",
}


def renamed_tables(keys: Iterable[str]) -> list[str]:
    """A line for each table that has another name now.

    >>> renamed_tables(["machine", "shell"])
    ['shell: renamed: write [torque_control.shell]']
    """
    return [f"{key}: renamed: write [{RENAMED[key]}]" for key in keys if key in RENAMED]


class Errors:
    """Collects the errors of an input, so that all of them are refused at once."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def add(self, text: str) -> None:
        """One more error; the same text counts once."""
        if text not in self.texts:
            self.texts.append(text)

    @contextmanager
    def collect(self, prefix: str = "") -> Iterator[None]:
        """Keep the :class:`InputError` of the block instead of raising it; ``prefix`` stands before its text."""
        try:
            yield
        except InputError as err:
            for text in err.args:
                self.add(f"{prefix}{text}")

    def refuse(self, prefix: str = "") -> None:
        """Raise what was collected.

        Raises
        ------
        InputError
            Something was; :class:`InputErrors` where there are several.
        """
        texts = [f"{prefix}{text}" for text in self.texts]
        if texts:
            raise InputErrors(*texts) if len(texts) > 1 else InputError(texts[0])


def table_errors(err: ValidationError, root: type[BaseModel], others: Sequence[type[BaseModel]] = ()) -> list[str]:
    """A line for each error: misspelt keys first; a key that one of them leaves missing is not repeated.

    Parameters
    ----------
    others : tables of the other kinds of jobs, whose keys are named as such
    """
    found = err.errors(include_url=False)
    # a list whose entry is refused is also called too short: the message on the entry is more precise
    errors = [e for e in found if not any(o["loc"][: len(e["loc"])] == e["loc"] and o is not e for o in found)]
    unknown = [e for e in errors if e["type"] == "extra_forbidden"]
    top: list[str] = [str(e["loc"][0]) for e in unknown if len(e["loc"]) == 1]
    foreign = {key for key in top if "program" in root.model_fields and any(key in o.model_fields for o in others)}
    wrong = [e for e in errors if e["type"] != "extra_forbidden"]
    meant = {(*e["loc"][:-1], nearest_key(str(e["loc"][-1]), keys_at(e["loc"][:-1], root))) for e in unknown}
    rest = unknown + [e for e in wrong if not (e["type"] == "missing" and e["loc"] in meant)]
    return list(dict.fromkeys(_line(e, root, foreign) for e in rest))


def left_missing(err: ValidationError, root: type[BaseModel]) -> set[str]:
    """The keys that a misspelt key leaves missing, and the tables that it stands in."""
    out: set[str] = set()
    for e in err.errors(include_url=False):
        if e["type"] == "extra_forbidden":
            table = e["loc"][:-1]
            meant = (*table, nearest_key(str(e["loc"][-1]), keys_at(table, root)))
            out |= {".".join(map(str, table)), ".".join(map(str, meant))}
    return out


def _line(e: Any, root: type[BaseModel], foreign: Collection[str] = ()) -> str:
    """`cutter.0.diameter_mm = -5: must be above 0`; ``foreign`` are tables of other kinds of jobs."""
    loc, kind, context = e["loc"], e["type"], e.get("ctx", {})
    # a union or a validator may add words of its own to the place: keep keys and indices of the file only
    key = ".".join(str(x) for x in loc if isinstance(x, int) or str(x).isidentifier())
    if kind == "extra_forbidden" and key in foreign:
        return f"{key}: not used where a [program] is run: leave it out"
    if kind == "extra_forbidden":
        if loc[0] == "cutter" and loc[-1] in BARREL_NAMES:
            return f"{key}: {BARREL}"
        if loc[0] == "operation" and loc[-1] in REMOVED:
            return f"{key}: {REMOVED[loc[-1]]}"
        known = keys_at(loc[:-1], root)
        return f"{key}: unknown key; did you mean {nearest_key(str(loc[-1]), known)}?"
    if kind == "missing":
        return f"{key}: missing: state it{_key_meaning(loc, root)}"
    value = _short(e["input"])
    bounds = {"greater_than": ("gt", "above"), "greater_than_equal": ("ge", "at least")}
    bounds |= {"less_than": ("lt", "below"), "less_than_equal": ("le", "at most")}
    if kind in bounds:
        name, word = bounds[kind]
        return f"{key} = {value}: must be {word} {context[name]:g}{_key_meaning(loc, root)}"
    if kind == "finite_number":
        return f"{key} = {value}: must be a finite number{_key_meaning(loc, root)}"
    if kind == "literal_error":
        expected = str(context["expected"]).replace(" or ", ", ")
        options = [word.strip("'") for word in expected.split(", ")]
        near = difflib.get_close_matches(str(e["input"]), options, 1) if len(options) > 1 else []
        return f"{key} = {value}: must be one of {expected}{f': did you mean {near[0]}?' if near else ''}"
    if kind in ("value_error", "assertion_error"):
        return f"{key} = {value}: {context['error']}{_key_meaning(loc, root)}"
    if kind == "too_short":
        return f"{key}: has no entry: state at least one{f' [[{key}]]' if keys_at(loc, root) else ''}"
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


def _key_meaning(loc: tuple[int | str, ...], root: type[BaseModel]) -> str:
    """The description of a key in brackets, where it has one."""
    model = _model_at(loc[:-1], root)
    field = model.model_fields.get(str(loc[-1])) if model is not None else None
    return f" ({field.description})" if field is not None and field.description else ""


def _model_at(loc: Iterable[int | str], root: type[BaseModel]) -> type[BaseModel] | None:
    """The model of the table at a place in the file."""
    model: type[BaseModel] | None = root
    field: FieldInfo | None = None
    for key in loc:
        if isinstance(key, int):
            continue
        if field is not None and (chosen := _table_of_tag(field.annotation, key)) is not None:
            model = chosen
            continue
        field = model.model_fields.get(key) if model is not None else None
        model = None if field is None else _model_in(field.annotation)
    return model


def _table_of_tag(annotation: Any, tag: str) -> type[BaseModel] | None:
    """The table of a tag, where a key takes either of several kinds of tables."""
    if any(isinstance(m, Tag) and m.tag == tag for m in getattr(annotation, "__metadata__", ())):
        return _model_in(annotation)
    found = (_table_of_tag(a, tag) for a in typing.get_args(annotation))
    return next((m for m in found if m is not None), None)


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
    return (difflib.get_close_matches(key, same or list(known), 1, 0.0) or ["none: not a table"])[0]
