"""The keys of a job as fields of a form: value, unit, range and meaning of each, by the JSON schema of its tables."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.jobs import capability_of, load_job
from chipload.jobs.reference import tables_in, value_words
from chipload.result.columns import unit_of
from chipload.tables import parse_toml

#: largest job [bytes] that is shown as a form
LARGEST = 1_000_000
#: units that no column of a history has, by the ending of a key
UNITS = {
    "gpa": "GPa",
    "n_um": "N/\u00b5m",
    "mm2": "mm\u00b2",
    "ms": "ms",
    "min": "min",
    "kg": "kg",
    "kg_m3": "kg/m\u00b3",
    "a": "A",
}

#: words of a schema for one of several kinds of values
CHOICES = ("anyOf", "oneOf")

Kind = Literal["number", "count", "word", "choice", "switch"]


@dataclass(frozen=True)
class FormField:
    """A key of a job.

    Parameters
    ----------
    path : as `--set` writes it, ``cutter.0.diameter_mm``
    table : the table that it stands in, ``cutter.0``; empty: before the first table
    key : its name in the table
    kind : what it holds
    value : as the file states it; None: it does not
    unit, bounds, meaning : as words; empty where there is none; ``bounds`` is the type with its range
    choices : words that it may be
    """

    path: str
    table: str
    key: str
    kind: Kind
    value: Any
    unit: str
    bounds: str
    meaning: str
    choices: tuple[str, ...] = ()


def job_fields(path: Path) -> list[FormField]:
    """Every single value that the tables of a job state or may state, in the order of the file.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    raw = parse_toml(path.name, read_regular(path, path.name, LARGEST))
    capability = capability_of(raw)
    schema = capability.root.model_json_schema()
    return list(_fields(raw, schema, schema.get("$defs", {}), capability.root, ""))


def override_of(field: FormField, entered: Any) -> str | None:
    """What `--set` takes for a changed field; None: it is as in the file, or empty.

    >>> speed = FormField("operation.0.speed_rpm", "operation.0", "speed_rpm", "number", 6000.0, "1/min", "", "")
    >>> override_of(speed, "7000"), override_of(speed, 6000), override_of(speed, "")
    ('operation.0.speed_rpm=7000', None, None)
    """
    if entered is None or entered == "" or entered == field.value:
        return None
    if field.kind in ("number", "count"):
        text = str(entered).strip()
        try:
            if field.value is not None and float(text) == float(field.value):
                return None
        except ValueError:
            pass  # not a number: the check of the job reports it
        return f"{field.path}={text}"
    return f"{field.path}={json.dumps(entered)}"


def job_errors(path: Path, overrides: Sequence[str]) -> list[str]:
    """What is wrong in a job with these values, a text each; empty: nothing."""
    try:
        load_job(path, overrides)
    except InputError as err:
        lines = [line.strip().removeprefix(f"{path.name}: ") for line in str(err).splitlines()]
        return [line for line in lines if line]
    return []


def _fields(
    raw: Mapping[str, Any], schema: Mapping[str, Any], defs: Mapping[str, Any], model: type[BaseModel] | None, at: str
) -> Iterator[FormField]:
    """Fields of a table: those that it states, then the others; then its tables that are stated."""
    properties = {key: _resolve_schema(one, defs) for key, one in schema.get("properties", {}).items()}
    order = [k for k in raw if k in properties] + [k for k in properties if k not in raw]
    for key in order:
        own = model.model_fields.get(key) if model is not None else None
        field = _field(key, raw.get(key), properties[key], "" if own is None else value_words(own), at)
        if field is not None:
            yield field
    for key in raw:
        inner, value = properties.get(key), raw[key]
        if inner is None:
            continue
        repeated = isinstance(value, list)
        known = tables_in(model.model_fields[key].annotation) if model is not None and key in model.model_fields else []
        table = next((t for t, several in known if several == repeated), known[0][0] if known else None)
        if isinstance(value, Mapping):
            yield from _fields(value, _table_schema(inner, defs), defs, table, f"{at}{key}.")
        elif isinstance(value, list) and value and all(isinstance(v, Mapping) for v in value):
            for k, one in enumerate(value):
                yield from _fields(one, _table_schema(inner, defs, repeated), defs, table, f"{at}{key}.{k}.")


def _field(key: str, value: Any, schema: Mapping[str, Any], takes: str, at: str) -> FormField | None:
    """The field of a key; None: it holds no single value."""
    kinds = [one for one in schema.get("anyOf", [schema]) if one.get("type") != "null"]
    own: Mapping[str, Any] = kinds[0] if len(kinds) == 1 else next((k for k in kinds if _kind(k)), {})
    kind = _kind(own)
    if kind is None or isinstance(value, (list, dict)):
        return None
    if len(kinds) > 1 and isinstance(value, str):
        kind, own = "word", {}
    words = tuple(str(w) for w in own.get("enum", (own["const"],) if "const" in own else ()))
    bounds = "" if words or kind == "switch" else takes
    meaning = str(schema.get("description") or own.get("description") or "")
    return FormField(f"{at}{key}", at.rstrip("."), key, kind, value, _unit(key), bounds, meaning, words)


def _unit(key: str) -> str:
    """Unit of a key by its ending."""
    words = key.split("_")
    own = (UNITS[end] for k in range(1, len(words)) if (end := "_".join(words[k:])) in UNITS)
    return unit_of(key) or next(own, "")


def _kind(schema: Mapping[str, Any]) -> Kind | None:
    if "enum" in schema or "const" in schema:
        return "choice"
    kinds: dict[str, Kind] = {"number": "number", "integer": "count", "string": "word", "boolean": "switch"}
    return kinds.get(str(schema.get("type")))


def _resolve_schema(schema: Mapping[str, Any], defs: Mapping[str, Any]) -> Mapping[str, Any]:
    """A schema with its reference followed, that of a list in its items, of a choice in each."""
    if "$ref" in schema:
        own: Mapping[str, Any] = defs.get(str(schema["$ref"]).rsplit("/", 1)[-1], {})
        return {**own, **{k: v for k, v in schema.items() if k != "$ref"}}
    chosen = {word: [_resolve_schema(one, defs) for one in schema[word]] for word in CHOICES if word in schema}
    return {**schema, **chosen}


def _table_schema(schema: Mapping[str, Any], defs: Mapping[str, Any], repeated: bool = False) -> Mapping[str, Any]:
    """The schema of the table that a key holds, itself or in a list; ``many``: the list, where it may be either."""
    options: list[Mapping[str, Any]] = [schema, *(one for word in CHOICES for one in schema.get(word, ()))]
    tables = [one for one in options if "properties" in one]
    lists = [one for one in options if one.get("type") == "array" and "items" in one]
    if lists and (repeated or not tables):
        return _table_schema(_resolve_schema(lists[0]["items"], defs), defs)
    return dict(tables[0]) if tables else {}
